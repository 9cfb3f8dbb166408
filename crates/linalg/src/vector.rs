//! Vector kernels with a fixed order of summation, shared by threads where that pays (see
//! [`crate::parallel`]).
//!
//! A sum is taken in blocks of 1024 entries, each with 16 partial sums that the compiler keeps in vector
//! registers; the sums of the blocks are added in `f64` in an order that depends on the length alone: equal
//! inputs give equal bits.

use crate::parallel;
use crate::scalar::Scalar;

/// Entries summed in the precision of the scalar before the sum goes over to `f64`.
pub(crate) const BLOCK: usize = 1024;

/// Independent partial sums in a block.
const LANES: usize = 16;

/// Scalar product `x . y`.
pub fn dot<T: Scalar>(x: &[T], y: &[T]) -> f64 {
    debug_assert_eq!(x.len(), y.len());
    let [sum] = parallel::sum(x.len(), |piece| {
        let (x, y) = (&x[piece.clone()], &y[piece]);
        [x.chunks(BLOCK).zip(y.chunks(BLOCK)).map(|(x, y)| dot_block(x, y)).sum()]
    });
    sum
}

/// Scalar product of one block, in the precision of `y`.
pub(crate) fn dot_block<S: Scalar, T: Scalar>(x: &[S], y: &[T]) -> f64 {
    let mut lanes = [T::ZERO; LANES];
    let (x_full, x_rest) = x.as_chunks::<LANES>();
    let (y_full, y_rest) = y.as_chunks::<LANES>();
    for (x, y) in x_full.iter().zip(y_full) {
        for lane in 0..LANES {
            lanes[lane] += T::from_f64(x[lane].to_f64()) * y[lane];
        }
    }
    for (lane, (&x, &y)) in lanes.iter_mut().zip(x_rest.iter().zip(y_rest)) {
        *lane += T::from_f64(x.to_f64()) * y;
    }
    fold(lanes)
}

/// Sum of the partial sums, as a balanced tree.
fn fold<T: Scalar>(mut lanes: [T; LANES]) -> f64 {
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            let upper = lanes[lane + width];
            lanes[lane] += upper;
        }
        width /= 2;
    }
    lanes[0].to_f64()
}

/// Euclidean norm; NaN or infinite if an entry is.
pub fn norm<T: Scalar>(x: &[T]) -> f64 {
    dot(x, x).sqrt()
}

/// `y += a x`, in the precision of `y`.
pub fn axpy<S: Scalar, T: Scalar>(a: f64, x: &[S], y: &mut [T]) {
    debug_assert_eq!(x.len(), y.len());
    parallel::for_each(y, |first, y| axpy_block(a, &x[first..], y));
}

/// [`axpy`] in this thread; `y` may be shorter than `x`.
pub(crate) fn axpy_block<S: Scalar, T: Scalar>(a: f64, x: &[S], y: &mut [T]) {
    let a = T::from_f64(a);
    for (y, &x) in y.iter_mut().zip(x) {
        *y += a * T::from_f64(x.to_f64());
    }
}

/// `y = a x + b y`.
pub fn axpby<T: Scalar>(a: f64, x: &[T], b: f64, y: &mut [T]) {
    debug_assert_eq!(x.len(), y.len());
    let (a, b) = (T::from_f64(a), T::from_f64(b));
    parallel::for_each(y, |first, y| {
        for (y, &x) in y.iter_mut().zip(&x[first..]) {
            *y = a * x + b * *y;
        }
    });
}

/// `x *= a`.
pub fn scale<T: Scalar>(a: f64, x: &mut [T]) {
    let a = T::from_f64(a);
    parallel::for_each(x, |_, x| x.iter_mut().for_each(|x| *x *= a));
}

/// `y = a x`.
pub fn scaled_copy<T: Scalar>(a: f64, x: &[T], y: &mut [T]) {
    debug_assert_eq!(x.len(), y.len());
    let a = T::from_f64(a);
    parallel::for_each(y, |first, y| {
        for (y, &x) in y.iter_mut().zip(&x[first..]) {
            *y = a * x;
        }
    });
}

/// `y = a x` from one precision to another, multiplied in double precision.
pub fn convert<S: Scalar, T: Scalar>(a: f64, x: &[S], y: &mut [T]) {
    debug_assert_eq!(x.len(), y.len());
    parallel::for_each(y, |first, y| {
        for (y, &x) in y.iter_mut().zip(&x[first..]) {
            *y = T::from_f64(a * x.to_f64());
        }
    });
}

/// `z = x y`, entry by entry.
pub fn multiply<T: Scalar>(x: &[T], y: &[T], z: &mut [T]) {
    debug_assert!(x.len() == y.len() && y.len() == z.len());
    parallel::for_each(z, |first, z| {
        for (z, (&x, &y)) in z.iter_mut().zip(x[first..].iter().zip(&y[first..])) {
            *z = x * y;
        }
    });
}

