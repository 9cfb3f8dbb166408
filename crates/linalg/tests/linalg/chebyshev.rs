//! Chebyshev smoothing against its bound, on a matrix whose eigenvalues and eigenvectors are known.

use std::f64::consts::PI;

use crate::support::{laplacian_2d, pseudo_random};
use gluey_linalg::{
    Chebyshev, ChebyshevParams, FnOp, Guess, Identity, Jacobi, KrylovError, LinOp, Preconditioner, Scalar,
    SparseMatrix, SpectralInterval, estimate_lambda_max, vector,
};

/// Eigenvector of the five-point Laplacian with the wave numbers `k`, `l`, and its eigenvalue over the
/// diagonal.
fn eigenpair(n: usize, k: usize, l: usize) -> (Vec<f64>, f64) {
    let wave = |k: usize, i: usize| (PI * k as f64 * (i + 1) as f64 / (n + 1) as f64).sin();
    let vector = (0..n * n).map(|row| wave(k, row % n) * wave(l, row / n)).collect();
    let part = |k: usize| (PI * k as f64 / (n + 1) as f64).cos();
    (vector, 1.0 - 0.5 * (part(k) + part(l)))
}

#[test]
fn error_in_the_interval_contracts_by_the_bound_and_none_grows() {
    let n = 20;
    let mut a = laplacian_2d(n);
    let mut jacobi = Jacobi::new(&a.diagonal()).expect("positive");
    let b = vec![0.0; n * n];
    for degree in [1, 2, 3, 5] {
        let interval = SpectralInterval { lower: 0.4, upper: 2.0 };
        let mut chebyshev = Chebyshev::new(n * n, degree, interval);
        let bound = chebyshev.contraction_bound();
        let mut worst: f64 = 0.0;
        for k in 1..=n {
            let (error, lambda) = eigenpair(n, k, (k * 7) % n + 1);
            let mut x = error.clone();
            chebyshev.smooth(&mut a, &mut jacobi, &b, &mut x, Guess::Given);
            let factor = vector::norm(&x) / vector::norm(&error);
            assert!(factor <= if lambda >= 0.4 { bound * (1.0 + 1e-10) } else { 1.0 });
            if lambda >= 0.4 {
                worst = worst.max(factor);
            }
        }
        assert!(worst > 0.5 * bound, "the bound is sharp: {worst} against {bound}");
    }
}

#[test]
fn a_smoother_for_an_operator_damps_the_upper_part_of_its_spectrum() {
    let mut a = laplacian_2d(20);
    let mut jacobi = Jacobi::new(&a.diagonal()).expect("positive");
    let params = ChebyshevParams { degree: 3, ratio: 8.0, safety: 1.1, lanczos_steps: 10 };
    let chebyshev = Chebyshev::for_operator(&mut a, &mut jacobi, &params).expect("positive definite");
    let lambda_max = estimate_lambda_max(&mut a, &mut jacobi, 10).expect("positive definite");
    assert_eq!(chebyshev.interval(), SpectralInterval::upper_part(lambda_max, 8.0, 1.1));
    assert_eq!(chebyshev.interval(), Chebyshev::<f64>::below(lambda_max, 400, &params).interval());
    assert!(chebyshev.interval().upper >= eigenpair(20, 20, 20).1);
    let defaults = Chebyshev::for_operator(&mut a, &mut jacobi, &ChebyshevParams::default());
    assert!(defaults.expect("positive definite").contraction_bound() < 0.1);
}

#[test]
fn contraction_bounds_are_chebyshev_polynomials() {
    let interval = SpectralInterval { lower: 1.0, upper: 3.0 };
    let bound = |degree| Chebyshev::<f64>::new(1, degree, interval).contraction_bound();
    assert!((bound(1) - 1.0 / 2.0).abs() < 1e-15);
    assert!((bound(2) - 1.0 / 7.0).abs() < 1e-15);
    assert!((bound(3) - 1.0 / 26.0).abs() < 1e-15);
}

