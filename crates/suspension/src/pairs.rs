//! All pairs up to a distance, with the images they are near in: a cell list, linear in the particles.

use gluey_geom::Vector;

use crate::Container;

/// A particle and an image of another, or of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearPair<const D: usize> {
    /// Index of the first particle.
    pub first: usize,
    /// Index of the second particle; not smaller.
    pub second: usize,
    /// Which image of the second, in periods along each axis.
    pub image: [i32; D],
    /// From the centre of the first to that of the image.
    pub arm: Vector<D>,
}

/// Calls `visit` for every pair of a particle and an image whose centres are at most `range` apart, once per
/// pair. Particles meet images of themselves, too, and each other more than once in a small box. Positions
/// need not be wrapped.
pub fn for_each_pair<const D: usize>(
    container: &Container<D>,
    positions: &[Vector<D>],
    range: f64,
    mut visit: impl FnMut(&NearPair<D>),
) {
    if positions.is_empty() {
        return;
    }
    let grid = ParticleCells::new(container, positions, range);
    for first in 0..positions.len() {
        grid.visit_partners(first, range, &mut visit);
    }
}

/// Particles binned by cells of the box without tilt.
struct ParticleCells<'a, const D: usize> {
    container: &'a Container<D>,
    axes: [CellAxis; D],
    /// Positions wrapped into the box.
    positions: Vec<Vector<D>>,
    /// By how many periods each was moved.
    windings: Vec<[i32; D]>,
    cells: Vec<[i64; D]>,
    /// First member of each cell.
    starts: Vec<usize>,
    /// Particles by cell.
    members: Vec<usize>,
}

/// Cells along an axis.
#[derive(Clone, Copy, Debug)]
struct CellAxis {
    lower: f64,
    width: f64,
    count: i64,
    /// Cells to look through on either side.
    reach: i64,
    is_periodic: bool,
}

impl CellAxis {
    fn cell(&self, place: f64) -> i64 {
        (((place - self.lower) / self.width) as i64).clamp(0, self.count - 1)
    }
}

impl<'a, const D: usize> ParticleCells<'a, D> {
    fn new(container: &'a Container<D>, positions: &[Vector<D>], range: f64) -> Self {
        let wrapped: Vec<_> = positions.iter().map(|x| container.wrapped(x)).collect();
        let lattice = container.lattice();
        let winding = |(x, w): (&Vector<D>, &Vector<D>)| {
            let moved = lattice.to_box(&(w - x), 0.0);
            std::array::from_fn(|d| lattice.periods()[d].map_or(0, |p| (moved[d] / p).round() as i32))
        };
        let windings = positions.iter().zip(&wrapped).map(winding).collect();
        let places: Vec<_> = wrapped.iter().map(|x| container.place(x)).collect();
        let axes = cell_axes(container, &places, range);
        let cells: Vec<[i64; D]> =
            places.iter().map(|place| std::array::from_fn(|d| axes[d].cell(place[d]))).collect();
        let mut grid = Self {
            container,
            axes,
            positions: wrapped,
            windings,
            cells,
            starts: Vec::new(),
            members: Vec::new(),
        };
        grid.bin();
        grid
    }

    fn number(&self, cell: &[i64; D]) -> usize {
        (0..D).rev().fold(0, |number, d| number * self.axes[d].count as usize + cell[d] as usize)
    }

    /// Sorts the particles by cell.
    fn bin(&mut self) {
        let cell_count: usize = self.axes.iter().map(|axis| axis.count as usize).product();
        let numbers: Vec<usize> = self.cells.iter().map(|cell| self.number(cell)).collect();
        self.starts = vec![0; cell_count + 1];
        numbers.iter().for_each(|&number| self.starts[number + 1] += 1);
        (0..cell_count).for_each(|cell| self.starts[cell + 1] += self.starts[cell]);
        let mut next = self.starts.clone();
        self.members = vec![0; numbers.len()];
        for (particle, &number) in numbers.iter().enumerate() {
            self.members[next[number]] = particle;
            next[number] += 1;
        }
    }

    /// Visits the pairs of which `first` is the first.
    fn visit_partners(&self, first: usize, range: f64, visit: &mut impl FnMut(&NearPair<D>)) {
        let counts: [i64; D] = std::array::from_fn(|d| 2 * self.axes[d].reach + 1);
        'cells: for number in 0..counts.iter().product() {
            let (mut rest, mut cell, mut image) = (number, [0; D], [0; D]);
            for d in 0..D {
                let axis = &self.axes[d];
                let wanted = self.cells[first][d] + rest % counts[d] - axis.reach;
                rest /= counts[d];
                cell[d] = wanted.rem_euclid(axis.count);
                image[d] = wanted.div_euclid(axis.count) as i32;
                if image[d] != 0 && !axis.is_periodic {
                    continue 'cells;
                }
            }
            self.visit_cell(first, range, &cell, &image, visit);
        }
    }

    /// Visits the pairs of `first` with members of an image of a cell.
    fn visit_cell(
        &self,
        first: usize,
        range: f64,
        cell: &[i64; D],
        image: &[i32; D],
        visit: &mut impl FnMut(&NearPair<D>),
    ) {
        let shift = self.container.lattice().shift(image) - self.positions[first];
        let number = self.number(cell);
        for &second in &self.members[self.starts[number]..self.starts[number + 1]] {
            let arm = self.positions[second] + shift;
            let is_first = second > first || (second == first && *image > [0; D]);
            if is_first && arm.norm_squared() <= range * range {
                let [here, there] = [first, second].map(|particle| self.windings[particle]);
                let image = std::array::from_fn(|d| image[d] + there[d] - here[d]);
                visit(&NearPair { first, second, image, arm });
            }
        }
    }
}

