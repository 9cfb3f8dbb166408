//! Schur complements of single cells, `S_c = B_c A_c^+ B_c^T`.
//!
//! With `A = sum R_c^T A_c R_c` and `p^T S p = max_v 2 p^T B v - v^T A v` the sum of the cells' own maxima
//! bounds the Schur complement of the whole system from above, `S <= sum S_c`, whatever the viscosity does
//! inside the cells. A mass matrix over some mean of the viscosity does not know how much of a cut cell can
//! still flow.
//!
//! In a cell of one viscosity `2 S_c` is not the mass matrix, which is close to twice the Schur complement of
//! the whole: a cell alone is free to expand, and for constant pressures the bound is `D` times too high. So
//! that cut cells fit to those around them, theirs is `T S_c T` with the symmetric `T` that turns the Schur
//! complement of a plain cell into its mass matrix.

use gluey_fem::ReferenceMatrices;
use gluey_fem::element::multi_index;
use gluey_linalg::{BlockError, DenseSymmetric};
use nalgebra::DMatrix;

/// See [`crate::operator::AddedViscosity::pressure_matrices`].
pub fn pressure_matrices<const D: usize>(
    cells: &mut dyn Iterator<Item = (f64, f64, Option<&[f64]>)>,
) -> Result<Vec<Option<Vec<f64>>>, BlockError> {
    let mut schur = CellSchur::<D>::new()?;
    let factor = mass_factor(&schur.unit, &schur.reference.pressure_mass);
    let m = ReferenceMatrices::<D>::PRESSURE;
    let matrix = |(viscous, divergence, own): (f64, f64, Option<&[f64]>)| {
        let Some(own) = own else { return Ok(None) };
        let matrix = DMatrix::from_vec(m, m, schur.of(viscous, divergence, own)?);
        Ok(Some((&factor * matrix * &factor).data.into()))
    };
    cells.map(matrix).collect()
}

/// The symmetric `T` with `T S T = M`: the geometric mean `S^-1 # M` (Pusz and Woronowicz 1975).
fn mass_factor(schur: &[f64], mass: &[f64]) -> DMatrix<f64> {
    let m = mass.len().isqrt();
    let power = |matrix: DMatrix<f64>, exponent: f64| {
        let eigen = matrix.symmetric_eigen();
        let scaled = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.powf(exponent)));
        &eigen.eigenvectors * scaled * eigen.eigenvectors.transpose()
    };
    let schur = DMatrix::from_row_slice(m, m, schur);
    let (root, inverse) = (power(schur.clone(), 0.5), power(schur, -0.5));
    let middle = power(&root * DMatrix::from_row_slice(m, m, mass) * &root, 0.5);
    &inverse * middle * &inverse
}

/// Computes the Schur complements of cells.
struct CellSchur<const D: usize> {
    reference: ReferenceMatrices<D>,
    /// `sum r r^T` over rigid motions `r`, which make up the kernel of every `A_c`.
    rigid: Vec<f64>,
    /// The Schur complement of the unit cube at viscosity one.
    unit: Vec<f64>,
    /// `[A_c, B_c^T; B_c, 0]` before and after elimination.
    saddle: DenseSymmetric,
}

impl<const D: usize> CellSchur<D> {
    fn new() -> Result<Self, BlockError> {
        let (reference, rigid) = (ReferenceMatrices::<D>::new(), rigid_projector::<D>());
        let mut new = Self { unit: Vec::new(), saddle: DenseSymmetric::default(), reference, rigid };
        new.unit = new.of(1.0, 1.0, &[])?;
        Ok(new)
    }

    /// The Schur complement of a cell with the matrices `A_c = viscous K + own` and `B_c = divergence B`, row
    /// by row.
    fn of(&mut self, viscous: f64, divergence: f64, own: &[f64]) -> Result<Vec<f64>, BlockError> {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        // The load of a pressure does no work on rigid motions: what is added on these changes nothing else.
        let matrix = &mut self.saddle;
        matrix.reset(n + m);
        let fluid = self.reference.viscous.chunks_exact(n).zip(self.rigid.chunks_exact(n));
        for (row, (fluid, rigid)) in fluid.enumerate() {
            let target = &mut matrix.row_mut(row)[..=row];
            let sums = fluid.iter().zip(rigid).map(|(k, r)| viscous * (k + r));
            target.iter_mut().zip(sums).for_each(|(a, k)| *a = k);
            let own = own.chunks_exact(n).nth(row).into_iter().flatten();
            target.iter_mut().zip(own).for_each(|(a, k)| *a += k);
        }
        for (q, load) in self.reference.divergence.chunks_exact(n).enumerate() {
            let target = matrix.row_mut(n + q).iter_mut();
            target.zip(load).for_each(|(a, b)| *a = divergence * b);
        }
        matrix.eliminate(n)?;
        let entry = |q: usize, r: usize| -matrix.row(n + q.max(r))[n + q.min(r)];
        Ok((0..m * m).map(|k| entry(k / m, k % m)).collect())
    }
}

