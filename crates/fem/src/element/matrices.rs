//! Element matrices of the Q2-Q1 pair on the unit cube.
//!
//! On a cell of size `h` the viscous matrix scales with `h^(D-2)`, the divergence with `h^(D-1)` and the
//! pressure mass with `h^D`. Velocity degrees of freedom are numbered `node * D + component`.

use std::sync::{Arc, OnceLock};

use super::{gauss_cube, gradient, node_count, value};

/// Dense element matrices on the unit cube, or on a sheared one, row-major. Those on the cube are integrated
/// once and then shared.
#[derive(Clone, Debug)]
pub struct ReferenceMatrices<const D: usize> {
    /// `K[(i,a),(j,b)] = int 2 eps(phi_j e_b) : eps(phi_i e_a)`, square of size `D 3^D`.
    pub viscous: Arc<[f64]>,
    /// `B[q,(j,b)] = int psi_q d_b phi_j`, `2^D` rows of `D 3^D`.
    pub divergence: Arc<[f64]>,
    /// `M[q,r] = int psi_q psi_r`, square of size `2^D`.
    pub pressure_mass: Arc<[f64]>,
}

impl<const D: usize> Default for ReferenceMatrices<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> ReferenceMatrices<D> {
    /// Velocity degrees of freedom of a cell, `D 3^D`.
    pub const VELOCITY: usize = D * node_count::<D>(2);
    /// Pressure degrees of freedom of a cell, `2^D`.
    pub const PRESSURE: usize = node_count::<D>(1);

    /// The matrices, integrated exactly (three Gauss points per direction).
    pub fn new() -> Self {
        static OF_DIMENSION: [OnceLock<Matrices>; 4] = [const { OnceLock::new() }; 4];
        let matrices = OF_DIMENSION[D].get_or_init(|| Matrices::new::<D>(0.0)).clone();
        let Matrices { viscous, divergence, pressure_mass } = matrices;
        Self { viscous, divergence, pressure_mass }
    }

    /// The matrices of a cell that is sheared: a point of the unit cube has the place `x + shear y e_1`.
    /// Components of velocities stay those along the axes of space.
    pub fn sheared(shear: f64) -> Self {
        if shear == 0.0 {
            return Self::new();
        }
        let Matrices { viscous, divergence, pressure_mass } = Matrices::new::<D>(shear);
        Self { viscous, divergence, pressure_mass }
    }
}

/// The matrices of one dimension.
#[derive(Clone, Debug)]
struct Matrices {
    viscous: Arc<[f64]>,
    divergence: Arc<[f64]>,
    pressure_mass: Arc<[f64]>,
}

/// The matrices while they are summed up.
struct Sums<const D: usize> {
    shear: f64,
    viscous: Vec<f64>,
    divergence: Vec<f64>,
    pressure_mass: Vec<f64>,
}

impl Matrices {
    fn new<const D: usize>(shear: f64) -> Self {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let [viscous, divergence, pressure_mass] = [n * n, m * n, m * m].map(|len| vec![0.0; len]);
        let mut sums = Sums::<D> { shear, viscous, divergence, pressure_mass };
        for (x, weight) in gauss_cube::<D>(3) {
            add_viscous_of(&slopes(shear, &x), weight, &mut sums.viscous);
            sums.add_pressure_terms(&x, weight);
        }
        let Sums { viscous, divergence, pressure_mass, .. } = sums;
        Self { viscous: viscous.into(), divergence: divergence.into(), pressure_mass: pressure_mass.into() }
    }
}

/// Gradients in space of the velocity functions at a point of the unit cube.
fn slopes<const D: usize>(shear: f64, x: &[f64; D]) -> Vec<[f64; D]> {
    let slope = |j: usize| {
        let mut slope = gradient::<D>(2, j, x);
        slope[1] -= shear * slope[0];
        slope
    };
    (0..node_count::<D>(2)).map(slope).collect()
}

impl<const D: usize> Sums<D> {
    fn add_pressure_terms(&mut self, x: &[f64; D], weight: f64) {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let psi: Vec<f64> = (0..m).map(|q| value::<D>(1, q, x)).collect();
        let slopes = slopes(self.shear, x);
        for q in 0..m {
            for r in 0..m {
                self.pressure_mass[q * m + r] += weight * psi[q] * psi[r];
            }
            for j in 0..n {
                self.divergence[q * n + j] += weight * psi[q] * slopes[j / D][j % D];
            }
        }
    }
}

