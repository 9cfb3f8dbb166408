//! Viscosity that varies inside a cell, by quadrature.
//!
//! `int 2 eta eps(v) : eps(u)` is the sum over the points of a tensor-product rule of
//! `2 eta_q eps(v)_q : eps(u)_q`. Each of the strains is a triquadratic in Legendre products; its values at
//! the points come one direction after another, with points that mirror each other in pairs.

use gluey_linalg::Scalar;

use super::legendre::{DERIVATIVE, UNKNOWNS, VELOCITY, stride};
use super::simd::Lanes;
use crate::element::{gauss, gauss_cube, multi_index, node_count};

/// Points per direction for which there is a kernel of its own.
const USUAL: usize = 4;
/// Stands for any other number of points.
const ANY: usize = 0;

/// Gauss points with the values of the Legendre polynomials.
#[derive(Clone, Debug)]
pub(super) struct PointRule<T> {
    /// Points per direction.
    count: usize,
    /// `c_1 P_1 / c_0` and `c_2 P_2 / c_0` at the points of the lower half.
    lower: Vec<[T; 2]>,
    /// Weights of all points, `c_0^2` per direction included.
    pub(super) weights: Vec<f64>,
    /// Derivatives: `c_{l+1} P_{l+1}' = slope[l] c_l P_l`.
    slope: [T; 2],
}

impl<T: Scalar> PointRule<T> {
    pub(super) fn new<const D: usize>(count: usize) -> Self {
        let lower = gauss(count).into_iter().take(count.div_ceil(2)).enumerate().map(|(q, (x, _))| {
            // The middle point is at zero but for a rounding.
            let t = if 2 * q + 1 == count { 0.0 } else { 2.0 * x - 1.0 };
            let [constant, linear, quadratic] = VELOCITY;
            [linear * t / constant, quadratic * 0.5 * (3.0 * t * t - 1.0) / constant].map(T::from_f64)
        });
        Self {
            count,
            lower: lower.collect(),
            weights: gauss_cube::<D>(count).iter().map(|p| p.1 * VELOCITY[0].powi(2 * D as i32)).collect(),
            slope: [0, 1].map(|l| T::from_f64(DERIVATIVE[l] * VELOCITY[l + 1] / VELOCITY[l])),
        }
    }

    /// Numbers in a workspace for vectors of `lanes`.
    pub(super) fn workspace_len(&self, lanes: usize) -> usize {
        2 * buffer_len(self.count) * lanes
    }

    /// `r += K(eta) u`; `eta` holds viscosities times weights, one group of lanes after another `step`
    /// numbers apart.
    #[inline(always)]
    pub(super) fn add_viscous<V: Lanes<Scalar = T>, const D: usize>(
        &self,
        eta: &[T],
        step: usize,
        u: &[V; UNKNOWNS],
        r: &mut [V; UNKNOWNS],
        work: &mut [T],
    ) {
        match self.count {
            USUAL => self.add_strains::<V, D, USUAL>(eta, step, u, r, work),
            _ => self.add_strains::<V, D, ANY>(eta, step, u, r, work),
        }
    }

    /// `add_viscous` for `N` points per direction.
    #[inline(always)]
    fn add_strains<V: Lanes<Scalar = T>, const D: usize, const N: usize>(
        &self,
        eta: &[T],
        step: usize,
        u: &[V; UNKNOWNS],
        r: &mut [V; UNKNOWNS],
        work: &mut [T],
    ) {
        let n = node_count::<D>(2);
        for b in 0..D {
            for a in 0..=b {
                let mut strain = [V::splat(T::ZERO); 27];
                for k in 0..n {
                    let l = multi_index::<D>(k, 3);
                    if l[b] < 2 {
                        strain[k] = u[a * n + k + stride(b)].mul(V::splat(self.slope[l[b]]));
                    }
                    if a < b && l[a] < 2 {
                        strain[k] = u[b * n + k + stride(a)].mul_add(V::splat(self.slope[l[a]]), strain[k]);
                    }
                }
                let factor = V::splat(if a == b { T::ONE + T::ONE } else { T::ONE });
                self.weigh::<V, D, N>(&mut strain, factor, eta, step, work);
                for k in 0..n {
                    let l = multi_index::<D>(k, 3);
                    if l[b] < 2 {
                        let r = &mut r[a * n + k + stride(b)];
                        *r = strain[k].mul_add(V::splat(self.slope[l[b]]), *r);
                    }
                    if a < b && l[a] < 2 {
                        let r = &mut r[b * n + k + stride(a)];
                        *r = strain[k].mul_add(V::splat(self.slope[l[a]]), *r);
                    }
                }
            }
        }
    }

    /// From the coefficients of a field to its moments with `factor * eta`.
    #[inline(always)]
    fn weigh<V: Lanes<Scalar = T>, const D: usize, const N: usize>(
        &self,
        field: &mut [V; 27],
        factor: V,
        eta: &[T],
        step: usize,
        work: &mut [T],
    ) {
        let count = self.count::<N>();
        let half = buffer_len(count) * V::COUNT;
        let (mut from, mut to) = work[..2 * half].split_at_mut(half);
        for (k, value) in field[..node_count::<D>(2)].iter().enumerate() {
            put(from, k, value.mul(factor));
        }
        for d in 0..D - 1 {
            self.evaluate::<V, N>(from, to, stride(D - 1 - d), count.pow(d as u32));
            (from, to) = (to, from);
        }
        self.weigh_lines::<V, N>(from, count.pow(D as u32 - 1), eta, step);
        for d in (0..D - 1).rev() {
            self.evaluate_transpose::<V, N>(from, to, stride(D - 1 - d), count.pow(d as u32));
            (from, to) = (to, from);
        }
        for (k, value) in field[..node_count::<D>(2)].iter_mut().enumerate() {
            *value = get(from, k);
        }
    }