/// `sum r r^T` over translations and rotations of the unit cube about its centre.
fn rigid_projector<const D: usize>() -> Vec<f64> {
    let n = ReferenceMatrices::<D>::VELOCITY;
    let x = |k: usize, d: usize| 0.5 * multi_index::<D>(k / D, 3)[d] as f64 - 0.5;
    let along = |c: usize, d: usize| if c == d { 1.0 } else { 0.0 };
    let mut sum = vec![0.0; n * n];
    let mut add = |motion: &dyn Fn(usize) -> f64| {
        for i in 0..n {
            for j in 0..n {
                sum[i * n + j] += motion(i) * motion(j);
            }
        }
    };
    for d in 0..D {
        add(&|k| along(k % D, d));
        for e in 0..d {
            add(&|k| along(k % D, d) * x(k, e) - along(k % D, e) * x(k, d));
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;

    use super::*;
    use crate::formulation::{Formulation, PaperParams, Problem};
    use crate::operator::Elements;
    use crate::precondition::schur::{PressureMatrices, weights};

    /// A constant pressure drives the expansion `v = x / (2 eta)`:
    /// `2 int div v - 2 eta int eps:eps = D V / (2 eta)`.
    fn constants_have_the_exact_value<const D: usize>() {
        let schur = CellSchur::<D>::new().unwrap();
        let sum: f64 = schur.unit.iter().sum();
        assert!((sum - 0.5 * D as f64).abs() < 1e-10, "{sum}");
    }

    #[test]
    fn a_constant_pressure_expands_a_cell() {
        constants_have_the_exact_value::<2>();
        constants_have_the_exact_value::<3>();
    }

    /// A uniform viscosity given as a matrix of the cell's own is one in the scale.
    fn viscosities_add_up<const D: usize>() {
        let mut schur = CellSchur::<D>::new().unwrap();
        let (eta, h) = (40.0, 0.25f64);
        let stiffness = h.powi(D as i32 - 2);
        let fluid = ReferenceMatrices::<D>::new().viscous;
        let own: Vec<f64> = fluid.iter().map(|k| (eta - 1.0) * stiffness * k).collect();
        let found = schur.of(stiffness, h.powi(D as i32 - 1), &own).unwrap();
        for (a, b) in found.iter().zip(&schur.unit) {
            assert!((a - h.powi(D as i32) / eta * b).abs() < 1e-9);
        }
    }

    /// The factor turns a plain cell into its mass matrix.
    fn a_plain_cell_has_its_mass<const D: usize>() {
        let schur = CellSchur::<D>::new().unwrap().unit;
        let mass = &*ReferenceMatrices::<D>::new().pressure_mass;
        let m = ReferenceMatrices::<D>::PRESSURE;
        let factor = mass_factor(&schur, mass);
        assert!((&factor - factor.transpose()).amax() < 1e-12);
        let difference =
            &factor * DMatrix::from_vec(m, m, schur) * &factor - DMatrix::from_row_slice(m, m, mass);
        assert!(difference.amax() < 1e-14);
    }

    #[test]
    fn the_schur_complement_of_a_plain_cell_becomes_its_mass() {
        a_plain_cell_has_its_mass::<2>();
        a_plain_cell_has_its_mass::<3>();
    }

    #[test]
    fn the_schur_complement_scales_with_volume_over_viscosity() {
        viscosities_add_up::<2>();
        viscosities_add_up::<3>();
    }
    /// The weights around a penalised ball away from the walls, those near its surface first.
    fn around_a_penalised_ball<const D: usize>(viscosity_ratio: f64) -> [Vec<f64>; 2] {
        let formulation = Formulation::Paper(PaperParams { viscosity_ratio, ..PaperParams::default() });
        let mesh = TreeMesh::refine(Aabb::unit(), [1; D], [false; D], 4, |_, _, _| true).unwrap();
        let centre = Vector::<D>::repeat(0.47);
        let problem = Problem::new(mesh, &[Ball::new(centre, 0.22)], 2.0, formulation).unwrap();
        let elements = Elements::new(&problem.system, ReferenceMatrices::<D>::VELOCITY);
        let matrices = PressureMatrices::new(&elements, 2.0).unwrap();
        let mut around = [Vec::new(), Vec::new()];
        for (q, weight) in weights(&elements, &matrices).into_iter().enumerate() {
            let point = problem.discretisation().pressure.point(q);
            if point.iter().all(|&x| (0.1..0.9).contains(&x)) {
                let distance = ((point - centre).norm() - 0.22).abs();
                around[usize::from(distance > 2.0 / 16.0 * (D as f64).sqrt())].push(weight);
            }
        }
        around
    }

    fn weights_near_a_surface<const D: usize>() {
        let [near, far] = around_a_penalised_ball::<D>(1.0001);
        assert!(near.iter().chain(&far).all(|w| (w - 1.0).abs() < 0.05));
        let [near, far] = around_a_penalised_ball::<D>(1e3);
        assert!(far.iter().all(|w| (w - 1.0).abs() < 0.05));
        let lowered = near.iter().filter(|w| **w < 0.9).count();
        assert!(8 * lowered > near.len(), "{lowered} of {}", near.len());
        assert!(near.iter().all(|w| (0.25..=2.0).contains(w)));
    }

    /// A solid like the fluid changes nothing; a stiff one takes velocities from the pressures in the cells
    /// it cuts.
    #[test]
    fn a_penalised_surface_lowers_the_weights_of_its_cells() {
        weights_near_a_surface::<2>();
        weights_near_a_surface::<3>();
    }
}
