//! What a term of the Stokes operator provides beside the cells that nothing cuts.
//!
//! A term has pieces of cells, which couple velocities, pressures and the twist of a body, rows of its own
//! below those of the pressures, `r x - g` for an unknown force `g`, or both.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Dim, Matrix, Vector, Wrench};

use crate::space::VelocitySpace;

/// Terms in the order in which they are added up.
pub type Terms<const D: usize> = Vec<Arc<dyn Term<D>>>;

/// Fills the matrix of a cell for velocities alone, by the place of its first piece.
pub type PieceMatrices<'a> = Box<dyn FnMut(usize, &mut [f64]) + 'a>;

/// A force per unit of volume.
pub type Force<'a, const D: usize> = &'a dyn Fn(&Vector<D>) -> Vector<D>;

/// Buffers that keep their memory from product to product, whatever a term has in them.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T>(pub [Vec<T>; 5]);

/// The product of a term with vectors of `X`, computed in `T`.
pub trait Product<X, T> {
    /// `y += A x` for reduced velocities, the pressures at all nodes and the rows of the term. What is empty
    /// in `x` is zero, what is empty in `y` is not wanted. Loads on nodes with given values are left zero.
    fn add(&self, x: [&[X]; 3], y: [&mut [X]; 3], scratch: &mut Scratch<T>);
}

/// A term of the Stokes operator.
pub trait Term<const D: usize>:
    Product<f64, f64> + Product<f32, f64> + Product<f32, f32> + Any + Debug + Send + Sync
{
    /// Whether a cell of the mesh is none of the fluid's own, since what is in it belongs to the term.
    fn covers(&self, _cell: usize) -> bool {
        false
    }

    /// Cell and body of each piece; those of a cell follow each other.
    fn pieces(&self) -> Box<dyn Iterator<Item = (usize, usize)> + '_> {
        Box::new(std::iter::empty())
    }

    /// Writes the matrix of a piece, row by row: velocities node by node, pressures, twist. This multiple of
    /// the pressures' mass is taken from their block.
    fn fill(&self, _piece: usize, _compressibility: f64, _matrix: &mut [f64]) {}

    /// What fills the matrices of whole cells for velocities alone, each by the place of its first piece.
    fn viscous_matrices(&self) -> PieceMatrices<'_> {
        Box::new(|_, _| ())
    }

    /// Adds the own pieces' block for the twist of each body, row by row.
    fn add_twist_blocks(&self, _blocks: &mut [f64]) {}

    /// Number of its rows.
    fn row_count(&self) -> usize {
        0
    }

    /// The entries of a row in reduced velocities; that of its own force is -1.
    fn row(&self, _row: usize) -> &[(u32, f64)] {
        &[]
    }

    /// Inverses of about the Schur complement of its forces, which is diagonal.
    fn row_inverses(&self) -> &[f64] {
        &[]
    }

    /// Adds to its rows what nodal velocities do that are data: those of walls.
    fn add_data(&self, _space: &VelocitySpace<D>, _velocity: &[f64], _rows: &mut [f64]) {}

    /// Adds the load of a force on the fluid in its pieces and on the bodies, of own cells.
    fn add_force(&self, _force: Force<'_, D>, _load: &mut Load<D>) {}

    /// Adds the load of a linear flow with this strain, relative to which velocities are, of own cells; that
    /// on its rows apart.
    fn add_strain(&self, _strain: &Matrix<D>, _load: &mut Load<D>, _rows: &mut [f64]) {}
}

/// A right-hand side before constraints are taken into account.
pub struct Load<const D: usize> {
    /// On the velocities of all nodes.
    pub velocity: Vec<f64>,
    /// On the pressures of all nodes.
    pub pressure: Vec<f64>,
    /// On the bodies.
    pub wrenches: Vec<Wrench<D>>,
}

/// `y += A x` by all terms.
pub fn add_terms<X, T, const D: usize>(
    terms: &Terms<D>,
    [u, p, mut g]: [&[X]; 3],
    [yu, yp, mut z]: [&mut [X]; 3],
    scratch: &mut Scratch<T>,
) where
    dyn Term<D>: Product<X, T>,
{
    for term in terms {
        let (own, own_z);
        (own, g) = g.split_at(g.len().min(term.row_count()));
        (own_z, z) = z.split_at_mut(z.len().min(term.row_count()));
        term.add([u, p, own], [&mut *yu, &mut *yp, own_z], scratch);
    }
}

/// Rows of the matrix of a piece.
pub fn piece_size<const D: usize>() -> usize {
    ReferenceMatrices::<D>::VELOCITY + ReferenceMatrices::<D>::PRESSURE + Dim::<D>::RIGID
}
