//! The preconditioner: a V-cycle on the velocities, a correction around it, and the Schur complement.

pub mod assembly;
mod block_triangular;
pub mod numbered;
pub mod schur;
pub mod surface;
pub mod velocity;

use crate::space::Discretisation;

pub use block_triangular::BlockTriangular;

/// The meshes of a velocity cycle and the bodies in them.
#[derive(Clone, Copy, Debug)]
pub struct CycleLevels<'a, const D: usize> {
    /// The meshes, coarsest first.
    pub meshes: &'a [Discretisation<D>],
    /// Radius of the largest body.
    pub radius: f64,
}

/// Constraints between the motions of bodies, films: changes the twists so that they hold, and writes the
/// loads on the bodies of the forces that this takes. All ranks call it.
pub type Ties<'a> = &'a mut dyn FnMut(&mut [f64], &mut [f64]);

/// A correction around the velocity cycle, for the errors that its levels do not reduce.
pub trait Correction: Send {
    /// `z = M^-1 r` for reduced velocities, where `levels(f, u)` turns the nodal load `f` into the reduced
    /// velocities `u` of the finest level. `ties` change what the levels do to bodies, in a correction that
    /// has twists among its unknowns.
    fn apply(
        &mut self,
        r: &[f64],
        z: &mut [f64],
        levels: &mut dyn FnMut(&mut [f64], &mut [f32]),
        ties: Option<Ties<'_>>,
    );

    /// Applications of operators since the last call, each as its share of the mesh. Solves with factors and
    /// products with patches do not count.
    fn take_applications(&mut self) -> f64;
}
