//! The block triangular preconditioner.
//!
//! It is made for free bodies. Where twists are data their block is left out of its answer too. With the
//! matrix `K` of the other unknowns, their coupling `C` to the twists, the block `R` of these and
//! the resistance `S = R - C^T K^-1 C` that block of the inverse is `K^-1 + K^-1 C S^-1 C^T K^-1`: what comes
//! on top of `K^-1` has the rank of the twists, and its eigenvalues, those of `S^-1 R`, lie close together.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::{Dim, Space};
use gluey_linalg::{Preconditioner, Scalar, vector};

use crate::operator::StokesSystem;
use crate::precondition::schur::SchurInverse;
use crate::precondition::velocity::VCycle;

/// `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`.
pub struct BlockTriangular<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    fluid: &'a CellOperator<f32, D>,
    cycle: &'a mut VCycle<D>,
    schur: &'a mut SchurInverse<D>,
    /// `r_p`, then `z_p` at all nodes.
    pressure: Vec<f32>,
    /// `z_p`.
    answer: Vec<f32>,
    work: Workspace<f32>,
}

impl<'a, const D: usize> BlockTriangular<'a, D>
where
    Dim<D>: Space<D>,
{
    pub fn new(
        system: &'a StokesSystem<D>,
        fluid: &'a CellOperator<f32, D>,
        cycle: &'a mut VCycle<D>,
        schur: &'a mut SchurInverse<D>,
    ) -> Self {
        let zeros = || vec![0.0; system.pressure.dim()];
        Self { system, fluid, cycle, schur, pressure: zeros(), answer: zeros(), work: Workspace::default() }
    }
}

impl<S: Scalar, const D: usize> Preconditioner<S> for BlockTriangular<'_, D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, r: &[S], z: &mut [S]) {
        let Self { system, fluid, cycle, schur, pressure, answer, work } = self;
        let (ru, rp) = r.split_at(system.velocity_dim());
        let (zu, zp) = z.split_at_mut(system.velocity_dim());
        vector::convert(-1.0, rp, pressure);
        system.pressure.remove_mean(pressure);
        schur.apply(&system.pressure, pressure, answer);
        system.pressure.remove_mean(answer);
        vector::convert(1.0, answer, zp);
        vector::copy(answer, pressure);
        system.pressure.expand(pressure);
        cycle.answer(ru, |load| fluid.gradient(pressure, load, work), zu);
        system.clear_held(zu);
    }
}
