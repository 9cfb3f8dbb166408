//! The unknowns: velocities with boundary, hanging and rigid nodes eliminated, pressures; the marking of
//! nodes and cells.

mod body_numbers;
mod cells;
mod discretisation;
mod expansion;
mod marking;
mod part_nodes;
mod partition;
mod pressure;
mod velocity;

use gluey_linalg::vector;
use gluey_parallel::Halo;

pub use cells::{ActiveCell, active_cells, all_cells, own_cells};
pub use discretisation::{Discretisation, finest_levels};
pub use expansion::{pressure_expansion, velocity_expansion};
pub use marking::{around_finest_cells, cells_touching, moves_as_one, nodes_of_cells_with, solid_nodes};
pub use part_nodes::PartNodes;
pub use partition::{PartBodies, Partition, owner_of_point};
pub use pressure::PressureSpace;
pub use velocity::{SolidNodes, VelocitySpace};

/// The Euclidean norm over all ranks of a vector that holds the same at ghosts as at their owners.
pub fn norm(halo: &Halo, x: &[f64]) -> f64 {
    let mut square = [halo.owned(x).map(|own| vector::dot(own, own)).sum()];
    halo.sum_over_ranks(&mut square);
    square[0].sqrt()
}
