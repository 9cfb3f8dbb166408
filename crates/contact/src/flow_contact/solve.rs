//! The iteration for the forces between pairs.

use gluey_geom::{Twist, Vector};

use super::coulomb::{Coulomb, PairForce, norm};
use super::course::Course;
use crate::solver::ResidualHistory;

/// Outcome of the iteration.
pub(super) struct Outcome<const D: usize> {
    /// Motions with the forces.
    pub twists: Vec<Twist<D>>,
    pub iterations: usize,
    /// The last residual, over the size of the forces.
    pub residual: f64,
}

/// An iteration that did not end.
pub(super) struct Stalled {
    pub residual: f64,
    pub iterations: usize,
    pub history: ResidualHistory,
    /// The pair with the largest residual.
    pub worst: usize,
}

/// The forces on the partners, from a guess.
pub(super) fn solve<const D: usize>(
    problem: &mut Coulomb<'_, D>,
    forces: &mut [PairForce<D>],
) -> Result<Outcome<D>, Stalled> {
    let mut course = Course::new();
    let mut history = Vec::new();
    for iterations in 0usize.. {
        let state = problem.state(forces);
        let residual = state.residual;
        if iterations == 0 || iterations.is_power_of_two() {
            history.push((iterations, residual));
        }
        if residual <= problem.params.tolerance || norm(&state.change) <= problem.noise() {
            if drop_parted(forces, &state.asked) {
                continue;
            }
            return Ok(Outcome { twists: state.twists, iterations, residual });
        }
        if iterations == problem.params.iteration_limit || residual.is_nan() {
            let of_pair = |k: usize| state.asked[k].minus(&forces[k]).total(&problem.touches[k]).norm();
            let worst = (0..forces.len()).max_by(|&a, &b| of_pair(a).total_cmp(&of_pair(b))).unwrap_or(0);
            let history = ResidualHistory { entries: history };
            return Err(Stalled { residual, iterations, history, worst });
        }
        course.go_on(problem, forces, state);
    }
    unreachable!("the loop ends by itself")
}

/// Lets go of what is left of the forces of contacts that part; tells whether there are any.
fn drop_parted<const D: usize>(forces: &mut [PairForce<D>], asked: &[PairForce<D>]) -> bool {
    let mut is_any = false;
    for (force, asked) in forces.iter_mut().zip(asked) {
        if asked.contact.amax() == 0.0 && force.contact.amax() > 0.0 {
            (force.contact, is_any) = (Vector::zeros(), true);
        }
    }
    is_any
}
