//! Stokes flow around rigid bodies by a fictitious-domain Q2-Q1 finite-element method.
//!
//! `-div(2 eta eps(u)) + grad p = 0`, `div u = 0` in a box, with `u` a rigid motion `U + w x r` in each body and no
//! force or torque on any. See [`FlowSolver`] for the two formulations of rigidity.

mod assembly;
mod direct;
mod discretisation;
mod element;
mod error;
mod flow;
mod level;
mod multigrid;
mod pressure;
mod refine;
mod solid;
mod solver;
mod space;
mod system;
mod transfer;

pub use direct::DirectSolver;
pub use discretisation::{CellKind, Discretisation, cell_kind, solid_nodes};
pub use error::StokesError;
pub use flow::{Flow, FlowParams, FlowSolver, Formulation, PaperParams, SolverKind};
pub use multigrid::MultigridSolver;
pub use pressure::{PressureSpace, WeakPressures};
pub use refine::Refinement;
pub use solid::{PointMatrices, SolidRegion, SolidStress};
pub use solver::{Preparation, SaddleSolver};
pub use space::{SolidNodes, VelocitySpace};
pub use system::{ActiveCell, Penalty, StokesSystem, SystemOperator};
pub use transfer::Evaluator;
