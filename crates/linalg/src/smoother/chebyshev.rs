//! Chebyshev smoothing (Adams, Brezina, Hu and Tuminaro 2003, 10.1016/S0021-9991(03)00194-3).
//!
//! With the spectrum of `M^-1 A` in `[lower, upper]` the error is multiplied by
//! `T_k((theta - M^-1 A)/delta) / T_k(theta/delta)`, `theta = (upper + lower)/2`,
//! `delta = (upper - lower)/2`: on that interval the error contracts by at least `1/T_k(theta/delta)`, and
//! modes below `lower` never grow. Nothing but `A`, `M` and vector updates is needed, so the result does not
//! depend on the number of threads, and the smoother is symmetric where `A` and `M` are.

use crate::krylov::{KrylovError, estimate_lambda_max};
use crate::operator::{LinOp, Preconditioner};
use crate::scalar::Scalar;
use crate::{parallel, vector};

/// Part of the spectrum of `M^-1 A` that is to be smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralInterval {
    /// Smallest eigenvalue to damp.
    pub lower: f64,
    /// Bound of all eigenvalues from above.
    pub upper: f64,
}

impl SpectralInterval {
    /// `[safety * lambda_max / ratio, safety * lambda_max]`: the upper part that a coarse grid does not see.
    /// `safety` (1.1 is usual) covers an estimate of the largest eigenvalue from below; see
    /// [`crate::estimate_lambda_max`].
    pub fn upper_part(lambda_max: f64, ratio: f64, safety: f64) -> Self {
        Self { lower: safety * lambda_max / ratio, upper: safety * lambda_max }
    }
}

/// Tuning of a Chebyshev smoother that damps the upper part of the spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChebyshevParams {
    /// Applications of the preconditioner per sweep.
    pub degree: usize,
    /// Largest over smallest eigenvalue that a sweep damps.
    pub ratio: f64,
    /// Factor on the estimate of the largest eigenvalue, which comes from below.
    pub safety: f64,
    /// Lanczos steps of that estimate.
    pub lanczos_steps: usize,
}

impl Default for ChebyshevParams {
    fn default() -> Self {
        Self { degree: 4, ratio: 5.0, safety: 1.1, lanczos_steps: 10 }
    }
}

/// Content of `x` before a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guess {
    /// Nothing: `x` counts as zero, whatever is in it. Saves one application of the operator.
    Zero,
    /// A guess to improve.
    Given,
}

/// Chebyshev smoother of fixed degree. Owns its workspace of two vectors.
///
/// The last two iterates take the place of residual and step:
/// `x_{k+1} = x_k + old (x_k - x_{k-1}) + new M^-1 (b - A x_k)` overwrites `x_{k-1}`, so a step reads five
/// vectors and writes one.
#[derive(Clone, Debug)]
pub struct Chebyshev<T> {
    degree: usize,
    interval: SpectralInterval,
    /// Every second iterate; the others are in the caller's vector.
    y: Vec<T>,
    /// `A x_k`.
    z: Vec<T>,
    work: SplitWorkspace<T>,
}

/// Residuals, and `M^-1` of them, where `M` is not a diagonal.
#[derive(Clone, Debug)]
struct SplitWorkspace<T> {
    rest: Vec<T>,
    scattered: [Vec<T>; 2],
}

impl<T> Default for SplitWorkspace<T> {
    fn default() -> Self {
        Self { rest: Vec::new(), scattered: Default::default() }
    }
}

impl<T: Scalar> Chebyshev<T> {
    /// A smoother with `degree` >= 1 applications of the preconditioner, for operators of dimension `dim`.
    pub fn new(dim: usize, degree: usize, interval: SpectralInterval) -> Self {
        let zeros = || vec![T::ZERO; dim];
        Self { degree: degree.max(1), interval, y: zeros(), z: zeros(), work: SplitWorkspace::default() }
    }

    /// A smoother for the upper part of the spectrum of `M^-1 A`, of which the largest eigenvalue is
    /// estimated.
    pub fn for_operator(
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        params: &ChebyshevParams,
    ) -> Result<Self, KrylovError> {
        let lambda_max = estimate_lambda_max(a, m, params.lanczos_steps)?;
        Ok(Self::below(lambda_max, a.dim(), params))
    }

    /// A smoother for the upper part of the spectrum below a known largest eigenvalue, for operators of
    /// dimension `dim`.
    pub fn below(lambda_max: f64, dim: usize, params: &ChebyshevParams) -> Self {
        let interval = SpectralInterval::upper_part(lambda_max, params.ratio, params.safety);
        Self::new(dim, params.degree, interval)
    }

    /// The interval in use.
    pub fn interval(&self) -> SpectralInterval {
        self.interval
    }

    /// Bound `1/T_k(theta/delta)` of the factor by which error components in the interval are multiplied.
    pub fn contraction_bound(&self) -> f64 {
        let SpectralInterval { lower, upper } = self.interval;
        let sigma = (upper + lower) / (upper - lower);
        1.0 / (self.degree as f64 * sigma.acosh()).cosh()
    }

