//! Random arrangements of equal discs and spheres that do not overlap.

use gluey_geom::Vector;
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

/// Discs or spheres of diameter 1 in a cube, in no order.
#[derive(Clone, Debug)]
pub struct Packing<const D: usize> {
    /// Centres, inside `0 <= x < side`.
    pub positions: Vec<Vector<D>>,
    /// Edge of the cube.
    pub side: f64,
}

/// How often each particle is moved at random.
const SWEEP_COUNT: usize = 20;

impl<const D: usize> Packing<D> {
    /// A hard-sphere fluid at the given fraction of the volume (of the area), sampled by the Metropolis
    /// method (1953, DOI 10.1063/1.1699114) from a lattice, in a cube that is periodic.
    ///
    /// Sampling is short: neighbours have forgotten the lattice, distant particles have not.
    ///
    /// # Panics
    /// If the lattice has no room for the fraction, or the cube for three cells a side.
    pub fn fluid(count: usize, fraction: f64, seed: u64) -> Self {
        let own = if D == 2 { std::f64::consts::FRAC_PI_4 } else { std::f64::consts::PI / 6.0 };
        let side = (own * count as f64 / fraction).powf(1.0 / D as f64);
        // Every other point of a cubic lattice, checkered: the densest packing in 3D.
        let mut per_side: usize = 2;
        while per_side.pow(D as u32) / 2 < count {
            per_side += 2;
        }
        let spacing = side / per_side as f64;
        assert!(
            spacing * 2f64.sqrt() >= 1.0,
            "a lattice of {count} particles has no room for the fraction {fraction}"
        );
        let index = |i: usize, d: usize| i / per_side.pow(d as u32) % per_side;
        let site = |i: usize| Vector::<D>::from_fn(|d, _| (0.5 + index(i, d) as f64) * spacing);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Sites that stay empty are spread at random.
        let mut sites: Vec<usize> = (0..per_side.pow(D as u32))
            .filter(|&i| (0..D).map(|d| index(i, d)).sum::<usize>().is_multiple_of(2))
            .collect();
        sites.shuffle(&mut random);
        let mut fluid = Fluid::new(sites[..count].iter().map(|&i| site(i)).collect(), side);
        for _ in 0..SWEEP_COUNT {
            fluid.sweep(&mut random);
        }
        Self { positions: fluid.positions, side }
    }
}

/// Particles in cells at least a diameter wide.
struct Fluid<const D: usize> {
    positions: Vec<Vector<D>>,
    side: f64,
    cells_per_side: usize,
    cells: Vec<Vec<u32>>,
}

impl<const D: usize> Fluid<D> {
    fn new(positions: Vec<Vector<D>>, side: f64) -> Self {
        let cells_per_side = side.floor() as usize;
        assert!(cells_per_side >= 3, "a cube of side {side} is too small");
        let cells = vec![Vec::new(); cells_per_side.pow(D as u32)];
        let mut fluid = Self { positions, side, cells_per_side, cells };
        for i in 0..fluid.positions.len() {
            let cell = fluid.cell(&fluid.place(&fluid.positions[i]));
            fluid.cells[cell].push(i as u32);
        }
        fluid
    }

    fn place(&self, x: &Vector<D>) -> [usize; D] {
        let width = self.side / self.cells_per_side as f64;
        std::array::from_fn(|d| ((x[d] / width) as usize).min(self.cells_per_side - 1))
    }

    fn cell(&self, place: &[usize; D]) -> usize {
        place.iter().rev().fold(0, |cell, at| cell * self.cells_per_side + at)
    }

    fn sweep(&mut self, random: &mut ChaCha8Rng) {
        for i in 0..self.positions.len() {
            let step = Vector::<D>::from_fn(|_, _| random.random_range(-0.15..0.15));
            let to = (self.positions[i] + step).map(|x| x.rem_euclid(self.side));
            // Rounding may lead to the side itself.
            let inside = to.iter().all(|x| *x < self.side);
            if inside && self.is_free(i, &to) {
                self.move_to(i, to);
            }
        }
    }

    fn is_free(&self, i: usize, x: &Vector<D>) -> bool {
        let place = self.place(x);
        (0..3usize.pow(D as u32)).all(|neighbour| {
            let around = std::array::from_fn(|d| {
                (place[d] + self.cells_per_side + neighbour / 3usize.pow(d as u32) % 3 - 1)
                    % self.cells_per_side
            });
            self.cells[self.cell(&around)].iter().all(|&j| {
                let apart = self.positions[j as usize] - x;
                j as usize == i || apart.map(|s| self.nearest(s)).norm_squared() >= 1.0
            })
        })
    }

    /// The image of a coordinate difference that is nearest to 0.
    fn nearest(&self, s: f64) -> f64 {
        let half = 0.5 * self.side;
        if s > half {
            s - self.side
        } else if s < -half {
            s + self.side
        } else {
            s
        }
    }

    fn move_to(&mut self, i: usize, x: Vector<D>) {
        let from = self.cell(&self.place(&self.positions[i]));
        let to = self.cell(&self.place(&x));
        if from != to {
            self.cells[from].retain(|&j| j as usize != i);
            self.cells[to].push(i as u32);
        }
        self.positions[i] = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const D: usize>(fraction: f64) {
        let packing = Packing::<D>::fluid(500, fraction, 1);
        assert_eq!(packing.positions.len(), 500);
        let mut nearest = f64::INFINITY;
        for (i, x) in packing.positions.iter().enumerate() {
            assert!(x.iter().all(|x| (0.0..packing.side).contains(x)));
            for y in &packing.positions[..i] {
                let apart = (y - x).map(|s| s - packing.side * (s / packing.side).round());
                nearest = nearest.min(apart.norm());
            }
        }
        assert!((1.0..1.01).contains(&nearest), "{nearest}");
    }

    #[test]
    fn particles_do_not_overlap() {
        check::<2>(0.6);
        check::<3>(0.4);
    }
}
