//! Nitsche's penalty from local eigenvalues.
//!
//! The form is positive if `beta` exceeds the largest eigenvalue `lambda` of `int_G |2 eta eps(u) n|^2 / eta`
//! against `int_F 2 eta eps(u):eps(u)` over the polynomials of a root, on the root and the bad cells that it
//! carries; twice that is taken (Annavarapu, Hautefeuille and Dolbow 2012 for the local eigenproblem). In
//! coordinates of the unit cube `lambda h` is a number of the cut alone.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, gradient, node_count};
use gluey_geom::Vector;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::cut_cells::{CutCell, CutCells};
use crate::space::Discretisation;

/// Multiple of the eigenvalue.
const FACTOR: f64 = 2.0;
/// Share of the trace that is added to the strain energy: rigid motions have none.
const SHIFT: f64 = 1e-10;
/// Steps of the power iteration for the eigenvalue.
const STEPS: usize = 40;

/// `beta h / eta` of every cut cell.
pub fn penalties<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    aggregates: &Aggregates,
) -> Vec<f64> {
    let mut members: Vec<(u32, u32)> = aggregates.roots.iter().copied().zip(0..).collect();
    members.sort_unstable();
    let clusters: Vec<&[(u32, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    let of_cluster = |cluster: &&[(u32, u32)]| {
        let root = cluster[0].0 as usize;
        FACTOR * largest_eigenvalue(discretisation, cut, root, cluster)
    };
    let values: Vec<f64> = clusters.par_iter().map(of_cluster).collect();
    let mut penalties = vec![0.0; cut.cells.len()];
    for (cluster, value) in clusters.iter().zip(values) {
        cluster.iter().for_each(|&(_, k)| penalties[k as usize] = value);
    }
    penalties
}

/// Sums over points of products of strains, in the polynomials of a root.
struct Forms<const D: usize> {
    energy: DMatrix<f64>,
    traction: DMatrix<f64>,
}

fn largest_eigenvalue<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    root: usize,
    cluster: &[(u32, u32)],
) -> f64 {
    let n = D * node_count::<D>(2);
    let mut forms = Forms::<D> { energy: DMatrix::zeros(n, n), traction: DMatrix::zeros(n, n) };
    if cut.cut(root).is_none() {
        let weights: Vec<f64> = gauss_cube::<D>(POINTS).into_iter().map(|point| point.1).collect();
        forms.add([0.0; D], &weights, None);
    }
    for &(_, k) in cluster {
        let cell = &cut.cells[k as usize];
        forms.add(offset(discretisation, root, cell.cell as usize), &cell.moments.volume, Some(cell));
    }
    forms.largest_eigenvalue()
}

/// Place of a cell relative to the root, in cells.
fn offset<const D: usize>(discretisation: &Discretisation<D>, root: usize, cell: usize) -> [f64; D] {
    let mesh = &discretisation.mesh;
    let lower = |cell: usize| mesh.lower_corner(&mesh.cells()[cell]);
    let arm: Vector<D> = lower(cell) - lower(root);
    std::array::from_fn(|d| {
        let period = mesh.periodic()[d].then_some(mesh.domain().extent()[d]);
        gluey_levelset::nearest_image(arm[d], period) / discretisation.cell_size(root)
    })
}

impl<const D: usize> Forms<D> {
    /// Adds the integrals over a cell and the surfaces in it.
    fn add(&mut self, offset: [f64; D], volume: &[f64], cell: Option<&CutCell<D>>) {
        let (nodes, n) = (node_count::<D>(2), D * node_count::<D>(2));
        // Twice the strain of each unknown, row by row.
        let mut strains = DMatrix::zeros(n, D * D);
        for (q, (at, _)) in gauss_cube::<D>(POINTS).iter().enumerate() {
            let x = std::array::from_fn(|d| offset[d] + at[d]);
            for i in 0..nodes {
                let slope = gradient::<D>(2, i, &x);
                for c in 0..D {
                    strains.row_mut(i * D + c).fill(0.0);
                    for d in 0..D {
                        strains[(i * D + c, c * D + d)] += slope[d];
                        strains[(i * D + c, d * D + c)] += slope[d];
                    }
                }
            }
            // int 2 eps:eps is half the product of twice the strains.
            self.energy.gemm(0.5 * volume[q], &strains, &strains.transpose(), 1.0);
            let Some(cell) = cell else { continue };
            let squares = normal_squares(cell, q, at);
            let tested = &strains * DMatrix::identity(D, D).kronecker(&squares);
            self.traction.gemm(1.0, &tested, &strains.transpose(), 1.0);
        }
    }

    fn largest_eigenvalue(self) -> f64 {
        let n = self.energy.nrows();
        let shift = SHIFT * self.energy.trace();
        let shifted = self.energy + DMatrix::identity(n, n) * shift;
        let Some(factor) = Cholesky::new(shifted) else { return f64::NAN };
        let mut x = DVector::from_fn(n, |k, _| (1.0 + k as f64).sin());
        let mut value = 0.0;
        for _ in 0..STEPS {
            let load = &self.traction * &x;
            let y = factor.solve(&load);
            value = load.dot(&y) / x.dot(&load);
            x = y.normalize();
        }
        value
    }
}

/// Integrals of `n_k n_l` at a point, over all surfaces of a cell: that of `n_k` times the normal there, which
/// is linear.
fn normal_squares<const D: usize>(cell: &CutCell<D>, point: usize, at: &[f64; D]) -> DMatrix<f64> {
    let mut squares = DMatrix::zeros(D, D);
    for (ball, surface) in cell.balls.iter().zip(&cell.moments.surfaces) {
        for k in 0..D {
            for l in 0..D {
                let normal = (ball.center[l] - at[l]) / ball.radius;
                let both = 0.5 * surface.normal[point][k] * normal;
                squares[(k, l)] += both;
                squares[(l, k)] += both;
            }
        }
    }
    squares
}
