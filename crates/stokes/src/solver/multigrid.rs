//! GCR on the Stokes system with a block triangular preconditioner, whose velocity block is multigrid.
//!
//! Generalised conjugate residuals ([`Gcr`]) on `[A, -B^T; -B, 0]` with the block triangular preconditioner
//! `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`: `S` is close to the Schur complement (see [`SchurInverse`]),
//! `V` one V-cycle on the velocity. Steps are in `f32`, with a residual in `f64` now and then, or in `f64`
//! where rounding would disturb them ([`rounding_noise`]). The levels are the tree's own: level `l` is the
//! mesh cut at depth `l`. On every level the solid nodes of that level are eliminated; a coarse correction
//! enters as the rigid motion that fits it best. Errors that the levels do not reduce are left to a
//! correction that the formulation has.

use gluey_fem::ReferenceMatrices;
use gluey_linalg::{Gcr, GcrParams, LinOp, Preconditioner, Reference, Scalar};

use super::{SaddleSolver, SolveReport};
use crate::error::StokesError;
use crate::film::FilmNetwork;
use crate::formulation::Problem;
use crate::operator::{Elements, PressureForces, StokesSystem, SystemOperator};
use crate::precondition::schur::SchurInverse;
use crate::precondition::velocity::{Hierarchy, LevelPlan, VCycle, relative_viscosity};
use crate::precondition::{BlockTriangular, CycleLevels};
use crate::space::{Discretisation, VelocitySpace, solid_nodes};

/// Iterations between restarts: a restart forgets the few modes that hold a crowd up. Most solves end before
/// 60.
const RESTART: usize = 150;
/// Largest [`rounding_noise`] with which steps are taken in single precision. A few times more costs many
/// iterations, see `docs/archive/experiments/0010-krylov-vectors.md`.
const MOST_NOISE: f64 = 1.0;

/// Generalised conjugate residuals (GCR) with a block triangular preconditioner: one V-cycle of multigrid on
/// the velocities, an approximate Schur complement on the pressures.
pub struct MultigridSolver<const D: usize> {
    /// With steps in single and in double precision.
    single: Gcr<f64, f32>,
    double: Gcr<f64, f64, f32>,
    /// See [`rounding_noise`].
    noise: f64,
    cycle: Option<VCycle<D>>,
    schur: Option<SchurInverse<D>>,
    forces: Option<PressureForces<D>>,
    films: Option<FilmNetwork>,
    /// Below the finest mesh, where ranks have parts of it.
    coarser: Vec<Discretisation<D>>,
}

impl<const D: usize> Default for MultigridSolver<D> {
    fn default() -> Self {
        let params = GcrParams { max_iterations: 200, restart: RESTART, ..GcrParams::default() };
        Self {
            single: Gcr::with_steps(params),
            double: Gcr::with_directions(params),
            noise: 0.0,
            cycle: None,
            schur: None,
            forces: None,
            films: None,
            coarser: Vec::new(),
        }
    }
}

impl<const D: usize> MultigridSolver<D> {
    /// One V-cycle on the velocity block, for reduced velocities; `None` before the solver was prepared.
    pub fn velocity_cycle(&mut self) -> Option<&mut impl Preconditioner<f64>> {
        self.cycle.as_mut()
    }

    /// Levels of the V-cycle it was prepared with.
    pub fn level_count(&self) -> usize {
        self.cycle.as_ref().map_or(0, |cycle| cycle.levels.len())
    }
}

