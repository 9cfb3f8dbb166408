//! The true surfaces of bodies in a mesh that does not fit them: cut cells, aggregates, Nitsche's penalty and
//! the operator of all that.

mod aggregates;
mod coupling;
mod cut_cells;
mod flats;
mod load;
mod penalty;
mod shapes;
mod strain;
mod traction;

pub use aggregates::Aggregates;
pub use coupling::{SurfaceCoupling, SurfaceWorkspace};
pub use cut_cells::{CellState, CutCells};
pub use flats::{Flat, Flats};
pub use load::{add_load_of_cut_cells, forces_on_bodies};
pub use shapes::slope;
pub use strain::load_of_strain;
pub use traction::first_moments;
