//! The matrices on the pressures of single cells that make up the approximate Schur complement.

use gluey_fem::ReferenceMatrices;
use gluey_linalg::BlockError;

use crate::operator::Elements;
use crate::space::ActiveCell;

/// Matrices on the pressures of the active cells whose sum is close to twice the Schur complement.
pub struct PressureMatrices {
    /// Matrix of the unit cube at viscosity one.
    unit: Vec<f64>,
    /// Factor of that matrix in each cell.
    scales: Vec<f64>,
    /// Matrices of cells in which the viscosity varies; no entries where it does in none.
    own: Vec<Option<Vec<f64>>>,
}

impl PressureMatrices {
    /// Mass matrices over the viscosity; where it varies inside a cell, what stands for them.
    ///
    /// # Errors
    /// Those of [`crate::operator::AddedViscosity::pressure_matrices`].
    pub fn new<const D: usize>(elements: &Elements<'_, D>, viscosity: f64) -> Result<Self, BlockError> {
        let cells = elements.cells().iter().enumerate();
        let scale = |(index, cell): (usize, &ActiveCell)| {
            cell.volume * cell.viscous / (viscosity * elements.viscous(index).0)
        };
        let unit = ReferenceMatrices::<D>::new().pressure_mass.to_vec();
        let scales = cells.clone().map(scale).collect();
        let mut of_cells = cells.map(|cell| {
            let (viscous, own) = elements.viscous(cell.0);
            (viscous, cell.1.divergence, own)
        });
        let added = elements.system().added.as_ref();
        let own = added.map_or(Ok(Vec::new()), |added| added.pressure_matrices(&mut of_cells))?;
        Ok(Self { unit, scales, own })
    }

    /// Matrix of an active cell, and the factor it is to be multiplied by.
    pub fn of(&self, index: usize) -> (f64, &[f64]) {
        match self.own.get(index) {
            Some(Some(own)) => (1.0, own),
            _ => (self.scales[index], &self.unit),
        }
    }
}
