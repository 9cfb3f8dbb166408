//! The matrix `T` that approximates the Schur complement: the mass of the pressures over the viscosity, with
//! their weights.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Dim, Space};
use gluey_linalg::{Pattern, SparseMatrix};

use super::cells::PressureMatrices;
use super::weights::scale_by_weights;
use crate::error::StokesError;
use crate::operator::{Elements, StokesSystem};
use crate::space::pressure_expansion;

/// `T`: the pressure mass matrix over twice the viscosity, or [`PressureMatrices`] in its place, scaled by
/// the weights of the pressures.
pub fn pressure_matrix<const D: usize>(
    elements: &Elements<'_, D>,
    viscosity: f64,
) -> Result<SparseMatrix, StokesError>
where
    Dim<D>: Space<D>,
{
    let matrices = PressureMatrices::new(elements, viscosity)?;
    let mut mass = pressure_mass(elements.system(), &matrices)?;
    scale_by_weights(&mut mass, elements, &matrices);
    mass.values_mut().iter_mut().for_each(|m| *m *= 0.5);
    Ok(mass)
}

/// The sum of the cells' pressure matrices on free pressure nodes; other rows hold a one.
pub fn pressure_mass<const D: usize>(
    system: &StokesSystem<D>,
    matrices: &PressureMatrices,
) -> Result<SparseMatrix, StokesError>
where
    Dim<D>: Space<D>,
{
    let discretisation = system.discretisation();
    let m = ReferenceMatrices::<D>::PRESSURE;
    let expansion = pressure_expansion(&system.pressure);
    let unknowns = |cell: u32| {
        let nodes = discretisation.pressure.cell(cell as usize).iter();
        nodes.flat_map(|&q| expansion.terms(q as usize)).map(|term| term.0 as usize).collect::<Vec<_>>()
    };
    let cut = || system.surfaces.iter().flat_map(|surfaces| surfaces.cut.cells.iter());
    let mesh_cells = system.cells.iter().map(|c| c.cell).chain(cut().map(|c| c.cell));
    let groups: Vec<Vec<usize>> = mesh_cells.map(unknowns).collect();
    let mut mass = SparseMatrix::zeros(Arc::new(Pattern::from_groups(system.pressure.dim(), &groups)?));
    drop(groups);
    for (index, c) in system.cells.iter().enumerate() {
        let nodes = discretisation.pressure.cell(c.cell as usize);
        let (scale, matrix) = matrices.of(index);
        for (i, &row) in nodes.iter().enumerate() {
            for (j, &column) in nodes.iter().enumerate() {
                let value = scale * matrix[i * m + j];
                for &(r, wr) in expansion.terms(row as usize) {
                    for &(c, wc) in expansion.terms(column as usize) {
                        mass.add(r as usize, c as usize, wr * wc * value)?;
                    }
                }
            }
        }
    }
    for (place, cell) in cut().enumerate() {
        let nodes = discretisation.pressure.cell(cell.cell as usize);
        let Some(surfaces) = &system.surfaces else { continue };
        let mut added = Ok(());
        surfaces.for_each_mass(place, |i, j, value| {
            let value = value / system.viscosity();
            for &(r, wr) in expansion.terms(nodes[i] as usize) {
                for &(c, wc) in expansion.terms(nodes[j] as usize) {
                    added = added.and(mass.add(r as usize, c as usize, wr * wc * value));
                }
            }
        });
        added?;
    }
    for q in (0..system.pressure.dim()).filter(|&q| !system.pressure.is_free(q)) {
        mass.add(q, q, 1.0)?;
    }
    Ok(mass)
}
