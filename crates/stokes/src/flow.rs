//! The flow around rigid bodies: two formulations, one interface.
//!
//! `rigid-dofs`: every velocity node with `alpha >= offset h` gets the rigid motion of its body; viscosity is constant,
//! force and torque on a free body vanish because they are the residual of its own unknowns.
//!
//! `paper` (Verdon et al. 2010): viscosity `eta = I eta_s + (1-I) eta_f` (eq. 5) and the augmented Lagrangian of
//! eqs. 9 and 10: `K(eta) u^k - B^T p^k = -1/2 K(I eta_s) lambda^(k-1)`, `B u^k = 0`, `lambda^k = lambda^(k-1) + rho u^k`,
//! where `K(eta)` is the matrix of `int 2 eta eps(u):eps(v)`. The bilinear form carries `2 eta_s` and the update steps with
//! `eta_s`, so it converges for `0 < rho < 4`. Each prediction starts cold (`lambda = 0`) and makes a fixed number of steps:
//! the softness this leaves is part of the formulation.

use gluey_fem::TreeMesh;
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_levelset::{Ball, Body, Ramp};
use gluey_linalg::vector;

use crate::direct::DirectSolver;
use crate::discretisation::{Discretisation, solid_nodes};
use crate::error::StokesError;
use crate::multigrid::MultigridSolver;
use crate::pressure::WeakPressures;
use crate::solid::{PointMatrices, SolidRegion, SolidStress};
use crate::solver::{Preparation, SaddleSolver};
use crate::space::VelocitySpace;
use crate::system::{Penalty, StokesSystem};
use crate::warm_start::{NodalFields, WarmStart};

/// How rigidity is imposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Formulation {
    /// Elimination of the solid degrees of freedom.
    RigidDofs {
        /// Nodes with `alpha >= offset h` are rigid; slightly negative is best, see `docs/theory`.
        offset: f64,
        /// Treatment of the pressures in cut cells.
        weak_pressures: WeakPressures,
    },
    /// Penalty and Uzawa multiplier of the paper.
    Paper(PaperParams),
}

/// Parameters of the `paper` formulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperParams {
    /// `r = eta_s / eta_f`.
    pub viscosity_ratio: f64,
    /// Thickness `e` of the ramp in cells.
    pub ramp: f64,
    /// Step `rho` of the multiplier update, `0 < rho < 4`.
    pub rho: f64,
    /// Number of solves a prediction, each followed by an update of the multiplier.
    pub uzawa_steps: usize,
    /// Gauss points a direction in cells near a surface.
    pub quadrature: usize,
}

impl Default for PaperParams {
    fn default() -> Self {
        Self { viscosity_ratio: 1e3, ramp: 1.0, rho: 1.0, uzawa_steps: 1, quadrature: 4 }
    }
}

/// Which linear solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverKind {
    /// Sparse direct factorisation.
    Direct,
    /// Krylov method with a multigrid preconditioner.
    Multigrid,
}

/// Parameters of a [`FlowSolver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowParams {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// How rigidity is imposed.
    pub formulation: Formulation,
    /// Linear solver.
    pub solver: SolverKind,
    /// Relative tolerance of a solve: Euclidean norm of the residual, relative to that of the undisturbed flow.
    pub tolerance: f64,
}

/// A computed flow.
#[derive(Clone, Debug)]
pub struct Flow<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Mesh and nodes.
    pub discretisation: Discretisation<D>,
    /// Nodal velocities, `D` interleaved components.
    pub velocity: Vec<f64>,
    /// Pressure at the pressure nodes; its mean over the nodes is zero.
    pub pressure: Vec<f64>,
    /// Multiplier of the rigidity, a nodal velocity field; empty in `rigid-dofs`.
    pub multiplier: Vec<f64>,
    /// Velocity and spin of each body.
    pub twists: Vec<Twist<D>>,
    /// Linear solves made.
    pub solve_count: usize,
    /// Krylov iterations or refinements over all solves.
    pub iteration_count: usize,
    /// Applications of the operator over all solves, see [`crate::SolveReport::fine_operator_applications`].
    pub fine_operator_applications: f64,
    /// Seconds in mesh and assembly, in the preparation of the solver, and in solves, as told by the caller's clock.
    pub phases: [f64; 3],
}

