//! Solvers of the dual projection problem.
//!
//! Minimising `1/2 |v - u*|_M^2` over the velocities that keep `d + c B v >= 0` (or `= 0`) is, for the contact forces
//! `lambda` with `M (v - u*) = B^T lambda`, the complementarity problem
//!
//! `w = q + A lambda`, `A = c B M^-1 B^T`, `q = d + c B u*`; `lambda >= floor`, `w >= 0`, `(lambda - floor) w = 0`.
//!
//! `w` are the gaps at the end of the step (length), `lambda` forces over `6 pi eta` (length^2/time). A contact that
//! must stay closed has `floor = -inf`, which leaves `w = 0`.

mod active_set;
mod spectrum;
mod uzawa;

pub use active_set::ActiveSet;
pub use spectrum::largest_eigenvalue;
pub use uzawa::Uzawa;

/// The symmetric positive semidefinite operator `A`.
pub trait GapOperator {
    /// Writes into `gaps` how far `forces` open each gap.
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]);
}

/// One projection problem.
pub struct Projection<'a> {
    /// `A`.
    pub operator: &'a mut dyn GapOperator,
    /// `q`: gaps at the end of the step without contact forces.
    pub free_gaps: &'a [f64],
    /// Smallest force of each contact: 0 where it can only push, `-inf` where it must stay closed.
    pub floors: &'a [f64],
    /// Residual to reach; unit: length.
    pub tolerance: f64,
    /// Most applications of the operator.
    pub iteration_limit: usize,
}

/// Finds contact forces; the initial `forces` are a guess.
pub trait ProjectionSolver: Send {
    /// Solves `problem`; on failure `forces` is what was reached.
    fn solve(
        &mut self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
    ) -> Result<SolveReport, SolveFailure>;
}

/// Effort and accuracy of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolveReport {
    /// Applications of the operator.
    pub iterations: usize,
    /// `max |min(w, ||A|| (lambda - floor))|`; unit: length.
    pub residual: f64,
}

/// A solve that ended above its tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveFailure {
    /// What was reached.
    pub report: SolveReport,
    /// Residuals on the way.
    pub history: ResidualHistory,
    /// Contact with the largest residual.
    pub worst: usize,
}

/// Residuals at iterations 1, 2, 4, 8, ... and at the last one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResidualHistory {
    /// `(iteration, residual)`, iterations increasing.
    pub entries: Vec<(usize, f64)>,
}

impl ResidualHistory {
    fn record(&mut self, iteration: usize, residual: f64) {
        if iteration.is_power_of_two() {
            self.entries.push((iteration, residual));
        }
    }

    fn close(&mut self, iteration: usize, residual: f64) {
        if self.entries.last().is_none_or(|last| last.0 != iteration) {
            self.entries.push((iteration, residual));
        }
    }
}

/// Contact with the largest residual `|min(w, norm (lambda - floor))|`, and that residual. NaN counts as largest.
fn residual(gaps: &[f64], forces: &[f64], floors: &[f64], norm: f64) -> (usize, f64) {
    let mut worst = (0, 0.0);
    for k in 0..gaps.len() {
        let slack = norm * (forces[k] - floors[k]);
        let here = if gaps[k] < slack { gaps[k].abs() } else { slack.abs() };
        let here = if gaps[k].is_nan() { f64::INFINITY } else { here };
        if here > worst.1 {
            worst = (k, here);
        }
    }
    worst
}

/// `gaps = q + A forces`.
fn gaps_under(problem: &mut Projection<'_>, forces: &[f64], gaps: &mut [f64]) {
    problem.operator.apply(forces, gaps);
    for (gap, free) in gaps.iter_mut().zip(problem.free_gaps) {
        *gap += free;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
