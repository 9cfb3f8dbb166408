//! The true surfaces of bodies in a mesh that does not fit them: cut cells, aggregates, Nitsche's penalty and
//! the operator of all that.

mod aggregates;
mod coupling;
mod cut_cells;
mod energy;
mod film_flux;
mod flats;
mod load;
mod penalty;
mod shapes;
mod strain;
mod term;
mod traction;
mod weak;

pub use aggregates::Aggregates;
pub use coupling::SurfaceCoupling;
pub use cut_cells::{CellState, CutCell, CutCells};
pub use energy::StrainEnergy;
pub use film_flux::flows_through_films;
pub use flats::{Flat, Flats};
pub use penalty::PenaltyFactor;
pub use traction::first_moments;
pub use weak::{WeakCell, weak_cells};
