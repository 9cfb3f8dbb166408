//! Nitsche's penalty from local eigenvalues.
//!
//! The form is positive if `beta` exceeds the largest ratio `lambda` of `int_G |2 eta eps(u) n|^2 / eta` to
//! `int_F 2 eta eps(u):eps(u)` over the polynomials of a root, on the root and the bad cells that it carries
//! (Annavarapu, Hautefeuille and Dolbow 2012 for the local eigenproblem); twice that is safe where bad cells
//! next to each other have different roots. Since `|eps n|^2 <= eps:eps`, the largest ratio `mu` of
//! `int_G 4 eps(u):eps(u)` to `int_F 2 eps(u):eps(u)` is no less than `lambda`, and takes the same products
//! of gradients in the volume and on the surface:
//!
//! `beta = 1.7 mu eta`.
//!
//! In coordinates of the unit cube `mu h` is a number of the cut alone.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, gradient, node_count};
use gluey_geom::Vector;
use gluey_levelset::nearest_image;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::cut_cells::CutCells;
use crate::error::StokesError;
use crate::space::Discretisation;

/// Multiple of the eigenvalue.
const FACTOR: f64 = 1.7;
/// Share of the mean diagonal that is added to the strain energy: rigid motions have none.
const SHIFT: f64 = 1e-9;
/// Lanczos steps for the eigenvalue, at most: enough for eight digits.
const STEPS: usize = 30;
/// A direction is used up where its norm falls to this share.
const USED_UP: f64 = 1e-10;

