//! The Stokes operator of a mesh, its matrices for direct solvers, its diagonal and its restrictions.

mod assembly;
mod cells;
mod diagonal;
mod element;
mod halos;
mod pressure_forces;
mod restricted;
mod shared;
mod system;
mod viscous;

pub use assembly::{assemble_stokes, assemble_viscous, assemble_viscous_on, factorised};
pub use cells::{AddedViscosity, CellViscosities, CellVisitor, viscous_diagonal};
pub use diagonal::{BlockDiagonal, DiagonalSums, nodal_diagonal};
pub use element::{Elements, MatrixSource};
pub use halos::SystemHalos;
pub use pressure_forces::PressureForces;
pub use restricted::{CountedOperator, Restricted, acting, add_at, gather};
pub use shared::{OnOwned, Summed};
pub use system::{StokesSystem, SystemOperator};
pub use viscous::ViscousOperator;
