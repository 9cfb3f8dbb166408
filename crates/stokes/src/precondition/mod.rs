//! The preconditioner: a V-cycle on the velocities, a correction for the penalised solid, and the Schur
//! complement.

mod assembly;
mod block_triangular;
mod numbered;
pub mod schur;
pub mod solid;
pub mod surface;
pub mod velocity;

use crate::space::Discretisation;

pub use block_triangular::BlockTriangular;

/// In 3D the operator in the bodies is factorised on meshes with at most this many cells per largest radius.
const FACTORISED_CELLS: f64 = 2.0;

/// The meshes of a velocity cycle and the bodies in them.
#[derive(Clone, Copy, Debug)]
pub struct CycleLevels<'a, const D: usize> {
    /// The meshes, coarsest first.
    pub meshes: &'a [Discretisation<D>],
    /// Radius of the largest body.
    pub radius: f64,
}

impl<const D: usize> CycleLevels<'_, D> {
    /// Whether bodies are factorised on the last of the meshes.
    pub fn are_factorised(&self) -> bool {
        let is_small = |mesh: &Discretisation<D>| self.radius <= FACTORISED_CELLS * mesh.finest_cell_size();
        D == 2 || self.meshes.len() < 2 || self.meshes.last().is_none_or(is_small)
    }

    /// The first of the levels.
    pub fn below(&self, count: usize) -> Self {
        Self { meshes: &self.meshes[..count], ..*self }
    }
}

/// A correction around the velocity cycle, for the errors that its levels do not reduce.
pub trait Correction: Send {
    /// `z = M^-1 r` for reduced velocities, where `levels(f, u)` turns the nodal load `f` into the reduced
    /// velocities `u` of the finest level.
    fn apply(&mut self, r: &[f64], z: &mut [f64], levels: &mut dyn FnMut(&mut [f64], &mut [f32]));

    /// Applications of operators since the last call, each as its share of the mesh. Solves with factors and
    /// products with patches do not count.
    fn take_applications(&mut self) -> f64;
}
