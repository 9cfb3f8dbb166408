//! The cells in which something flows.

use super::discretisation::Discretisation;
use super::marking::moves_as_one;
use super::velocity::VelocitySpace;

/// A cell that is not rigid.
#[derive(Clone, Copy, Debug)]
pub struct ActiveCell {
    /// Index in the mesh.
    pub cell: u32,
    /// `eta_f h^(D-2)`.
    pub viscous: f64,
    /// `h^(D-1)`.
    pub divergence: f64,
    /// `h^D`.
    pub volume: f64,
}

/// The cells that are not rigid.
pub fn active_cells<const D: usize>(space: &VelocitySpace<D>, viscosity: f64) -> Vec<ActiveCell> {
    let discretisation = space.discretisation();
    let nodes = |cell: &ActiveCell| discretisation.velocity.cell(cell.cell as usize).iter();
    let mut cells = all_cells(discretisation, viscosity);
    cells.retain(|cell| !moves_as_one(nodes(cell).map(|&n| space.body_of(n as usize))));
    cells
}

/// All cells of a mesh.
pub fn all_cells<const D: usize>(discretisation: &Discretisation<D>, viscosity: f64) -> Vec<ActiveCell> {
    let active = |cell: usize| {
        let h = discretisation.cell_size(cell);
        ActiveCell {
            cell: cell as u32,
            viscous: viscosity * h.powi(D as i32 - 2),
            divergence: h.powi(D as i32 - 1),
            volume: h.powi(D as i32),
        }
    };
    (0..discretisation.mesh.cell_count()).map(active).collect()
}

/// Those that are added up here.
pub fn own_cells<const D: usize>(
    discretisation: &Discretisation<D>,
    cells: &[ActiveCell],
) -> Vec<ActiveCell> {
    cells.iter().filter(|cell| discretisation.is_own(cell.cell as usize)).copied().collect()
}