impl<const D: usize> SaddleSolver<D> for MultigridSolver<D> {
    fn prepare(&mut self, problem: &Problem<D>) -> Result<(), StokesError> {
        let system = &problem.system;
        let elements = Elements::new(system, ReferenceMatrices::<D>::VELOCITY);
        let (finest, before) = (problem.discretisation(), self.cycle.take().map(|cycle| cycle.hierarchy));
        let hierarchy = match finest.is_part() {
            true => Hierarchy::of_parts(self.coarser.iter().chain([finest]).cloned().collect()),
            false => Hierarchy::new(finest, before.unwrap_or_default()),
        };
        let before = self.schur.take().filter(|_| !finest.is_part());
        let meshes = hierarchy.meshes.clone();
        let schur = || SchurInverse::new(&meshes, &elements, before);
        let cycle = || velocity_cycle(problem, &elements, hierarchy);
        let (schur, cycle) = match finest.is_part() {
            // One after the other, as others wait for messages.
            true => {
                let cycle = cycle()?;
                (schur(), Ok(cycle))
            }
            false => rayon::join(schur, cycle),
        };
        (self.schur, self.cycle) = (Some(schur?), Some(cycle?));
        self.forces = Some(PressureForces::new(system));
        self.films = finest.agreed(system.film_network().map_err(StokesError::from))?;
        // Penalties and extrapolated nodes in thin films leave large numbers that nearly cancel.
        self.noise = if system.terms.is_empty() { rounding_noise(system) } else { f64::INFINITY };
        Ok(())
    }

    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError> {
        let (Some(cycle), Some(schur), Some(forces)) = (&mut self.cycle, &mut self.schur, &mut self.forces)
        else {
            return Err(StokesError::NotPrepared);
        };
        cycle.take_fine_applications();
        let [of_iterates, of_steps] =
            [(); 2].map(|()| self.films.as_ref().map(FilmNetwork::correction).transpose());
        let corrections = of_iterates.and_then(|of_iterates| Ok((of_iterates, of_steps?)));
        let corrections = corrections.map_err(StokesError::from);
        let (of_iterates, of_steps) = system.discretisation().agreed(corrections)?;
        let operator = &mut SystemOperator::new(system).with_films(of_iterates);
        let preconditioner = &mut BlockTriangular::new(system, forces, cycle, schur, of_steps);
        let goal = Goal { tolerance, reference: system.fluid_norm(b) };
        let residuals = if self.noise <= MOST_NOISE {
            run(&mut self.single, operator, preconditioner, b, x, goal)?
        } else {
            run(&mut self.double, operator, preconditioner, b, x, goal)?
        };
        Ok(SolveReport {
            iterations: residuals.len() - 1,
            fine_operator_applications: operator.applications() as f64 + cycle.take_fine_applications(),
            residuals,
            reference: goal.reference,
        })
    }

    fn share(&mut self, coarser: &[Discretisation<D>], max_iterations: usize) -> Result<(), StokesError> {
        let params = GcrParams { max_iterations, restart: RESTART, ..GcrParams::default() };
        self.single = Gcr::with_steps(params);
        self.double = Gcr::with_directions(params);
        self.coarser = coarser.to_vec();
        Ok(())
    }
}

/// The cycle whose levels are those the formulation asks for.
fn velocity_cycle<const D: usize>(
    problem: &Problem<D>,
    elements: &Elements<'_, D>,
    hierarchy: Hierarchy<D>,
) -> Result<VCycle<D>, StokesError> {
    let Problem { system, all_bodies, rigidity, .. } = problem;
    let levels = CycleLevels { meshes: &hierarchy.meshes, radius: problem.largest_radius() };
    let held = system.space.held_of_all();
    let mut finest = rigidity.finest_level(problem);
    finest.hold(held);
    let correction = rigidity.correction(elements, &finest, levels)?;
    let coarser = hierarchy.meshes[..hierarchy.meshes.len() - 1].iter().map(|mesh| {
        let bodies = mesh.near(all_bodies);
        let solid = solid_nodes(mesh, &bodies, rigidity.coarse_offset());
        let mut space = VelocitySpace::new(mesh, &bodies, &solid);
        space.hold(held);
        (space, false)
    });
    let spaces = coarser.chain([(finest, true)]);
    let plan = |(space, is_finest): (VelocitySpace<D>, bool)| LevelPlan {
        viscosity: system.viscosity() * relative_viscosity(space.discretisation(), all_bodies, held),
        smoothing: rigidity.smoothing(levels, is_finest),
        space,
    };
    let plans = spaces.map(plan).collect();
    VCycle::new(hierarchy, plans, correction)
}

/// A residual at which a solve stops: this fraction of a norm.
#[derive(Clone, Copy)]
struct Goal {
    tolerance: f64,
    reference: f64,
}

/// Solves `A x = b` with steps in `S` and returns the norms of the residuals.
fn run<S: Scalar>(
    krylov: &mut Gcr<f64, S, f32>,
    a: &mut (impl LinOp<f64> + LinOp<S>),
    m: &mut impl Preconditioner<S>,
    b: &[f64],
    x: &mut [f64],
    goal: Goal,
) -> Result<Vec<f64>, StokesError> {
    krylov.set_relative_tolerance(goal.tolerance);
    krylov.solve(a, m, b, x, Reference::Norm(goal.reference))?;
    Ok(krylov.residual_history().to_vec())
}

/// Change of the viscous force when a velocity is rounded to single precision, over the force of a velocity
/// as smooth as the box: a difference of neighbours, times the largest viscosity.
fn rounding_noise<const D: usize>(system: &StokesSystem<D>) -> f64 {
    let mesh = &system.discretisation().mesh;
    let contrast = system.added.as_ref().map_or(1.0, |added| added.contrast());
    let cells = mesh.domain().extent().max() / mesh.size(mesh.max_level());
    f64::from(f32::EPSILON) * contrast * cells * cells
}

#[cfg(test)]
mod tests;
