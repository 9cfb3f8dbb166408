//! Mesh and parameters of the flow of a case.

use gluey_geom::Aabb;
use gluey_stokes::{FlowParams, Refinement, SolverKind};

use super::error::FlowError;
use crate::case::{Case, Formulation, Lubrication, Solver};

/// The root cells along each axis of a box, and the level of the surfaces.
pub(crate) fn tree<const D: usize>(case: &Case, domain: &Aabb<D>) -> Result<([u32; D], f64), FlowError> {
    let roots = case.root_cells().and_then(|roots| roots.try_into().ok());
    let uneven = || FlowError::Box { extent: domain.extent().iter().copied().collect() };
    roots.zip(case.surface_level()).ok_or_else(uneven)
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
pub(crate) fn lubrication(case: &Case) -> gluey_stokes::Lubrication {
    match case.lubrication() {
        Lubrication::Deficit => gluey_stokes::Lubrication::Deficit,
        Lubrication::None => gluey_stokes::Lubrication::None,
    }
}
