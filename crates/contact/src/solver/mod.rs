//! Solvers of the dual projection problem.
//!
//! Minimising `1/2 |v - u*|_M^2` over the velocities that keep `d + c B v >= 0` (or `= 0`) is, for the
//! contact forces `lambda` with `M (v - u*) = B^T lambda`, the complementarity problem
//!
//! `w = q + A lambda`, `A = c B M^-1 B^T`, `q = d + c B u*`; `lambda >= floor`, `w >= 0`,
//! `(lambda - floor) w = 0`.
//!
//! `w` are the gaps at the end of the step (length), `lambda` forces over `6 pi eta` (length^2/time). A
//! contact that must stay closed has `floor = -inf`, which leaves `w = 0`.
//!
//! | solver | where |
//! |---|---|
//! | [`Auto`] | takes the best of the others for the number of contacts |
//! | [`Uzawa`] | one or two contacts; the paper's |
//! | [`Accelerated`] | many contacts, few digits |
//! | [`ActiveSet`] | many contacts, many digits |

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

mod accelerated;
mod active_set;
mod auto;
mod envelope;
mod factor;
mod infeasibility;
mod laws;
mod newton;
mod spectrum;
mod uzawa;
mod whole;

pub use accelerated::Accelerated;
pub use active_set::ActiveSet;
pub use auto::Auto;
pub use factor::Factor;
pub(crate) use laws::{GapLaw, LawProblem, Loads, TOLERANCE, farthest};
pub use spectrum::largest_eigenvalue;
pub use uzawa::Uzawa;

/// The Delassus operator `A = c B M^-1 B^T`, symmetric and positive semidefinite: how far contact forces open
/// the gaps.
pub trait DelassusOperator {
    /// Writes into `gaps` how far `forces` open each gap.
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]);

    /// `R` with `A = R R^T`, if it is known and sparse: one row per contact, one column per degree of
    /// freedom.
    fn factor(&self) -> Option<Factor> {
        None
    }

    /// Makes sums over the contacts that are here sums over all contacts of the problem, and largest numbers
    /// the largest over all, where others hold some of them.
    fn complete(&self, _sums: &mut [f64], _largest: &mut [f64]) {}

    /// The place of this one among those who share the problem; none where nobody else holds contacts. Where
    /// others do, columns of [`DelassusOperator::factor`] have the same numbers everywhere, of any size.
    fn place(&self) -> Option<usize> {
        None
    }

    /// The numbers of all who share the problem, in the order of their places.
    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>> {
        vec![numbers.to_vec()]
    }
}

/// Stands for a contact that is not among those here.
pub(crate) const ELSEWHERE: usize = usize::MAX;

/// A projection problem.
pub struct Projection<'a> {
    /// `A`.
    pub operator: &'a mut dyn DelassusOperator,
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
pub trait ProjectionSolver: Send + Sync {
    /// How many vectors of the size of the problem [`ProjectionSolver::solve`] works on.
    fn scratch_count(&self) -> usize;

    /// Solves `problem`; on failure `forces` is what was reached. `scratch` holds
    /// [`ProjectionSolver::scratch_count`] vectors of any content. Nothing is allocated on the way to a
    /// solution.
    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure>;
}

/// Effort and accuracy of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolveReport {
    /// Applications of the operator, those for its norm not counted.
    pub iterations: usize,
    /// `max |min(w, ||A|| (lambda - floor))|`; unit: length.
    pub residual: f64,
}

/// A solve that ended above its tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveFailure {
    /// Iterations made and residual reached.
    pub report: SolveReport,
    /// Residuals on the way.
    pub history: ResidualHistory,
    /// Contact with the largest residual; `usize::MAX` if others hold it.
    pub worst: usize,
    /// Contacts that no forces can satisfy together, if that is why the solve failed.
    pub infeasible: Option<Vec<usize>>,
}

impl SolveFailure {
    /// That of one contact whose gap is not a number.
    pub(crate) fn not_a_number() -> Self {
        let report = SolveReport { iterations: 1, residual: f64::INFINITY };
        let history = ResidualHistory { entries: vec![(1, report.residual)] };
        Self { report, history, worst: 0, infeasible: None }
    }
}

/// Residuals at iterations 1, 2, 4, 8, ... and at the last one.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ResidualHistory {
    /// `(iteration, residual)`, iterations increasing.
    pub entries: Vec<(usize, f64)>,
}

/// Most iterations a history can tell are `2^40`.
const HISTORY_LENGTH: usize = 40;

/// Residuals of a solve: decides when to stop, and explains a failure.
struct ConvergenceLog {
    history: [f64; HISTORY_LENGTH],
    iteration: usize,
    residual: f64,
    worst: usize,
}

impl ConvergenceLog {
    fn new() -> Self {
        Self { history: [0.0; HISTORY_LENGTH], iteration: 0, residual: f64::INFINITY, worst: 0 }
    }

