//! Conjugate gradients on the active set: MPRGP, "modified proportioning with reduced gradient projections"
//! (Dostal 2009, Optimal Quadratic Programming Algorithms, DOI 10.1007/b138610, algorithm 5.8).
//!
//! Conjugate gradients move the contacts whose force is above its floor; when a force would pass its floor, a
//! projected gradient step changes the active set; when the forces at the floor are worse than the others, a
//! step frees them. The rate of convergence depends on the spectrum of `A` only, and the operator may be
//! singular.

use super::infeasibility::{InfeasibilityMonitor, MONITOR_VECTOR_COUNT};
use super::{
    ConvergenceLog, Projection, ProjectionSolver, ResidualSums, SolveFailure, SolveReport, dot, gaps_under,
    largest_eigenvalue, residual, split,
};

/// Iterations between two computations of the gaps from the forces, beside twice the number of contacts: they
/// bound the drift of the recurrence, but each is a restart that costs conjugate gradients what they have
/// learnt.
const REFRESH: usize = 50;
/// `p.A p / (||A|| p.p)` below which a direction is taken for a null vector of `A`.
const NULL: f64 = 1e-13;

/// The solver for many contacts.
#[derive(Clone, Copy, Debug, Default)]
pub struct ActiveSet;

/// Vectors of one solve.
struct ActiveSetState<'a> {
    /// `w`, the gradient of the dual function.
    gaps: &'a mut [f64],
    /// Gradient of the forces above their floor.
    free: &'a mut [f64],
    /// Gradient of the forces at their floor that want to leave it.
    chopped: &'a mut [f64],
    direction: &'a mut [f64],
    /// `A direction`.
    image: &'a mut [f64],
    /// How far the last step along a conjugate direction moved the forces.
    moved: f64,
}

impl ProjectionSolver for ActiveSet {
    fn scratch_count(&self) -> usize {
        5 + MONITOR_VECTOR_COUNT
    }

    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let [gaps, free, chopped, direction, image, mark, ray, mapped] = split(scratch, forces.len());
        let norm = largest_eigenvalue(problem.operator, ray, mapped);
        let mut monitor = InfeasibilityMonitor::new([mark, ray, mapped], problem, forces);
        let mut state = ActiveSetState { gaps, free, chopped, direction, image, moved: 0.0 };
        let mut log = ConvergenceLog::new();
        let refresh = REFRESH + 2 * problem.count(forces.len());
        state.begin(problem, forces);
        let mut fresh = true;
        loop {
            let mut measures = state.measures(problem, forces, norm);
            log.record(measures.complete(problem));
            if log.has_converged(problem) && fresh {
                return Ok(log.report());
            }
            log.check(&mut monitor, problem, forces, norm)?;
            fresh = log.has_converged(problem) || log.iteration.is_multiple_of(refresh);
            if fresh {
                state.begin(problem, forces);
            } else {
                let [chopped, reduced] = measures.sums;
                state.iterate(problem, forces, norm, chopped <= reduced);
                monitor.note(norm * state.moved);
            }
        }
    }
}

