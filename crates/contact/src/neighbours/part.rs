//! The neighbour list of one of several ranks: its own particles and copies of others near them.
//!
//! Particles come in the order of space of all ranks, with the distances to search that follow from the
//! motion of all. So each pair is found where it would be by one search for all, by the ranks that hold both
//! particles; one of them takes it, the one that owns the particle with the smaller number.

use gluey_geom::Vector;

use super::ownership::Ownership;
use super::{AffineFit, NeighbourList, frame_of_step, wrap};
use crate::broadphase::Broadphase;
use crate::{Domain, StepGeometry, Wall};

/// Input of a search among the particles of a rank.
pub(crate) struct PartSearch<'a, const D: usize> {
    pub ownership: &'a mut Ownership,
    /// Displacements without contact, by particle.
    pub free: &'a [Vector<D>],
    /// How far to search around each particle.
    pub reach: &'a [f64],
    /// Displacements along a wall's normal up to which walls are candidates, beyond the free ones.
    pub wall_slack: f64,
}

impl<const D: usize> NeighbourList<D> {
    /// Takes over the particles of a rank, which are in the order of space, and searches among them.
    pub(crate) fn search_part(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        part: PartSearch<'_, D>,
    ) {
        (self.widening, self.wall_slack, self.margin) = (1.0, part.wall_slack, 0.0);
        std::mem::swap(self.ownership.get_or_insert_default(), part.ownership);
        wrap(step.positions, domain, &mut self.search.wrapped, &mut self.search.windings);
        for numbers in [&mut self.order, &mut self.places, &mut self.ranks] {
            numbers.clear();
            numbers.extend(0..step.positions.len() as u32);
        }
        self.load(step, part.free);
        self.radii.clear();
        self.radii.extend_from_slice(step.radii);
        self.reach.clear();
        self.reach.extend_from_slice(part.reach);
        self.remaining_reach.clone_from(&self.reach);
        self.search_within_reach(domain);
        self.add_walls(step, domain);
    }

    /// Finds the pairs within the reach of each place.
    pub(super) fn search_within_reach(&mut self, domain: &Domain<D>) {
        self.place_balls(domain);
        let super::Search { broadphase, centers, reaches, pairs, .. } = &mut self.search;
        broadphase.meeting(centers, reaches, self.order.len(), pairs);
        self.collect();
    }

    /// Number of a place's particle among those of all ranks; none for walls.
    pub(crate) fn name(&self, place: u32) -> Option<u32> {
        self.ownership.as_ref()?.names.get(place as usize).copied()
    }

    /// Whether a place is one of a particle that this rank owns.
    pub(crate) fn is_own(&self, place: usize) -> bool {
        self.ownership.as_ref().is_none_or(|owned| owned.is_own[place])
    }

    /// [`NeighbourList::is_sufficient`] for the own particles; `complete` makes sums over these sums over
    /// all particles.
    pub(crate) fn is_sufficient_here(
        &self,
        domain: &Domain<D>,
        dt: f64,
        displacements: &[Vector<D>],
        complete: impl Fn(&mut [f64]),
    ) -> bool {
        let own = || (0..self.count()).filter(|&place| self.is_own(place));
        let of_own = |values: &[Vector<D>]| own().map(|place| values[place]).collect::<Vec<_>>();
        let (positions, moves) = (of_own(&self.positions), of_own(displacements));
        let fit = AffineFit::completed(&positions, &moves, &frame_of_step(domain), complete);
        let reaches_wall = |place: usize, wall: &Wall<D>| {
            self.wall_reach(wall, place, dt) >= wall.speed * dt - wall.normal.dot(&displacements[place])
        };
        own().zip(positions.iter().zip(&moves)).all(|(place, (x, s))| {
            self.need(place, &fit, (x, s)) <= self.remaining_reach[place]
                && domain.walls.iter().all(|wall| reaches_wall(place, wall))
        })
    }
}
