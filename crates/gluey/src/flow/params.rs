//! Mesh and parameters of the flow of a case.

use gluey_geom::{Aabb, Vector};
use gluey_stokes::{FlowParams, Refinement, SolverKind, Suspension};

use super::error::FlowError;
use crate::case::{Case, Formulation, Lubrication, Solver};

/// The particles of a checked case in their flow.
///
/// # Errors
/// [`FlowError::Box`] if it has no mesh.
pub(crate) fn suspension<const D: usize>(case: &Case) -> Result<Suspension<D>, FlowError> {
    let corner = |x: Vec<f64>| Vector::<D>::from_fn(|d, _| x[d]);
    let domain = Aabb { lower: corner(case.lower()), upper: corner(case.upper()) };
    let roots = case.root_cells().and_then(|roots| roots.try_into().ok());
    let uneven = || FlowError::Box { extent: domain.extent().iter().copied().collect() };
    let (roots, level) = roots.zip(case.surface_level()).ok_or_else(uneven)?;
    Ok(Suspension {
        domain,
        roots,
        periods: std::array::from_fn(|axis| case.period(axis)),
        refinement: refinement(case, level),
        lubrication: lubrication(case),
        radii: case.particles.iter().map(|particle| particle.radius).collect(),
        wrenches: case.wrenches(),
        given: case.given_twists(),
        force_density: case.force_density(),
        shear_rate: case.shear_rate,
        shear_stress: case.shear_stress,
    })
}

/// Refinement of the mesh of a checked case, whose surfaces are at `level`.
pub(crate) fn refinement(case: &Case, level: f64) -> Refinement {
    let surface = level as u8;
    Refinement {
        coarsest: case.coarsest_level().min(u32::from(surface)) as u8,
        surface,
        band: case.flow.mesh.band,
    }
}

/// Parameters of the flow of a checked case.
pub(crate) fn flow_params<const D: usize>(case: &Case) -> FlowParams {
    let flow = &case.flow;
    let formulation = match flow.formulation {
        Formulation::Paper => gluey_stokes::Formulation::Paper(flow.paper.params()),
        Formulation::Unfitted => gluey_stokes::Formulation::Unfitted { lubrication: lubrication(case) },
    };
    let solver = match flow.solver {
        Solver::Direct => SolverKind::Direct,
        Solver::Multigrid => SolverKind::Multigrid,
        Solver::Auto if D == 2 => SolverKind::Direct,
        Solver::Auto => SolverKind::Multigrid,
    };
    FlowParams { viscosity: 1.0, formulation, solver, tolerance: flow.tolerance }
}

/// Treatment of films that are too thin for the mesh.
fn lubrication(case: &Case) -> gluey_stokes::Lubrication {
    match case.lubrication() {
        Lubrication::Deficit => gluey_stokes::Lubrication::Deficit,
        Lubrication::None => gluey_stokes::Lubrication::None,
    }
}
