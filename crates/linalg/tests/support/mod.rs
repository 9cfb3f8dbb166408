//! Matrices for the tests: Q2-Q1 Stokes on a uniform grid and the five-point Laplacian; operators between
//! precisions.

#![allow(dead_code)]

use std::sync::Arc;

use gluey_linalg::{LinOp, Pattern, Preconditioner, SparseMatrix, vector};

/// A saddle-point matrix and which of its unknowns are pressures.
pub struct Saddle {
    pub matrix: SparseMatrix,
    pub is_pressure: Vec<bool>,
}

/// Q2-Q1 elements on `n x n` cells of the unit square, velocity zero on the boundary, one pressure pinned,
/// and viscosity `viscosity(x, y)` at the quadrature points.
pub fn stokes_2d(n: usize, viscosity: impl Fn(f64, f64) -> f64) -> Saddle {
    stokes_2d_around(n, viscosity, |_, _| false)
}

/// The same with velocity zero also where `solid(x, y)`; pressures that see no free velocity are left out.
pub fn stokes_2d_around(
    n: usize,
    viscosity: impl Fn(f64, f64) -> f64,
    solid: impl Fn(f64, f64) -> bool,
) -> Saddle {
    let grid = Grid::new(n, solid);
    let cells: Vec<Vec<usize>> = grid.cells().map(|(i, j)| grid.unknowns(i, j).flatten().collect()).collect();
    let pattern = Pattern::from_groups(grid.dim, &cells).expect("unknowns in range");
    let mut matrix = SparseMatrix::zeros(Arc::new(pattern));
    for (i, j) in grid.cells() {
        let block = cell_matrix(1.0 / n as f64, |x, y| {
            viscosity((i as f64 + x) / n as f64, (j as f64 + y) / n as f64)
        });
        let unknowns: Vec<Option<usize>> = grid.unknowns(i, j).collect();
        for (row, a) in unknowns.iter().zip(&block) {
            for (column, &value) in unknowns.iter().zip(a) {
                if let (Some(row), Some(column)) = (row, column) {
                    matrix.add(*row, *column, value).expect("in pattern");
                }
            }
        }
    }
    let is_pressure = (0..grid.dim).map(|unknown| unknown >= grid.velocity_count).collect();
    Saddle { matrix, is_pressure }
}

struct Grid {
    n: usize,
    dim: usize,
    velocity_count: usize,
    /// First of the two unknowns of a velocity node, where it is free.
    velocity: Vec<Option<usize>>,
    pressure: Vec<Option<usize>>,
}

impl Grid {
    fn new(n: usize, solid: impl Fn(f64, f64) -> bool) -> Self {
        let side = 2 * n + 1;
        let mut dim = 0;
        let mut number = |free: bool, size: usize| {
            free.then(|| {
                dim += size;
                dim - size
            })
        };
        let inner = |k: usize| 0 < k && k < 2 * n;
        let place = |k: usize| k as f64 / (2 * n) as f64;
        let velocity: Vec<_> = (0..side * side)
            .map(|node| (node % side, node / side))
            .map(|(x, y)| number(inner(x) && inner(y) && !solid(place(x), place(y)), 2))
            .collect();
        let velocity_count = velocity.iter().flatten().count() * 2;
        // The coupling to the far corners of the cells is zero: the integral of (1-t) t (2t-1) over [0, 1]
        // vanishes.
        let sees_velocity = |px: usize, py: usize| {
            let near = |k: usize| k.saturating_sub(2)..=(k + 2).min(2 * n);
            let couples = |x: usize, y: usize| px.abs_diff(x) < 2 || py.abs_diff(y) < 2;
            near(py).any(|y| near(px).any(|x| couples(x, y) && velocity[y * side + x].is_some()))
        };
        let pressure = (0..(n + 1) * (n + 1))
            .map(|node| number(node > 0 && sees_velocity(2 * (node % (n + 1)), 2 * (node / (n + 1))), 1))
            .collect();
        Self { n, dim, velocity_count, velocity, pressure }
    }

    fn cells(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.n;
        (0..n * n).map(move |cell| (cell % n, cell / n))
    }

    /// The 18 velocities (two for each of the 9 nodes) and 4 pressures of a cell; none where they are given.
    fn unknowns(&self, i: usize, j: usize) -> impl Iterator<Item = Option<usize>> + use<'_> {
        let velocities = (0..18).map(move |k| {
            let (x, y) = (2 * i + (k / 2) % 3, 2 * j + k / 6);
            self.velocity[y * (2 * self.n + 1) + x].map(|first| first + k % 2)
        });
        let pressures = (0..4).map(move |k| self.pressure[(j + k / 2) * (self.n + 1) + i + k % 2]);
        velocities.chain(pressures)
    }
}

