//! Frames, particles and outcomes of a step as numbers.

use gluey_contact::part::{
    PAIR_WORDS, PartContact, PartFrame, PartMemory, PartOutcome, PartParticle, RankShare, pair_of, pair_words,
};
use gluey_contact::{
    Contact, ContactLaw, ContactParams, ContactReport, Domain, GammaUpdate, SolverKind, Wall, WorstPair,
};
use gluey_geom::{Dim, Lattice, Space, Vector};

/// Numbers of a frame before its periods and walls.
const FRAME_HEAD: usize = 15;

/// A frame as numbers; law and tuning, the step, how images slide, periods, walls.
pub(super) fn of_frame<const D: usize>(frame: &PartFrame<D>) -> Vec<f64> {
    let PartFrame { params, domain, velocity_weight, dt, tolerance, wall_slack } = frame;
    let flag = |flag: bool| f64::from(u8::from(flag));
    let law = ContactLaw::ALL.iter().position(|law| *law == params.law).unwrap_or(0);
    let solver = SolverKind::ALL.iter().position(|solver| *solver == params.solver).unwrap_or(0);
    let mut numbers = vec![
        law as f64,
        flag(params.exact_gap),
        flag(params.gamma_update == GammaUpdate::Consistent),
        params.gamma_min.unwrap_or(f64::NAN),
        params.threshold,
        solver as f64,
        params.tolerance,
        params.iteration_limit as f64,
        params.pass_limit as f64,
        *velocity_weight,
        *dt,
        *tolerance,
        *wall_slack,
        domain.lattice.tilt(),
        domain.tilt_step,
    ];
    numbers.extend(domain.lattice.periods().map(|period| period.unwrap_or(f64::NAN)));
    for Wall { normal, offset, speed } in &domain.walls {
        numbers.extend(normal.iter().chain([offset, speed]));
    }
    numbers
}

/// The frame of such numbers.
pub(super) fn frame_of<const D: usize>(numbers: &[f64]) -> PartFrame<D> {
    let some = |number: f64| Some(number).filter(|number| !number.is_nan());
    let mut next = numbers.iter().copied();
    let mut next = || next.next().unwrap_or(f64::NAN);
    let params = ContactParams {
        law: ContactLaw::ALL[next() as usize],
        exact_gap: next() > 0.0,
        gamma_update: if next() > 0.0 { GammaUpdate::Consistent } else { GammaUpdate::Paper },
        gamma_min: some(next()),
        threshold: next(),
        solver: SolverKind::ALL[next() as usize],
        tolerance: next(),
        iteration_limit: next() as usize,
        pass_limit: next() as usize,
    };
    let [velocity_weight, dt, tolerance, wall_slack, tilt, tilt_step] = std::array::from_fn(|_| next());
    let periods = std::array::from_fn(|_| some(next()));
    let wall = |numbers: &[f64]| Wall {
        normal: Vector::from_fn(|d, _| numbers[d]),
        offset: numbers[D],
        speed: numbers[D + 1],
    };
    let walls = numbers[FRAME_HEAD + D..].chunks_exact(D + 2).map(wall).collect();
    let domain = Domain { walls, lattice: Lattice::new(periods).tilted(tilt), tilt_step };
    PartFrame { params, domain, velocity_weight, dt, tolerance, wall_slack }
}

/// What a rank gets, as numbers: how many particles, they, what pairs remember.
pub(super) fn of_dealt<const D: usize>(shares: &RankShare<D>) -> Vec<u64> {
    let mut words = Vec::with_capacity(1 + shares.particles.len() * (6 + 2 * D));
    words.push(shares.particles.len() as u64);
    for particle in &shares.particles {
        let PartParticle { index, order, owner, position, free, radius, mobility, reach } = particle;
        words.extend([*index, *order, *owner].map(u64::from));
        words.extend(position.iter().chain(free).chain([radius, mobility, reach]).map(|x| x.to_bits()));
    }
    for PartMemory { pair, gamma, lambda } in &shares.memory {
        words.extend(pair_words(*pair));
        words.extend([gamma, lambda].map(|x| x.to_bits()));
    }
    words
}

