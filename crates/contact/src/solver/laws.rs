//! Newton's method for the loads of gaps that follow laws.
//!
//! Under the load `L` a gap is `h(L)`, which decreases: what loads open together has to be what each gap has
//! by its own, `q + A L = h(L)`. Both sides are gradients of convex functions. The systems `(A + C) x = -(q +
//! A L - h)` of the compliances `C = -h'` are solved by conjugate gradients with their diagonal as
//! preconditioner (Hestenes and Stiefel 1952).
//!
//! A contact is the limit of such a law: no gap above the floor of its force, any gap at it. `h` has no
//! derivative then, and the other solvers are for that.

use super::{DelassusOperator, ResidualHistory, SolveFailure, SolveReport, dot};

/// A gap this near to where it should be, relative to it, is there: what is left adds up over thousands of
/// steps...
pub(crate) const TOLERANCE: f64 = 1e-10;
/// ... or as near as this share of the thinnest gap.
const LEAST: f64 = 1e-2;
/// Newton steps at most. A linear problem takes one to ten.
const MOST_NEWTON_STEPS: usize = 100;
/// Iterations of a Newton step at most; what is left then is left to the next.
const MOST_ITERATIONS: usize = 2000;
/// Gaps are taken to yield at least so much in a Newton step, over the diagonal of `A` (Levenberg 1944,
/// 10.1090/qam/10666): where more of them are closed than bodies have ways to move, gaps do not tell their
/// loads. More where steps had to be shortened a lot, less where they were right.
const SOFTENINGS: [f64; 2] = [1e-6, 0.1];
/// By which factor.
const HARDENING: f64 = 10.0;
/// Newton steps are shortened where the slope along them does not fall to this share of itself...
const SLOPE: f64 = 0.9;
/// ... to no less than this share.
const SHORTEST: f64 = 1e-12;
/// Steps below this share are much shortened.
const SHORT: f64 = 0.25;
/// Linear problems are solved this much more accurately than gaps.
const MARGIN: f64 = 0.1;

/// The law of a gap.
pub(crate) trait GapLaw {
    /// `h(load)`, sought from another gap, and `-h'(load)`.
    fn gap(&self, load: f64, start: f64) -> (f64, f64);

    /// The thinnest gap that positions resolve.
    fn thinnest(&self) -> f64;
}

/// Gaps with laws that are linear in their loads.
pub(crate) struct LawProblem<'a, L> {
    /// `A`.
    pub operator: &'a mut dyn DelassusOperator,
    /// Its diagonal.
    pub diagonal: &'a [f64],
    pub laws: &'a [L],
    /// `q`.
    pub free_gaps: &'a [f64],
}

/// Loads, and what they lead to.
pub(crate) struct Loads {
    /// `L`.
    pub loads: Vec<f64>,
    state: LawState,
}

/// Outcome of some loads.
struct LawState {
    gaps: Vec<f64>,
    /// `C`.
    compliances: Vec<f64>,
    /// Gaps that loads open, less those by the laws.
    excess: Vec<f64>,
}

/// The gap whose error is the largest in the unit in which it is told, and how large it is.
pub(crate) fn farthest(laws: &[impl GapLaw], gaps: &[f64], error: impl Fn(usize) -> f64) -> (usize, f64) {
    let off = |k: usize| error(k).abs() / (gaps[k] + LEAST / TOLERANCE * laws[k].thinnest());
    // What is not a number is farthest.
    let farther =
        |most: (usize, f64), next: (usize, f64)| if next.1 > most.1 || next.1.is_nan() { next } else { most };
    (0..gaps.len()).map(|k| (k, off(k))).fold((0, 0.0), farther)
}

impl Loads {
    /// No loads on gaps that are about these.
    pub(crate) fn new(gaps: Vec<f64>) -> Self {
        let loads = vec![0.0; gaps.len()];
        let state = LawState { gaps, compliances: Vec::new(), excess: Vec::new() };
        Self { loads, state }
    }