/// Values and derivatives of the three quadratic and two linear shape functions on [0, 1].
fn shapes(x: f64) -> ([f64; 3], [f64; 3], [f64; 2]) {
    let quadratic = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
    let derivative = [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0];
    (quadratic, derivative, [1.0 - x, x])
}

fn cell_matrix(h: f64, viscosity: impl Fn(f64, f64) -> f64) -> [[f64; 22]; 22] {
    let offset = 0.5 * 0.6f64.sqrt();
    let gauss = [(0.5 - offset, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + offset, 5.0 / 18.0)];
    let mut a = [[0.0; 22]; 22];
    for (y, wy) in gauss {
        for (x, wx) in gauss {
            add_point(&mut a, x, y, viscosity(x, y), wx * wy * h * h, h);
        }
    }
    a
}

fn add_point(a: &mut [[f64; 22]; 22], x: f64, y: f64, eta: f64, weight: f64, h: f64) {
    let ((vx, dx, lx), (vy, dy, ly)) = (shapes(x), shapes(y));
    let gradient = |node: usize| [dx[node % 3] * vy[node / 3] / h, vx[node % 3] * dy[node / 3] / h];
    for i in 0..9 {
        let gi = gradient(i);
        for j in 0..9 {
            let gj = gradient(j);
            let laplace = gi[0] * gj[0] + gi[1] * gj[1];
            for (c, d) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let diagonal = if c == d { laplace } else { 0.0 };
                a[2 * i + c][2 * j + d] += weight * eta * (diagonal + gi[d] * gj[c]);
            }
        }
        for q in 0..4 {
            for c in 0..2 {
                let value = -weight * gi[c] * lx[q % 2] * ly[q / 2];
                a[2 * i + c][18 + q] += value;
                a[18 + q][2 * i + c] += value;
            }
        }
    }
}

/// The five-point Laplacian on `n x n` interior points, with diagonal 4.
pub fn laplacian_2d(n: usize) -> SparseMatrix {
    let mut triplets = Vec::new();
    for y in 0..n {
        for x in 0..n {
            let row = y * n + x;
            triplets.push((row, row, 4.0));
            if x > 0 {
                triplets.extend([(row, row - 1, -1.0), (row - 1, row, -1.0)]);
            }
            if y > 0 {
                triplets.extend([(row, row - n, -1.0), (row - n, row, -1.0)]);
            }
        }
    }
    SparseMatrix::from_triplets(n * n, n * n, &triplets).expect("in range")
}

/// A fixed right-hand side.
pub fn pseudo_random(seed: u64, dim: usize) -> Vec<f64> {
    let mut x = vec![0.0; dim];
    gluey_linalg::vector::fill_pseudo_random(seed, &mut x);
    x
}

/// `|b - A x| / |b|`.
pub fn relative_residual(a: &SparseMatrix, b: &[f64], x: &[f64]) -> f64 {
    let mut r = b.to_vec();
    a.multiply_add(-1.0, x, &mut r);
    gluey_linalg::vector::norm(&r) / gluey_linalg::vector::norm(b)
}

/// An operator or a preconditioner in double precision, between vectors in single precision.
#[derive(Clone, Debug)]
pub struct Rounded<A> {
    inner: A,
    input: Vec<f64>,
    output: Vec<f64>,
}

impl<A> Rounded<A> {
    /// Wraps `inner` for vectors of length `dim`.
    pub fn new(dim: usize, inner: A) -> Self {
        Self { inner, input: vec![0.0; dim], output: vec![0.0; dim] }
    }

    fn between(&mut self, x: &[f32], y: &mut [f32], action: impl FnOnce(&mut A, &[f64], &mut [f64])) {
        vector::convert(1.0, x, &mut self.input);
        action(&mut self.inner, &self.input, &mut self.output);
        vector::convert(1.0, &self.output, y);
    }
}

impl<A: LinOp<f64>> LinOp<f64> for Rounded<A> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.inner.apply(x, y);
    }
}

impl<A: LinOp<f64>> LinOp<f32> for Rounded<A> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.between(x, y, |inner, x, y| inner.apply(x, y));
    }
}

impl<M: Preconditioner<f64>> Preconditioner<f32> for Rounded<M> {
    fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        self.between(r, z, |inner, r, z| inner.apply(r, z));
    }
}