/// What rank `rank` gets, from such numbers.
pub(super) fn dealt_of<const D: usize>(rank: usize, words: &[u64]) -> RankShare<D> {
    let (count, words) = words.split_first().map_or((0, words), |(count, words)| (*count as usize, words));
    let (of_particles, of_memory) = words.split_at(count * (6 + 2 * D));
    let particle = |words: &[u64]| {
        let number = |k: usize| f64::from_bits(words[k]);
        let vector = |first: usize| Vector::from_fn(|d, _| number(first + d));
        PartParticle {
            index: words[0] as u32,
            order: words[1] as u32,
            owner: words[2] as u32,
            position: vector(3),
            free: vector(3 + D),
            radius: number(3 + 2 * D),
            mobility: number(4 + 2 * D),
            reach: number(5 + 2 * D),
        }
    };
    let memory = |[first, second, i, j, k, gamma, lambda]: &[u64; PAIR_WORDS + 2]| PartMemory {
        pair: pair_of([*first, *second, *i, *j, *k]),
        gamma: f64::from_bits(*gamma),
        lambda: f64::from_bits(*lambda),
    };
    RankShare {
        rank: rank as u32,
        particles: of_particles.chunks_exact(6 + 2 * D).map(particle).collect(),
        memory: of_memory.as_chunks().0.iter().map(memory).collect(),
    }
}

/// What came of a step on a rank.
#[derive(Clone, Debug, Default)]
pub(super) struct Outcome<const D: usize> {
    pub report: ContactReport,
    /// Rows in islands that reach across ranks.
    pub shared_row_count: usize,
    /// Index and change of velocity of own particles.
    pub changes: Vec<(u32, Vector<D>)>,
    pub contacts: Vec<Contact>,
}

impl<const D: usize> Outcome<D>
where
    Dim<D>: Space<D>,
{
    /// What came of it where it was solved.
    pub fn of(outcome: &PartOutcome, part: &PartContact<D>, shares: &RankShare<D>) -> Self {
        let own = shares.particles.iter().zip(part.changes()).filter(|(of, _)| of.owner == shares.rank);
        let changed = own.filter(|(_, change)| change.amax() > 0.0);
        Self {
            report: outcome.report,
            shared_row_count: outcome.shared_row_count,
            changes: changed.map(|(particle, change)| (particle.index, *change)).collect(),
            contacts: part.contacts().to_vec(),
        }
    }

    /// As numbers.
    pub fn words(&self) -> Vec<u64> {
        let ContactReport { iterations, passes, residual, pair_count, active_count, worst } = self.report;
        let mut words = vec![iterations as u64, passes as u64, residual.to_bits()];
        words.extend([pair_count, active_count, self.shared_row_count, self.changes.len()].map(|n| n as u64));
        words.push(u64::from(worst.is_some()));
        if let Some(WorstPair { pair, gap }) = worst {
            words.extend(pair_words(pair));
            words.push(gap.to_bits());
        }
        for (index, change) in &self.changes {
            words.push(u64::from(*index));
            words.extend(change.iter().map(|x| x.to_bits()));
        }
        for Contact { pair, lambda, gamma, gap } in &self.contacts {
            words.extend(pair_words(*pair));
            words.extend([lambda, gamma, gap].map(|x| x.to_bits()));
        }
        words
    }

    /// From such numbers; `None` if they are not such.
    pub fn from_words(words: &[u64]) -> Option<Self> {
        let (&head, mut rest) = words.split_first_chunk::<8>()?;
        let [iterations, passes, residual, pair_count, active_count, shared, change_count, has_worst] = head;
        let mut worst = None;
        if has_worst == 1 {
            let (of_worst, after) = rest.split_first_chunk::<{ PAIR_WORDS + 1 }>()?;
            let (pair, gap) = of_worst.split_first_chunk::<PAIR_WORDS>()?;
            worst = Some(WorstPair { pair: pair_of(*pair), gap: f64::from_bits(gap[0]) });
            rest = after;
        }
        let (changes, contacts) = rest.split_at_checked(change_count as usize * (1 + D))?;
        let change = |words: &[u64]| (words[0] as u32, Vector::from_fn(|d, _| f64::from_bits(words[1 + d])));
        let contact = |words: &[u64; PAIR_WORDS + 3]| {
            let [first, second, i, j, k, lambda, gamma, gap] = *words;
            let [lambda, gamma, gap] = [lambda, gamma, gap].map(f64::from_bits);
            Contact { pair: pair_of([first, second, i, j, k]), lambda, gamma, gap }
        };
        Some(Self {
            report: ContactReport {
                iterations: iterations as usize,
                passes: passes as usize,
                residual: f64::from_bits(residual),
                pair_count: pair_count as usize,
                active_count: active_count as usize,
                worst,
            },
            shared_row_count: shared as usize,
            changes: changes.chunks_exact(1 + D).map(change).collect(),
            contacts: contacts.as_chunks().0.iter().map(contact).collect(),
        })
    }
}
