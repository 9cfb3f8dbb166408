//! How the iteration for the forces of contacts goes on from what pairs ask for.
//!
//! Anderson's acceleration of the steps takes 10 to 40 of them as a rule. Where a crowd jams, pairs stick and
//! slip in turn, and it may not end. Sweeps over the pairs do, with Newton's method now and then, at the
//! price of a block for each two of them.

use super::anderson::Anderson;
use super::coulomb::{Coulomb, PairForce, State};
use super::sweeps::Sweeps;

/// Steps that the acceleration remembers.
const WINDOW: usize = 10;
/// The acceleration begins anew where a residual is so many times the smallest so far.
const GROWTH: f64 = 10.0;
/// Accelerated steps before sweeps.
const ACCELERATED: usize = 200;

/// Course of an iteration.
pub(super) enum Course<const D: usize> {
    /// Accelerated steps, with the smallest residual so far, and how many there were.
    Accelerated(Anderson, f64, usize),
    /// Sweeps.
    Swept(Sweeps<D>),
}

impl<const D: usize> Course<D> {
    /// The beginning.
    pub fn new() -> Self {
        Self::Accelerated(Anderson::new(WINDOW), f64::INFINITY, 0)
    }

    /// Goes on from `forces`, with which the pairs are in this state.
    pub fn go_on(&mut self, problem: &mut Coulomb<'_, D>, forces: &mut [PairForce<D>], state: State<D>) {
        if let Self::Accelerated(_, _, ACCELERATED) = self
            && let Some(sweeps) = Sweeps::new(problem)
        {
            *self = Self::Swept(sweeps);
        }
        match self {
            Self::Swept(sweeps) => sweeps.improve(problem, forces, state.motions),
            Self::Accelerated(anderson, least, count) => {
                if state.residual > GROWTH * *least {
                    anderson.restart();
                    *least = state.residual;
                }
                (*least, *count) = (least.min(state.residual), *count + 1);
                let asked = state.asked.iter().flat_map(PairForce::numbers).collect();
                problem.set(forces, &anderson.next(asked, state.change));
            }
        }
    }
}