/// `beta h / eta` of every cut cell.
///
/// # Errors
/// [`StokesError::NoPenalty`] where the volume left by bodies is not that of a fluid.
pub fn penalties<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    aggregates: &Aggregates,
) -> Result<Vec<f64>, StokesError> {
    let mut members: Vec<(u32, u32)> = aggregates.roots.iter().copied().zip(0..).collect();
    members.sort_unstable();
    let clusters: Vec<&[(u32, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    let at_home = Gradients::<D>::new([0.0; D]);
    let of_cluster = |cluster: &&[(u32, u32)]| {
        let root = cluster[0].0 as usize;
        let mut products = [Products::<D>::zeros(), Products::zeros()];
        if cut.cut(root).is_none() {
            let weights: Vec<f64> = gauss_cube::<D>(POINTS).into_iter().map(|point| point.1).collect();
            products[0].add(&at_home, &weights);
        }
        for &(_, k) in *cluster {
            let cell = &cut.cells[k as usize];
            let moments = &cell.moments;
            let elsewhere = (cell.cell as usize != root)
                .then(|| Gradients::new(offset(discretisation, root, cell.cell as usize)));
            let gradients = elsewhere.as_ref().unwrap_or(&at_home);
            products[0].add(gradients, &moments.volume);
            moments.surfaces.iter().for_each(|surface| products[1].add(gradients, &surface.area));
        }
        let [volume, surface] = products.map(|products| products.energy());
        // int 4 eps:eps on the surface to int 2 eps:eps in the volume.
        FACTOR * 2.0 * largest_ratio(&surface, volume)
    };
    let values: Vec<f64> = clusters.par_iter().map(of_cluster).collect();
    let mut penalties = vec![0.0; cut.cells.len()];
    for (cluster, value) in clusters.iter().zip(values) {
        if value.is_nan() {
            let first = &cut.cells[cluster[0].1 as usize];
            let (body, cell) = (first.bodies[0] as usize, first.cell as usize);
            return Err(StokesError::NoPenalty { body, cell });
        }
        cluster.iter().for_each(|&(_, k)| penalties[k as usize] = value);
    }
    Ok(penalties)
}

/// Place of a cell relative to the root, in cells.
fn offset<const D: usize>(discretisation: &Discretisation<D>, root: usize, cell: usize) -> [f64; D] {
    let mesh = &discretisation.mesh;
    let lower = |cell: usize| mesh.lower_corner(&mesh.cells()[cell]);
    let arm: Vector<D> = lower(cell) - lower(root);
    std::array::from_fn(|d| {
        let period = mesh.periodic()[d].then_some(mesh.domain().extent()[d]);
        (nearest_image(arm[d], period) / discretisation.cell_size(root)).round()
    })
}

/// Derivatives of the shape functions of a root at the points of a cell: a row for each function, a column
/// for each point.
struct Gradients<const D: usize>([DMatrix<f64>; D]);

impl<const D: usize> Gradients<D> {
    fn new(offset: [f64; D]) -> Self {
        let rule = gauss_cube::<D>(POINTS);
        let mut all = std::array::from_fn(|_| DMatrix::zeros(node_count::<D>(2), rule.len()));
        for (q, (at, _)) in rule.iter().enumerate() {
            let x = std::array::from_fn(|d| offset[d] + at[d]);
            for i in 0..node_count::<D>(2) {
                let slope = gradient::<D>(2, i, &x);
                (0..D).for_each(|d| all[d][(i, q)] = slope[d]);
            }
        }
        Self(all)
    }
}

/// Integrals of products of derivatives, `int d_a phi_i d_b phi_j` for `b <= a`.
struct Products<const D: usize>([[DMatrix<f64>; D]; D]);

impl<const D: usize> Products<D> {
    fn zeros() -> Self {
        let n = node_count::<D>(2);
        Self(std::array::from_fn(|_| std::array::from_fn(|_| DMatrix::zeros(n, n))))
    }

    fn add(&mut self, Gradients(gradients): &Gradients<D>, weights: &[f64]) {
        for a in 0..D {
            let mut weighted = gradients[a].clone();
            for (mut column, &weight) in weighted.column_iter_mut().zip(weights) {
                column *= weight;
            }
            for b in 0..=a {
                self.0[a][b].gemm(1.0, &weighted, &gradients[b].transpose(), 1.0);
            }
        }
    }

    /// `int 2 eps(u):eps(v)` of the components, component by component.
    fn energy(&self) -> DMatrix<f64> {
        let n = node_count::<D>(2);
        let mut energy = DMatrix::zeros(D * n, D * n);
        let product = |a: usize, b: usize, i: usize, j: usize| match b <= a {
            true => self.0[a][b][(i, j)],
            false => self.0[b][a][(j, i)],
        };
        for c in 0..D {
            for d in 0..D {
                for i in 0..n {
                    for j in 0..n {
                        let laplacian: f64 =
                            if c == d { (0..D).map(|a| product(a, a, i, j)).sum() } else { 0.0 };
                        // 2 eps:eps = grad u : (grad v + grad v^T).
                        energy[(c * n + i, d * n + j)] = laplacian + product(d, c, i, j);
                    }
                }
            }
        }
        energy
    }
}

/// The largest eigenvalue of `above` against `below` by the method of Lanczos in the scalar product of
/// `below`, with all directions orthogonal to those before; NaN if `below` is not positive but for rigid
/// motions.
fn largest_ratio(above: &DMatrix<f64>, below: DMatrix<f64>) -> f64 {
    let n = below.nrows();
    let shifted = &below + DMatrix::identity(n, n) * (SHIFT * below.trace() / n as f64);
    let Some(factor) = Cholesky::new(shifted.clone()) else { return f64::NAN };
    let mut direction = factor.solve(&(above * DVector::from_fn(n, |k, _| (1.0 + k as f64).sin())));
    let (mut basis, mut images) = (Vec::new(), Vec::new());
    let mut projected = DMatrix::zeros(STEPS, STEPS);
    for step in 0..STEPS.min(n) {
        let image = &shifted * &direction;
        let norm = direction.dot(&image).sqrt();
        // Norms after the first are of the size of the eigenvalues.
        if step > 0 {
            if norm.is_nan() || norm <= USED_UP * projected[(0, 0)] {
                break;
            }
            (projected[(step, step - 1)], projected[(step - 1, step)]) = (norm, norm);
        }
        basis.push(direction / norm);
        images.push(image / norm);
        let load = above * &basis[step];
        projected[(step, step)] = basis[step].dot(&load);
        direction = factor.solve(&load);
        for (v, image) in basis.iter().zip(&images) {
            let share = image.dot(&direction);
            direction.axpy(-share, v, 1.0);
        }
    }
    projected.symmetric_eigenvalues().max()
}