#[test]
fn a_zero_guess_is_the_given_guess_zero() {
    let mut a = laplacian_2d(9);
    let b = pseudo_random(1, 81);
    let mut chebyshev = Chebyshev::new(81, 4, SpectralInterval::upper_part(8.0, 10.0, 1.1));
    let mut x = vec![f64::NAN; 81];
    chebyshev.smooth(&mut a, &mut Identity, &b, &mut x, Guess::Zero);
    let mut y = vec![0.0; 81];
    chebyshev.smooth(&mut a, &mut Identity, &b, &mut y, Guess::Given);
    assert_eq!(x, y);
}

#[test]
fn the_smoother_is_symmetric_and_linear() {
    let mut a = laplacian_2d(9);
    let mut chebyshev = Chebyshev::new(81, 3, SpectralInterval::upper_part(8.0, 10.0, 1.1));
    let (b, c) = (pseudo_random(1, 81), pseudo_random(2, 81));
    let mut apply = |b: &[f64]| {
        let mut x = vec![0.0; 81];
        chebyshev.smooth(&mut a, &mut Identity, b, &mut x, Guess::Zero);
        x
    };
    let (sb, sc) = (apply(&b), apply(&c));
    assert!((vector::dot(&sb, &c) - vector::dot(&b, &sc)).abs() < 1e-13);
    assert!(vector::dot(&sb, &b) > 0.0);
}

/// Counts applications.
struct Counting<A> {
    inner: A,
    count: usize,
}

impl<A: LinOp<f64>> LinOp<f64> for Counting<A> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.count += 1;
        self.inner.apply(x, y);
    }
}

impl<M: Preconditioner<f64>> Preconditioner<f64> for Counting<M> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.count += 1;
        self.inner.apply(r, z);
    }
}

#[test]
fn the_cost_is_what_is_promised() {
    for (guess, expected) in [(Guess::Zero, (3, 4)), (Guess::Given, (4, 4))] {
        let mut a = Counting { inner: laplacian_2d(3), count: 0 };
        let mut m = Counting { inner: Identity, count: 0 };
        let interval = SpectralInterval { lower: 1.0, upper: 8.0 };
        Chebyshev::new(9, 4, interval).smooth(&mut a, &mut m, &[1.0; 9], &mut [0.0; 9], guess);
        assert_eq!((a.count, m.count), expected);
    }
}

fn estimate<T: Scalar>(n: usize, iterations: usize) -> f64 {
    let double = laplacian_2d(n);
    let values = double.values().iter().map(|&v| T::from_f64(v)).collect();
    let mut a = SparseMatrix::<T>::new(double.pattern().clone(), values).expect("same pattern");
    let mut jacobi = Jacobi::new(&a.diagonal()).expect("positive");
    estimate_lambda_max(&mut a, &mut jacobi, iterations).expect("positive definite")
}

#[test]
fn the_largest_eigenvalue_is_approached_from_below() {
    let (_, exact) = eigenpair(30, 30, 30);
    let ten = estimate::<f64>(30, 10);
    let thirty = estimate::<f64>(30, 30);
    assert!(ten <= thirty && thirty <= exact * (1.0 + 1e-12));
    assert!(ten > 0.9 * exact && thirty > 0.99 * exact, "{ten} {thirty} {exact}");
    assert!((estimate::<f32>(30, 10) / ten - 1.0).abs() < 1e-4);
    assert_eq!(ten, estimate::<f64>(30, 10));
}

#[test]
fn few_distinct_eigenvalues_are_found_exactly() {
    let (_, exact) = eigenpair(3, 3, 3);
    assert!((estimate::<f64>(3, 50) - exact).abs() < 1e-12);
}

#[test]
fn an_indefinite_operator_has_no_estimate() {
    let mut minus = FnOp::new(4, |x: &[f64], y: &mut [f64]| vector::scaled_copy(-1.0, x, y));
    let error = estimate_lambda_max(&mut minus, &mut Identity, 5).expect_err("negative");
    assert!(matches!(error, KrylovError::NotPositiveDefinite { what: "operator", iteration: 1, .. }));
    let mut nan = FnOp::new(4, |_: &[f64], y: &mut [f64]| y.fill(f64::NAN));
    let error = estimate_lambda_max(&mut nan, &mut Identity, 5).expect_err("NaN");
    assert_eq!(error, KrylovError::NotFinite { iteration: 1 });
}