/// Adds `weight * 2 eps(phi_j e_b) : eps(phi_i e_a)` at the point `x` of the unit cube to a `(D 3^D)^2`
/// matrix.
pub fn add_viscous<const D: usize>(x: &[f64; D], weight: f64, matrix: &mut [f64]) {
    add_viscous_of(&slopes(0.0, x), weight, matrix);
}

fn add_viscous_of<const D: usize>(slopes: &[[f64; D]], weight: f64, matrix: &mut [f64]) {
    let nodes = slopes.len();
    for (i, si) in slopes.iter().enumerate() {
        for (j, sj) in slopes.iter().enumerate() {
            let laplace: f64 = (0..D).map(|d| si[d] * sj[d]).sum();
            for a in 0..D {
                let row = &mut matrix[(i * D + a) * nodes * D + j * D..][..D];
                for b in 0..D {
                    row[b] += weight * si[b] * sj[a];
                }
                row[a] += weight * laplace;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::multi_index;

    fn rigid_motions_cost_nothing<const D: usize>() {
        let reference = ReferenceMatrices::<D>::new();
        let n = ReferenceMatrices::<D>::VELOCITY;
        let points: Vec<[f64; D]> =
            (0..n / D).map(|i| multi_index::<D>(i, 3).map(|k| 0.5 * k as f64)).collect();
        let rotation: Vec<f64> =
            points.iter().flat_map(|x| (0..D).map(|c| [-x[1], x[0], 0.0][c]).collect::<Vec<_>>()).collect();
        let shear: Vec<f64> =
            points.iter().flat_map(|x| (0..D).map(|c| [x[1], 0.0, 0.0][c]).collect::<Vec<_>>()).collect();
        let energy = |u: &[f64]| -> f64 {
            (0..n).map(|i| u[i] * (0..n).map(|j| reference.viscous[i * n + j] * u[j]).sum::<f64>()).sum()
        };
        assert!(energy(&rotation).abs() < 1e-12);
        // 2 eps:eps of u = (y, 0) is 2 (1/4 + 1/4) = 1.
        assert!((energy(&shear) - 1.0).abs() < 1e-12);
        for q in 0..ReferenceMatrices::<D>::PRESSURE {
            let divergence: f64 = (0..n).map(|j| reference.divergence[q * n + j] * shear[j]).sum();
            assert!(divergence.abs() < 1e-13);
        }
    }

    /// In a sheared cell a rotation in space costs nothing.
    fn rotations_of_sheared_cells_cost_nothing<const D: usize>() {
        let shear = 0.37;
        let reference = ReferenceMatrices::<D>::sheared(shear);
        let n = ReferenceMatrices::<D>::VELOCITY;
        let mut energy = [0.0; 2];
        let motion = |k: usize, factor: f64| {
            let x = multi_index::<D>(k / D, 3).map(|k| 0.5 * k as f64);
            [-x[1], factor * (x[0] + shear * x[1]), 0.0][k % D]
        };
        for (energy, factor) in energy.iter_mut().zip([1.0, -1.0]) {
            let row =
                |i: usize| -> f64 { (0..n).map(|j| reference.viscous[i * n + j] * motion(j, factor)).sum() };
            *energy = (0..n).map(|i| motion(i, factor) * row(i)).sum();
        }
        // 2 eps:eps of u = (-y, -x) is 4.
        assert!(energy[0].abs() < 1e-12 && (energy[1] - 4.0).abs() < 1e-12, "{energy:?}");
        for q in 0..ReferenceMatrices::<D>::PRESSURE {
            let divergence: f64 = (0..n).map(|j| reference.divergence[q * n + j] * motion(j, 1.0)).sum();
            assert!(divergence.abs() < 1e-13);
        }
    }

    #[test]
    fn energies_of_rigid_and_shear_motions() {
        rotations_of_sheared_cells_cost_nothing::<2>();
        rotations_of_sheared_cells_cost_nothing::<3>();
        rigid_motions_cost_nothing::<2>();
        rigid_motions_cost_nothing::<3>();
    }
}
