//! The neighbour list (Verlet 1967, DOI 10.1103/PhysRev.159.98): candidates for contact, kept from step to
//! step as long as particles stay near where they were, or where images that slide carry them.

mod affine;
mod images;
mod order;
mod ownership;
mod part;

use gluey_geom::{Lattice, Vector};

use crate::broadphase::BestOf;
use crate::{ContactError, Domain, PairKey, Partner, StepGeometry, Wall};
pub(crate) use affine::{AffineFit, KnownMotion};
pub(crate) use images::{for_each_image, wrap};
pub(crate) use order::SpatialOrder;
pub(crate) use ownership::Ownership;
pub(crate) use part::PartSearch;

/// Pairs nearer than this part of their summed radii are kept in the list whatever they do (the skin of the
/// list), so that one search serves several steps.
const SKIN: f64 = 0.1;

/// A candidate for contact, in the numbering of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// A particle's place, or a wall's number plus the number of particles.
    pub tail: u32,
    /// A particle's place.
    pub head: u32,
    /// Which image of the head.
    pub image: [i32; 3],
}

/// The neighbour list of a step. Particles are numbered by their *places*, an order of space.
#[derive(Debug, Default)]
pub(crate) struct NeighbourList<const D: usize> {
    /// Particle of each place.
    pub order: Vec<u32>,
    /// Place of each particle.
    places: Vec<u32>,
    /// Candidates: pairs that were found, walls, remembered contacts that are neither.
    pub candidates: Vec<Candidate>,
    /// First found pair of each place; found pairs are sorted by tail.
    starts: Vec<u32>,
    found_count: usize,
    walls_end: usize,
    /// Positions and radii of the places.
    pub positions: Vec<Vector<D>>,
    pub radii: Vec<f64>,
    /// Displacements of the places without contact.
    pub free: Vec<Vector<D>>,
    /// Rank of each place in an order of space that depends on nothing but where particles are.
    pub ranks: Vec<u32>,
    /// Where places were when the search was made, and the distance up to which it was made.
    reference: Vec<Vector<D>>,
    reference_lattice: Lattice<D>,
    reach: Vec<f64>,
    remaining_reach: Vec<f64>,
    /// Gap kept between particles, relative to their radii.
    pub margin: f64,
    /// Factor of the displacements that are searched for: doubles whenever a step needs a wider search, for
    /// contact pushes particles elsewhere when it knows more pairs.
    widening: f64,
    /// Displacements along a wall's normal up to which walls are candidates, beyond the free ones.
    wall_slack: f64,
    /// Whose the particles are, where this is the list of one of several ranks.
    ownership: Option<Ownership>,
    search: Search<D>,
}

/// Buffers of a search.
#[derive(Debug, Default)]
struct Search<const D: usize> {
    spatial: SpatialOrder,
    ranked: Vec<u32>,
    broadphase: BestOf,
    wrapped: Vec<Vector<D>>,
    windings: Vec<[i32; 3]>,
    centers: Vec<Vector<D>>,
    reaches: Vec<f64>,
    /// Place and image of each ball that is not a particle itself.
    ghosts: Vec<(u32, [i32; 3])>,
    pairs: Vec<(u32, u32)>,
    moved: Vec<Vector<D>>,
}

impl<const D: usize> NeighbourList<D> {
    /// Number of particles.
    pub(crate) fn count(&self) -> usize {
        self.order.len()
    }

    /// Wall of a candidate, if it is one.
    pub(crate) fn wall(&self, candidate: &Candidate) -> Option<usize> {
        (candidate.tail as usize).checked_sub(self.count())
    }

    /// The name of the contact, in the numbering of the caller.
    pub(crate) fn key(&self, candidate: &Candidate) -> PairKey {
        let name = |place: u32| {
            let particle = self.order[place as usize] as usize;
            self.ownership.as_ref().map_or(particle, |owned| owned.names[particle] as usize)
        };
        let head = name(candidate.head);
        match self.wall(candidate) {
            Some(wall) => PairKey::wall(head, wall),
            None => PairKey::across(name(candidate.tail), head, candidate.image),
        }
    }

