//! Chebyshev smoothing (Adams, Brezina, Hu and Tuminaro 2003, 10.1016/S0021-9991(03)00194-3).
//!
//! With the spectrum of `M^-1 A` in `[lower, upper]` the error is multiplied by `T_k((theta - M^-1 A)/delta) /
//! T_k(theta/delta)`, `theta = (upper + lower)/2`, `delta = (upper - lower)/2`: on that interval the error contracts by
//! at least `1/T_k(theta/delta)`, and modes below `lower` never grow. Nothing but `A`, `M` and vector updates is
//! needed, so the result does not depend on the number of threads, and the smoother is symmetric where `A` and `M` are.

use crate::{LinOp, Preconditioner, Scalar, parallel};

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
        let first = T::from_f64(1.0 / theta);
        match guess {
            Guess::Zero => self.step(m, b, x, |_, _, b| b, |z, _, _| (first * z, first * z)),
            Guess::Given => {
                a.apply(x, &mut self.z);
                self.step(m, b, x, |_, ax, b| b - ax, |z, _, x| (first * z, x + first * z));
            }
        }
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        for _ in 1..self.degree {
            a.apply(&self.d, &mut self.z);
            let rho_next = 1.0 / (2.0 * sigma - rho);
            let (new, old) = (T::from_f64(2.0 * rho_next / delta), T::from_f64(rho_next * rho));
            let next = |z: T, d: T| new * z + old * d;
            self.step(m, b, x, |r, ad, _| r - ad, |z, d, x| (next(z, d), x + next(z, d)));
            rho = rho_next;
        }
    }

    /// `r = residual(r, z, b)`, `z = M^-1 r`, `(d, x) = advance(z, d, x)`, in one pass where `M` is a diagonal.
    fn step(
        &mut self,
        m: &mut (impl Preconditioner<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        residual: impl Fn(T, T, T) -> T + Sync,
        advance: impl Fn(T, T, T) -> (T, T) + Sync,
    ) {
        let Self { r, d, z, .. } = self;
        let split = m.diagonal().len();
        let (r, r_rest) = r.split_at_mut(split);
        let (d, d_rest) = d.split_at_mut(split);
        let (z, z_rest) = z.split_at_mut(split);
        let (b, b_rest) = b.split_at(split);
        let (x, x_rest) = x.split_at_mut(split);
        if !r_rest.is_empty() {
            parallel::for_each(r_rest, |first, r| {
                for (r, (&z, &b)) in r.iter_mut().zip(z_rest[first..].iter().zip(&b_rest[first..])) {
                    *r = residual(*r, z, b);
                }
            });
            m.apply_rest(r_rest, z_rest);
            parallel::for_each_2(d_rest, x_rest, |first, d, x| {
                for ((d, x), &z) in d.iter_mut().zip(x).zip(&z_rest[first..]) {
                    (*d, *x) = advance(z, *d, *x);
                }
            });
        }
        let diagonal = m.diagonal();
        parallel::for_each_3(r, d, x, |first, r, d, x| {
            let given = diagonal[first..].iter().zip(z[first..].iter().zip(&b[first..]));
            for (((r, d), x), (&inverse, (&z, &b))) in r.iter_mut().zip(d).zip(x).zip(given) {
                *r = residual(*r, z, b);
                (*d, *x) = advance(inverse * *r, *d, *x);
            }
        });
    }
}
