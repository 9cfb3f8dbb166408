//! Stokes flow around rigid bodies by a fictitious-domain Q2-Q1 finite-element method.
//!
//! `-div(2 eta eps(u)) + grad p = 0`, `div u = 0` in a box, with `u` a rigid motion `U + w x r` in each body
//! and no force or torque on any. [`Formulation`] names the two ways to impose rigidity.
//!
//! ```
//! use gluey_geom::{Aabb, Vector};
//! use gluey_levelset::Ball;
//! use gluey_stokes::{FlowParams, FlowSolver, Formulation, Refinement, SolverKind, WeakPressures};
//!
//! let disc = Ball::new(Vector::<2>::new(0.5, 0.7), 0.05);
//! let refinement = Refinement { coarsest: 3, surface: 6, band: 2.0, gap_fraction: 1.0, gap_levels: 9 };
//! let mesh = refinement.mesh(Aabb::unit(), [1, 1], [false; 2], &[disc])?;
//! let formulation = Formulation::RigidDofs { offset: -0.1, weak_pressures: WeakPressures::Aggregate };
//! let params = FlowParams { viscosity: 1.0, formulation, solver: SolverKind::Direct, tolerance: 1e-8 };
//! let mut solver = FlowSolver::<2>::new(params)?;
//! let flow = solver.solve(mesh, &[disc], &|x| Vector::<2>::new(x[1] - 0.5, 0.0))?;
//! assert!((flow.twists[0].velocity[0] - 0.2022).abs() < 1e-3);
//! # Ok::<(), gluey_stokes::StokesError>(())
//! ```
//!
//! Not for inertia, free surfaces or deformable bodies; bodies are balls, the domain is a box.

mod error;
mod flow;
mod formulation;
mod operator;
mod precondition;
mod solid;
mod solver;
mod space;

pub use error::{DiagonalError, SmallMatrix, StokesError};
pub use flow::{
    Flow, FlowParams, FlowSolver, NodalFields, PhaseTimes, Refinement, SolverKind, WarmStartError,
};
pub use formulation::{Formulation, PaperParams, ParticleVelocity, Problem, default_offset};
pub use gluey_fem::Evaluator;
pub use operator::{StokesSystem, SystemOperator};
pub use solid::{Penalty, PointMatrices, SolidRegion, SolidStress};
pub use solver::{DirectSolver, MultigridSolver, SaddleSolver, SolveReport};
pub use space::{
    ActiveCell, CellKind, Discretisation, PressureSpace, SolidNodes, VelocitySpace, WeakPressures, cell_kind,
    solid_nodes,
};
