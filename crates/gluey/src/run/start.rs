//! The simulation that a case is.

use crate::case::Case;
use crate::simulation::{FlowIteration, Simulation, Sliding};
use gluey_contact::ContactModel;

/// A case at time 0.
pub(super) fn simulation<const D: usize, H, C>(
    case: &Case,
    hydrodynamics: H,
    contact: C,
) -> Simulation<D, H, C>
where
    H: gluey_motion::Hydrodynamics<D>,
    C: ContactModel<D>,
{
    let (scheme, dt) = (case.time.scheme, case.time.step);
    let mut simulation = Simulation::new(case.start(), scheme, dt, hydrodynamics, contact);
    let iteration = FlowIteration { tolerance: case.contact.flow_tolerance(), ..FlowIteration::default() };
    simulation = simulation.halving(case.time.halvings).iterating(iteration);
    if let Some(tolerance) = case.time.tolerance {
        simulation = simulation.within(tolerance);
    }
    if case.has_forces() {
        simulation = simulation.under_forces();
    }
    if let Some(law) = case.repulsion() {
        simulation = simulation.repelling(law, case.surroundings());
    }
    if !case.is_sheared() {
        return simulation;
    }
    let simulation = simulation.sheared(Sliding {
        rate: case.shear_rate,
        height: case.upper()[1] - case.lower()[1],
        stress_every: case.stress_every(),
    });
    if case.shear_stress.is_some() { simulation.at_given_stress() } else { simulation }
}
