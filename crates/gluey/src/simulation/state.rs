//! What a simulation needs to go on.

use gluey_contact::{ContactState, FilmMemory};
use gluey_geom::Particle;
use gluey_motion::{ErrorEstimate, Integrator};

use super::strain_clock::StrainClock;

/// Everything a simulation needs to go on as if it had never stopped.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(bound = "")]
pub struct SimulationState<const D: usize> {
    /// Steps done.
    pub step: usize,
    /// Whether the shear is reversed.
    pub reversed: bool,
    /// Shear strain of the periodic images, where they slide.
    pub strain: f64,
    /// Time, where steps are those of the strain.
    pub clock: Option<StrainClock>,
    /// Particles.
    pub particles: Vec<Particle<D>>,
    /// Velocity history.
    pub integrator: Integrator<D>,
    /// What errors of steps are estimated from.
    pub estimate: ErrorEstimate<D>,
    /// Memory of films.
    pub films: FilmMemory,
    /// Forces by which particles repelled each other, where no contact in the flow has them.
    pub repelling: ContactState,
    /// Memory of the contact model.
    pub contact: ContactState,
    /// Warm start of the flow, as [`gluey_motion::Hydrodynamics::checkpoint`] gave it.
    pub hydrodynamics: Vec<u8>,
}