    #[inline(always)]
    fn count<const N: usize>(&self) -> usize {
        if N == ANY { self.count } else { N }
    }

    #[inline(always)]
    fn lower<const N: usize>(&self) -> &[[T; 2]] {
        &self.lower[..self.count::<N>().div_ceil(2)]
    }

    /// From coefficients to values at the points of one direction: `outer x 3 x inner` to
    /// `outer x count x inner`.
    #[inline(always)]
    fn evaluate<V: Lanes<Scalar = T>, const N: usize>(
        &self,
        from: &[T],
        to: &mut [T],
        outer: usize,
        inner: usize,
    ) {
        let count = self.count::<N>();
        for block in 0..outer {
            for i in 0..inner {
                let a = get_line::<V>(from, 3 * block * inner + i, inner);
                let at = |q: usize| (count * block + q) * inner + i;
                for (q, &[odd, even]) in self.lower::<N>().iter().enumerate() {
                    let (lower, upper) = pair(a, odd, even);
                    put(to, at(count - 1 - q), upper);
                    put(to, at(q), lower);
                }
            }
        }
    }

    /// In the last direction: to values at the points, times `eta`, and back.
    #[inline(always)]
    fn weigh_lines<V: Lanes<Scalar = T>, const N: usize>(
        &self,
        lines: &mut [T],
        inner: usize,
        eta: &[T],
        step: usize,
    ) {
        let count = self.count::<N>();
        for i in 0..inner {
            let a = get_line::<V>(lines, i, inner);
            let mut sum = [V::splat(T::ZERO); 3];
            let eta = |q: usize| V::load(&eta[(q * inner + i) * step..]);
            for (q, &[odd, even]) in self.lower::<N>().iter().enumerate() {
                let (lower, upper) = pair(a, odd, even);
                let mirrored =
                    if 2 * q + 1 == count { V::splat(T::ZERO) } else { upper.mul(eta(count - 1 - q)) };
                add_pair(lower.mul(eta(q)), mirrored, odd, even, &mut sum);
            }
            put_line(lines, i, inner, sum);
        }
    }

    /// The transpose of `evaluate`.
    #[inline(always)]
    fn evaluate_transpose<V: Lanes<Scalar = T>, const N: usize>(
        &self,
        from: &[T],
        to: &mut [T],
        outer: usize,
        inner: usize,
    ) {
        let count = self.count::<N>();
        for block in 0..outer {
            for i in 0..inner {
                let mut sum = [V::splat(T::ZERO); 3];
                let at = |q: usize| (count * block + q) * inner + i;
                for (q, &[odd, even]) in self.lower::<N>().iter().enumerate() {
                    let mirrored =
                        if 2 * q + 1 == count { V::splat(T::ZERO) } else { get(from, at(count - 1 - q)) };
                    add_pair(get(from, at(q)), mirrored, odd, even, &mut sum);
                }
                put_line(to, 3 * block * inner + i, inner, sum);
            }
        }
    }
}

/// Vectors in a buffer for all stages but the last.
const fn buffer_len(count: usize) -> usize {
    let count = if count < 3 { 3 } else { count };
    3 * count * count
}

/// Values at a point of the lower half and at its mirror image.
#[inline(always)]
fn pair<V: Lanes>(a: [V; 3], odd: V::Scalar, even: V::Scalar) -> (V, V) {
    let even = a[2].mul_add(V::splat(even), a[0]);
    let odd = a[1].mul(V::splat(odd));
    (even.add(odd), even.sub(odd))
}

/// The transpose of [`pair`].
#[inline(always)]
fn add_pair<V: Lanes>(lower: V, upper: V, odd: V::Scalar, even: V::Scalar, a: &mut [V; 3]) {
    let (sum, difference) = (lower.add(upper), lower.sub(upper));
    a[0] = a[0].add(sum);
    a[1] = difference.mul_add(V::splat(odd), a[1]);
    a[2] = sum.mul_add(V::splat(even), a[2]);
}

#[inline(always)]
fn get_line<V: Lanes>(from: &[V::Scalar], start: usize, stride: usize) -> [V; 3] {
    [get(from, start), get(from, start + stride), get(from, start + 2 * stride)]
}

#[inline(always)]
fn put_line<V: Lanes>(to: &mut [V::Scalar], start: usize, stride: usize, a: [V; 3]) {
    for (l, a) in a.into_iter().enumerate() {
        put(to, start + l * stride, a);
    }
}

#[inline(always)]
fn get<V: Lanes>(from: &[V::Scalar], k: usize) -> V {
    V::load(&from[k * V::COUNT..])
}

#[inline(always)]
fn put<V: Lanes>(to: &mut [V::Scalar], k: usize, value: V) {
    value.store(&mut to[k * V::COUNT..]);
}