    /// The candidate that a contact's name means.
    fn candidate(&self, key: PairKey) -> Candidate {
        let first = self.places[key.first as usize];
        match key.second {
            Partner::Wall(wall) => Candidate { tail: self.count() as u32 + wall, head: first, image: [0; 3] },
            Partner::Particle { index, image } => {
                let second = self.places[index as usize];
                if first <= second {
                    Candidate { tail: first, head: second, image }
                } else {
                    Candidate { tail: second, head: first, image: image.map(|n| -n) }
                }
            }
        }
    }

    /// Index of a contact's candidate, added if no search found it.
    pub(crate) fn find_or_add(&mut self, key: PairKey) -> usize {
        let wanted = self.candidate(key);
        let found = match self.wall(&wanted) {
            None => {
                let tail = wanted.tail as usize;
                let row = self.starts[tail] as usize..self.starts[tail + 1] as usize;
                self.candidates[row.clone()]
                    .iter()
                    .position(|candidate| *candidate == wanted)
                    .map(|k| row.start + k)
            }
            Some(_) => {
                let walls = &self.candidates[self.found_count..self.walls_end];
                let place = walls.binary_search_by_key(&(wanted.tail, wanted.head), |candidate| {
                    (candidate.tail, candidate.head)
                });
                place.ok().map(|k| self.found_count + k)
            }
        };
        found.unwrap_or_else(|| {
            self.candidates.push(wanted);
            self.candidates.len() - 1
        })
    }

    /// Takes over the particles of a step that would move by `displacements` (by particle) without contact.
    ///
    /// Whether the search was made now or some steps ago changes no bit of the results.
    pub(crate) fn begin(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        displacements: &[Vector<D>],
    ) -> Result<(), ContactError> {
        (self.widening, self.wall_slack) = (1.0, 0.0);
        let same = self.is_of(step.radii);
        if same {
            self.load(step, displacements);
            self.set_remaining_reach(domain);
        }
        if same && self.has_all_pairs(domain, &self.free) {
            self.rank(domain);
        } else {
            self.rebuild(step, domain, displacements, displacements)?;
        }
        self.add_walls(step, domain);
        Ok(())
    }

    /// Whether the list is one of particles with these radii.
    fn is_of(&self, radii: &[f64]) -> bool {
        self.radii.len() == radii.len()
            && self.order.iter().zip(&self.radii).all(|(&i, radius)| radii[i as usize] == *radius)
    }

    /// Widens the search to what `needed` displacements (by particle) could close.
    pub(crate) fn extend(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        displacements: &[Vector<D>],
        needed: &[Vector<D>],
    ) -> Result<(), ContactError> {
        self.widening *= 2.0;
        for wall in &domain.walls {
            let farthest = needed.iter().map(|s| wall.normal.dot(s).abs()).fold(0.0, f64::max);
            self.wall_slack = self.wall_slack.max(farthest);
        }
        self.rebuild(step, domain, displacements, needed)?;
        self.add_walls(step, domain);
        Ok(())
    }

    /// Whether no contact that `displacements` (by place) could close is missing.
    pub(crate) fn is_sufficient(
        &self,
        domain: &Domain<D>,
        step: &StepGeometry<'_, D>,
        displacements: &[Vector<D>],
    ) -> bool {
        let walls = domain.walls.iter().all(|wall| {
            let reached = |place: usize| {
                self.wall_reach(wall, place, step.dt)
                    >= wall.speed * step.dt - wall.normal.dot(&displacements[place])
            };
            (0..self.count()).all(reached)
        });
        walls && self.has_all_pairs(domain, displacements)
    }

    fn load(&mut self, step: &StepGeometry<'_, D>, displacements: &[Vector<D>]) {
        self.positions.clear();
        self.positions.extend(self.order.iter().map(|&i| step.positions[i as usize]));
        self.free.clear();
        self.free.extend(self.order.iter().map(|&i| displacements[i as usize]));
    }