/// `y = x`.
pub fn copy<T: Scalar>(x: &[T], y: &mut [T]) {
    debug_assert_eq!(x.len(), y.len());
    parallel::for_each(y, |first, y| y.copy_from_slice(&x[first..][..y.len()]));
}

/// `x = 0`.
pub fn clear<T: Scalar>(x: &mut [T]) {
    parallel::for_each(x, |_, x| x.fill(T::ZERO));
}

/// `r = b - r`, which turns `A x` held in `r` into the residual, in the precision of `r`.
pub fn residual_from_product<S: Scalar, T: Scalar>(b: &[S], r: &mut [T]) {
    debug_assert_eq!(b.len(), r.len());
    parallel::for_each(r, |first, r| {
        for (r, &b) in r.iter_mut().zip(&b[first..]) {
            *r = T::from_f64(b.to_f64()) - *r;
        }
    });
}

/// [`residual_from_product`] and the square of the norm of the residual.
pub fn residual_square_from_product<T: Scalar>(b: &[T], r: &mut [T]) -> f64 {
    debug_assert_eq!(b.len(), r.len());
    let [square] = parallel::update_and_sum(r, |first, piece| {
        let blocks = piece.chunks_mut(BLOCK).zip(b[first..].chunks(BLOCK));
        [blocks.map(|(r, b)| residual_block(b, r)).sum()]
    });
    square
}

/// The residual of one block and the square of its norm.
fn residual_block<T: Scalar>(b: &[T], r: &mut [T]) -> f64 {
    r.iter_mut().zip(b).for_each(|(r, &b)| *r = b - *r);
    dot_block(r, r)
}

/// Whether every entry is finite.
pub fn all_finite<T: Scalar>(x: &[T]) -> bool {
    // 0 x is zero for finite x and NaN otherwise, so one reduction without branches decides.
    x.chunks(BLOCK).all(|block| block.iter().fold(T::ZERO, |sum, &x| sum + x * T::ZERO) == T::ZERO)
}

/// A fixed vector with entries spread over (-1, 1) that has a part in every eigenvector in practice
/// (splitmix64 of the index; Steele, Lea and Flood 2014, 10.1145/2660193.2660195).
pub fn fill_pseudo_random<T: Scalar>(seed: u64, x: &mut [T]) {
    fill_pseudo_random_from(seed, 0, x);
}

/// The same numbers from the one at the index `first` on.
pub fn fill_pseudo_random_from<T: Scalar>(seed: u64, first: usize, x: &mut [T]) {
    let mut state = seed.wrapping_add(STEP.wrapping_mul(first as u64));
    for x in x {
        *x = T::from_f64(2.0 * uniform(&mut state) - 1.0);
    }
}

/// Between the states of two numbers that follow each other.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(STEP);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dot_is_exact_on_integers_of_every_length() {
        for n in [0, 1, 15, 16, 17, 1023, 1024, 1025, 5000] {
            let x: Vec<f64> = (0..n).map(|i| (i % 7) as f64 - 3.0).collect();
            let y: Vec<f64> = (0..n).map(|i| (i % 5) as f64 - 1.0).collect();
            let expected: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
            assert_eq!(dot(&x, &y), expected, "n = {n}");
        }
    }

    #[test]
    fn single_precision_sums_lose_little() {
        let x = vec![0.1f32; 1 << 20];
        let exact = (0.1f32 as f64).powi(2) * x.len() as f64;
        assert!((dot(&x, &x) / exact - 1.0).abs() < 1e-6);
    }

    #[test]
    fn updates_do_what_they_say() {
        let x = [1.0, 2.0, 3.0];
        let mut y = [1.0, 1.0, 1.0];
        axpy(2.0, &x, &mut y);
        assert_eq!(y, [3.0, 5.0, 7.0]);
        axpby(1.0, &x, -1.0, &mut y);
        assert_eq!(y, [-2.0, -3.0, -4.0]);
        let mut r = y;
        residual_from_product(&x, &mut y);
        assert_eq!(y, [3.0, 5.0, 7.0]);
        assert_eq!((residual_square_from_product(&x, &mut r).round(), r), (83.0, y));
        scaled_copy(0.5, &x, &mut y);
        scale(2.0, &mut y);
        assert_eq!(y, x);
    }

    #[test]
    fn a_single_bad_entry_is_seen() {
        let mut x = vec![1.0f32; 3000];
        assert!(all_finite(&x));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            x[2047] = bad;
            assert!(!all_finite(&x));
        }
        assert!(all_finite::<f64>(&[f64::MAX, -f64::MAX, f64::MAX]));
    }

    #[test]
    fn pseudo_random_vectors_repeat_and_differ_by_seed() {
        let (mut a, mut b, mut c) = ([0.0f64; 100], [0.0; 100], [0.0; 100]);
        fill_pseudo_random(1, &mut a);
        fill_pseudo_random(1, &mut b);
        fill_pseudo_random(2, &mut c);
        assert_eq!(a, b);
        assert_ne!(a, c);
        assert!(a.iter().all(|x| x.abs() < 1.0));
    }
}
