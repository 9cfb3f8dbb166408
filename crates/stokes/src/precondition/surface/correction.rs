//! The cycle of a mesh that surfaces cut, on the levels with eliminated bodies.
//!
//! The finest of these levels holds the field with which coarser ones correct: it is taken at the free nodes
//! of the mesh, inside the bodies too, and the motions of the bodies are copied. With the blocks `G` of the
//! smoother, the levels `V` and Chebyshev's sweep `C`:
//!
//! `z = G r`, `z += V (r - A z)`, `z += G (r - A z)`, `z += C (r - A z)`.
//!
//! The levels move what is inside a body with it. Small bodies have blocks for what is left of that, whose
//! corrections are added to those of the levels.
//!
//! Films tie the motions of bodies to each other. They change what the levels do to the bodies, and their
//! forces join the residual: so the smoothers after the levels see both, and the fluid follows. In 2D this
//! saves nothing where discs touch, and they are left to the correction after the cycle.

use gluey_linalg::vector;
use gluey_parallel::Halo;

use super::smoother::SurfaceSmoother;
use crate::error::StokesError;
use crate::operator::Elements;
use crate::precondition::{Correction, Ties};
use crate::space::{VelocitySpace, norm};
use crate::surface::SurfaceCoupling;

/// The smoothers of the finest mesh around the rigid levels. Vectors hold the same at ghosts as at their
/// owners.
pub struct SurfaceCorrection<const D: usize> {
    smoother: SurfaceSmoother<D>,
    /// The velocities of the finest rigid level.
    rigid: VelocitySpace<D>,
    halo: Halo,
    /// Whether a node is free.
    is_free: Vec<bool>,
    /// On the reduced velocities.
    x: Vec<f32>,
    r: Vec<f32>,
    /// Load and velocity on the finest rigid level.
    load: Vec<f64>,
    spread: Vec<f64>,
    velocity: Vec<f32>,
    /// What the levels correct, on the reduced velocities.
    correction: Vec<f32>,
}

impl<const D: usize> SurfaceCorrection<D> {
    /// For the system of `elements`, on levels of which the finest has the velocities `rigid`. All ranks call
    /// this.
    pub fn new(
        elements: &Elements<'_, D>,
        surfaces: &SurfaceCoupling<D>,
        rigid: &VelocitySpace<D>,
    ) -> Result<Self, StokesError> {
        let (smoother, space) = (SurfaceSmoother::new(elements, surfaces, rigid)?, &elements.system().space);
        let dim = space.dim();
        let [x, r, velocity] = [(); 3].map(|()| vec![0.0; dim]);
        Ok(Self {
            smoother,
            halo: rigid.halo().clone(),
            rigid: rigid.clone(),
            is_free: (0..space.nodes().node_count()).map(|node| space.is_free(node)).collect(),
            x,
            r,
            load: vec![0.0; dim],
            spread: vec![0.0; dim],
            correction: velocity.clone(),
            velocity,
        })
    }

    /// `z = V r`, with what is inside small bodies, `x += z`, `r -= A z` for the residual in the workspace,
    /// over `norm`.
    fn correct(&mut self, levels: &mut dyn FnMut(&mut [f64], &mut [f32]), ties: Option<Ties<'_>>, norm: f64) {
        let nodal = self.rigid.full_dim();
        vector::convert(1.0, &self.r, &mut self.load);
        self.halo.update(&mut self.load);
        // The loads on the bodies, as nodal loads of the rigid level.
        self.spread.fill(0.0);
        self.spread[nodal..].copy_from_slice(&self.load[nodal..]);
        self.rigid.spread(&mut self.spread);
        for (load, spread) in self.load[..nodal].iter_mut().zip(&self.spread) {
            *load += spread;
        }
        levels(&mut self.load, &mut self.velocity);
        if D == 3
            && let Some(ties) = ties
        {
            self.tie(ties, norm);
        }
        self.correction[nodal..].copy_from_slice(&self.velocity[nodal..]);
        self.rigid.expand(&mut self.velocity);
        let fields = self.correction.chunks_exact_mut(D).zip(self.velocity.chunks_exact(D));
        for ((z, u), _) in fields.zip(&self.is_free).filter(|(_, is_free)| **is_free) {
            z.copy_from_slice(u);
        }
        self.smoother.add_inside(&self.r, &mut self.correction);
        self.smoother.update(&mut self.correction);
        vector::axpy(1.0, &self.correction, &mut self.x);
        self.smoother.subtract(&self.correction, &mut self.r);
    }

    /// Ties the motions of the bodies, of which `x` and the levels' velocities are the sums, and subtracts
    /// the loads of that from the residual.
    fn tie(&mut self, ties: Ties<'_>, norm: f64) {
        let nodal = self.rigid.full_dim();
        let Self { x, r, velocity, halo, spread, load, .. } = self;
        let [twists, loads] = [spread, load].map(|wide| &mut wide[nodal..]);
        let (x, velocities) = (&x[nodal..], &mut velocity[nodal..]);
        let sums = x.iter().zip(&*velocities).map(|(x, v)| norm * (f64::from(*x) + f64::from(*v)));
        twists.iter_mut().zip(sums).for_each(|(twist, sum)| *twist = sum);
        ties(twists, loads);
        for ((v, twist), x) in velocities.iter_mut().zip(&*twists).zip(x) {
            *v = (twist / norm - f64::from(*x)) as f32;
        }
        r[nodal..].iter_mut().zip(&*loads).for_each(|(r, load)| *r -= (load / norm) as f32);
        halo.update(velocity);
    }
}

impl<const D: usize> Correction for SurfaceCorrection<D> {
    fn apply(
        &mut self,
        r: &[f64],
        z: &mut [f64],
        levels: &mut dyn FnMut(&mut [f64], &mut [f32]),
        ties: Option<Ties<'_>>,
    ) {
        let norm = norm(self.smoother.halo(), r);
        if norm == 0.0 {
            return z.fill(0.0);
        }
        vector::convert(1.0 / norm, r, &mut self.r);
        self.x.fill(0.0);
        self.smoother.add_blocks(&mut self.r, &mut self.x);
        self.correct(levels, ties, norm);
        self.smoother.add_blocks(&mut self.r, &mut self.x);
        self.smoother.sweep(&self.r, &mut self.x);
        vector::convert(norm, &self.x, z);
    }

    fn take_applications(&mut self) -> f64 {
        self.smoother.take_applications()
    }
}
