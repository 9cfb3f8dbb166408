//! Several flows around the particles of a case where they are at time 0.

use gluey_motion::Configuration;
use gluey_stokes::Prepared;

use super::{FlowError, stokes_flow};
use crate::case::Case;

/// Sets up flows around the particles of a checked case at time 0: for mobilities and resistances.
///
/// # Errors
/// [`FlowError`] if the box cannot be meshed or a parameter is out of range.
pub fn prepared_flow<const D: usize>(case: &Case) -> Result<Prepared<'static, D>, FlowError> {
    let flow = stokes_flow::<D>(case)?;
    let balls = flow.suspension.balls(&Configuration::at(0.0, &case.start()));
    let mesh = flow.suspension.mesh(&balls)?;
    Ok(flow.solver.into_prepared(mesh, &balls)?)
}