/// Computes flows one after the other, keeping what can be reused.
pub struct FlowSolver<const D: usize>
where
    Dim<D>: Space<D>,
{
    params: FlowParams,
    solver: Box<dyn SaddleSolver<D> + Send>,
    matrices: PointMatrices<D>,
    warm_start: Option<WarmStart<D>>,
    clock: fn() -> f64,
}

impl<const D: usize> FlowSolver<D>
where
    Dim<D>: Space<D>,
{
    /// A solver with the given parameters. `clock` gives seconds for the phase table; the library itself reads no clock.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range.
    pub fn new(params: FlowParams, clock: fn() -> f64) -> Result<Self, StokesError> {
        check(&params)?;
        let quadrature = match params.formulation {
            Formulation::Paper(paper) => paper.quadrature,
            Formulation::RigidDofs { .. } => 1,
        };
        let solver: Box<dyn SaddleSolver<D> + Send> = match params.solver {
            SolverKind::Direct => Box::new(DirectSolver::default()),
            SolverKind::Multigrid => Box::new(MultigridSolver::default()),
        };
        Ok(Self { params, solver, matrices: PointMatrices::new(quadrature), warm_start: None, clock })
    }

    /// Flow on `mesh` around `bodies` with the velocity `boundary(x)` on the outer boundary; the same function, which
    /// must be divergence-free, is the undisturbed flow inside.
    pub fn solve(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<Flow<D>, StokesError> {
        let start = (self.clock)();
        let discretisation = Discretisation::new(mesh);
        let undisturbed = nodal_values(&discretisation, boundary);
        match self.params.formulation {
            Formulation::RigidDofs { offset, weak_pressures } => {
                self.solve_rigid(discretisation, bodies, &undisturbed, offset, weak_pressures, start)
            }
            Formulation::Paper(paper) => self.solve_paper(discretisation, bodies, &undisturbed, paper, start),
        }
    }

    fn solve_rigid(
        &mut self,
        discretisation: Discretisation<D>,
        bodies: &[Ball<D>],
        undisturbed: &[f64],
        offset: f64,
        weak_pressures: WeakPressures,
        start: f64,
    ) -> Result<Flow<D>, StokesError> {
        let h = discretisation.mesh.size(discretisation.mesh.max_level());
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, bodies, offset);
        let space = VelocitySpace::new(discretisation.velocity.clone(), bodies, &solid);
        check_resolved(&space, bodies, h)?;
        let viscosity = self.params.viscosity;
        let system = StokesSystem::new(&discretisation, space, viscosity, weak_pressures, None);
        let prepared_from = (self.clock)();
        let preparation = Preparation { bodies, offset, viscosity, touched: None };
        self.solver.prepare(&discretisation, &system, &preparation)?;
        let solved_from = (self.clock)();

        // The lift carries the undisturbed flow, with the twists that fit it best.
        let nodal = system.space.full_dim();
        let mut lift = lifted(&system.space, undisturbed);
        let mut b = vec![0.0; system.dim()];
        system.residual(&lift, &vec![0.0; system.pressure.dim()], &mut b);
        let (mut x, before) = self.initial_guess(&system, &discretisation);
        let tolerance = self.params.tolerance;
        let report = self.solver.solve(&system, &b, &mut x, tolerance)?;

        let pressure = self.finish(&system, &discretisation, &x, before);
        let mut expanded = x[..system.velocity_dim()].to_vec();
        system.space.expand(&mut expanded);
        vector::axpy(1.0, &expanded, &mut lift);
        let twists = (0..bodies.len()).map(|body| system.space.twist(&lift, body)).collect();
        lift.truncate(nodal);
        let end = (self.clock)();
        Ok(Flow {
            discretisation,
            velocity: lift,
            pressure,
            multiplier: Vec::new(),
            twists,
            solve_count: 1,
            iteration_count: report.iterations,
            fine_operator_applications: report.fine_operator_applications,
            phases: [prepared_from - start, solved_from - prepared_from, end - solved_from],
        })
    }

    fn solve_paper(
        &mut self,
        discretisation: Discretisation<D>,
        bodies: &[Ball<D>],
        undisturbed: &[f64],
        paper: PaperParams,
        start: f64,
    ) -> Result<Flow<D>, StokesError> {
        let h = discretisation.mesh.size(discretisation.mesh.max_level());
        let viscosity = self.params.viscosity;
        let region = SolidRegion::new(&discretisation, bodies, Ramp::new(paper.ramp * h), &self.matrices);
        for (body, ball) in bodies.iter().enumerate() {
            if !region.holds(body) || ball.bounding_radius() < h {
                return Err(StokesError::Unresolved { body, radius: ball.bounding_radius(), cell_size: h });
            }
        }
        let solid_viscosity = viscosity * paper.viscosity_ratio;
        let stress = SolidStress::new(&discretisation, &region, &self.matrices, solid_viscosity);
        let touched = region.touched_nodes(&discretisation.velocity, bodies);
        let nowhere = vec![None; discretisation.velocity.node_count()];
        let space = VelocitySpace::new::<Ball<D>>(discretisation.velocity.clone(), &[], &nowhere);
        let penalty = Penalty { factor: 1.0 - 1.0 / paper.viscosity_ratio, stress };
        let system = StokesSystem::new(&discretisation, space, viscosity, WeakPressures::Keep, Some(penalty));
        let prepared_from = (self.clock)();
        let preparation = Preparation { bodies, offset: 0.0, viscosity, touched: Some(&touched) };
        self.solver.prepare(&discretisation, &system, &preparation)?;
        let solved_from = (self.clock)();

        let nodal = system.space.full_dim();
        let mut lift = undisturbed.to_vec();
        system.space.expand(&mut lift);
        let mut base = vec![0.0; system.dim()];
        system.residual(&lift, &vec![0.0; system.pressure.dim()], &mut base);
        let reference = vector::norm(&base);
        let (mut x, before) = self.initial_guess(&system, &discretisation);
        let mut multiplier = vec![0.0; nodal];
        let mut velocity = Vec::new();
        let (mut iteration_count, mut fine_operator_applications) = (0, 0.0);
        for step in 0..paper.uzawa_steps {
            let mut b = base.clone();
            if step > 0 {
                subtract_multiplier(&system, &multiplier, &mut b);
            }
            let scale = reference / vector::norm(&b).max(f64::MIN_POSITIVE);
            let tolerance = self.params.tolerance * scale.min(1.0);
            let report = self.solver.solve(&system, &b, &mut x, tolerance)?;
            iteration_count += report.iterations;
            fine_operator_applications += report.fine_operator_applications;
            velocity = x[..nodal].to_vec();
            system.space.expand(&mut velocity);
            vector::axpy(1.0, &lift, &mut velocity);
            vector::axpy(paper.rho, &velocity, &mut multiplier);
        }
        let pressure = self.finish(&system, &discretisation, &x, before);
        let twists = region.twists(&discretisation, bodies, &self.matrices, &velocity);
        let end = (self.clock)();
        Ok(Flow {
            discretisation,
            velocity,
            pressure,
            multiplier,
            twists,
            solve_count: paper.uzawa_steps,
            iteration_count,
            fine_operator_applications,
            phases: [prepared_from - start, solved_from - prepared_from, end - solved_from],
        })
    }

    /// The deviations from the undisturbed flow that the next solve starts from, where the solver is iterative: the last
    /// one, and the one before on the same mesh.
    pub fn warm_start(&self) -> Option<(&NodalFields, Option<&NodalFields>)> {
        self.warm_start.as_ref().map(WarmStart::fields)
    }

    /// Restores what [`FlowSolver::warm_start`] gave, on the mesh it belongs to; `false` if the lengths do not fit.
    pub fn set_warm_start(
        &mut self,
        mesh: TreeMesh<D>,
        last: NodalFields,
        before: Option<NodalFields>,
    ) -> bool {
        let restored = WarmStart::restore(mesh, last, before);
        let fits = restored.is_some();
        if fits {
            self.warm_start = restored;
        }
        fits
    }

    /// What the solve starts from, and the last flow on its mesh; zero and nothing at the first step.
    fn initial_guess(
        &self,
        system: &StokesSystem<D>,
        discretisation: &Discretisation<D>,
    ) -> (Vec<f64>, Option<NodalFields>) {
        match &self.warm_start {
            Some(warm) if self.params.solver == SolverKind::Multigrid => {
                let last = warm.last_on(discretisation);
                (warm.guess(&last, discretisation, system), Some(last))
            }
            _ => (vec![0.0; system.dim()], None),
        }
    }

    /// Keeps the solution for the next guess and returns the nodal pressure.
    fn finish(
        &mut self,
        system: &StokesSystem<D>,
        discretisation: &Discretisation<D>,
        x: &[f64],
        before: Option<NodalFields>,
    ) -> Vec<f64> {
        let split = system.velocity_dim();
        let mut pressure = x[split..].to_vec();
        system.pressure.expand(&mut pressure);
        if self.params.solver == SolverKind::Multigrid {
            let mut velocity = x[..split].to_vec();
            system.space.expand(&mut velocity);
            velocity.truncate(system.space.full_dim());
            let last = NodalFields { velocity, pressure: pressure.clone() };
            let smooth = matches!(self.params.formulation, Formulation::Paper(_));
            let before = before.filter(|_| smooth);
            self.warm_start = Some(WarmStart::new(discretisation.clone(), last, before));
        }
        pressure
    }
}

