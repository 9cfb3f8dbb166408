//! The element matrices in products of Legendre polynomials.
//!
//! On the line from -1 to 1 let a quadratic be `a_0 P_0 + a_1 P_1 + a_2 P_2`. The `P_l` are orthogonal, and
//! so are their derivatives `P_1' = P_0`, `P_2' = 3 P_1`. In the products of these polynomials
//!
//! - mass and Laplacian of a cube are diagonal,
//! - `int d_b v_a d_a u_b` joins each function to at most one other, since `P_l'` is a multiple of `P_{l-1}`,
//! - a trilinear pressure sees one function of each component,
//!
//! so 153 multiplications apply the viscous matrix of a 3D cell, in place of 6561 for its entries, and a
//! change of basis costs four operations per line of three nodes: `A_0 = u_0 + 4 u_1 + u_2`,
//! `A_1 = u_0 - u_2`, `A_2 = u_1 - A_0 / 6` are `a_l / c_l`.
//!
//! Where cells are sheared, derivatives in space are `d_2 - g d_1` in the second direction and as they were
//! in the others. The few hundred entries that this adds are a table: loops over strains, unrolled in every
//! kernel, would take minutes to compile.

use std::collections::BTreeMap;

use gluey_linalg::Scalar;

use super::simd::Lanes;
use crate::element::{multi_index, node_count};

/// Most velocity unknowns of a cell: those in 3D.
pub(super) const UNKNOWNS: usize = 81;
/// Most corners of a cell.
pub(super) const CORNERS: usize = 8;

/// `a_l = c_l A_l` on a line of three velocity nodes.
pub(super) const VELOCITY: [f64; 3] = [1.0 / 6.0, -0.5, -2.0];
/// The same for `p_0 + p_1`, `p_0 - p_1` on a line of two pressure nodes.
const PRESSURE: [f64; 2] = [0.5, -0.5];
/// `int P_l^2` over the unit interval.
const MASS: [f64; 3] = [1.0, 1.0 / 3.0, 0.2];
/// `int P_l'^2` over the unit interval, with the derivative in the coordinate of the unit interval.
const STIFFNESS: [f64; 3] = [0.0, 4.0, 12.0];
/// `P_{l+1}' = DERIVATIVE[l] P_l`, the same derivative.
pub(super) const DERIVATIVE: [f64; 2] = [2.0, 6.0];

/// Coefficients of the element matrices of the unit cube.
#[derive(Clone, Debug)]
pub(super) struct Coefficients<T> {
    /// Diagonal of the viscous matrix, one component after another.
    diagonal: Vec<T>,
    /// Of `int d_b v_a d_a u_b`: the lower degrees in `a` and `b`, and that in the third direction.
    cross: [[[T; 3]; 2]; 2],
    /// Of the divergence, by the degree of the pressure in the direction of the component.
    divergence: [T; 2],
    /// What shear adds to the viscous matrix and to the divergence: row, column, entry.
    of_shear: [Vec<(u8, u8, T)>; 2],
}

/// Unknowns of one component.
const fn nodes<const D: usize>() -> usize {
    node_count::<D>(2)
}

/// Distance of neighbours in a direction, in a grid of three nodes per direction.
#[inline(always)]
pub(super) const fn stride(direction: usize) -> usize {
    [1, 3, 9, 27][direction]
}

impl<T: Scalar> Coefficients<T> {
    pub(super) fn new<const D: usize>() -> Self {
        let mass = |l: usize| MASS[l] * VELOCITY[l].powi(2);
        let stiffness = |l: usize| STIFFNESS[l] * VELOCITY[l].powi(2);
        let diagonal = |a: usize, node: usize| {
            let l = multi_index::<D>(node, 3);
            let along = |d: usize| -> f64 {
                (0..D).map(|e| if e == d { stiffness(l[e]) } else { mass(l[e]) }).product()
            };
            (0..D).map(|d| if d == a { 2.0 * along(d) } else { along(d) }).sum()
        };
        let lowered = |k: usize| DERIVATIVE[k] * MASS[k] * VELOCITY[k] * VELOCITY[k + 1];
        let third = |t: usize| if D == 2 { 1.0 } else { mass(t) };
        // Equal for both degrees of the pressure.
        let aside = MASS[0] * PRESSURE[0] * VELOCITY[0];
        let divergence =
            |k: usize| DERIVATIVE[k] * MASS[k] * PRESSURE[k] * VELOCITY[k + 1] * aside.powi(D as i32 - 1);
        Self {
            diagonal: (0..D * nodes::<D>())
                .map(|k| T::from_f64(diagonal(k / nodes::<D>(), k % nodes::<D>())))
                .collect(),
            cross: [0, 1]
                .map(|i| [0, 1].map(|j| [0, 1, 2].map(|t| T::from_f64(lowered(i) * lowered(j) * third(t))))),
            divergence: [0, 1].map(|k| T::from_f64(divergence(k))),
            of_shear: [Vec::new(), Vec::new()],
        }
    }

