//! The contribution of a vector of cells: from nodes to lanes, the matrices in Legendre products, and back.

use gluey_linalg::Scalar;

use super::legendre::{self, CORNERS, UNKNOWNS};
use super::scalar::CellScalar;
use super::simd::{Lanes, Nodes};
use super::{CellOperator, GROUP};
use crate::element::node_count;

/// Nodes at the corners of a plane of nine.
const CORNERS_OF_PLANE: [usize; 4] = [0, 2, 6, 8];

/// Fields of as many cells as a vector has lanes.
pub(super) struct Registers<'a, V: Lanes> {
    u: [V; UNKNOWNS],
    r: [V; UNKNOWNS],
    p: [V; CORNERS],
    q: [V; CORNERS],
    /// Room for fields at quadrature points.
    points: &'a mut [V::Scalar],
}

/// Reads the nodes of cells, plane by plane: velocities go to Legendre products in the first two directions.
#[inline(always)]
fn gather<V: Lanes, const D: usize, const VISCOUS: bool>(
    x: &Nodes<V::Scalar>,
    locals: &[u16],
    u: &mut [V; UNKNOWNS],
    p: &mut [V; CORNERS],
) {
    let n = node_count::<D>(2);
    for plane in 0..n / 9 {
        let mut of_plane = [[V::splat(V::Scalar::ZERO); 9]; 4];
        for k in 0..9 {
            let node = V::gather(x, &locals[9 * plane + k..], n);
            for c in 0..4 {
                of_plane[c][k] = node[c];
            }
        }
        if plane != 1 {
            for (k, corner) in CORNERS_OF_PLANE.into_iter().enumerate() {
                p[2 * plane + k] = of_plane[D][corner];
            }
        }
        if VISCOUS {
            for c in 0..D {
                legendre::plane::<V, true>(&mut of_plane[c]);
                u[c * n + 9 * plane..][..9].copy_from_slice(&of_plane[c]);
            }
        }
    }
}

/// Adds to the nodes of cells; the transpose of [`gather`].
#[inline(always)]
fn scatter<V: Lanes, const D: usize, const DIVERGENCE: bool>(
    y: &mut Nodes<V::Scalar>,
    locals: &[u16],
    r: &[V; UNKNOWNS],
    q: &[V; CORNERS],
) {
    let n = node_count::<D>(2);
    for plane in 0..n / 9 {
        let mut of_plane = [[V::splat(V::Scalar::ZERO); 9]; 4];
        for c in 0..D {
            of_plane[c].copy_from_slice(&r[c * n + 9 * plane..][..9]);
            legendre::plane::<V, false>(&mut of_plane[c]);
        }
        if DIVERGENCE && plane != 1 {
            for (k, corner) in CORNERS_OF_PLANE.into_iter().enumerate() {
                of_plane[D][corner] = q[2 * plane + k];
            }
        }
        for k in 0..9 {
            let node = [of_plane[0][k], of_plane[1][k], of_plane[2][k], of_plane[3][k]];
            V::scatter(node, y, &locals[9 * plane + k..], n);
        }
    }
}

impl<'a, V: Lanes> Registers<'a, V> {
    #[inline(always)]
    pub(super) fn new(points: &'a mut [V::Scalar]) -> Self {
        let zero = V::splat(V::Scalar::ZERO);
        Self { u: [zero; UNKNOWNS], r: [zero; UNKNOWNS], p: [zero; CORNERS], q: [zero; CORNERS], points }
    }
}

impl<T: CellScalar, const D: usize> CellOperator<T, D> {
    /// Adds the contributions of [`Lanes::COUNT`] cells.
    #[inline(always)]
    pub(super) fn cells<
        V: Lanes<Scalar = T>,
        const VISCOUS: bool,
        const PRESSURE: bool,
        const VARYING: bool,
    >(
        &self,
        first: usize,
        eta: &[T],
        x: &Nodes<T>,
        y: &mut Nodes<T>,
        registers: &mut Registers<'_, V>,
    ) {
        let n = node_count::<D>(2);
        let locals = &self.locals[first * n..][..V::COUNT * n];
        let Registers { u, r, p, q, points } = registers;
        gather::<V, D, VISCOUS>(x, locals, u, p);
        if VISCOUS {
            legendre::third::<V, D, true>(u);
            if PRESSURE {
                self.coefficients.divergence::<V, D>(u, q);
            }
            if VARYING {
                let mut by_points = [V::splat(T::ZERO); UNKNOWNS];
                self.rule.add_viscous::<V, D>(eta, GROUP, u, &mut by_points, points);
                self.viscous_lanes::<V>(first, u, r);
                for (r, add) in r[..D * n].iter_mut().zip(&by_points) {
                    *r = r.add(*add);
                }
            } else {
                self.viscous_lanes::<V>(first, u, r);
            }
        } else {
            *r = [V::splat(T::ZERO); UNKNOWNS];
        }
        if PRESSURE {
            let scale = V::splat(T::ZERO).sub(V::load(&self.divergence[first..]));
            legendre::pressures::<V, D>(p);
            for p in &mut p[..1 << D] {
                *p = p.mul(scale);
            }
            self.coefficients.add_gradient::<V, D>(p, r);
            if VISCOUS {
                legendre::pressures::<V, D>(q);
                for q in &mut q[..1 << D] {
                    *q = q.mul(scale);
                }
            }
        }
        legendre::third::<V, D, false>(r);
        if VISCOUS && PRESSURE {
            scatter::<V, D, true>(y, locals, r, q);
        } else {
            scatter::<V, D, false>(y, locals, r, q);
        }
    }

    /// `r = scale K u`; `u` is scaled in place.
    #[inline(always)]
    fn viscous_lanes<V: Lanes<Scalar = T>>(
        &self,
        first: usize,
        u: &mut [V; UNKNOWNS],
        r: &mut [V; UNKNOWNS],
    ) {
        let scale = V::load(&self.viscous[first..]);
        for u in &mut u[..D * node_count::<D>(2)] {
            *u = u.mul(scale);
        }
        self.coefficients.viscous::<V, D>(u, r);
    }
}