/// `b -= int I eta_s eps(lambda):eps(v)`: half of `K(I eta_s) lambda`, which carries `2 eta_s`.
fn subtract_multiplier<const D: usize>(system: &StokesSystem<D>, multiplier: &[f64], b: &mut [f64])
where
    Dim<D>: Space<D>,
{
    if let Some(penalty) = &system.penalty {
        let mut load = vec![0.0; system.velocity_dim()];
        penalty.stress.apply(system.space.nodes(), multiplier, &mut load);
        system.space.reduce(&mut load);
        vector::axpy(-0.5, &load, &mut b[..system.velocity_dim()]);
    }
}

/// The undisturbed flow as a field that fulfils all constraints.
fn lifted<const D: usize>(space: &VelocitySpace<D>, undisturbed: &[f64]) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let mut twists = vec![0.0; space.dim()];
    twists[..undisturbed.len()].copy_from_slice(undisturbed);
    space.project(&mut twists);
    let mut lift = undisturbed.to_vec();
    lift.extend_from_slice(&twists[space.full_dim()..]);
    space.expand(&mut lift);
    lift
}

fn nodal_values<const D: usize>(
    discretisation: &Discretisation<D>,
    field: &dyn Fn(&Vector<D>) -> Vector<D>,
) -> Vec<f64> {
    let nodes = &discretisation.velocity;
    (0..nodes.node_count()).flat_map(|n| field(&nodes.point(n)).data.0[0]).collect()
}