impl ActiveSetState<'_> {
    /// Starts conjugate gradients anew from `forces`.
    fn begin(&mut self, problem: &mut Projection<'_>, forces: &mut [f64]) {
        for (force, floor) in forces.iter_mut().zip(problem.floors) {
            *force = force.max(*floor);
        }
        gaps_under(problem, forces, self.gaps);
        self.split(forces, problem.floors);
        self.direction.copy_from_slice(self.free);
    }

    /// Parts the gradient into its free and chopped components.
    fn split(&mut self, forces: &[f64], floors: &[f64]) {
        for k in 0..forces.len() {
            let above = forces[k] > floors[k];
            self.free[k] = if above { self.gaps[k] } else { 0.0 };
            self.chopped[k] = if above { 0.0 } else { self.gaps[k].min(0.0) };
        }
    }

    /// The residual, the square of the chopped gradient, and the product of the free one with its part that
    /// a step can follow.
    fn measures(&self, problem: &Projection<'_>, forces: &[f64], norm: f64) -> ResidualSums<2> {
        let sums = [dot(self.chopped, self.chopped), self.reduced(forces, problem.floors, norm)];
        ResidualSums { here: residual(self.gaps, forces, problem.floors, norm), sums }
    }

    /// A step; `proportional` where forces at their floors are not worse than the others.
    fn iterate(&mut self, problem: &mut Projection<'_>, forces: &mut [f64], norm: f64, proportional: bool) {
        if proportional {
            self.conjugate_step(problem, forces, norm);
        } else {
            self.release_step(problem, forces, norm);
        }
    }

    /// Product of the free gradient with its part that a step `1/norm` can still follow.
    fn reduced(&self, forces: &[f64], floors: &[f64], norm: f64) -> f64 {
        let room = forces.iter().zip(floors).map(|(force, floor)| norm * (force - floor));
        room.zip(&*self.free).map(|(room, free)| room.min(*free) * free).sum()
    }

    fn conjugate_step(&mut self, problem: &mut Projection<'_>, forces: &mut [f64], norm: f64) {
        problem.operator.apply(self.direction, self.image);
        let (direction, image) = (&*self.direction, &*self.image);
        let mut sums = [dot(direction, image), dot(direction, direction), dot(self.gaps, direction)];
        let mut longest = [-self.feasible_length(forces, problem.floors)];
        problem.operator.complete(&mut sums, &mut longest);
        let ([curvature, square, slope], feasible) = (sums, -longest[0]);
        if curvature <= NULL * norm * square {
            self.gradient_step(problem, forces, norm);
            return;
        }
        let length = slope / curvature;
        self.moved = length.abs().min(feasible) * square.sqrt();
        self.advance(forces, length.min(feasible));
        if length > feasible {
            self.split(forces, problem.floors);
            self.gradient_step(problem, forces, norm);
            return;
        }
        self.split(forces, problem.floors);
        let mut product = [dot(self.free, self.image)];
        problem.operator.complete(&mut product, &mut []);
        let beta = product[0] / curvature;
        for (direction, free) in self.direction.iter_mut().zip(&*self.free) {
            *direction = free - beta * *direction;
        }
    }

    /// Longest step against the direction before a force meets its floor.
    fn feasible_length(&self, forces: &[f64], floors: &[f64]) -> f64 {
        let mut length = f64::INFINITY;
        for k in 0..forces.len() {
            if self.direction[k] > 0.0 {
                length = length.min((forces[k] - floors[k]) / self.direction[k]);
            }
        }
        length
    }

    /// Moves by `-length * direction`, gaps by recurrence.
    fn advance(&mut self, forces: &mut [f64], length: f64) {
        for k in 0..forces.len() {
            forces[k] -= length * self.direction[k];
            self.gaps[k] -= length * self.image[k];
        }
    }

    /// Projected step along the free gradient: forces may meet their floors.
    fn gradient_step(&mut self, problem: &mut Projection<'_>, forces: &mut [f64], norm: f64) {
        for (force, free) in forces.iter_mut().zip(&*self.free) {
            *force -= free / norm;
        }
        self.begin(problem, forces);
    }

    /// Step along the chopped gradient: forces leave their floors.
    fn release_step(&mut self, problem: &mut Projection<'_>, forces: &mut [f64], norm: f64) {
        self.direction.copy_from_slice(self.chopped);
        problem.operator.apply(self.direction, self.image);
        let (direction, image) = (&*self.direction, &*self.image);
        let mut sums = [dot(direction, direction), dot(direction, image), dot(self.gaps, direction)];
        problem.operator.complete(&mut sums, &mut []);
        let [square, curvature, slope] = sums;
        self.advance(forces, slope / curvature.max(NULL * norm * square));
        self.split(forces, problem.floors);
        self.direction.copy_from_slice(self.free);
    }
}