    /// The matrices of cells that are sheared.
    pub(super) fn sheared<const D: usize>(self, shear: f64) -> Self {
        let [before, after] = [0.0, shear].map(viscous_entries::<D>);
        let added = after.iter().map(|(&(row, column), entry)| {
            (row, column, entry - before.get(&(row, column)).copied().unwrap_or(0.0))
        });
        let added = added.filter(|entry| entry.2.abs() > 1e-15);
        let viscous = added.map(|(row, column, entry)| (row, column, T::from_f64(entry))).collect();
        let corner = |corner: usize| {
            let degrees = (corner & 1) + 3 * (corner >> 1 & 1) + 9 * (corner >> 2 & 1);
            let unknown = nodes::<D>() + degrees + stride(0);
            let entry = T::from_f64(-shear * self.divergence[corner & 1].to_f64());
            (corner as u8, unknown as u8, entry)
        };
        let divergence = if shear == 0.0 { Vec::new() } else { (0..1 << D).map(corner).collect() };
        Self { of_shear: [viscous, divergence], ..self }
    }

    /// `r = K u`.
    #[inline(always)]
    pub(super) fn viscous<V: Lanes<Scalar = T>, const D: usize>(
        &self,
        u: &[V; UNKNOWNS],
        r: &mut [V; UNKNOWNS],
    ) {
        let n = nodes::<D>();
        for ((r, u), &diagonal) in r[..D * n].iter_mut().zip(&u[..D * n]).zip(&self.diagonal[..D * n]) {
            *r = u.mul(V::splat(diagonal));
        }
        self.cross::<V, D, 0, 1>(u, r);
        if D == 3 {
            self.cross::<V, D, 0, 2>(u, r);
            self.cross::<V, D, 1, 2>(u, r);
        }
        for &(row, column, entry) in &self.of_shear[0] {
            r[row as usize] = u[column as usize].mul_add(V::splat(entry), r[row as usize]);
        }
    }

    /// The terms of `r = K u` that join components `A` and `B`.
    #[inline(always)]
    fn cross<V: Lanes<Scalar = T>, const D: usize, const A: usize, const B: usize>(
        &self,
        u: &[V; UNKNOWNS],
        r: &mut [V; UNKNOWNS],
    ) {
        let (n, a, b) = (nodes::<D>(), stride(A), stride(B));
        for t in 0..if D == 3 { 3 } else { 1 } {
            // The third of the directions 0, 1 and 2.
            let start = t * stride(3 - A - B);
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let first = A * n + start + i * a + (j + 1) * b;
                let second = B * n + start + (i + 1) * a + j * b;
                let factor = V::splat(self.cross[i][j][t]);
                r[first] = u[second].mul_add(factor, r[first]);
                r[second] = u[first].mul_add(factor, r[second]);
            }
        }
    }

    /// `q = B u`.
    #[inline(always)]
    pub(super) fn divergence<V: Lanes<Scalar = T>, const D: usize>(
        &self,
        u: &[V; UNKNOWNS],
        q: &mut [V; CORNERS],
    ) {
        *q = [V::splat(T::ZERO); CORNERS];
        self.for_each_pressure::<V, D>(|corner, unknown, factor| {
            q[corner] = u[unknown].mul_add(factor, q[corner])
        });
    }

    /// `r += B^T p`.
    #[inline(always)]
    pub(super) fn add_gradient<V: Lanes<Scalar = T>, const D: usize>(
        &self,
        p: &[V; CORNERS],
        r: &mut [V; UNKNOWNS],
    ) {
        self.for_each_pressure::<V, D>(|corner, unknown, factor| {
            r[unknown] = p[corner].mul_add(factor, r[unknown])
        });
    }

    /// Visits the entries of `B`: the function of component `b` whose derivative in direction `b` has the
    /// degrees of the pressure.
    #[inline(always)]
    fn for_each_pressure<V: Lanes<Scalar = T>, const D: usize>(
        &self,
        mut visit: impl FnMut(usize, usize, V),
    ) {
        let factors = self.divergence.map(V::splat);
        for b in 0..D {
            for corner in 0..1 << D {
                let degrees = (corner & 1) + 3 * (corner >> 1 & 1) + 9 * (corner >> 2 & 1);
                visit(corner, b * nodes::<D>() + degrees + stride(b), factors[corner >> b & 1]);
            }
        }
        for &(corner, unknown, entry) in &self.of_shear[1] {
            visit(corner as usize, unknown as usize, V::splat(entry));
        }
    }
}

