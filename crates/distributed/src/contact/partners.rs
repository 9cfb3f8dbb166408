//! The other ranks as contact sees them: ghosts of particles, sums and maxima.

use std::cell::RefCell;

use gluey_contact::part::{Partners, RankShare};
use gluey_geom::Vector;
use gluey_parallel::{Communicator, GhostPlan, Ranks, Wanted};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The ranks that share a step.
pub(super) struct Sharers<'a, const D: usize> {
    ranks: &'a Ranks,
    /// Of all particles here, and of those selected.
    all: RefCell<Border>,
    selected: RefCell<Option<Border>>,
    /// Values by particle.
    buffer: RefCell<Vec<f64>>,
}

/// Messages between ranks, and the particles that they are of.
struct Border {
    plan: GhostPlan,
    /// Place among the values, and particle.
    particles: Vec<(u32, u32)>,
}

impl Border {
    /// Of values that stand in the order of the particles; `place` says where, if they do.
    fn new(plan: GhostPlan, place: impl Fn(u32) -> Option<u32>) -> Self {
        let mut particles: Vec<u32> = plan.owned().chain(plan.ghosts()).collect();
        particles.sort_unstable();
        particles.dedup();
        let particles =
            particles.into_iter().filter_map(|particle| Some((place(particle)?, particle))).collect();
        Self { plan, particles }
    }
}

impl<'a, const D: usize> Sharers<'a, D> {
    /// Finds out who has copies of which particles. All ranks call this.
    pub fn new(ranks: &'a Ranks, shares: &RankShare) -> Self {
        let particles = &shares.particles;
        let copies = (0u32..).zip(particles).filter(|(_, particle)| particle.owner != shares.rank);
        let wanted = copies.map(|(place, particle)| Wanted {
            owner: particle.owner as usize,
            key: u64::from(particle.order),
            place,
        });
        let find = |key: u64| {
            let place = particles.binary_search_by_key(&key, |particle| u64::from(particle.order));
            place.ok().map(|place| place as u32)
        };
        let plan = GhostPlan::new(ranks, wanted.collect(), find);
        let buffer = RefCell::new(vec![0.0; particles.len() * D]);
        let (all, selected) = (RefCell::new(Border::new(plan, Some)), RefCell::new(None));
        Self { ranks, all, selected, buffer }
    }

    /// Lets `work` exchange the values at the border.
    fn with_border(&self, values: &mut [Vector<D>], work: impl Fn(&mut GhostPlan, &mut [f64])) {
        let (mut all, mut selected) = (self.all.borrow_mut(), self.selected.borrow_mut());
        let Border { plan, particles } = selected.as_mut().unwrap_or(&mut all);
        let buffer = &mut *self.buffer.borrow_mut();
        for &(place, particle) in &*particles {
            buffer[particle as usize * D..][..D].copy_from_slice(values[place as usize].as_slice());
        }
        work(plan, buffer);
        for &(place, particle) in &*particles {
            values[place as usize].as_mut_slice().copy_from_slice(&buffer[particle as usize * D..][..D]);
        }
    }
}

impl<const D: usize> Partners<D> for Sharers<'_, D> {
    fn rank(&self) -> usize {
        self.ranks.rank()
    }

    fn complete(&self, sums: &mut [f64], largest: &mut [f64]) {
        self.ranks.reduce(sums, largest);
    }

    fn first_failure(&self, own: Option<String>) -> Option<String> {
        self.ranks.first_failure(own).map(|failure| failure.message)
    }

    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>> {
        all_of(self.ranks, &numbers.to_vec())
    }

    fn accumulate(&self, values: &mut [Vector<D>]) {
        self.with_border(values, |plan, buffer| plan.accumulate::<f64, D>(self.ranks, buffer));
    }

    fn update(&self, values: &mut [Vector<D>]) {
        self.with_border(values, |plan, buffer| plan.update::<f64, D>(self.ranks, buffer));
    }

    fn select(&self, particles: Option<&[Option<u32>]>) {
        let selected = particles.map(|particles| {
            let mut places = vec![u32::MAX; self.buffer.borrow().len() / D];
            for (place, particle) in (0u32..).zip(particles) {
                particle.iter().for_each(|&particle| places[particle as usize] = place);
            }
            let place = |particle: u32| Some(places[particle as usize]).filter(|&place| place != u32::MAX);
            let plan = self.all.borrow().plan.restricted(self.ranks, |particle| place(particle).is_some());
            Border::new(plan, place)
        });
        self.selected.replace(selected);
    }
}

/// The values of all ranks, in their order.
pub(super) fn all_of<T: Serialize + DeserializeOwned>(ranks: &Ranks, own: &T) -> Vec<T> {
    const WHY: &str = "what was encoded by the same program in memory is whole";
    let mut bytes = postcard::to_stdvec(own).expect(WHY);
    let most = ranks.all_gather(&[bytes.len().div_ceil(8) as u64]).into_iter().max().unwrap_or(0) as usize;
    bytes.resize(8 * most, 0);
    let words: Vec<u64> = bytes.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
    let all: Vec<u8> = ranks.all_gather(&words).into_iter().flat_map(u64::to_le_bytes).collect();
    all.chunks_exact((8 * most).max(1)).map(|bytes| postcard::from_bytes(bytes).expect(WHY)).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failure here is a failing test")]
mod tests {
    use gluey_contact::solver::ResidualHistory;
    use gluey_contact::{ContactError, PairKey};
    use gluey_parallel::Threads;

    use super::*;

    #[test]
    fn errors_arrive_as_they_were_sent() {
        let pairs = [PairKey::across(7, 3, [1, -2, 0]), PairKey::new(0, 1), PairKey::wall(4, 1)];
        let [pair, worst, _] = pairs;
        let history = ResidualHistory { entries: vec![(1, 0.5), (2, 1e-3)] };
        let errors = [
            ContactError::BadStep { velocity_weight: 0.0, dt: 0.0 },
            ContactError::Coincident { pair },
            ContactError::Given { pair: pairs[2], gap: -0.25 },
            ContactError::GapNotClosed { pair, gap: 1e-9, passes: 7 },
            ContactError::Infeasible { pairs: pairs.to_vec() },
            ContactError::NotConverged { residual: 1e-3, tolerance: 1e-13, iterations: 9, history, worst },
        ];
        // Of other lengths on each rank, and none on some.
        let own = |rank: usize| (rank != 1).then(|| errors[2 * rank].clone());
        let all = Threads::run(3, |ranks| all_of(ranks, &own(ranks.rank()))).unwrap();
        assert_eq!(all, vec![[0, 1, 2].map(own).to_vec(); 3]);
        let all = Threads::run(2, |ranks| all_of(ranks, &errors.to_vec())).unwrap();
        assert_eq!(all, vec![vec![errors.to_vec(); 2]; 2]);
    }
}
