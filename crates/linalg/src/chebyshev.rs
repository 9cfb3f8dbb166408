//! Chebyshev smoothing (Adams, Brezina, Hu and Tuminaro 2003, 10.1016/S0021-9991(03)00194-3).
//!
//! With the spectrum of `M^-1 A` in `[lower, upper]` the error is multiplied by `T_k((theta - M^-1 A)/delta) /
//! T_k(theta/delta)`, `theta = (upper + lower)/2`, `delta = (upper - lower)/2`: on that interval the error contracts by
//! at least `1/T_k(theta/delta)`, and modes below `lower` never grow. Nothing but `A`, `M` and vector updates is
//! needed, so the result does not depend on the number of threads, and the smoother is symmetric where `A` and `M` are.

use crate::{LinOp, Preconditioner, Scalar, vector};

/// Part of the spectrum of `M^-1 A` that is to be smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralInterval {
    /// Smallest eigenvalue to damp.
    pub lower: f64,
    /// Bound of all eigenvalues from above.
    pub upper: f64,
}

impl SpectralInterval {
    /// `[safety * lambda_max / ratio, safety * lambda_max]`: the upper part that a coarse grid does not see. `safety`
    /// (1.1 is usual) covers an estimate of the largest eigenvalue from below; see [`crate::estimate_lambda_max`].
    pub fn upper_part(lambda_max: f64, ratio: f64, safety: f64) -> Self {
        Self { lower: safety * lambda_max / ratio, upper: safety * lambda_max }
    }
}

/// What a smoother finds in `x`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guess {
    /// Nothing: `x` counts as zero, whatever is in it. Saves one application of the operator.
    Zero,
    /// A guess to improve.
    Given,
}

/// Chebyshev smoother of fixed degree. Owns its workspace of three vectors.
#[derive(Clone, Debug)]
pub struct Chebyshev<T> {
    degree: usize,
    interval: SpectralInterval,
    r: Vec<T>,
    d: Vec<T>,
    z: Vec<T>,
}

impl<T: Scalar> Chebyshev<T> {
    /// A smoother with `degree` >= 1 applications of the preconditioner, for operators of dimension `dim`.
    pub fn new(dim: usize, degree: usize, interval: SpectralInterval) -> Self {
        let zeros = || vec![T::ZERO; dim];
        Self { degree: degree.max(1), interval, r: zeros(), d: zeros(), z: zeros() }
    }

    /// The interval in use.
    pub fn interval(&self) -> SpectralInterval {
        self.interval
    }

    /// Takes a new interval, after the operator has changed.
    pub fn set_interval(&mut self, interval: SpectralInterval) {
        self.interval = interval;
    }

    /// Bound `1/T_k(theta/delta)` of the factor by which error components in the interval are multiplied.
    pub fn contraction_bound(&self) -> f64 {
        let SpectralInterval { lower, upper } = self.interval;
        let sigma = (upper + lower) / (upper - lower);
        1.0 / (self.degree as f64 * sigma.acosh()).cosh()
    }

    /// One smoothing sweep for `A x = b`: `degree` applications of `m`, and as many of `a`, less one from a zero guess.
    pub fn smooth(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        guess: Guess,
    ) {
        let SpectralInterval { lower, upper } = self.interval;
        let (theta, delta) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        self.first_step(a, m, b, x, guess, theta);
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        for _ in 1..self.degree {
            a.apply(&self.d, &mut self.z);
            vector::axpy(-1.0, &self.z, &mut self.r);
            m.apply(&self.r, &mut self.z);
            let rho_next = 1.0 / (2.0 * sigma - rho);
            self.step(2.0 * rho_next / delta, rho_next * rho, x);
            rho = rho_next;
        }
    }

    /// `r = b - A x`, `d = M^-1 r / theta`, `x += d`.
    fn first_step(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        guess: Guess,
        theta: f64,
    ) {
        match guess {
            Guess::Zero => {
                self.r.copy_from_slice(b);
                m.apply(&self.r, &mut self.z);
                vector::scaled_copy(1.0 / theta, &self.z, &mut self.d);
                x.copy_from_slice(&self.d);
            }
            Guess::Given => {
                a.apply(x, &mut self.r);
                vector::residual_from_product(b, &mut self.r);
                m.apply(&self.r, &mut self.z);
                vector::scaled_copy(1.0 / theta, &self.z, &mut self.d);
                vector::axpy(1.0, &self.d, x);
            }
        }
    }

    /// `d = a z + b d`, `x += d` in one pass.
    fn step(&mut self, a: f64, b: f64, x: &mut [T]) {
        let (a, b) = (T::from_f64(a), T::from_f64(b));
        for ((d, &z), x) in self.d.iter_mut().zip(&self.z).zip(x) {
            *d = a * z + b * *d;
            *x += *d;
        }
    }
}
