//! Two equal free spheres in an unbounded linear flow, exactly.
//!
//! The disturbance is a sum of Lamb's decaying solutions around both centres (Happel and Brenner 1965,
//! section 3.2; Kim and Karrila 1991, section 4.2). With `psi_n = r^-(n+1) P_n^m(cos theta) cos(m phi)`
//! around a centre, in units of the radius, the viscosity and the rate of strain, these are
//!
//! ```text
//! u = grad psi_n,   u = x cross grad psi'_n,
//! u = -(n-2)/(2n(2n-1)) r^2 grad psi_n + (n+1)/(n(2n-1)) x psi_n   with the pressure psi_n,
//! ```
//!
//! `psi'_n` with the sine. Order one of the second and third is a torque and a force, which free spheres do
//! not have; order two of the third is the stresslet, `p = -3/(4 pi) x.S.x / r^5`. Coefficients, velocities
//! and spins are those that come closest to `u + E x = U + w cross (x - x_s)` on rings of both spheres, in
//! least squares.
//!
//! The strain is one of three along and across the line of centres, which the orders `m = 0, 1, 2` belong to.
//! Every other is a sum of them, turned.

use std::f64::consts::PI;

use gluey_geom::{Matrix, Vector};
use nalgebra::{DMatrix, DVector};

/// A strain whose disturbance has one order in the angle about the line of centres, which is the last axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairStrain {
    /// `diag(-1/2, -1/2, 1)`.
    Along,
    /// `e_1 e_3 + e_3 e_1`.
    Tilting,
    /// `diag(1, -1, 0)`.
    Across,
}

impl PairStrain {
    /// All three.
    pub const ALL: [PairStrain; 3] = [PairStrain::Along, PairStrain::Tilting, PairStrain::Across];

    /// The strain, with the line of centres along the last of these orthonormal axes.
    pub fn matrix(self, axes: &[Vector<3>; 3]) -> Matrix<3> {
        let [x, y, z] = axes;
        match self {
            PairStrain::Along => z * z.transpose() - (x * x.transpose() + y * y.transpose()) * 0.5,
            PairStrain::Tilting => x * z.transpose() + z * x.transpose(),
            PairStrain::Across => x * x.transpose() - y * y.transpose(),
        }
    }

    /// `m`.
    fn order(self) -> usize {
        self as usize
    }

    /// `E x` at the distance `rho` from the axis and the height `z`: its parts along `rho`, `phi` and `z`,
    /// without the cosine (sine for that along `phi`) of `m phi`.
    fn velocity(self, rho: f64, z: f64) -> [f64; 3] {
        match self {
            PairStrain::Along => [-0.5 * rho, 0.0, z],
            PairStrain::Tilting => [z, -z, rho],
            PairStrain::Across => [rho, -rho, 0.0],
        }
    }

    /// Velocities of a rigid sphere at this place relative to its centre: its motion at velocity one, then at
    /// spin one about the second axis.
    fn rigid(self, rho: f64, z: f64) -> Vec<[f64; 3]> {
        match self {
            PairStrain::Along => vec![[0.0, 0.0, 1.0]],
            PairStrain::Tilting => vec![[1.0, -1.0, 0.0], [z, -z, -rho]],
            PairStrain::Across => Vec::new(),
        }
    }

    /// `x.E.x / r^2` over `P_2^m cos(m phi)`.
    fn share(self) -> f64 {
        [1.0, 2.0 / 3.0, 1.0 / 3.0][self as usize]
    }
}

/// The motion and the stresslets of a pair in a strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairInStrain {
    /// Stresslet of either sphere over that of a single one, `20/3 pi mu a^3 E`. It has the shape of the
    /// strain.
    pub stresslet: f64,
    /// Velocity of the sphere ahead, along the last axis (`Along`) or the first (`Tilting`), in radii.
    pub velocity: f64,
    /// Spin about the second axis.
    pub spin: f64,
}

/// Two spheres of radius one at this gap, to 1e-7 for gaps down to 0.01.
pub fn pair_in_strain(strain: PairStrain, gap: f64) -> PairInStrain {
    // Coefficients fall like `exp(-order acosh(half))`, which is about the root of the gap.
    pair_of_orders(strain, gap, 20 + (16.0 / gap.sqrt()) as usize)
}