    /// Ranks the places, which particles have moved away from.
    fn rank(&mut self, domain: &Domain<D>) {
        let search = &mut self.search;
        wrap(&self.positions, domain, &mut search.wrapped, &mut search.windings);
        search.spatial.sort(&search.wrapped, &mut search.ranked);
        self.ranks.resize(self.order.len(), 0);
        for (rank, &place) in search.ranked.iter().enumerate() {
            self.ranks[place as usize] = rank as u32;
        }
    }

    /// Puts the walls behind the found pairs.
    fn add_walls(&mut self, step: &StepGeometry<'_, D>, domain: &Domain<D>) {
        self.candidates.truncate(self.found_count);
        for (number, wall) in domain.walls.iter().enumerate() {
            let tail = (self.count() + number) as u32;
            for place in 0..self.count() {
                let is_near = wall.distance(&self.positions[place]) - self.radii[place]
                    <= self.wall_reach(wall, place, step.dt);
                if is_near && self.is_own(place) {
                    self.candidates.push(Candidate { tail, head: place as u32, image: [0; 3] });
                }
            }
        }
        self.walls_end = self.candidates.len();
    }

    /// Gap up to which a wall is a candidate.
    fn wall_reach(&self, wall: &Wall<D>, place: usize, dt: f64) -> f64 {
        let approach = wall.normal.dot(&self.free[place]).abs() + wall.speed.abs() * dt;
        approach + self.wall_slack + SKIN * self.radii[place]
    }

    /// Searches anew: for places an order of space, for pairs what `needed` could close.
    fn rebuild(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        displacements: &[Vector<D>],
        needed: &[Vector<D>],
    ) -> Result<(), ContactError> {
        // Should this fail, nothing is known.
        self.radii.clear();
        let search = &mut self.search;
        wrap(step.positions, domain, &mut search.wrapped, &mut search.windings);
        search.spatial.sort(&search.wrapped, &mut self.order);
        self.places.resize(self.order.len(), 0);
        for (place, &particle) in self.order.iter().enumerate() {
            self.places[particle as usize] = place as u32;
        }
        self.ranks.clear();
        self.ranks.extend(0..self.order.len() as u32);
        self.load(step, needed);
        self.reference.clone_from(&self.positions);
        self.reference_lattice = domain.lattice;
        self.set_reach(step, domain)?;
        self.load(step, displacements);
        self.radii.extend(self.order.iter().map(|&i| step.radii[i as usize]));
        self.search_within_reach(domain);
        self.remaining_reach.clone_from(&self.reach);
        Ok(())
    }

    /// How far to search around each place, for the displacements that are loaded.
    fn set_reach(&mut self, step: &StepGeometry<'_, D>, domain: &Domain<D>) -> Result<(), ContactError> {
        let moves = Moves {
            order: &self.order,
            positions: &self.positions,
            displacements: &self.free,
            margin: self.margin,
            widening: self.widening,
        };
        moves.reach(step.radii, domain, &mut self.reach)
    }

    /// The balls of the search: one per particle, and the images that could meet one.
    fn place_balls(&mut self, domain: &Domain<D>) {
        let search = &mut self.search;
        search.centers.clear();
        search.centers.extend(self.order.iter().map(|&i| search.wrapped[i as usize]));
        search.reaches.clone_from(&self.reach);
        search.ghosts.clear();
        if !domain.is_periodic() {
            return;
        }
        let margin = 2.0 * self.reach.iter().copied().fold(0.0, f64::max);
        for place in 0..self.order.len() {
            let x = search.centers[place];
            for_each_image(&x, &domain.lattice, margin, |image| {
                search.centers.push(x + domain.shift(&image));
                search.reaches.push(self.reach[place]);
                search.ghosts.push((place as u32, image));
            });
        }
    }

