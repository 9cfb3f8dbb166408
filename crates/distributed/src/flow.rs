//! A flow in a box that ranks share.

use gluey_geom::Vector;
use gluey_parallel::Traffic;
use gluey_stokes::part::LevelSizes;
use gluey_stokes::{Flow, FlowParams, Formulation, Lubrication, RaisedPenalties, SolverKind};

/// A fluid, and how well its flow is to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxFlow {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Largest residual, as a fraction of that of a fluid at rest.
    pub tolerance: f64,
    /// Give up after so many.
    pub max_iterations: usize,
}

impl BoxFlow {
    /// Those of one process with this treatment of films that are too thin for the mesh.
    pub fn params(&self, lubrication: Lubrication) -> FlowParams {
        FlowParams {
            viscosity: self.viscosity,
            formulation: Formulation::Unfitted { lubrication },
            solver: SolverKind::Multigrid,
            tolerance: self.tolerance,
        }
    }
}

/// A flow on the part of one rank, right at the nodes of its own cells; twists, wrenches, means and stresses
/// are the same on all ranks. Velocities and pressures at the nodes that ranks own, in the order of the
/// ranks, are those at all nodes in the order of one process.
#[derive(Clone, Debug)]
pub struct LocalFlow<const D: usize> {
    /// The flow.
    pub flow: Flow<D>,
    /// How penalties were changed for it.
    pub raised_penalties: RaisedPenalties,
    /// What the rank holds, coarsest level first.
    pub levels: Vec<LevelSizes>,
    /// What it sent beside the solves.
    pub setup_traffic: Traffic,
}

impl<const D: usize> LocalFlow<D> {
    /// Places of the velocity nodes that the rank owns.
    pub fn points(&self) -> Vec<Vector<D>> {
        let mesh = &self.flow.discretisation;
        mesh.own_nodes().map(|node| mesh.velocity.point(node)).collect()
    }

    /// Velocities at them.
    pub fn velocity(&self) -> Vec<Vector<D>> {
        let own = &self.flow.velocity.as_chunks::<D>().0[self.flow.discretisation.own_nodes()];
        own.iter().map(|&u| u.into()).collect()
    }

    /// Pressures at the pressure nodes that the rank owns.
    pub fn pressure(&self) -> &[f64] {
        &self.flow.pressure[self.flow.discretisation.own_pressure_nodes()]
    }
}
