//! A grid of cells over a cloud of points, and sorting by cell.

use std::ops::Range;

use gluey_geom::Vector;

/// Cells along an axis.
const MOST_ALONG_AXIS: f64 = 1e9;

/// A grid of cells over a cloud of points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid<const D: usize> {
    lower: Vector<D>,
    inverse_width: f64,
    counts: [usize; D],
}

impl<const D: usize> Grid<D> {
    /// The grid of cells at least `width` wide, wider if there would be more than `most` of them.
    pub(crate) fn over(points: &[Vector<D>], width: f64, most: usize) -> Self {
        let (lower, extent) = bounds(points);
        Self::within(lower, extent, width, most)
    }

    /// A grid with about one cell per point.
    pub(crate) fn fine(points: &[Vector<D>]) -> Self {
        let (lower, extent) = bounds(points);
        Self::within(lower, extent, extent.amax() / points.len().max(1) as f64, points.len())
    }

    fn within(lower: Vector<D>, extent: Vector<D>, width: f64, most: usize) -> Self {
        // More cells than this along an axis are too many; and a width of zero would never grow.
        let mut width = width.max(extent.amax() / MOST_ALONG_AXIS).max(f64::MIN_POSITIVE);
        loop {
            let counts: [usize; D] =
                std::array::from_fn(|d| (extent[d] / width).clamp(0.0, MOST_ALONG_AXIS) as usize + 1);
            let total = counts.iter().fold(1.0, |total, count| total * *count as f64);
            if total <= most.max(1) as f64 {
                return Self { lower, inverse_width: 1.0 / width, counts };
            }
            width *= 1.2;
        }
    }

    pub(crate) fn cell_count(&self) -> usize {
        self.counts.iter().product()
    }

    /// Place of a point along each axis.
    fn place(&self, x: &Vector<D>) -> [usize; D] {
        std::array::from_fn(|d| {
            (((x[d] - self.lower[d]) * self.inverse_width) as usize).min(self.counts[d] - 1)
        })
    }

    /// Number of the cell of a point.
    pub(crate) fn cell(&self, x: &Vector<D>) -> usize {
        let place = self.place(x);
        (0..D).rev().fold(0, |cell, d| cell * self.counts[d] + place[d])
    }

    /// Place along each axis of a cell.
    pub(crate) fn coordinates(&self, cell: usize) -> [usize; D] {
        let mut rest = cell;
        self.counts.map(|count| {
            let place = rest % count;
            rest /= count;
            place
        })
    }

    /// Whether a point within a cell's width of a side of all points, in these directions, may lie in a cell.
    pub(crate) fn is_at_side(&self, cell: usize, directions: &[bool; D]) -> bool {
        let place = self.coordinates(cell);
        (0..D).any(|d| directions[d] && (place[d] == 0 || place[d] + 2 >= self.counts[d]))
    }

    /// Calls `visit` with the numbers of each run of neighbouring cells around a point, in increasing order.
    pub(crate) fn for_each_row(&self, x: &Vector<D>, mut visit: impl FnMut(Range<usize>)) {
        let place = self.place(x);
        let lower: [usize; D] = std::array::from_fn(|d| place[d].saturating_sub(1));
        let upper: [usize; D] = std::array::from_fn(|d| (place[d] + 1).min(self.counts[d] - 1));
        let mut at = lower;
        loop {
            let row = (1..D).rev().fold(0, |cell, d| (cell + at[d]) * self.counts[d - 1]);
            visit(row + lower[0]..row + upper[0] + 1);
            let Some(d) = (1..D).find(|&d| at[d] < upper[d]) else { return };
            at[d] += 1;
            at[1..d].copy_from_slice(&lower[1..d]);
        }
    }
}

/// Lower corner and edge lengths of the box around points.
fn bounds<const D: usize>(points: &[Vector<D>]) -> (Vector<D>, Vector<D>) {
    let infinite = Vector::<D>::repeat(f64::INFINITY);
    let lower = points.iter().fold(infinite, |lower, x| lower.inf(x));
    let upper = points.iter().fold(-infinite, |upper, x| upper.sup(x));
    if points.is_empty() { (Vector::zeros(), Vector::zeros()) } else { (lower, upper - lower) }
}

/// Sorts `0..count` by `key` (smaller than `key_count`), stably: `starts[k]..starts[k + 1]` is the range of
/// key `k`.
pub(crate) fn sort_by_key(
    count: usize,
    key_count: usize,
    key: impl Fn(usize) -> usize,
    starts: &mut Vec<u32>,
    sorted: &mut Vec<u32>,
) {
    starts.clear();
    starts.resize(key_count + 1, 0);
    for i in 0..count {
        starts[key(i)] += 1;
    }
    let mut sum = 0;
    for start in starts.iter_mut() {
        sum += *start;
        *start = sum;
    }
    sorted.resize(count, 0);
    for i in (0..count).rev() {
        let place = &mut starts[key(i)];
        *place -= 1;
        sorted[*place as usize] = i as u32;
    }
}