/// Cells as wide as the range or the spacing of the particles, whichever is more.
fn cell_axes<const D: usize>(container: &Container<D>, places: &[Vector<D>], range: f64) -> [CellAxis; D] {
    let extent = |d: usize| match container.lattice().periods()[d] {
        Some(period) => (0.0, period),
        None => {
            let lower = places.iter().map(|x| x[d]).fold(f64::INFINITY, f64::min);
            (lower, places.iter().map(|x| x[d]).fold(lower, f64::max) - lower)
        }
    };
    let extents: [(f64, f64); D] = std::array::from_fn(extent);
    let volume: f64 = extents.iter().map(|(_, length)| length.max(range)).product();
    let wanted = range.max((volume / places.len() as f64).powf(1.0 / D as f64)).max(f64::MIN_POSITIVE);
    let is_periodic = |d: usize| !container.is_walled(d);
    std::array::from_fn(|d| {
        let (lower, length) = extents[d];
        // Tilted cells are narrower across than along x.
        let slant = if d == 0 { 1f64.hypot(container.lattice().shear()) } else { 1.0 };
        let count = ((length / (wanted * slant)) as i64).max(1);
        let width = (length / count as f64).max(f64::MIN_POSITIVE);
        let reach = match is_periodic(d) {
            true => (range * slant / width).ceil() as i64,
            false => ((range / width).ceil() as i64).min(count - 1),
        };
        CellAxis { lower, width, count, reach, is_periodic: is_periodic(d) }
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    type Found = Vec<(usize, usize, Vec<i32>)>;

    fn found<const D: usize>(container: &Container<D>, positions: &[Vector<D>], range: f64) -> Found {
        let mut pairs = Vec::new();
        for_each_pair(container, positions, range, |pair| {
            let NearPair { first, second, image, arm } = pair;
            let expected = positions[*second] + container.lattice().shift(image) - positions[*first];
            assert!((arm - expected).norm() < 1e-12, "{arm} {expected}");
            pairs.push((*first, *second, image.to_vec()));
        });
        pairs.sort();
        pairs
    }

    /// Images up to six periods away are looked through.
    fn brute_force<const D: usize>(container: &Container<D>, positions: &[Vector<D>], range: f64) -> Found {
        let mut pairs = Vec::new();
        for first in 0..positions.len() {
            for second in first..positions.len() {
                for number in 0..13usize.pow(D as u32) {
                    let image: [i32; D] =
                        std::array::from_fn(|d| (number / 13usize.pow(d as u32) % 13) as i32 - 6);
                    let is_there = (0..D).all(|d| image[d] == 0 || !container.is_walled(d));
                    let arm = positions[second] + container.lattice().shift(&image) - positions[first];
                    let counts = second > first || image > [0; D];
                    if is_there && counts && arm.norm() <= range {
                        pairs.push((first, second, image.to_vec()));
                    }
                }
            }
        }
        pairs.sort();
        pairs
    }

    fn check<const D: usize>() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let bounds = gluey_geom::Aabb {
            lower: Vector::repeat(-0.3),
            upper: Vector::from_fn(|d, _| [0.9, 0.5, 0.7][d]),
        };
        for (periodic, tilt) in [([true; D], 0.0), ([true; D], 0.57), ([true; D], -0.4), ([false; D], 0.0)] {
            for range in [0.05, 0.3, 0.9] {
                let container = Container::new(bounds, periodic).tilted(tilt);
                // Some are outside by a period.
                let spread = |d: usize| bounds.extent()[d] * if periodic[d] { 2.0 } else { 1.0 };
                let positions: Vec<Vector<D>> = (0..12)
                    .map(|_| {
                        Vector::from_fn(|d, _| bounds.lower[d] + spread(d) * random.random_range(0.0..1.0))
                    })
                    .collect();
                let expected = brute_force(&container, &positions, range);
                assert_eq!(found(&container, &positions, range), expected, "{D}D, tilt {tilt}, {range}");
            }
        }
    }

    #[test]
    fn pairs_equal_brute_force() {
        check::<2>();
        check::<3>();
    }

    #[test]
    fn a_particle_meets_its_own_images() {
        let container = Container::periodic(&Vector::<3>::repeat(1.0));
        assert_eq!(found(&container, &[Vector::zeros()], 1.1).len(), 3);
        assert!(found(&container, &[], 1.0).is_empty());
    }
}
