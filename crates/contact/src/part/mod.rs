//! Contact of particles that several ranks share, each with those in its part of space: what one rank does,
//! and what it asks of the others. How messages travel is the affair of who implements [`Partners`].
//!
//! All ranks know all particles and what all contacts remember. Each finds its part of them for itself, along
//! a Morton curve through the cells of the neighbour grid ([`RankShare`]): particles that it owns, and copies
//! of others that come near them. It searches among these and has the rows of the pairs whose particle with
//! the smaller number it owns. Islands whose rows are all on one rank are solved there, as without ranks and
//! to the same bits. Those that reach across ranks are one problem, by the same methods: rows stay where they
//! are, forces on copies are added to those on the owner's particle, which tells how it moves, and products
//! and residuals are sums and maxima over all ranks. What comes of a step is put together again by all
//! ([`PartContact`]).
//!
//! The documentation of `gluey-distributed` has what runs on this.

mod failure;
pub(crate) mod partition;

use gluey_geom::Vector;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{Contact, ContactError, ContactReport, PairState};

pub use crate::pair_contact::{Centers, PartContact};
pub use partition::RankOf;

/// Questions of a rank to the others with whom it shares contacts. All ranks call the same methods in the
/// same order.
pub trait Partners<const D: usize> {
    /// The number of this rank, from zero.
    fn rank(&self) -> usize;

    /// Replaces `sums` by the sums over all ranks, in an order that depends on their number alone, and
    /// `largest` by the largest over all ranks.
    fn complete(&self, sums: &mut [f64], largest: &mut [f64]);

    /// What the first rank that failed says of it, on all ranks; nothing if none failed.
    fn first_failure(&self, own: Option<String>) -> Option<String>;

    /// The numbers of all ranks in their order.
    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>>;

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
pub struct PartParticle {
    /// Its index among all particles.
    pub index: u32,
    /// Its Morton index: its place among all particles in the order of space.
    pub order: u32,
    /// The rank that owns it.
    pub owner: u32,
    /// How far to search around it; unit: length.
    pub reach: f64,
}

/// The share of a rank in a step: its own particles and copies of others, in the order of space, and the
/// memory of its pairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RankShare {
    /// The rank.
    pub rank: u32,
    /// Own particles and copies.
    pub particles: Vec<PartParticle>,
    /// Memory of the pairs whose particle with the smaller index is an own one; particles are named by their
    /// places among those above.
    pub memory: Vec<PairState>,
}

impl RankShare {
    /// Place, index and whether it is an own one, of each particle.
    pub(crate) fn own(&self) -> impl Iterator<Item = (usize, u32)> {
        let own = self.particles.iter().enumerate().filter(|(_, particle)| particle.owner == self.rank);
        own.map(|(place, particle)| (place, particle.index))
    }
}

/// The outcome of a step on a rank, for all.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub enum PartOutcome<const D: usize> {
    /// The search went far enough, on all ranks.
    Complete {
        /// Effort, and the pairs of this rank.
        report: ContactReport,
        /// Rows of this rank in islands that reach across ranks.
        shared_row_count: usize,
        /// Index and change of velocity of own particles.
        changes: Vec<(u32, Vector<D>)>,
        /// Contacts of this rank's pairs.
        contacts: Vec<Contact>,
    },
    /// The search did not go far enough, on some rank: index and displacement of own particles, for which
    /// particles are to be partitioned anew.
    Incomplete(Vec<(u32, Vector<D>)>),
}

/// Failure of a step, on all ranks.
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