    /// Turns pairs of balls into candidates; of a pair across the border and its mirror image, one stays.
    fn collect(&mut self) {
        let count = self.order.len();
        let search = &self.search;
        self.candidates.clear();
        self.starts.clear();
        for &(tail, ball) in &search.pairs {
            let (head, image) = match (ball as usize).checked_sub(count) {
                None => (ball, [0; 3]),
                Some(ghost) => search.ghosts[ghost],
            };
            if head <= tail || self.ownership.as_ref().is_some_and(|owned| !owned.has_pair(tail, head)) {
                continue;
            }
            self.starts.resize(tail as usize + 1, self.candidates.len() as u32);
            // Images count from the positions as they were given.
            let [behind, ahead] =
                [tail, head].map(|place| search.windings[self.order[place as usize] as usize]);
            let image = std::array::from_fn(|d| image[d] + ahead[d] - behind[d]);
            self.candidates.push(Candidate { tail, head, image });
        }
        self.starts.resize(count + 1, self.candidates.len() as u32);
        self.found_count = self.candidates.len();
    }

    /// How much of each reach particles have left by moving since the search.
    ///
    /// A pair that was not found was farther apart than its two reaches; since then particles moved by an
    /// affine motion of gradient `G` and a rest, which left at least `(1 - |G|) reach - rest` of each reach.
    fn set_remaining_reach(&mut self, domain: &Domain<D>) {
        let moved = &mut self.search.moved;
        moved.clear();
        moved.extend(self.positions.iter().zip(&self.reference).map(|(x, before)| x - before));
        let shear = domain.lattice.shear() - self.reference_lattice.shear();
        let past = AffineFit::new(&self.reference, moved, &KnownMotion { shear, ..frame_of_step(domain) });
        let rests = self.reference.iter().zip(moved).map(|(x, moved)| past.rest(x, moved));
        self.remaining_reach.clear();
        self.remaining_reach
            .extend(self.reach.iter().zip(rests).map(|(reach, rest)| (1.0 - past.strain) * reach - rest));
    }

    /// Whether the search reached as far as pairs could come together under `displacements` (by place).
    fn has_all_pairs(&self, domain: &Domain<D>, displacements: &[Vector<D>]) -> bool {
        let fit = AffineFit::new(&self.positions, displacements, &frame_of_step(domain));
        let motion = |place: usize| (&self.positions[place], &displacements[place]);
        (0..self.order.len())
            .all(|place| self.need(place, &fit, motion(place)) <= self.remaining_reach[place])
    }

    /// How far to search around a place at `motion.0` that moves by `motion.1`.
    fn need(&self, place: usize, fit: &AffineFit<D>, motion: (&Vector<D>, &Vector<D>)) -> f64 {
        let rest = fit.rest(motion.0, motion.1);
        ((1.0 + self.margin) * self.radii[place] + rest) / (1.0 - fit.strain)
    }
}

/// Particles in an order, and how far they are to move.
pub(crate) struct Moves<'a, const D: usize> {
    pub order: &'a [u32],
    /// By place in the order.
    pub positions: &'a [Vector<D>],
    pub displacements: &'a [Vector<D>],
    /// Gap kept between particles, relative to their radii.
    pub margin: f64,
    /// Factor of what displacements have besides their affine part.
    pub widening: f64,
}

impl<const D: usize> Moves<'_, D> {
    /// How far to search around each place.
    pub(crate) fn reach(
        &self,
        radii: &[f64],
        domain: &Domain<D>,
        reach: &mut Vec<f64>,
    ) -> Result<(), ContactError> {
        let fit = AffineFit::new(self.positions, self.displacements, &frame_of_step(domain));
        reach.clear();
        for (place, &particle) in self.order.iter().enumerate() {
            let particle = particle as usize;
            let rest = fit.rest(&self.positions[place], &self.displacements[place]);
            let radius = radii[particle];
            if let Some(&period) =
                domain.lattice.periods().iter().flatten().find(|period| rest > 0.5 * **period)
            {
                return Err(ContactError::TooFast { particle, displacement: rest, period });
            }
            // The next steps may strain as much before they search.
            let need = ((1.0 + self.margin) * radius + self.widening * rest) / (1.0 - fit.strain);
            reach.push(need * (1.0 + fit.strain) + SKIN * radius);
        }
        Ok(())
    }
}

/// The motion of the lattice in the step.
fn frame_of_step<const D: usize>(domain: &Domain<D>) -> KnownMotion<D> {
    KnownMotion { free: domain.lattice.periods().map(|period| period.is_none()), shear: domain.strain_step() }
}

#[cfg(test)]
mod tests;