/// Entries of the viscous matrix in cells with this shear: `sum_{a<b} (2 eps_ab)^2 + 2 sum_a eps_aa^2` in the
/// products, whose mass is diagonal.
fn viscous_entries<const D: usize>(shear: f64) -> BTreeMap<(u8, u8), f64> {
    let n = nodes::<D>();
    // c_{l+1} P_{l+1}' = slope c_l P_l.
    let slope = |l: usize| DERIVATIVE[l] * VELOCITY[l + 1] / VELOCITY[l];
    let along = |d: usize, component: usize, k: usize, factor: f64| {
        let degree = k / stride(d) % 3;
        (degree < 2).then(|| (component * n + k + stride(d), factor * slope(degree)))
    };
    // The derivative of a component along an axis of space, in the product `k`.
    let derivative = |axis: usize, component: usize, k: usize| {
        let leaning = if axis == 1 { along(0, component, k, -shear) } else { None };
        along(axis, component, k, 1.0).into_iter().chain(leaning)
    };
    let mut entries = BTreeMap::new();
    for (a, b, k) in (0..D).flat_map(|b| (0..=b).flat_map(move |a| (0..n).map(move |k| (a, b, k)))) {
        let mut strain: Vec<(usize, f64)> = derivative(b, a, k).collect();
        if a < b {
            strain.extend(derivative(a, b, k));
        }
        let mass: f64 = multi_index::<D>(k, 3).into_iter().map(|l| MASS[l] * VELOCITY[l].powi(2)).product();
        let factor = if a == b { 2.0 * mass } else { mass };
        for &(row, first) in &strain {
            for &(column, second) in &strain {
                *entries.entry((row as u8, column as u8)).or_insert(0.0) += factor * first * second;
            }
        }
    }
    entries
}

/// From the values on a line of nodes to `A`.
#[inline(always)]
fn forward<V: Lanes>(u: [V; 3]) -> [V; 3] {
    let (four, sixth) = (V::splat(V::Scalar::from_f64(4.0)), V::splat(V::Scalar::from_f64(-1.0 / 6.0)));
    let first = u[1].mul_add(four, u[0].add(u[2]));
    [first, u[0].sub(u[2]), first.mul_add(sixth, u[1])]
}

/// The transpose of [`forward`].
#[inline(always)]
fn backward<V: Lanes>(r: [V; 3]) -> [V; 3] {
    let (four, sixth) = (V::splat(V::Scalar::from_f64(4.0)), V::splat(V::Scalar::from_f64(-1.0 / 6.0)));
    let even = r[2].mul_add(sixth, r[0]);
    [even.add(r[1]), even.mul_add(four, r[2]), even.sub(r[1])]
}

#[inline(always)]
fn line<V: Lanes, const FORWARD: bool>(u: &mut [V], start: usize, stride: usize) {
    let old = [u[start], u[start + stride], u[start + 2 * stride]];
    let new = if FORWARD { forward(old) } else { backward(old) };
    (u[start], u[start + stride], u[start + 2 * stride]) = (new[0], new[1], new[2]);
}

/// [`forward`] or [`backward`] in both directions of a plane of nine nodes.
#[inline(always)]
pub(super) fn plane<V: Lanes, const FORWARD: bool>(u: &mut [V; 9]) {
    for row in 0..3 {
        line::<V, FORWARD>(u, 3 * row, 1);
    }
    for column in 0..3 {
        line::<V, FORWARD>(u, column, 3);
    }
}

/// [`forward`] or [`backward`] in the third direction.
#[inline(always)]
pub(super) fn third<V: Lanes, const D: usize, const FORWARD: bool>(u: &mut [V; UNKNOWNS]) {
    if D == 3 {
        for component in u.chunks_exact_mut(27) {
            for start in 0..9 {
                line::<V, FORWARD>(component, start, 9);
            }
        }
    }
}

/// Sums and differences on all lines of pressure nodes; its own transpose.
#[inline(always)]
pub(super) fn pressures<V: Lanes, const D: usize>(p: &mut [V; CORNERS]) {
    for d in 0..D {
        for corner in (0..1 << D).filter(|corner| corner >> d & 1 == 0) {
            let (a, b) = (p[corner], p[corner | 1 << d]);
            (p[corner], p[corner | 1 << d]) = (a.add(b), a.sub(b));
        }
    }
}
