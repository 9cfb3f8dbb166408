//! Contact of particles that several ranks share, each with those in its part of space: what one rank does,
//! and what it asks of the others. How messages travel is the affair of who implements [`Partners`].
//!
//! [`Coordinator`] stands where all particles are known. It partitions them among ranks along a Morton curve
//! through the cells of the neighbour grid ([`RankShare`]): those that a rank owns, and copies of others that
//! come near them. A [`PartContact`] searches among these and has the rows of the pairs whose particle with
//! the smaller number its rank owns. Islands whose rows are all on one rank are solved there, as without
//! ranks and to the same bits. Those that reach across ranks are one problem, by the same methods: rows stay
//! where they are, forces on copies are added to those on the owner's particle, which tells how it moves, and
//! products and residuals are sums and maxima over all ranks.
//!
//! The documentation of `gluey-distributed` has what runs on this.

mod failure;
pub(crate) mod partition;

use gluey_geom::Vector;

use crate::{ContactError, ContactParams, ContactReport, Domain, PairKey};

pub use crate::coordinator::Coordinator;
pub use crate::pair_contact::PartContact;
pub use failure::{PAIR_WORDS, pair_of, pair_words};

/// What a rank asks of the others with whom it shares contacts. All ranks call the same methods in the same
/// order.
pub trait Partners<const D: usize> {
    /// The number of this rank, from zero.
    fn rank(&self) -> usize;

    /// Replaces `sums` by the sums over all ranks, in an order that depends on their number alone, and
    /// `largest` by the largest over all ranks.
    fn complete(&self, sums: &mut [f64], largest: &mut [f64]);

    /// What the first rank that failed says of it, on all ranks; nothing if none failed.
    fn first_failure(&self, own: Option<String>) -> Option<String>;

    /// The words of all ranks in their order, on rank zero.
    fn gather(&self, words: &[u64]) -> Option<Vec<Vec<u64>>>;

    /// What rank zero, which alone has some, has for each rank.
    fn scatter(&self, words: Option<Vec<Vec<u64>>>) -> Vec<u64>;

    /// Adds the values of copies to those of the owners' particles, in the order of the ranks; those of
    /// copies are zero then.
    fn accumulate(&self, values: &mut [Vector<D>]);

    /// Sets the values of copies to those of the owners' particles.
    fn update(&self, values: &mut [Vector<D>]);

    /// From now on values are those of these particles of the [`RankShare`], in this order; of all, in
    /// theirs, where nothing is given. Values without a particle are this rank's own affair. If a rank lists
    /// a copy, its owner lists the particle.
    fn select(&self, particles: Option<&[Option<u32>]>);
}

/// A particle on a rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartParticle<const D: usize> {
    /// Its index among all particles.
    pub index: u32,
    /// Its Morton index: its place among all particles in the order of space.
    pub order: u32,
    /// The rank that owns it.
    pub owner: u32,
    /// Centre at the beginning of the step; unit: length.
    pub position: Vector<D>,
    /// Displacement in the step without contact; unit: length.
    pub free: Vector<D>,
    /// Radius; unit: length.
    pub radius: f64,
    /// Velocity that a unit force gives it, 0 if it moves as it is told; unit: 1/length.
    pub mobility: f64,
    /// How far to search around it; unit: length.
    pub reach: f64,
}

/// The memory of a pair, whose particles are named by their ranks in the order of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMemory {
    /// The first and the second, or the wall.
    pub pair: PairKey,
    /// Memory before the step, `<= 0`; unit: length^2.
    pub gamma: f64,
    /// Force of the last step over `6 pi eta`; unit: length^2/time.
    pub lambda: f64,
}

/// What a rank gets for a step: its own particles and copies of others, in the order of space, and the
/// memory of its pairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RankShare<const D: usize> {
    /// The rank.
    pub rank: u32,
    /// Own particles and copies.
    pub particles: Vec<PartParticle<D>>,
    /// Memory of the pairs whose particle with the smaller index is an own one.
    pub memory: Vec<PartMemory>,
}

/// What all ranks know of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct PartFrame<const D: usize> {
    /// Law and tuning.
    pub params: ContactParams,
    /// Walls, periods and how images slide.
    pub domain: Domain<D>,
    /// Displacement that a unit velocity makes.
    pub velocity_weight: f64,
    /// Length of the step.
    pub dt: f64,
    /// Residual to reach; unit: length.
    pub tolerance: f64,
    /// Displacements along a wall's normal up to which walls are candidates, beyond the free ones.
    pub wall_slack: f64,
}

impl<const D: usize> Default for PartFrame<D> {
    fn default() -> Self {
        let (params, domain) = (ContactParams::default(), Domain::default());
        Self { params, domain, velocity_weight: 1.0, dt: 1.0, tolerance: 0.0, wall_slack: 0.0 }
    }
}

/// What came of a step on a rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartOutcome {
    /// Whether the search went far enough, on all ranks. Otherwise nothing but [`PartContact::displacements`]
    /// is of use, and particles are to be partitioned anew.
    pub is_complete: bool,
    /// Effort, and the pairs of this rank.
    pub report: ContactReport,
    /// Rows of this rank in islands that reach across ranks.
    pub shared_row_count: usize,
}

/// Why a step failed, on all ranks.
#[derive(Clone, Debug, PartialEq)]
pub enum PartFailure {
    /// The failure is one of contacts of this rank. Of contacts that are infeasible it names those here.
    Here(ContactError),
    /// Other ranks know what it is, and say so.
    Elsewhere {
        /// What they say.
        message: String,
    },
}

#[cfg(test)]
mod tests;
