//! The search for balls that meet.

use gluey_geom::Vector;

/// Finds the pairs of balls that meet. All implementations give the same pairs in the same order.
pub trait Broadphase<const D: usize>: Send {
    /// Replaces `pairs` by all `(i, j)` with `i < j`, `i < asker_count` and `|x_i - x_j| <= r_i + r_j`,
    /// sorted.
    ///
    /// Balls from `asker_count` on are only looked for (images across a periodic border). Coordinates are
    /// finite, radii are positive.
    fn meeting(
        &mut self,
        centers: &[Vector<D>],
        radii: &[f64],
        asker_count: usize,
        pairs: &mut Vec<(u32, u32)>,
    );
}

/// Whether two balls meet.
pub(super) fn meet<const D: usize>(x: &Vector<D>, y: &Vector<D>, reach: f64) -> bool {
    (y - x).norm_squared() <= reach * reach
}