fn check_resolved<const D: usize>(
    space: &VelocitySpace<D>,
    bodies: &[Ball<D>],
    cell_size: f64,
) -> Result<(), StokesError>
where
    Dim<D>: Space<D>,
{
    match (0..bodies.len()).find(|&b| !space.is_active(b) || bodies[b].bounding_radius() < cell_size) {
        Some(body) => {
            Err(StokesError::Unresolved { body, radius: bodies[body].bounding_radius(), cell_size })
        }
        None => Ok(()),
    }
}

fn check(params: &FlowParams) -> Result<(), StokesError> {
    let wrong = |name, value, wanted| Err(StokesError::Parameter { name, value, wanted });
    if !(params.viscosity > 0.0 && params.viscosity.is_finite()) {
        return wrong("viscosity", params.viscosity, "must be positive and finite");
    }
    if !(params.tolerance > 0.0 && params.tolerance < 1.0) {
        return wrong("tolerance", params.tolerance, "must lie between 0 and 1");
    }
    match params.formulation {
        Formulation::RigidDofs { offset, .. } if !(-1.0..=1.0).contains(&offset) => {
            wrong("offset", offset, "must lie between -1 and 1 cells")
        }
        Formulation::Paper(p) if !(p.viscosity_ratio > 1.0 && p.viscosity_ratio.is_finite()) => {
            wrong("viscosity_ratio", p.viscosity_ratio, "must be larger than 1 and finite")
        }
        Formulation::Paper(p) if !(p.rho > 0.0 && p.rho < 4.0) => {
            wrong("rho", p.rho, "must lie between 0 and 4")
        }
        Formulation::Paper(p) if !(p.ramp > 0.0 && p.ramp.is_finite()) => {
            wrong("ramp", p.ramp, "must be positive")
        }
        Formulation::Paper(p) if p.quadrature == 0 => wrong("quadrature", 0.0, "must be at least 1"),
        Formulation::Paper(p) if p.uzawa_steps == 0 => wrong("uzawa_steps", 0.0, "must be at least 1"),
        _ => Ok(()),
    }
}
