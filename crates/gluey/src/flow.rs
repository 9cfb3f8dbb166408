//! The finite-element flow as [`Hydrodynamics`]: particles in, velocities out.
//!
//! Each prediction builds a mesh that is fine at the surfaces, solves the Stokes problem of a
//! [`Suspension`], and reads off the twists.

mod error;
mod estimate;
mod params;
mod prepared;

use std::time::Instant;

use gluey_contact::TwistMobility;
use gluey_geom::Vector;
use gluey_levelset::Ball;
use gluey_motion::{Configuration, Fields, Film, Hydrodynamics, NextLoads, Prediction, ResumeError};
use gluey_stokes::{Flow, FlowParams, FlowSolver, NodalFields, Suspension};
use serde::{Deserialize, Serialize};

use crate::case::Case;

pub(crate) use params::{flow_params, refinement, suspension};

pub use error::FlowError;
pub use estimate::{MeshEstimate, MeshSize};
pub use prepared::prepared_flow;

/// Flows that the next prediction starts from, for checkpoints.
#[derive(Serialize, Deserialize)]
struct StoredFlows<const D: usize> {
    centers: Vec<Vector<D>>,
    strain: f64,
    last: SavedFields,
    before: Option<SavedFields>,
}

/// [`NodalFields`] as they are stored.
#[derive(Serialize, Deserialize)]
struct SavedFields {
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    bodies: Vec<f64>,
    films: Vec<f64>,
}

impl From<NodalFields> for SavedFields {
    fn from(NodalFields { velocity, pressure, bodies, films }: NodalFields) -> Self {
        Self { velocity, pressure, bodies, films }
    }
}

impl From<SavedFields> for NodalFields {
    fn from(SavedFields { velocity, pressure, bodies, films }: SavedFields) -> Self {
        Self { velocity, pressure, bodies, films }
    }
}

/// Finite-element flow around the particles of a case.
pub struct StokesFlow<const D: usize> {
    suspension: Suspension<D>,
    params: FlowParams,
    solver: FlowSolver<D>,
    last: Option<Last<D>>,
    /// Where the particles were and how images were sheared in the flow that the next one starts from.
    places: Vec<Vector<D>>,
    strain: f64,
}

/// The last flow, in the box.
struct Last<const D: usize> {
    flow: Flow<D>,
    balls: Vec<Ball<D>>,
    shear_factor: f64,
}

/// Sets up the finite-element flow of a checked case.
///
/// # Errors
/// [`FlowError`] if the box cannot be meshed or a parameter is out of range.
pub fn stokes_flow<const D: usize>(case: &Case) -> Result<StokesFlow<D>, FlowError> {
    let (suspension, params) = (suspension(case)?, flow_params::<D>(case));
    let solver = FlowSolver::new(params)?;
    Ok(StokesFlow { suspension, params, solver, last: None, places: Vec::new(), strain: 0.0 })
}

impl<const D: usize> Hydrodynamics<D> for StokesFlow<D> {
    type Error = FlowError;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, FlowError> {
        self.predict_with_contacts(configuration, &mut |_| None)
    }

    fn predict_with_contacts(
        &mut self,
        configuration: &Configuration<'_, D>,
        next: &mut NextLoads<'_, D>,
    ) -> Result<Prediction<D>, FlowError> {
        let Self { suspension, solver, .. } = self;
        let (balls, start) = (suspension.balls(configuration), Instant::now());
        let mesh = solver.discretised(suspension.mesh(&balls)?);
        let meshed = start.elapsed().as_secs_f64();
        let (mut flow, prediction) = solver.predict::<FlowError>(&mesh, suspension, configuration, next)?;
        flow.times.assembly += meshed;
        let statistics = flow.statistics(solver.take_raised_penalties());
        self.places = configuration.particles.iter().map(|particle| particle.pose.position).collect();
        self.strain = configuration.strain;
        self.last = Some(Last { flow, balls, shear_factor: configuration.shear_factor });
        Ok(Prediction { statistics, ..prediction })
    }

    fn near_mobility(
        &self,
        configuration: &Configuration<'_, D>,
    ) -> Result<Option<Box<dyn TwistMobility<D>>>, FlowError> {
        let mobility = self.suspension.near_mobility(configuration, self.params.viscosity)?;
        Ok(Some(Box::new(mobility)))
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn films(&self, configuration: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        self.suspension.films(configuration, reach)
    }

    fn fields(&self) -> Option<Fields<D>> {
        let Last { flow, balls, shear_factor } = self.last.as_ref()?;
        let fields = flow.fields(balls, &self.params);
        Some(self.suspension.in_space(fields, flow.discretisation.mesh.shear(), *shear_factor))
    }

    fn checkpoint(&self) -> Result<Vec<u8>, FlowError> {
        let Some((last, before)) = self.solver.warm_start() else { return Ok(Vec::new()) };
        let (centers, strain) = (self.places.clone(), self.strain);
        let state = StoredFlows {
            centers,
            strain,
            last: last.clone().into(),
            before: before.cloned().map(Into::into),
        };
        Ok(postcard::to_allocvec(&state)?)
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), ResumeError<FlowError>> {
        if state.is_empty() {
            return Ok(());
        }
        let StoredFlows { centers, strain, last, before } =
            postcard::from_bytes(state).map_err(FlowError::from)?;
        let (saved, present) = (centers.len(), self.suspension.radii.len());
        if saved != present {
            return Err(FlowError::Particles { saved, present }.into());
        }
        let particles = self.suspension.particles(&centers);
        let balls = self.suspension.balls(&Configuration { strain, ..Configuration::at(0.0, &particles) });
        let mesh = self.suspension.mesh(&balls).map_err(FlowError::from)?;
        self.solver.set_warm_start(mesh, last.into(), before.map(Into::into)).map_err(FlowError::from)?;
        (self.places, self.strain) = (centers, strain);
        Ok(())
    }
}
