//! Element matrices of the Stokes system: the viscous one, or the whole saddle.

use gluey_fem::ReferenceMatrices;

use super::system::StokesSystem;
use crate::space::ActiveCell;
use crate::term::PieceMatrices;

/// Relative artificial compressibility added to the factorised matrix: enough to make pressures that act on
/// no velocity harmless. The solve corrects it.
const COMPRESSIBILITY: f64 = 1e-9;

/// A cell or a piece that has a matrix: its place among its kind, its cell in the mesh, and for the pieces of
/// terms the body.
#[derive(Clone, Copy, Debug)]
pub enum MatrixSource {
    /// An active cell that no term covers.
    Cell {
        /// Place among the active cells.
        index: usize,
        /// Index in the mesh.
        cell: usize,
    },
    /// A piece of a cell.
    Piece {
        /// Place of its term.
        term: usize,
        /// Place among the pieces.
        index: usize,
        /// Index of the cell in the mesh.
        cell: usize,
        /// The body whose surface it has.
        body: usize,
    },
}

impl MatrixSource {
    /// Index of the cell in the mesh.
    pub fn cell(self) -> usize {
        match self {
            Self::Cell { cell, .. } | Self::Piece { cell, .. } => cell,
        }
    }

    /// Whether it is a piece of a term, whose matrix has velocities, pressures and a twist.
    pub fn is_piece(self) -> bool {
        matches!(self, Self::Piece { .. })
    }
}

/// The matrices of the active cells.
pub struct Elements<'a, const D: usize> {
    system: &'a StokesSystem<D>,
    reference: ReferenceMatrices<D>,
    size: usize,
    /// Scale of the viscous reference matrix in each cell.
    viscous: Vec<f64>,
    /// The viscous matrix that a cell has in addition; no entries where none has.
    own: Vec<Option<Box<[f64]>>>,
}

impl<'a, const D: usize> Elements<'a, D> {
    /// Matrices of `size` rows: velocities only, or velocities and pressures.
    pub fn new(system: &'a StokesSystem<D>, size: usize) -> Self {
        let discretisation = system.discretisation();
        let mut new = Self {
            system,
            reference: discretisation.reference(),
            size,
            viscous: system.cells.iter().map(|cell| cell.viscous).collect(),
            own: Vec::new(),
        };
        new.add_viscosity(discretisation.mesh.cell_count());
        new
    }

    /// The system whose cells they are.
    pub fn system(&self) -> &'a StokesSystem<D> {
        self.system
    }

    /// Rows of a matrix.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The active cells.
    pub fn cells(&self) -> &'a [ActiveCell] {
        &self.system.cells
    }

    /// The multiple of the viscous reference matrix that a cell has, and the matrix that comes to it where
    /// the viscosity varies.
    pub fn viscous(&self, index: usize) -> (f64, Option<&[f64]>) {
        (self.viscous[index], self.own.get(index).and_then(Option::as_deref))
    }

    fn add_viscosity(&mut self, cell_count: usize) {
        let Some(added) = &self.system.added else { return };
        let mut slot = vec![usize::MAX; cell_count];
        for (k, cell) in self.system.cells.iter().enumerate() {
            slot[cell.cell as usize] = k;
        }
        self.own = vec![None; self.system.cells.len()];
        added.for_each_matrix(&mut |cell, scale, own| {
            let slot = slot[cell as usize];
            match own {
                None => self.viscous[slot] += scale,
                Some(own) => self.own[slot] = Some(own.iter().map(|k| scale * k).collect()),
            }
        });
    }

    /// All that has a matrix.
    pub fn sources(&self) -> impl Iterator<Item = MatrixSource> + 'a {
        let cells = self.system.cells.iter().enumerate();
        let cells = cells.map(|(index, cell)| MatrixSource::Cell { index, cell: cell.cell as usize });
        let terms = self.system.terms.iter().enumerate();
        cells.chain(terms.flat_map(|(term, pieces)| {
            let pieces = pieces.pieces().enumerate();
            pieces.map(move |(index, (cell, body))| MatrixSource::Piece { term, index, cell, body })
        }))
    }

    /// All that has a matrix for velocities alone: a cell with pieces once, with the first.
    pub fn viscous_sources(&self) -> impl Iterator<Item = MatrixSource> + 'a {
        let mut last = None;
        self.sources()
            .filter(move |source| !source.is_piece() || last.replace(source.cell()) != Some(source.cell()))
    }

    /// Writes the matrix of a cell or a piece, row by row.
    pub fn fill_source(&self, source: MatrixSource, matrix: &mut [f64]) {
        match source {
            MatrixSource::Cell { index, .. } => self.fill(index, matrix),
            MatrixSource::Piece { term, index, .. } => {
                let compressibility = COMPRESSIBILITY / self.system.viscosity();
                self.system.terms[term].fill(index, compressibility, matrix);
            }
        }
    }

    /// What fills the matrices of cells with pieces, term by term, for velocities alone.
    pub fn of_pieces(&self) -> Vec<PieceMatrices<'a>> {
        self.system.terms.iter().map(|term| term.viscous_matrices()).collect()
    }

    /// Writes the matrix of one of the [`Elements::viscous_sources`], row by row.
    pub fn fill_velocities(
        &self,
        source: MatrixSource,
        pieces: &mut [PieceMatrices<'_>],
        matrix: &mut [f64],
    ) {
        match source {
            MatrixSource::Piece { term, index, .. } => pieces[term](index, matrix),
            MatrixSource::Cell { index, .. } => self.fill(index, matrix),
        }
    }

    /// Writes the matrix of an active cell, row by row.
    pub fn fill(&self, index: usize, matrix: &mut [f64]) {
        let (n, size) = (ReferenceMatrices::<D>::VELOCITY, self.size);
        let (viscous, own) = self.viscous(index);
        for (row, from) in matrix.chunks_exact_mut(size).zip(self.reference.viscous.chunks_exact(n)) {
            row.iter_mut().zip(from).for_each(|(value, k)| *value = viscous * k);
        }
        if let Some(own) = own {
            for (row, from) in matrix.chunks_exact_mut(size).zip(own.chunks_exact(n)) {
                row.iter_mut().zip(from).for_each(|(value, k)| *value += k);
            }
        }
        if size > n {
            self.fill_pressure(index, matrix);
        }
    }

    fn fill_pressure(&self, index: usize, matrix: &mut [f64]) {
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let (reference, cell) = (&self.reference, &self.system.cells[index]);
        let viscosity = cell.viscous * (cell.volume / cell.divergence).powi(2) / cell.volume;
        let compressibility = COMPRESSIBILITY * cell.volume / viscosity;
        for q in 0..m {
            for r in 0..m {
                matrix[(n + q) * self.size + n + r] = -compressibility * reference.pressure_mass[q * m + r];
            }
            for j in 0..n {
                let value = -cell.divergence * reference.divergence[q * n + j];
                matrix[(n + q) * self.size + j] = value;
                matrix[j * self.size + n + q] = value;
            }
        }
    }
}