#[test]
fn threads_and_fused_passes_change_no_bit() {
    /// The diagonal with all or none of it offered for fusion, or all but the last hundred unknowns.
    struct Offered(Vec<f32>, usize);
    impl Preconditioner<f32> for Offered {
        fn apply(&mut self, r: &[f32], z: &mut [f32]) {
            vector::multiply(&self.0, r, z);
        }
        fn diagonal(&self) -> &[f32] {
            &self.0[..self.1]
        }
        fn apply_rest(&mut self, r: &[f32], z: &mut [f32]) {
            vector::multiply(&self.0[self.1..], r, z);
        }
    }
    let n = 70_000;
    let smooth = |threads: usize, offered: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut a = FnOp::new(n, |x: &[f32], y: &mut [f32]| {
                y[0] = 2.0 * x[0];
                (1..n).for_each(|i| y[i] = (2.0 + (i % 5) as f32) * x[i] - x[i - 1]);
            });
            let inverse = (0..n).map(|i| 1.0 / (2.0 + (i % 5) as f32)).collect();
            let b: Vec<f32> = (0..n).map(|i| (0.3 * i as f32).sin()).collect();
            let mut x = vec![0.0; n];
            let interval = SpectralInterval { lower: 0.4, upper: 1.6 };
            let mut chebyshev = Chebyshev::new(n, 3, interval);
            chebyshev.smooth(&mut a, &mut Offered(inverse, offered), &b, &mut x, Guess::Zero);
            let mut m = Offered((0..n).map(|i| 1.0 / (2.0 + (i % 5) as f32)).collect(), offered);
            chebyshev.smooth(&mut a, &mut m, &b, &mut x, Guess::Given);
            x
        })
    };
    let reference = smooth(1, 0);
    for (threads, offered) in [(1, n), (1, n - 100), (2, n - 100), (3, 0), (4, n)] {
        assert!(smooth(threads, offered) == reference);
    }
}

#[test]
fn what_is_scattered_is_added_to_the_diagonal() {
    /// The inverse diagonal, on every third unknown given apart from the rest.
    struct Split {
        diagonal: Vec<f64>,
        scattered: Vec<u32>,
    }
    impl Preconditioner<f64> for Split {
        fn apply(&mut self, _: &[f64], _: &mut [f64]) {
            unreachable!("all of it is in its parts")
        }
        fn diagonal(&self) -> &[f64] {
            &self.diagonal
        }
        fn scattered(&self) -> &[u32] {
            &self.scattered
        }
        fn apply_scattered(&mut self, r: &[f64], z: &mut [f64]) {
            z.iter_mut().zip(r).for_each(|(z, r)| *z = 0.25 * r);
        }
    }
    let n = 9;
    let mut a = laplacian_2d(n);
    let b = pseudo_random(1, n * n);
    let whole = a.diagonal();
    let scattered: Vec<u32> = (0..(n * n) as u32).step_by(3).collect();
    let mut diagonal = vec![0.25; n * n];
    scattered.iter().for_each(|&k| diagonal[k as usize] = 0.0);
    let mut split = Split { diagonal, scattered };
    let mut jacobi = Jacobi::new(&whole).expect("positive");
    for degree in [1, 2, 3, 4] {
        let mut chebyshev = Chebyshev::new(n * n, degree, SpectralInterval { lower: 0.4, upper: 2.0 });
        let (mut x, mut y) = (vec![0.0; n * n], vec![0.0; n * n]);
        for guess in [Guess::Zero, Guess::Given] {
            chebyshev.smooth(&mut a, &mut split, &b, &mut x, guess);
            chebyshev.smooth(&mut a, &mut jacobi, &b, &mut y, guess);
            assert!(whole.iter().all(|&d| d == 4.0) && vector::norm(&x) > 0.0);
            assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-14), "degree {degree}");
        }
    }
}