/// The same with so many orders around each centre.
fn pair_of_orders(strain: PairStrain, gap: f64, orders: usize) -> PairInStrain {
    let half = 1.0 + 0.5 * gap;
    let families = families(strain, orders);
    let sides = [-half, half];
    let motions = strain.rigid(0.0, 0.0).len();
    let columns = 2 * (families.len() + motions);
    let rings = 2 * orders;
    let mut a = DMatrix::zeros(2 * 3 * rings, columns);
    let mut b = DVector::zeros(2 * 3 * rings);
    for (side, center) in sides.into_iter().enumerate() {
        for ring in 0..rings {
            let theta = (ring as f64 + 0.5) / rings as f64 * PI;
            let (rho, z) = (theta.sin(), theta.cos());
            let row = 3 * (side * rings + ring);
            let flow = strain.velocity(rho, z + center);
            b.rows_mut(row, 3).copy_from_slice(&flow.map(|u| -u));
            for (other, around) in sides.into_iter().enumerate() {
                let first = other * families.len();
                let solutions = lamb(strain.order(), &families, rho, z + center - around);
                for (k, u) in solutions.iter().enumerate() {
                    a.fixed_view_mut::<3, 1>(row, first + k).copy_from_slice(u);
                }
            }
            for (k, u) in strain.rigid(rho, z).iter().enumerate() {
                let column = 2 * families.len() + side * motions + k;
                a.fixed_view_mut::<3, 1>(row, column).copy_from_slice(&u.map(|u| -u));
            }
        }
    }
    let x = least_squares(a, b);
    let stresslet = families.iter().position(|family| *family == (Family::Pressure, 2)).map_or(0.0, |k| x[k]);
    let of_motion = |k: usize| if k < motions { x[2 * families.len() + motions + k] } else { 0.0 };
    PairInStrain {
        stresslet: -stresslet / (5.0 * strain.share()),
        velocity: of_motion(0),
        spin: of_motion(1),
    }
}

/// Kinds of Lamb's solutions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    Gradient,
    Swirl,
    Pressure,
}

/// The solutions of a strain up to an order, without forces, torques and sources.
fn families(strain: PairStrain, orders: usize) -> Vec<(Family, usize)> {
    let m = strain.order();
    let mut families = Vec::new();
    for n in m.max(1)..=orders {
        families.push((Family::Gradient, n));
        if m > 0 && n > 1 {
            families.push((Family::Swirl, n));
        }
        if n > 1 {
            families.push((Family::Pressure, n));
        }
    }
    families
}

/// The solutions at a place, parts along `rho`, `phi` and `z` as in [`PairStrain::velocity`].
fn lamb(m: usize, families: &[(Family, usize)], rho: f64, z: f64) -> Vec<[f64; 3]> {
    let r = rho.hypot(z);
    let (sin, cos) = (rho / r, z / r);
    let top = families.iter().map(|family| family.1).max().unwrap_or(m);
    let legendre = legendre(m, top, cos, sin);
    let of = |&(family, order): &(Family, usize)| {
        let n = order as f64;
        let p = legendre[order];
        let before = if order > m { legendre[order - 1] } else { 0.0 };
        let slope = (n * cos * p - (n + m as f64) * before) / sin;
        let turn = m as f64 * p / sin;
        let decay = r.powi(-(order as i32) - 2);
        let gradient = [-(n + 1.0) * p * decay, slope * decay, -turn * decay];
        let [radial, polar, around] = match family {
            Family::Gradient => gradient,
            Family::Swirl => [0.0, -turn * decay * r, slope * decay * r],
            Family::Pressure => {
                let scale = -(n - 2.0) / (2.0 * n * (2.0 * n - 1.0)) * r * r;
                let outward = (n + 1.0) / (n * (2.0 * n - 1.0)) * r * r * p * decay;
                [scale * gradient[0] + outward, scale * gradient[1], scale * gradient[2]]
            }
        };
        [radial * sin + polar * cos, around, radial * cos - polar * sin]
    };
    families.iter().map(of).collect()
}

