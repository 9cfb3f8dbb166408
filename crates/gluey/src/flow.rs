//! The finite-element flow as [`Hydrodynamics`]: particles in, velocities out.
//!
//! Each prediction builds a mesh that is fine at the surfaces (and, in `rigid-dofs`, in narrow gaps), solves
//! the Stokes problem of `gluey-stokes` in the undisturbed shear `gamma_dot (y - y_mid) e_x` and under the
//! forces and torques of the case, and reads off the twists.

mod estimate;
mod fields;

use std::time::Instant;

use gluey_fem::{MeshError, TreeMesh};
use gluey_geom::{Aabb, Dim, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Fields, Film, FlowStatistics, Hydrodynamics, ResumeError};
use gluey_stokes::{
    Conditions, CutCellPressures, Flow, FlowParams, FlowSolver, NodalFields, PhaseTimes, Refinement,
    SolverKind, StokesError, WarmStartError,
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::case::{Case, Formulation, Lubrication, Solver};

pub use estimate::MeshEstimate;

/// Why the finite-element flow failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FlowError {
    /// In mesh, assembly or solution.
    #[error(transparent)]
    Stokes(#[from] StokesError),
    /// The box is not made of cubes.
    #[error(
        "[domain]: a box of {extent:?} is not a small number of cubes; make the ratios of its edges simple, such as 2:1"
    )]
    Box {
        /// Edge lengths.
        extent: Vec<f64>,
    },
    /// What the next prediction starts from could not be turned into bytes or back.
    #[error("the flow to start from cannot be stored or read")]
    Stored(#[from] postcard::Error),
    /// A flow to start from that is of other particles.
    #[error("the flow to start from is one around {saved} particles, not {present}")]
    Particles {
        /// Particles of the stored flow.
        saved: usize,
        /// Particles here.
        present: usize,
    },
    /// A flow to start from that is of another mesh.
    #[error(transparent)]
    WarmStart(#[from] WarmStartError),
}

impl From<MeshError> for FlowError {
    fn from(error: MeshError) -> Self {
        Self::Stokes(error.into())
    }
}

/// Flows that the next prediction starts from, for checkpoints.
#[derive(Serialize, Deserialize)]
struct WarmStart<const D: usize> {
    centers: Vec<Vector<D>>,
    last: SavedFields,
    before: Option<SavedFields>,
}

/// [`NodalFields`] as they are stored.
#[derive(Serialize, Deserialize)]
struct SavedFields {
    velocity: Vec<f64>,
    pressure: Vec<f64>,
}

impl From<NodalFields> for SavedFields {
    fn from(NodalFields { velocity, pressure }: NodalFields) -> Self {
        Self { velocity, pressure }
    }
}

impl From<SavedFields> for NodalFields {
    fn from(SavedFields { velocity, pressure }: SavedFields) -> Self {
        Self { velocity, pressure }
    }
}

/// Finite-element flow around the particles of a case.
pub struct StokesFlow<const D: usize>
where
    Dim<D>: Space<D>,
{
    solver: FlowSolver<D>,
    params: FlowParams,
    refinement: Refinement,
    domain: Aabb<D>,
    roots: [u32; D],
    periods: [Option<f64>; D],
    shear_rate: f64,
    shear_factor: f64,
    /// Whether lubrication keeps particles apart.
    keeps_films_open: bool,
    radii: Vec<f64>,
    /// Forces and torques on the particles; empty if there are none.
    wrenches: Vec<Wrench<D>>,
    last: Option<Flow<D>>,
    last_balls: Vec<Ball<D>>,
}

/// Sets up the finite-element flow of a checked case.
///
/// # Errors
/// [`FlowError`] if the box cannot be meshed or a parameter is out of range.
pub fn stokes_flow<const D: usize>(case: &Case) -> Result<StokesFlow<D>, FlowError>
where
    Dim<D>: Space<D>,
{
    let corner = |x: Vec<f64>| Vector::<D>::from_fn(|d, _| x[d]);
    let domain = Aabb { lower: corner(case.lower()), upper: corner(case.upper()) };
    let (roots, level) = tree(case, &domain)?;
    let radii: Vec<f64> = case.particles.iter().map(|p| p.radius).collect();
    let params = flow_params::<D>(case);
    Ok(StokesFlow {
        solver: FlowSolver::new(params)?,
        params,
        refinement: refinement(case, level),
        domain,
        roots,
        periods: std::array::from_fn(|axis| case.period(axis)),
        shear_rate: case.shear_rate,
        shear_factor: 1.0,
        keeps_films_open: case.lubrication() == Lubrication::Deficit,
        radii,
        wrenches: case.wrenches(),
        last: None,
        last_balls: Vec::new(),
    })
}

impl<const D: usize> StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    fn balls(&self, centers: impl Iterator<Item = Vector<D>>) -> Vec<Ball<D>> {
        let ball = |(center, &radius)| Ball::periodic(center, radius, self.periods);
        centers.zip(&self.radii).map(ball).collect()
    }

    fn mesh(&self, balls: &[Ball<D>]) -> Result<TreeMesh<D>, FlowError> {
        let periodic = self.periods.map(|period| period.is_some());
        Ok(self.refinement.mesh(self.domain, self.roots, periodic, balls)?)
    }
}