    /// One smoothing sweep for `A x = b`: `degree` applications of `m`, and as many of `a`, less one from a
    /// zero guess.
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
        let is_odd = self.degree % 2 == 1;
        if guess == Guess::Given {
            a.apply(x, &mut self.z);
            if is_odd {
                vector::copy(x, &mut self.y);
            }
        }
        let Self { y, z, work, .. } = self;
        let mut system = System { b, z, work };
        // So that the last iterate is in `x`.
        let (mut before, mut now) = if is_odd { (&mut y[..], x) } else { (x, &mut y[..]) };
        let weight = T::from_f64(1.0 / theta);
        match guess {
            Guess::Zero => {
                Recurrence { weight, residual: |b, _| b, next: |_, _| T::ZERO }.take(
                    m,
                    &mut system,
                    before,
                    now,
                );
            }
            Guess::Given => {
                Recurrence { weight, residual: |b, z| b - z, next: |x, _| x }.take(
                    m,
                    &mut system,
                    before,
                    now,
                );
            }
        }
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        for k in 1..self.degree {
            a.apply(now, system.z);
            let rho_next = 1.0 / (2.0 * sigma - rho);
            let (weight, old) = (T::from_f64(2.0 * rho_next / delta), T::from_f64(rho_next * rho));
            let residual = |b, z| b - z;
            if k == 1 && guess == Guess::Zero {
                Recurrence { weight, residual, next: |x, _| x + old * x }.take(m, &mut system, now, before);
            } else {
                let next = |x: T, before: T| x + old * (x - before);
                Recurrence { weight, residual, next }.take(m, &mut system, now, before);
            }
            std::mem::swap(&mut before, &mut now);
            rho = rho_next;
        }
    }
}

/// The right-hand side, `A x` of the last iterate, and workspace.
struct System<'a, T> {
    b: &'a [T],
    z: &'a mut [T],
    work: &'a mut SplitWorkspace<T>,
}

/// `to = next(from, to) + weight M^-1 residual(b, z)`.
struct Recurrence<T, R, N> {
    weight: T,
    residual: R,
    next: N,
}

impl<T: Scalar, R: Fn(T, T) -> T + Sync, N: Fn(T, T) -> T + Sync> Recurrence<T, R, N> {
    /// In one pass where `M` is a diagonal.
    fn take(
        &self,
        m: &mut (impl Preconditioner<T> + ?Sized),
        System { b, z, work }: &mut System<'_, T>,
        from: &[T],
        to: &mut [T],
    ) {
        let split = m.diagonal().len();
        let (to, to_rest) = to.split_at_mut(split);
        if !to_rest.is_empty() {
            let part = System { b: &b[split..], z: &mut z[split..], work };
            self.take_rest(m, part, &from[split..], to_rest);
        }
        self.take_diagonal(m.diagonal(), b, z, from, to);
        if !m.scattered().is_empty() {
            self.add_scattered(m, System { b, z, work }, to);
        }
    }

    /// On the unknowns after those of the diagonal.
    fn take_rest(
        &self,
        m: &mut (impl Preconditioner<T> + ?Sized),
        System { b, z, work }: System<'_, T>,
        from: &[T],
        to: &mut [T],
    ) {
        let Self { weight, residual, next } = self;
        let rest = &mut work.rest;
        rest.resize(b.len(), T::ZERO);
        parallel::for_each(rest, |first, r| {
            for (r, (&b, &z)) in r.iter_mut().zip(b[first..].iter().zip(&z[first..])) {
                *r = residual(b, z);
            }
        });
        m.apply_rest(rest, z);
        parallel::for_each(to, |first, to| {
            for (to, (&z, &from)) in to.iter_mut().zip(z[first..].iter().zip(&from[first..])) {
                *to = next(from, *to) + *weight * z;
            }
        });
    }

    fn take_diagonal(&self, diagonal: &[T], b: &[T], z: &[T], from: &[T], to: &mut [T]) {
        let Self { weight, residual, next } = self;
        parallel::for_each(to, |first, to| {
            let n = to.len();
            let (diagonal, b) = (&diagonal[first..][..n], &b[first..][..n]);
            let (z, from) = (&z[first..][..n], &from[first..][..n]);
            for k in 0..n {
                to[k] = next(from[k], to[k]) + *weight * (diagonal[k] * residual(b[k], z[k]));
            }
        });
    }

    fn add_scattered(
        &self,
        m: &mut (impl Preconditioner<T> + ?Sized),
        System { b, z, work }: System<'_, T>,
        to: &mut [T],
    ) {
        let [r, sum] = &mut work.scattered;
        r.clear();
        r.extend(m.scattered().iter().map(|&k| (self.residual)(b[k as usize], z[k as usize])));
        sum.resize(r.len(), T::ZERO);
        m.apply_scattered(r, sum);
        m.scattered().iter().zip(sum).for_each(|(&k, sum)| to[k as usize] += self.weight * *sum);
    }
}
