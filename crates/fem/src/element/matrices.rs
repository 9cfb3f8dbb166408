//! Element matrices of the Q2-Q1 pair on the unit cube.
//!
//! On a cell of size `h` the viscous matrix scales with `h^(D-2)`, the divergence with `h^(D-1)` and the
//! pressure mass with `h^D`. Velocity degrees of freedom are numbered `node * D + component`.

use std::sync::OnceLock;

use super::{gauss_cube, gradient, node_count, value};

/// Dense element matrices on the unit cube, row-major. They are integrated once and then shared.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceMatrices<const D: usize> {
    /// `K[(i,a),(j,b)] = int 2 eps(phi_j e_b) : eps(phi_i e_a)`, square of size `D 3^D`.
    pub viscous: &'static [f64],
    /// `B[q,(j,b)] = int psi_q d_b phi_j`, `2^D` rows of `D 3^D`.
    pub divergence: &'static [f64],
    /// `M[q,r] = int psi_q psi_r`, square of size `2^D`.
    pub pressure_mass: &'static [f64],
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
        let Matrices { viscous, divergence, pressure_mass } = OF_DIMENSION[D].get_or_init(Matrices::new::<D>);
        Self { viscous, divergence, pressure_mass }
    }
}

/// The matrices of one dimension.
#[derive(Debug)]
struct Matrices {
    viscous: Vec<f64>,
    divergence: Vec<f64>,
    pressure_mass: Vec<f64>,
}

impl Matrices {
    fn new<const D: usize>() -> Self {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let mut new =
            Self { viscous: vec![0.0; n * n], divergence: vec![0.0; m * n], pressure_mass: vec![0.0; m * m] };
        for (x, weight) in gauss_cube::<D>(3) {
            add_viscous(&x, weight, &mut new.viscous);
            new.add_pressure_terms(&x, weight);
        }
        new
    }

    fn add_pressure_terms<const D: usize>(&mut self, x: &[f64; D], weight: f64) {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let psi: Vec<f64> = (0..m).map(|q| value::<D>(1, q, x)).collect();
        let slopes: Vec<[f64; D]> = (0..n / D).map(|j| gradient::<D>(2, j, x)).collect();
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
    let nodes = node_count::<D>(2);
    let slopes: Vec<[f64; D]> = (0..nodes).map(|i| gradient::<D>(2, i, x)).collect();
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

    #[test]
    fn energies_of_rigid_and_shear_motions() {
        rigid_motions_cost_nothing::<2>();
        rigid_motions_cost_nothing::<3>();
    }
}
