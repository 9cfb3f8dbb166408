//! The method of multipliers with Newton steps (Hestenes 1969, DOI 10.1007/BF00927673; Rockafellar 1976, DOI
//! 10.1287/moor.1.2.97; with semismooth Newton steps: Li, Sun and Toh 2018, DOI 10.1137/16M1097572).
//!
//! With `A = R R^T` and the gaps `w = q + A lambda`, forces are improved by minimising over the changes of
//! velocity `y` (scaled by the mobility)
//!
//! `|y|^2 / 2 + sum_k p_k(w_k + R_k y)`, `p_k' = lambda_k - max(floor_k, lambda_k - sigma (w_k + R_k y))`,
//!
//! whose pieces are quadratic: each Newton step solves `(1 + sigma sum_active R_k^T R_k) s = -gradient`
//! directly, and the exact minimum along `s` is taken. New forces are `max(floor, lambda - sigma (w + R y))`.
//! Rounding is relative to `w`, which tends to zero, so that it does no harm however large `sigma` is.
//!
//! Where gradient methods need thousands of steps to find out which of many contacts that depend on each
//! other carry forces (a jammed cluster), some ten or a hundred of these do.

use super::envelope::Envelope;
use super::{Factor, Projection, SolveReport, gaps_under, residual};

/// Smallest and largest `sigma ||A||`.
const SIGMAS: (f64, f64) = (1e3, 1e14);
/// A gap as large as the residual moves forces by so many times the largest of them: through those contacts
/// that have to open, where contacts depend on each other.
const STRIDE: f64 = 10.0;
/// Part of `sigma` that is tried after a round that made things worse, and the smallest such part.
const CAUTION: (f64, f64) = (1e-2, 1e-6);
/// Rounds of the method of multipliers.
const ROUND_LIMIT: usize = 40;
/// Newton steps of a round.
const STEP_LIMIT: usize = 200;
/// Slope at the minimum along a step, relative to that at its beginning.
const SLOPE: f64 = 1e-3;

/// Works on one problem.
pub(super) struct Newton<'a> {
    factor: &'a Factor,
    envelope: Envelope,
    /// Changes of velocity since the last round, and the direction to go.
    y: Vec<f64>,
    direction: Vec<f64>,
    /// Gaps at the end of the last round, and at `y`.
    before: Vec<f64>,
    gaps: Vec<f64>,
    /// How the direction changes the gaps.
    slopes: Vec<f64>,
    is_active: Vec<bool>,
}

impl<'a> Newton<'a> {
    /// `None` if the system is too large to be factorised.
    pub(super) fn new(factor: &'a Factor) -> Option<Self> {
        let (coordinates, rows) = (factor.coordinate_count(), factor.row_count());
        let envelope = Envelope::new(factor)?;
        let [y, direction] = [0, 0].map(|_| vec![0.0; coordinates]);
        let [before, gaps, slopes] = [0; 3].map(|_| vec![0.0; rows]);
        Some(Self { factor, envelope, y, direction, before, gaps, slopes, is_active: vec![false; rows] })
    }

    /// Replaces `forces` by better ones; what was reached with how many steps.
    pub(super) fn improve(
        &mut self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        norm: f64,
        step_limit: usize,
    ) -> SolveReport {
        gaps_under(problem, forces, &mut self.before);
        let mut report =
            SolveReport { iterations: 0, residual: residual(&self.before, forces, problem.floors, norm).1 };
        let mut part = 1.0;
        for _ in 0..ROUND_LIMIT {
            let largest = forces.iter().fold(0.0, |most: f64, force| most.max(force.abs()));
            let sigma = part * (STRIDE * largest / report.residual).clamp(SIGMAS.0 / norm, SIGMAS.1 / norm);
            let known = forces.to_vec();
            report.iterations += self.round(problem.floors, &known, forces, sigma);
            gaps_under(problem, forces, &mut self.before);
            let reached = residual(&self.before, forces, problem.floors, norm).1;
            if reached < report.residual {
                report.residual = reached;
            } else {
                forces.copy_from_slice(&known);
                gaps_under(problem, forces, &mut self.before);
                part *= CAUTION.0;
            }
            if report.residual <= problem.tolerance || report.iterations >= step_limit || part < CAUTION.1 {
                break;
            }
        }
        report
    }

    /// One minimisation; returns its number of steps.
    fn round(&mut self, floors: &[f64], known: &[f64], forces: &mut [f64], sigma: f64) -> usize {
        let push = |k: usize, gap: f64| known[k] - sigma * gap;
        self.y.fill(0.0);
        self.gaps.copy_from_slice(&self.before);
        let mut is_exact = false;
        for step in 0..STEP_LIMIT {
            let mut has_changed = false;
            for (k, active) in self.is_active.iter_mut().enumerate() {
                let now = push(k, self.gaps[k]) > floors[k];
                has_changed |= std::mem::replace(active, now) != now;
                forces[k] = push(k, self.gaps[k]).max(floors[k]);
            }
            // A whole step within one quadratic piece ends at its minimum.
            if is_exact && !has_changed {
                return step;
            }
            self.turn(|k| forces[k] - known[k], sigma);
            let length = self.minimum(|k, gap| push(k, gap).max(floors[k]) - known[k]);
            if length == 0.0 {
                // Rounding is all that is left.
                return step;
            }
            is_exact = length == 1.0;
            self.y.iter_mut().zip(&self.direction).for_each(|(y, s)| *y += length * s);
            for (k, gap) in self.gaps.iter_mut().enumerate() {
                *gap = self.before[k] + self.factor.product(k, &self.y);
            }
        }
        STEP_LIMIT
    }

    /// Newton's direction, from minus the gradient `R^T (forces - known forces) - y`.
    fn turn(&mut self, change: impl Fn(usize) -> f64, sigma: f64) {
        self.direction.iter_mut().zip(&self.y).for_each(|(s, y)| *s = -y);
        for k in 0..self.gaps.len() {
            self.factor.add_row(k, change(k), &mut self.direction);
        }
        self.envelope.factorise(self.factor, sigma, &self.is_active);
        self.envelope.solve(&mut self.direction);
    }

    /// How far to go along the direction: the root of the slope, which increases. `change` is that of a force
    /// for a gap.
    fn minimum(&mut self, change: impl Fn(usize, f64) -> f64) -> f64 {
        for (k, slope) in self.slopes.iter_mut().enumerate() {
            *slope = self.factor.product(k, &self.direction);
        }
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (along, square) = (product(&self.y, &self.direction), product(&self.direction, &self.direction));
        let slope = |t: f64| {
            let contacts = self.gaps.iter().zip(&self.slopes).enumerate();
            let pushes = contacts.map(|(k, (gap, slope))| change(k, gap + t * slope) * slope);
            along + t * square - pushes.sum::<f64>()
        };
        let small = SLOPE * slope(0.0).abs();
        root(slope, small)
    }
}

/// A root from 0 on of a function that is negative at 0 and increases, to a value that is `small`: 1 if that
/// is one.
fn root(function: impl Fn(f64) -> f64, small: f64) -> f64 {
    const FARTHEST: f64 = 1e6;
    const HALVING_COUNT: usize = 60;
    let (mut low, mut high) = (0.0, 1.0);
    let mut value = function(high);
    if value.abs() <= small {
        return high;
    }
    while value < 0.0 && high < FARTHEST {
        (low, high) = (high, 2.0 * high);
        value = function(high);
    }
    for _ in 0..HALVING_COUNT {
        let middle = 0.5 * (low + high);
        value = function(middle);
        if value.abs() <= small {
            return middle;
        }
        if value < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
