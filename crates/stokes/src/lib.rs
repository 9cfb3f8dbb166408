//! Stokes flow around rigid bodies by an unfitted Q2-Q1 finite-element method.
//!
//! `-div(2 eta eps(u)) + grad p = f`, `div u = 0` in a box, with `u` a rigid motion `U + w x r` in each body
//! and no force or torque on any but those of `f` and those given. [`Formulation`] names the ways to
//! impose rigidity.
//!
//! ```
//! use gluey_stokes::geom::{Aabb, Vector};
//! use gluey_stokes::levelset::Ball;
//! use gluey_stokes::{FlowParams, FlowSolver, Refinement};
//!
//! let disc = Ball::new(Vector::<2>::new(0.5, 0.7), 0.05);
//! let mesh = Refinement::to_level(6).mesh(Aabb::unit(), [1, 1], [false; 2], &[disc])?;
//! let mut solver = FlowSolver::<2>::new(FlowParams { tolerance: 1e-8, ..FlowParams::for_dimension(2) })?;
//! let flow = solver.solve(mesh, &[disc], &|x| Vector::<2>::new(x[1] - 0.5, 0.0))?;
//! assert!((flow.twists[0].velocity[0] - 0.202_200_6).abs() < 1e-5);
//! # Ok::<(), gluey_stokes::StokesError>(())
//! ```
//!
//! A program that only wants flows needs [`FlowSolver`], [`FlowParams`] and [`Refinement`]; [`Conditions`]
//! say what acts on the bodies, [`Prepared`] has their mobility and resistance. One that calls the linear
//! solvers itself builds a [`Problem`] and hands it to a [`SaddleSolver`].
//!
//! The rooms, lowest first; a room knows only those before it: errors, spaces of unknowns, films, surfaces,
//! operators, preconditioners, formulations of rigidity, solvers, flows, suspensions.
//!
//! Not for inertia, free surfaces or deformable bodies; bodies are balls, the domain is a box.

// Without it nothing takes up some of what a formulation may ask of the rooms below.
#![cfg_attr(not(feature = "paper"), allow(dead_code, unused_imports))]

mod dimension;
mod error;
mod film;
mod flow;
mod formulation;
mod operator;
pub mod part;
mod precondition;
mod solver;
mod space;
mod surface;
mod suspension;
mod term;

// A flow, or one after the other, and the meshes they are computed on.
pub use flow::{
    Conditions, Field, Flow, FlowParams, FlowSolver, Given, GivenOf, NodalFields, PhaseTimes, Prepared,
    RaisedPenalties, Refinement, Stress, WarmStartError,
};
// Near bodies and the films between them.
pub use film::{Film, FilmForce, Heights, Lubrication, Partner, films, thin_films};
// How rigidity is imposed.
pub use formulation::Formulation;
#[cfg(feature = "paper")]
pub use formulation::{PaperParams, ParticleVelocity, PointMatrices, SolidRegion};
// Why there is no flow.
pub use error::{DiagonalError, SmallMatrix, StokesError};
// What drives the particles of a suspension, and what its flow predicts.
pub use suspension::{Drive, NotDriven, Suspension};
// The linear system and its solvers.
pub use formulation::Problem;
pub use operator::{StokesSystem, SystemOperator};
pub use solver::{DirectSolver, MultigridSolver, SaddleSolver, SolveReport, SolverKind};
// The parts of the system: unknowns, planes that cut bodies flat.
pub use space::{
    Discretisation, PartBodies, PartNodes, Partition, PressureSpace, SolidNodes, VelocitySpace, solid_nodes,
};
pub use surface::{Flat, Flats};
// The crates whose types appear in this one.
pub use {
    gluey_fem as fem, gluey_geom as geom, gluey_levelset as levelset, gluey_linalg as linalg,
    gluey_motion as motion,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
