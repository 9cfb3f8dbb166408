//! The matrix `T` that approximates the Schur complement: the mass of the pressures over the viscosity, with
//! their weights.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_linalg::{Jagged, Pattern, SparseMatrix};
use rayon::prelude::*;

use super::cells::PressureMatrices;
use super::weights::scale_by_weights;
use crate::error::StokesError;
use crate::operator::{Elements, StokesSystem};
use crate::space::pressure_expansion;
use crate::surface::SurfaceCoupling;

/// The share of own cells in `T`: the pressure mass matrix over twice the viscosity, or [`PressureMatrices`]
/// in its place, scaled by the weights of the pressures. All ranks call this.
pub fn pressure_matrix<const D: usize>(
    elements: &Elements<'_, D>,
    viscosity: f64,
) -> Result<SparseMatrix, StokesError> {
    let matrices = PressureMatrices::new(elements, viscosity);
    let mass = matrices
        .map_err(StokesError::from)
        .and_then(|matrices| Ok((pressure_mass(elements.system(), &matrices)?, matrices)));
    let (mut mass, matrices) = elements.system().discretisation().agreed(mass)?;
    scale_by_weights(&mut mass, elements, &matrices);
    mass.values_mut().iter_mut().for_each(|m| *m *= 0.5);
    Ok(mass)
}

/// The sum of the own cells' pressure matrices on free pressure nodes; other rows hold a one.
pub fn pressure_mass<const D: usize>(
    system: &StokesSystem<D>,
    matrices: &PressureMatrices,
) -> Result<SparseMatrix, StokesError> {
    let (nodes, expansion) = (&system.discretisation().pressure, pressure_expansion(&system.pressure));
    let sources = Sources::new(system, matrices);
    let unknowns = |at: usize| {
        let terms = nodes.cell(sources.cell(at)).iter().flat_map(|&q| expansion.terms(q as usize));
        terms.map(|term| term.0 as usize).collect::<Vec<_>>()
    };
    let groups: Vec<Vec<usize>> = (0..sources.len()).into_par_iter().map(unknowns).collect();
    let dim = system.pressure.dim();
    let mut mass = SparseMatrix::zeros(Arc::new(Pattern::from_groups(dim, &groups)?));
    let pairs = groups.iter().zip(0u32..).flat_map(|(group, at)| group.iter().map(move |&q| (q, at)));
    let touching = Jagged::grouped(dim, pairs);
    let add_to_row = |row: usize, columns: &[u32], values: &mut [f64]| {
        if !system.pressure.is_free(row) {
            columns
                .iter()
                .zip(&mut *values)
                .filter(|(c, _)| **c as usize == row)
                .for_each(|(_, v)| *v += 1.0);
        }
        let mut last = None;
        for &at in touching[row].iter().filter(|&&at| last.replace(at) != Some(at)) {
            let of_cell = nodes.cell(sources.cell(at as usize));
            let (scale, matrix) = sources.matrix(at as usize);
            for (i, &q) in of_cell.iter().enumerate() {
                let weight: f64 = weight_of(row, expansion.terms(q as usize));
                if weight == 0.0 {
                    continue;
                }
                for (j, &r) in of_cell.iter().enumerate() {
                    let value = weight * scale * matrix[i * of_cell.len() + j];
                    for &(column, share) in expansion.terms(r as usize) {
                        if let Ok(place) = columns.binary_search(&column) {
                            values[place] += share * value;
                        }
                    }
                }
            }
        }
    };
    mass.fill_rows(add_to_row);
    Ok(mass)
}

/// What an unknown counts in a sum of unknowns.
fn weight_of(unknown: usize, terms: &[(u32, f64)]) -> f64 {
    terms.iter().filter(|term| term.0 as usize == unknown).map(|term| term.1).sum()
}

/// The cells whose matrices are added up: those of the fluid, then those that surfaces cut.
struct Sources<'a, const D: usize> {
    system: &'a StokesSystem<D>,
    matrices: &'a PressureMatrices,
    /// Own cells among those of the system.
    fluid: Vec<usize>,
    /// The own cut cells with their matrices, row by row.
    of_cut: Vec<(usize, Vec<f64>)>,
}

impl<'a, const D: usize> Sources<'a, D> {
    fn new(system: &'a StokesSystem<D>, matrices: &'a PressureMatrices) -> Self {
        let m = ReferenceMatrices::<D>::PRESSURE;
        let is_own = |cell: u32| system.discretisation().is_own(cell as usize);
        let mass = |surfaces: &SurfaceCoupling<D>, place: usize| {
            let cell = surfaces.cut.cells[place].cell;
            let mut matrix = vec![0.0; m * m];
            is_own(cell).then(|| {
                surfaces.for_each_mass(place, |i, j, value| matrix[i * m + j] = value);
                (cell as usize, matrix)
            })
        };
        let of_cut = system.surfaces().map_or_else(Vec::new, |surfaces| {
            let places = (0..surfaces.cut.cells.len()).into_par_iter();
            places.filter_map(|place| mass(surfaces, place)).collect()
        });
        let fluid = (0..system.cells.len()).filter(|&index| is_own(system.cells[index].cell)).collect();
        Self { system, matrices, fluid, of_cut }
    }

    fn len(&self) -> usize {
        self.fluid.len() + self.of_cut.len()
    }

    fn cell(&self, at: usize) -> usize {
        match self.fluid.get(at) {
            Some(&index) => self.system.cells[index].cell as usize,
            None => self.of_cut[at - self.fluid.len()].0,
        }
    }

    /// The factor of a matrix, and the matrix.
    fn matrix(&self, at: usize) -> (f64, &[f64]) {
        match self.fluid.get(at) {
            Some(&index) => self.matrices.of(index),
            None => (1.0 / self.system.viscosity(), &self.of_cut[at - self.fluid.len()].1),
        }
    }
}