impl<const D: usize> Hydrodynamics<D> for StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    type Error = FlowError;

    fn predict(
        &mut self,
        _t: f64,
        particles: &[Particle<D>],
        twists: &mut [Twist<D>],
    ) -> Result<(), FlowError> {
        let balls = self.balls(particles.iter().map(|p| p.pose.position));
        let start = Instant::now();
        let mesh = self.mesh(&balls)?;
        let meshed = start.elapsed().as_secs_f64();
        let middle = self.domain.center()[1];
        let rate = self.shear_rate * self.shear_factor;
        let shear = move |x: &Vector<D>| {
            let mut u = Vector::zeros();
            u[0] = rate * (x[1] - middle);
            u
        };
        let conditions = Conditions::boundary(&shear).with_wrenches(&self.wrenches);
        let mut flow = self.solver.solve_under(mesh, &balls, &conditions)?;
        flow.times.assembly += meshed;
        twists.copy_from_slice(&flow.twists);
        self.last = Some(flow);
        self.last_balls = balls;
        Ok(())
    }

    fn set_shear_factor(&mut self, factor: f64) {
        self.shear_factor = factor;
    }

    fn films(&self, reach: f64) -> Vec<Film<D>> {
        if !self.keeps_films_open {
            return Vec::new();
        }
        let films = gluey_stokes::films(&self.last_balls, &self.domain, reach);
        let film = |film: gluey_stokes::Film<D>| Film {
            first: film.body as usize,
            second: film.side(1),
            branch: film.branch(),
            slide: Vector::zeros(),
            gap: film.gap,
            curvature_radius: film.curvature_radius(),
        };
        films.into_iter().map(film).collect()
    }

    fn statistics(&self) -> FlowStatistics {
        let Some(flow) = &self.last else { return FlowStatistics::default() };
        let PhaseTimes { assembly, preparation, solve } = flow.times;
        FlowStatistics {
            cell_count: flow.discretisation.mesh.cell_count(),
            dof_count: flow.discretisation.dof_count(),
            solve_count: flow.solve_count,
            iteration_count: flow.iteration_count,
            phases: vec![("mesh and assembly", assembly), ("solver set-up", preparation), ("solve", solve)],
        }
    }

    fn fields(&self) -> Option<Fields<D>> {
        let flow = self.last.as_ref()?;
        Some(fields::fields(flow, &self.last_balls, &self.params))
    }

    fn checkpoint(&self) -> Result<Vec<u8>, FlowError> {
        let Some((last, before)) = self.solver.warm_start() else { return Ok(Vec::new()) };
        let centers = self.last_balls.iter().map(|b| *b.center()).collect();
        let state = WarmStart { centers, last: last.clone().into(), before: before.cloned().map(Into::into) };
        Ok(postcard::to_allocvec(&state)?)
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), ResumeError<FlowError>> {
        if state.is_empty() {
            return Ok(());
        }
        let WarmStart { centers, last, before } = postcard::from_bytes(state).map_err(FlowError::from)?;
        let (saved, present) = (centers.len(), self.radii.len());
        if saved != present {
            return Err(FlowError::Particles { saved, present }.into());
        }
        let balls = self.balls(centers.into_iter());
        let mesh = self.mesh(&balls)?;
        self.solver.set_warm_start(mesh, last.into(), before.map(Into::into)).map_err(FlowError::from)?;
        self.last_balls = balls;
        Ok(())
    }
}

/// The root cells along each axis of a box, and the level of the surfaces.
fn tree<const D: usize>(case: &Case, domain: &Aabb<D>) -> Result<([u32; D], f64), FlowError> {
    let roots = case.root_cells().and_then(|roots| roots.try_into().ok());
    let uneven = || FlowError::Box { extent: domain.extent().iter().copied().collect() };
    roots.zip(case.surface_level()).ok_or_else(uneven)
}

/// Refinement of the mesh of a checked case, whose surfaces are at `level`.
fn refinement(case: &Case, level: f64) -> Refinement {
    let (mesh, rigid_dofs) = (&case.flow.mesh, &case.flow.rigid_dofs);
    let surface = level as u8;
    let rigid = case.flow.formulation == Formulation::RigidDofs;
    let levels_left = case.finest_level().unwrap_or(0).saturating_sub(u32::from(surface));
    Refinement {
        coarsest: mesh.coarsest_level.min(u32::from(surface)) as u8,
        surface,
        band: mesh.band,
        gap_fraction: if rigid { rigid_dofs.gap_fraction } else { 0.0 },
        gap_levels: case.gap_levels().min(levels_left) as u8,
    }
}

fn flow_params<const D: usize>(case: &Case) -> FlowParams {
    let flow = &case.flow;
    let formulation = match flow.formulation {
        Formulation::RigidDofs => gluey_stokes::Formulation::RigidDofs {
            offset: case.rigid_offset(),
            cut_cell_pressures: CutCellPressures::Aggregate,
        },
        Formulation::Paper => gluey_stokes::Formulation::Paper(flow.paper.params()),
        Formulation::Unfitted => gluey_stokes::Formulation::Unfitted {
            lubrication: match case.lubrication() {
                Lubrication::Deficit => gluey_stokes::Lubrication::Deficit,
                Lubrication::None => gluey_stokes::Lubrication::None,
            },
        },
    };
    let solver = match flow.solver {
        Solver::Direct => SolverKind::Direct,
        Solver::Multigrid => SolverKind::Multigrid,
        Solver::Auto if D == 2 => SolverKind::Direct,
        Solver::Auto => SolverKind::Multigrid,
    };
    FlowParams { viscosity: 1.0, formulation, solver, tolerance: flow.tolerance }
}