    /// Gaps by the laws.
    pub(crate) fn gaps(&self) -> &[f64] {
        &self.state.gaps
    }

    /// Newton's method from the loads as they are.
    pub(crate) fn solve(
        &mut self,
        problem: &mut LawProblem<'_, impl GapLaw>,
    ) -> Result<SolveReport, SolveFailure> {
        self.state = problem.state(&self.loads, &self.state.gaps);
        let [least, most] = SOFTENINGS;
        let (mut softening, mut iterations) = (least, 0);
        loop {
            let (worst, residual) = farthest(problem.laws, &self.state.gaps, |k| self.state.excess[k]);
            let report = SolveReport { iterations, residual };
            if residual <= TOLERANCE {
                return Ok(report);
            }
            if iterations == MOST_NEWTON_STEPS {
                let history = ResidualHistory::default();
                return Err(SolveFailure { report, history, worst, infeasible: None });
            }
            iterations += 1;
            let step = problem.newton_step(&self.state, softening);
            softening = match self.go_along(problem, &step) {
                ..SHORT => (softening * HARDENING).min(most),
                1.0 => (softening / HARDENING).max(least),
                _ => softening,
            };
        }
    }

    /// Goes along a step as far as the slope of what is minimised allows; returns the share of it.
    fn go_along(&mut self, problem: &mut LawProblem<'_, impl GapLaw>, step: &[f64]) -> f64 {
        let slope = dot(&self.state.excess, step);
        let mut length = 1.0;
        loop {
            let loads: Vec<f64> = self.loads.iter().zip(step).map(|(load, x)| load + length * x).collect();
            let state = problem.state(&loads, &self.state.gaps);
            if dot(&state.excess, step) <= SLOPE * slope.abs() || length <= SHORTEST {
                (self.loads, self.state) = (loads, state);
                return length;
            }
            length *= 0.5;
        }
    }
}

impl<L: GapLaw> LawProblem<'_, L> {
    /// What these loads lead to; gaps are sought from others.
    fn state(&mut self, loads: &[f64], from: &[f64]) -> LawState {
        let mut excess = vec![0.0; loads.len()];
        self.operator.apply(loads, &mut excess);
        let by_law = self.laws.iter().zip(loads).zip(from).map(|((law, load), from)| law.gap(*load, *from));
        let (gaps, compliances): (Vec<f64>, Vec<f64>) = by_law.unzip();
        for ((excess, free), gap) in excess.iter_mut().zip(self.free_gaps).zip(&gaps) {
            *excess = free + *excess - gap;
        }
        LawState { gaps, compliances, excess }
    }

    /// Solves `(A + C) x = -excess` with softened compliances.
    fn newton_step(&mut self, state: &LawState, softening: f64) -> Vec<f64> {
        let soft = state.compliances.iter().zip(self.diagonal).map(|(c, own)| c + softening * own);
        let compliances: Vec<f64> = soft.collect();
        let diagonal: Vec<f64> = compliances.iter().zip(self.diagonal).map(|(c, own)| c + own).collect();
        let scaled = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut residual: Vec<f64> = state.excess.iter().map(|f| -f).collect();
        let mut x = vec![0.0; residual.len()];
        let mut image = x.clone();
        let mut direction = scaled(&residual);
        let mut square = dot(&residual, &direction);
        for _ in 0..MOST_ITERATIONS {
            if farthest(self.laws, &state.gaps, |k| residual[k]).1 <= MARGIN * TOLERANCE {
                break;
            }
            self.operator.apply(&direction, &mut image);
            image.iter_mut().zip(&compliances).zip(&direction).for_each(|((y, c), x)| *y += c * x);
            let length = square / dot(&direction, &image);
            for k in 0..x.len() {
                x[k] += length * direction[k];
                residual[k] -= length * image[k];
            }
            let ahead = scaled(&residual);
            let next = dot(&residual, &ahead);
            let turn = next / square;
            direction.iter_mut().zip(ahead).for_each(|(x, y)| *x = y + turn * *x);
            square = next;
        }
        x
    }
}
