//! Mesh and parameters of the flow of a case.

use gluey_geom::Aabb;
use gluey_stokes::{CutCellPressures, FlowParams, Refinement, SolverKind};

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
    let (mesh, rigid_dofs) = (&case.flow.mesh, &case.flow.rigid_dofs);
    let surface = level as u8;
    let rigid = case.flow.formulation == Formulation::RigidDofs;
    let levels_left = case.finest_level().unwrap_or(0).saturating_sub(u32::from(surface));
    Refinement {
        coarsest: case.coarsest_level().min(u32::from(surface)) as u8,
        surface,
        band: mesh.band,
        gap_fraction: if rigid { rigid_dofs.gap_fraction } else { 0.0 },
        gap_levels: case.gap_levels().min(levels_left) as u8,
    }
}

/// Parameters of the flow of a checked case.
pub(crate) fn flow_params<const D: usize>(case: &Case) -> FlowParams {
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