    /// Records the residual of the next iteration, and of which contact it is.
    fn record(&mut self, worst: (usize, f64)) {
        self.iteration += 1;
        (self.worst, self.residual) = worst;
        if self.iteration.is_power_of_two() {
            self.history[(self.iteration.ilog2() as usize).min(HISTORY_LENGTH - 1)] = self.residual;
        }
    }

    /// Whether the last residual is small enough.
    fn has_converged(&self, problem: &Projection<'_>) -> bool {
        self.residual <= problem.tolerance
    }

    fn report(&self) -> SolveReport {
        SolveReport { iterations: self.iteration, residual: self.residual }
    }

    fn failure(&self, infeasible: Option<Vec<usize>>) -> SolveFailure {
        let powers = 0..=self.iteration.max(1).ilog2() as usize;
        let mut entries: Vec<(usize, f64)> =
            powers.map(|power| (1 << power, self.history[power.min(HISTORY_LENGTH - 1)])).collect();
        if !self.iteration.is_power_of_two() {
            entries.push((self.iteration, self.residual));
        }
        let history = ResidualHistory { entries };
        SolveFailure { report: self.report(), history, worst: self.worst, infeasible }
    }
}

impl Projection<'_> {
    /// Number of contacts, those elsewhere included.
    fn count(&self, here: usize) -> usize {
        let mut count = [here as f64];
        self.operator.complete(&mut count, &mut []);
        count[0] as usize
    }

    /// [`residual`] over all contacts.
    fn residual(&self, gaps: &[f64], forces: &[f64], norm: f64) -> (usize, f64) {
        let mut measures = ResidualSums::<0>::of(self, gaps, forces, norm);
        measures.complete(self)
    }
}

/// Sums over all contacts that are made together with their residual, for it takes one message.
struct ResidualSums<const N: usize> {
    /// The contact with the largest residual here, and that residual.
    here: (usize, f64),
    sums: [f64; N],
}

impl ResidualSums<0> {
    fn of(problem: &Projection<'_>, gaps: &[f64], forces: &[f64], norm: f64) -> Self {
        Self { here: residual(gaps, forces, problem.floors, norm), sums: [] }
    }
}

impl<const N: usize> ResidualSums<N> {
    /// Completes the sums; the contact with the largest residual of all, and that residual.
    fn complete(&mut self, problem: &Projection<'_>) -> (usize, f64) {
        let (worst, own) = self.here;
        let mut largest = [own];
        problem.operator.complete(&mut self.sums, &mut largest);
        (if own == largest[0] { worst } else { ELSEWHERE }, largest[0])
    }
}

/// `|min(gap, slack)|`, how far a contact is from being open without a force or closed with one. What is not
/// a number is infinitely far.
pub(crate) fn defect(gap: f64, slack: f64) -> f64 {
    if gap.is_nan() || slack.is_nan() { f64::INFINITY } else { gap.min(slack).abs() }
}

/// Contact with the largest residual `|min(w, norm (lambda - floor))|`, and that residual.
fn residual(gaps: &[f64], forces: &[f64], floors: &[f64], norm: f64) -> (usize, f64) {
    let mut worst = (0, 0.0);
    for (k, ((gap, force), floor)) in gaps.iter().zip(forces).zip(floors).enumerate() {
        let here = defect(*gap, norm * (force - floor));
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

/// Products are summed in lanes, which is as fixed an order as any and can be vectorised.
const LANE_COUNT: usize = 8;

/// The product over the contacts here: see [`DelassusOperator::complete`].
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (left, right) = (a.chunks_exact(LANE_COUNT), b.chunks_exact(LANE_COUNT));
    let rest: f64 = left.remainder().iter().zip(right.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; LANE_COUNT];
    for (a, b) in left.zip(right) {
        for lane in 0..LANE_COUNT {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// The first vectors of `scratch`, `count` long.
fn split<const N: usize>(scratch: &mut [f64], count: usize) -> [&mut [f64]; N] {
    let mut rest = scratch;
    std::array::from_fn(|_| {
        let (first, others) = std::mem::take(&mut rest).split_at_mut(count);
        rest = others;
        first
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_the_largest_residual() {
        let (gaps, forces, floors) = ([0.0, 0.5, 0.0], [1.0, 0.0, 2.0], [0.0; 3]);
        assert_eq!(residual(&gaps, &forces, &floors, 2.0), (0, 0.0));
        let far = |(worst, off): (usize, f64)| (worst, off == f64::INFINITY);
        assert_eq!(far(residual(&[0.0, f64::NAN, 0.0], &forces, &floors, 2.0)), (1, true));
        assert_eq!(far(residual(&gaps, &[1.0, 0.0, f64::NAN], &floors, 2.0)), (2, true));
        assert_eq!(far(residual(&gaps, &forces, &floors, f64::NAN)), (0, true));
        // Contacts that must stay closed have all forces.
        assert_eq!(residual(&gaps, &forces, &[f64::NEG_INFINITY; 3], 2.0), (1, 0.5));
    }
}
