//! Hard balls in equilibrium: Metropolis moves of single particles (Metropolis et al. 1953,
//! DOI 10.1063/1.1699114), a move at a cost that does not depend on the number of particles.

use gluey_geom::Vector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::Container;

/// Part of the moves that is to be accepted.
const ACCEPTANCE: f64 = 0.4;
/// Part of the sweeps in which the length of moves is adapted.
const ADAPTING: f64 = 0.5;

/// Balls in cells at least as wide as the largest of them.
struct HardFluid<'a, const D: usize> {
    container: &'a Container<D>,
    positions: Vec<Vector<D>>,
    radii: &'a [f64],
    cell_counts: [usize; D],
    cells: Vec<Vec<u32>>,
}

/// Moves every ball `sweep_count` times by a random vector, where that makes no overlap. Balls do not overlap
/// before. In the first half of the sweeps the length of moves is adapted so that 40 % are accepted.
pub(super) fn equilibrate<const D: usize>(
    container: &Container<D>,
    positions: &mut Vec<Vector<D>>,
    radii: &[f64],
    sweep_count: usize,
    random: &mut ChaCha8Rng,
) {
    let largest = radii.iter().copied().fold(0.0, f64::max);
    let longest = 0.5 * container.bounds().extent().min();
    let mut fluid = HardFluid::new(container, std::mem::take(positions), radii);
    let mut step = 0.2 * largest;
    for sweep in 0..sweep_count {
        let accepted = fluid.sweep(step, random) as f64 / radii.len() as f64;
        if (sweep as f64) < ADAPTING * sweep_count as f64 {
            step = (step * (accepted / ACCEPTANCE).clamp(0.8, 1.25)).clamp(1e-4 * largest, longest);
        }
    }
    *positions = fluid.positions;
}

impl<'a, const D: usize> HardFluid<'a, D> {
    fn new(container: &'a Container<D>, positions: Vec<Vector<D>>, radii: &'a [f64]) -> Self {
        let widest = 2.0 * radii.iter().copied().fold(0.0, f64::max);
        let spacing = (container.volume() / radii.len() as f64).powf(1.0 / D as f64);
        let edges = container.bounds().extent();
        let cell_counts = std::array::from_fn(|d| ((edges[d] / widest.max(spacing)) as usize).max(1));
        let cells = vec![Vec::new(); cell_counts.iter().product()];
        let positions = positions.iter().map(|x| container.wrapped(x)).collect();
        let mut fluid = Self { container, positions, radii, cell_counts, cells };
        for i in 0..fluid.positions.len() {
            let cell = fluid.number(&fluid.cell(&fluid.positions[i]));
            fluid.cells[cell].push(i as u32);
        }
        fluid
    }

    fn cell(&self, x: &Vector<D>) -> [usize; D] {
        let (bounds, counts) = (self.container.bounds(), &self.cell_counts);
        std::array::from_fn(|d| {
            let part = (x[d] - bounds.lower[d]) / (bounds.upper[d] - bounds.lower[d]);
            ((part * counts[d] as f64) as usize).min(counts[d] - 1)
        })
    }

    fn number(&self, cell: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |number, d| number * self.cell_counts[d] + cell[d])
    }

    /// Tries to move every ball by at most `step` along each axis; the number of moves made.
    fn sweep(&mut self, step: f64, random: &mut ChaCha8Rng) -> usize {
        let mut accepted = 0;
        for i in 0..self.positions.len() {
            let by = Vector::<D>::from_fn(|_, _| random.random_range(-step..step));
            let to = self.container.wrapped(&(self.positions[i] + by));
            if self.is_inside(&to, self.radii[i]) && self.is_free(i, &to) {
                self.move_to(i, to);
                accepted += 1;
            }
        }
        accepted
    }

    fn is_inside(&self, x: &Vector<D>, radius: f64) -> bool {
        let bounds = self.container.bounds();
        (0..D).all(|d| {
            !self.container.is_walled(d)
                || (x[d] - radius >= bounds.lower[d] && x[d] + radius <= bounds.upper[d])
        })
    }

    /// Whether ball `i` overlaps no other at `x`: those in the cells around, each in the image that is there.
    fn is_free(&self, i: usize, x: &Vector<D>) -> bool {
        let around = self.around(&self.cell(x));
        let mut places = [0; D];
        loop {
            let number = (0..D).rev().fold(0, |n, d| n * self.cell_counts[d] + around[d][places[d]].0);
            let from = Vector::<D>::from_fn(|d, _| around[d][places[d]].1) - x;
            if !self.cells[number].iter().all(|&j| self.is_apart(i, &from, j as usize)) {
                return false;
            }
            let Some(d) = (0..D).find(|&d| places[d] < 2) else { return true };
            places[..d].fill(0);
            places[d] += 1;
        }
    }

    /// The three cells around one along each axis, with the shift of the image they belong to. Beyond a wall
    /// is the other end of the box, too far away to matter.
    fn around(&self, cell: &[usize; D]) -> [[(usize, f64); 3]; D] {
        let edges = self.container.bounds().extent();
        std::array::from_fn(|d| {
            let (here, count) = (cell[d], self.cell_counts[d]);
            let below = if here == 0 { (count - 1, -edges[d]) } else { (here - 1, 0.0) };
            let above = if here + 1 == count { (0, edges[d]) } else { (here + 1, 0.0) };
            [below, (here, 0.0), above]
        })
    }

    /// Whether ball `i` and ball `j` are apart, whose image is displaced by `from` from its position and `i`.
    fn is_apart(&self, i: usize, from: &Vector<D>, j: usize) -> bool {
        let reach = self.radii[i] + self.radii[j];
        j == i || (self.positions[j] + from).norm_squared() >= reach * reach
    }

    fn move_to(&mut self, i: usize, x: Vector<D>) {
        let [from, to] = [self.positions[i], x].map(|x| self.number(&self.cell(&x)));
        if from != to {
            self.cells[from].retain(|&j| j as usize != i);
            self.cells[to].push(i as u32);
        }
        self.positions[i] = x;
    }
}
