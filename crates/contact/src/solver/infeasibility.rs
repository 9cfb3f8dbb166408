//! Detection of infeasible contacts, such as those of a particle between two walls that are too near, by a
//! certificate of Farkas.
//!
//! No forces open all gaps if there are forces `y >= 0` (of any sign where a contact must stay closed) with
//! `A y = 0` and `q . y < 0` (Farkas' lemma): along `y` the dual function falls for ever, and iterates run
//! away in that direction.

use super::{ConvergenceLog, Projection, SolveFailure, dot};

/// Forces that would have to be so many times larger than the gaps call for are taken for infinite.
const INFINITE: f64 = 1e9;
/// First iteration at which to look.
const FIRST: usize = 64;
/// Forces of a certificate smaller than this part of the largest do not belong to it.
const NEGLIGIBLE: f64 = 1e-3;

/// Looks at iterations 64, 128, ... for a Farkas certificate: the direction in which the forces run away.
pub(super) struct InfeasibilityMonitor<'a> {
    mark: &'a mut [f64],
    ray: &'a mut [f64],
    image: &'a mut [f64],
    /// Forces over the inverse of the norm that gaps call for.
    needed: f64,
    /// Whether a step since the mark was so long that forces may run away.
    has_leapt: bool,
}

/// A step that moves forces by so many times what the gaps call for leads along a null vector of `A`, or
/// nearly so; then it is looked at every so many iterations.
const LEAP: f64 = 1e4;
const LOOKS_AFTER_LEAP: usize = 4;

/// Vectors a monitor works on.
pub(super) const MONITOR_VECTOR_COUNT: usize = 3;

impl<'a> InfeasibilityMonitor<'a> {
    pub(super) fn new(
        [mark, ray, image]: [&'a mut [f64]; MONITOR_VECTOR_COUNT],
        problem: &Projection<'_>,
        forces: &[f64],
    ) -> Self {
        mark.copy_from_slice(forces);
        let (mut count, mut free_gap) = ([forces.len() as f64], [largest(problem.free_gaps)]);
        problem.operator.complete(&mut count, &mut free_gap);
        let needed = count[0] * free_gap[0].max(problem.tolerance);
        Self { mark, ray, image, needed, has_leapt: false }
    }

    /// Notes the length of a step, times the norm: what comes after a long one is looked at more closely, for
    /// the next one may hide it again.
    pub(super) fn note(&mut self, length: f64) {
        self.has_leapt |= length > LEAP * self.needed;
    }

    /// The infeasible contacts, if the forces ran along a certificate since the last look.
    pub(super) fn certificate(
        &mut self,
        iteration: usize,
        problem: &mut Projection<'_>,
        forces: &[f64],
        norm: f64,
    ) -> Option<Vec<usize>> {
        let is_due = iteration >= FIRST && iteration.is_power_of_two();
        let is_looked_at = is_due || self.has_leapt && iteration.is_multiple_of(LOOKS_AFTER_LEAP);
        if !is_looked_at {
            return None;
        }
        for k in 0..forces.len() {
            let run = forces[k] - self.mark[k];
            self.ray[k] = if problem.floors[k] == f64::NEG_INFINITY { run } else { run.max(0.0) };
        }
        if is_due {
            self.mark.copy_from_slice(forces);
            self.has_leapt = false;
        }
        problem.operator.apply(self.ray, self.image);
        let mut sums = [-dot(problem.free_gaps, self.ray)];
        let mut sizes = [largest(self.image), largest(self.ray)];
        problem.operator.complete(&mut sums, &mut sizes);
        // q + A x >= 0 implies |x|_1 >= -q.y / |A y|_inf.
        let ([fall], [image, ray]) = (sums, sizes);
        if norm * fall <= INFINITE * self.needed * image || fall <= 0.0 {
            return None;
        }
        let threshold = NEGLIGIBLE * ray;
        Some((0..forces.len()).filter(|&k| self.ray[k].abs() > threshold).collect())
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, x| most.max(x.abs()))
}

impl ConvergenceLog {
    /// The failure to report if there is no sense in going on.
    pub(super) fn check(
        &self,
        monitor: &mut InfeasibilityMonitor<'_>,
        problem: &mut Projection<'_>,
        forces: &[f64],
        norm: f64,
    ) -> Result<(), SolveFailure> {
        let infeasible = monitor.certificate(self.iteration, problem, forces, norm);
        let is_lost = self.iteration >= problem.iteration_limit || !self.residual.is_finite();
        if infeasible.is_some() || is_lost { Err(self.failure(infeasible)) } else { Ok(()) }
    }
}
