//! The unknowns: velocities with boundary, hanging and rigid nodes eliminated, pressures; the marking of
//! nodes and cells.

mod cells;
mod discretisation;
mod expansion;
mod marking;
mod pressure;
mod velocity;

pub use cells::{ActiveCell, active_cells, all_cells, own_cells};
pub use discretisation::Discretisation;
pub use expansion::{pressure_expansion, velocity_expansion};
pub use marking::{around_finest_cells, cells_touching, moves_as_one, nodes_of_cells_with, solid_nodes};
pub use pressure::PressureSpace;
pub use velocity::{SolidNodes, VelocitySpace};
