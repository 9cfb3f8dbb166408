//! Cut cells whose penalty is too small for a computed flow.
//!
//! Nitsche's form is `a(u, u) >= E - sum_K Q_K` with the strain energy `E = int 2 eta eps:eps` and
//! `Q_K = int_(G in K) |2 eta eps n|^2 / beta`: what the tractions on the surfaces may take of it. In a good
//! cell `Q_K <= E_K / factor`, by the eigenvalue of its polynomials. The nodes of a bad cell belong in part
//! to good cells other than its root, and what it takes of all of these together no eigenvalue of one
//! polynomial tells. The computed flow does: where a bad cell takes more than a quarter of the energy around
//! it, its penalty is raised until that would be an eighth, and the flow is computed anew.
//!
//! Of ten thousand flows around a hundred discs at an area fraction of 0.5, 1.3 cells in a radius, one in
//! fifty dissipated a tenth more or less than its stresses did work. In four of these looked into, one or two
//! cells took 0.7 to 2.2 of the energy around them and all others at most 0.15; in two flows in which nothing
//! was wrong none took more than 0.3.

use gluey_geom::Matrix;
use rayon::prelude::*;

use super::coupling::SurfaceCoupling;
use super::cut_cells::CellState;
use super::energy::StrainEnergy;

/// Share of the strain energy around it that a cell may take.
const MOST: f64 = 0.25;
/// Share that it takes after its penalty was raised, by the same flow.
const AFTERWARDS: f64 = 0.125;

/// A cut cell that takes too much of the strain energy around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakCell {
    /// Index in the whole mesh.
    pub cell: u32,
    /// Index in the mesh of the rank, if it has the cell.
    pub place: Option<u32>,
    /// The first body that cuts it.
    pub body: u32,
    /// The share that it takes; infinite where there is no energy around it.
    pub share: f64,
}

impl WeakCell {
    /// What its penalty has to be multiplied by.
    pub fn factor(&self) -> f64 {
        (self.share / AFTERWARDS).clamp(2.0, 64.0)
    }
}

/// The cells whose penalty is too small for this velocity, nodal values relative to a linear flow with this
/// strain; in the order of the mesh.
pub fn weak_cells<const D: usize>(
    surfaces: &SurfaceCoupling<D>,
    velocity: &[f64],
    strain: &Matrix<D>,
) -> Vec<WeakCell> {
    let (discretisation, cut) = (surfaces.discretisation(), &surfaces.cut);
    let energy = StrainEnergy::new(discretisation, cut);
    let mesh = &discretisation.mesh;
    // The part holds all cells around its own.
    let around = |cell: u32| -> f64 {
        let here = &mesh.cells()[cell as usize];
        let offset = |k: usize| std::array::from_fn(|d| (k / 3usize.pow(d as u32) % 3) as i32 - 1);
        let neighbours =
            (0..3usize.pow(D as u32)).filter_map(|k| mesh.find(&mesh.neighbour(here, &offset(k))?));
        neighbours.map(|neighbour| energy.in_cell(neighbour, velocity, strain)).sum()
    };
    let weak = |place: usize| -> Option<WeakCell> {
        let cell = cut.cells[place].cell;
        let taken = energy.at_surfaces(place, velocity, strain) / surfaces.penalty(place);
        // What is around a cell is no less than what is in it.
        if taken <= MOST * energy.in_cell(cell as usize, velocity, strain) {
            return None;
        }
        let share = taken / around(cell);
        let number = discretisation.cell_number(cell as usize) as u32;
        let body = cut.cells[place].bodies[0];
        (share > MOST).then_some(WeakCell { cell: number, place: Some(cell), body, share })
    };
    let is_bad = |place: &usize| {
        let cell = cut.cells[*place].cell as usize;
        cut.states[cell] == CellState::Bad && discretisation.is_own(cell)
    };
    (0..cut.cells.len()).into_par_iter().with_min_len(64).filter(is_bad).filter_map(weak).collect()
}