/// `P_n^m` for `n` from zero to `top`, without the sign `(-1)^m`.
fn legendre(m: usize, top: usize, cos: f64, sin: f64) -> Vec<f64> {
    let mut p = vec![0.0; top.max(m) + 1];
    p[m] = (0..m).map(|k| (2 * k + 1) as f64 * sin).product();
    for n in m + 1..=top {
        let before = if n > m + 1 { p[n - 2] } else { 0.0 };
        p[n] = ((2 * n - 1) as f64 * cos * p[n - 1] - (n + m - 1) as f64 * before) / (n - m) as f64;
    }
    p
}

/// The `x` that makes `A x - b` smallest; columns are scaled to length one first.
fn least_squares(mut a: DMatrix<f64>, b: DVector<f64>) -> DVector<f64> {
    let scales: Vec<f64> = a.column_iter().map(|column| 1.0 / column.norm()).collect();
    a.column_iter_mut().zip(&scales).for_each(|(mut column, scale)| column *= *scale);
    let qr = a.qr();
    let mut x = b;
    qr.q_tr_mul(&mut x);
    let columns = scales.len();
    let mut x = x.rows(0, columns).into_owned();
    qr.r().solve_upper_triangular_mut(&mut x);
    x.iter_mut().zip(&scales).for_each(|(x, scale)| *x *= scale);
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference;

    /// Velocities and spins of the table, which comes from bispherical coordinates.
    #[test]
    fn pairs_move_as_the_table_says() {
        let table = reference::sphere_pair_mobility().expect("a table");
        let column = |name: &str| table.column(name).expect(name);
        let [gaps, a, b, c] = ["xi", "A", "B", "C_rot"].map(column);
        for gap in [1.0, 0.1, 0.01] {
            let row = gaps.iter().position(|&xi| (xi - gap).abs() < 1e-12).expect("a row");
            let half = 1.0 + 0.5 * gap;
            let [along, tilting] =
                [PairStrain::Along, PairStrain::Tilting].map(|strain| pair_in_strain(strain, gap));
            let errors = [
                along.velocity - half * (1.0 - a[row]),
                tilting.velocity - half * (1.0 - b[row]),
                tilting.spin - c[row],
            ];
            println!("{gap}: {errors:?}");
            assert!(errors.iter().all(|error| error.abs() < 3.5e-9), "{gap}: {errors:?}");
        }
    }

    /// Twice the orders change stresslets by 1e-8 at most.
    #[test]
    fn stresslets_have_converged() {
        for gap in [1.0, 0.1] {
            for strain in PairStrain::ALL {
                let [found, finer] = [1, 2].map(|times| {
                    pair_of_orders(strain, gap, times * (20 + (16.0 / f64::sqrt(gap)) as usize)).stresslet
                });
                assert!((found - finer).abs() < 3e-8, "{strain:?} {gap}: {found} {finer}");
            }
        }
    }

    /// `5/2 + 15/2 int J r^2 dr = 5.002` for pairs at random (Batchelor and Green 1972,
    /// 10.1017/S0022112072001435), `J` the mean over five orthogonal strains of what the other sphere adds;
    /// midpoints of ten ranges of `r^-3` give 4.996, of sixteen 4.999.
    #[test]
    fn pairs_at_random_have_the_known_coefficient() {
        let count = 10;
        let width = 0.125 / f64::from(count);
        let integrand = |k: i32| {
            let inverse_cube = (f64::from(k) + 0.5) * width;
            let gap = inverse_cube.powf(-1.0 / 3.0) - 2.0;
            let [along, tilting, across] =
                PairStrain::ALL.map(|strain| pair_in_strain(strain, gap).stresslet);
            ((along + 2.0 * tilting + 2.0 * across) / 5.0 - 1.0) / (3.0 * inverse_cube.powi(2))
        };
        let integral: f64 = (0..count).map(integrand).sum::<f64>() * width;
        let found = 2.5 + 7.5 * integral;
        assert!((found - 5.002).abs() < 0.015, "{found}");
    }
}
