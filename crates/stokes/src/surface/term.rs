//! The cells that surfaces cut as a term of the operator.

use gluey_fem::ReferenceMatrices;
use gluey_fem::cut::ViscousMatrices;
use gluey_geom::{Dim, Matrix};
use gluey_linalg::Scalar;

use super::coupling::SurfaceCoupling;
use super::cut_cells::CellState;
use super::load::{add_load_of_cut_cells, forces_on_bodies};
use super::strain::add_load_of_strain;
use crate::term::{Force, Load, PieceMatrices, Product, Scratch, Term, piece_size};

impl<X: Scalar, const D: usize> Product<X, f64> for SurfaceCoupling<D> {
    fn add(&self, [x, p, _]: [&[X]; 3], [y, q, _]: [&mut [X]; 3], scratch: &mut Scratch<f64>) {
        self.add_by(&self.wide, [x, p], [y, q], scratch);
    }
}

impl<const D: usize> Product<f32, f32> for SurfaceCoupling<D> {
    fn add(&self, [x, p, _]: [&[f32]; 3], [y, q, _]: [&mut [f32]; 3], scratch: &mut Scratch<f32>) {
        self.add_by(&self.narrow, [x, p], [y, q], scratch);
    }
}

impl<const D: usize> Term<D> for SurfaceCoupling<D> {
    fn covers(&self, cell: usize) -> bool {
        self.cut.states[cell] != CellState::Fluid
    }

    fn pieces(&self) -> Box<dyn Iterator<Item = (usize, usize)> + '_> {
        Box::new(self.pieces.iter().map(|&(place, number)| {
            let cell = &self.cut.cells[place as usize];
            (cell.cell as usize, cell.bodies[number as usize] as usize)
        }))
    }

    /// The first piece of a cell has its fluid.
    fn fill(&self, piece: usize, compressibility: f64, matrix: &mut [f64]) {
        self.wide.matrix(piece, matrix);
        let (n, size) = (ReferenceMatrices::<D>::VELOCITY, piece_size::<D>());
        if let (place, 0) = self.pieces[piece] {
            self.for_each_mass(place as usize, |q, r, mass| {
                matrix[(n + q) * size + n + r] -= compressibility * mass;
            });
        }
    }

    fn viscous_matrices(&self) -> PieceMatrices<'_> {
        let mut with = ViscousMatrices::new(self.discretisation().mesh.shear());
        Box::new(move |piece, matrix| self.viscous_matrix(self.pieces[piece].0 as usize, &mut with, matrix))
    }

    fn add_twist_blocks(&self, blocks: &mut [f64]) {
        let size = Dim::<D>::RIGID.pow(2);
        let pieces = Term::pieces(self).enumerate();
        for (piece, (_, body)) in pieces.filter(|(_, (cell, _))| self.discretisation().is_own(*cell)) {
            self.add_twist_block(piece, &mut blocks[body * size..][..size]);
        }
    }

    fn add_force(&self, force: Force<'_, D>, load: &mut Load<D>) {
        let discretisation = self.discretisation();
        add_load_of_cut_cells(discretisation, &self.cut, force, &mut load.velocity);
        let forces = forces_on_bodies(discretisation, &self.cut, force, load.wrenches.len());
        load.wrenches.iter_mut().zip(forces).for_each(|(sum, own)| *sum = *sum + own);
    }

    fn add_strain(&self, strain: &Matrix<D>, load: &mut Load<D>, _: &mut [f64]) {
        add_load_of_strain(self, strain, load);
    }
}
