//! Detection of infeasible contacts, such as those of a particle between two walls that are too near, by a
//! certificate of Farkas.
//!
//! No forces open all gaps if there are forces `y >= 0` (of any sign where a contact must stay closed) with
//! `A y = 0` and `q . y < 0` (Farkas' lemma): along `y` the dual function falls for ever, and iterates run
//! away in that direction.

use super::{Projection, dot};

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
}

/// Vectors a monitor works on.
pub(super) const MONITOR_VECTOR_COUNT: usize = 3;

impl<'a> InfeasibilityMonitor<'a> {
    pub(super) fn new([mark, ray, image]: [&'a mut [f64]; MONITOR_VECTOR_COUNT], forces: &[f64]) -> Self {
        mark.copy_from_slice(forces);
        Self { mark, ray, image }
    }

    /// The infeasible contacts, if the forces ran along a certificate since the last look.
    pub(super) fn certificate(
        &mut self,
        iteration: usize,
        problem: &mut Projection<'_>,
        forces: &[f64],
        norm: f64,
    ) -> Option<Vec<usize>> {
        if iteration < FIRST || !iteration.is_power_of_two() {
            return None;
        }
        for k in 0..forces.len() {
            let run = forces[k] - self.mark[k];
            self.ray[k] = if problem.floors[k] == f64::NEG_INFINITY { run } else { run.max(0.0) };
        }
        self.mark.copy_from_slice(forces);
        problem.operator.apply(self.ray, self.image);
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let mut sums = [-dot(problem.free_gaps, self.ray), forces.len() as f64];
        let mut sizes = [largest(problem.free_gaps), largest(self.image), largest(self.ray)];
        problem.operator.complete(&mut sums, &mut sizes);
        // q + A x >= 0 implies |x|_1 >= -q.y / |A y|_inf.
        let ([fall, count], [free_gap, image, ray]) = (sums, sizes);
        let needed = count * free_gap.max(problem.tolerance);
        if norm * fall <= INFINITE * needed * image || fall <= 0.0 {
            return None;
        }
        let threshold = NEGLIGIBLE * ray;
        Some((0..forces.len()).filter(|&k| self.ray[k].abs() > threshold).collect())
    }
}
