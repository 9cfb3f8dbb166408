//! The block triangular preconditioner around surfaces, as in the serial solver: `z_p = -S^-1 r_p`,
//! `z_u = V (r_u + B^T z_p)`, the forces of films with the pressures.
//!
//! With the blocks `G` of the smoother, the levels `L` and the sweep `C` the cycle `V` is `z = G r`, `z += L
//! (r - A z)`, `z += G (r - A z)`, `z += C (r - A z)`. Its vectors hold the same at copies as at their
//! owners.

use gluey_geom::{Dim, Space};
use gluey_linalg::{Preconditioner, vector};
use gluey_parallel::Communicator;
use gluey_stokes::part::{PressureForces, SurfaceSmoother};
use gluey_stokes::{PressureSpace, StokesSystem};

use super::films::SharedFilms;
use super::space::SurfaceSpace;
use crate::bodies::rigid;
use crate::cycle::VCycle;
use crate::level::Level;
use crate::schur::SchurInverse;

/// The cycle on the velocities.
pub struct SurfaceCycle<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    levels: VCycle<'a, D>,
    smoother: SurfaceSmoother<D>,
    /// Whether a node of the part is free.
    is_free: Vec<bool>,
    /// Reduced velocities of the part.
    x: Vec<f32>,
    r: Vec<f32>,
    correction: Vec<f32>,
    /// What is owned of them.
    own: Vec<f32>,
}

impl<'a, const D: usize> SurfaceCycle<'a, D>
where
    Dim<D>: Space<D>,
{
    pub fn new(levels: VCycle<'a, D>, smoother: SurfaceSmoother<D>, system: &StokesSystem<D>) -> Self {
        let [x, r, correction] = [(); 3].map(|()| vec![0.0; system.velocity_dim()]);
        let nodes = system.space.nodes().node_count();
        let is_free = (0..nodes).map(|node| system.space.is_free(node)).collect();
        Self { levels, smoother, is_free, x, r, correction, own: Vec::new() }
    }

    /// `z = V r` on owned velocities and twists.
    fn apply(&mut self, space: &SurfaceSpace<'a, D>, r: &[f64], z: &mut [f64]) {
        let mut square = [vector::dot(r, r)];
        space.ranks.sum(&mut square);
        let norm = square[0].sqrt();
        if norm == 0.0 {
            return z.fill(0.0);
        }
        self.own.resize(r.len(), 0.0);
        vector::convert(1.0 / norm, r, &mut self.own);
        space.set_velocities(&self.own, &mut self.r);
        self.smoother.update(&mut self.r);
        self.x.fill(0.0);
        self.smoother.add_blocks(&mut self.r, &mut self.x);
        self.correct(space);
        self.smoother.add_blocks(&mut self.r, &mut self.x);
        self.smoother.sweep(&self.r, &mut self.x);
        space.copy_velocities(&self.x, &mut self.own);
        vector::convert(norm, &self.own, z);
    }

    /// `z = L r`, `x += z`, `r -= A z`.
    fn correct(&mut self, space: &SurfaceSpace<'a, D>) {
        let top = self.levels.levels.len() - 1;
        self.restrict(space);
        self.levels.run();
        let Level { operator, z, .. } = &mut self.levels.levels[top];
        operator.scatter(z);
        operator.expand();
        let nodal = space.level.nodal_dim();
        let owned = space.level.velocity.owned.clone();
        for node in owned.filter(|&node| self.is_free[node]) {
            let at = node * D..(node + 1) * D;
            self.correction[at.clone()].copy_from_slice(&operator.x[at]);
        }
        let twists = z[space.level.owned_nodal_dim()..].chunks_exact(rigid::<D>());
        for (twist, &body) in twists.zip(&space.own_bodies) {
            self.correction[nodal + body as usize * rigid::<D>()..][..rigid::<D>()].copy_from_slice(twist);
        }
        self.smoother.update(&mut self.correction);
        vector::axpy(1.0, &self.correction, &mut self.x);
        self.smoother.subtract(&self.correction, &mut self.r);
    }

    /// The residual as a load on the unknowns of the finest level: those of its rigid nodes on its twists, to
    /// which those of the bodies come.
    fn restrict(&mut self, space: &SurfaceSpace<'a, D>) {
        let top = self.levels.levels.len() - 1;
        let Level { operator, b, .. } = &mut self.levels.levels[top];
        let (nodal, n) = (space.level.nodal_dim(), rigid::<D>());
        operator.y.fill(0.0);
        let owned = &space.level.velocity.owned;
        let at = owned.start * D..owned.end * D;
        operator.y[at.clone()].copy_from_slice(&self.r[at]);
        operator.reduce();
        operator.gather(b);
        let twists = b[space.level.owned_nodal_dim()..].chunks_exact_mut(n);
        for (loads, &body) in twists.zip(&space.own_bodies) {
            let own = &self.r[nodal + body as usize * n..][..n];
            loads.iter_mut().zip(own).for_each(|(load, own)| *load += own);
        }
    }
}

/// The preconditioner.
pub struct SurfaceTriangular<'s, 'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'s StokesSystem<D>,
    space: SurfaceSpace<'a, D>,
    cycle: SurfaceCycle<'a, D>,
    schur: SchurInverse<'a, D>,
    forces: PressureForces<D>,
    /// At the owned pressures.
    r: Vec<f32>,
    z: Vec<f32>,
    /// At all pressures of the part, and their forces on its velocities.
    p: Vec<f32>,
    load: Vec<f32>,
    /// Owned velocities.
    own_load: Vec<f32>,
    wide: Vec<f64>,
    films: Option<SharedFilms<'s>>,
}

impl<'s, 'a, const D: usize> SurfaceTriangular<'s, 'a, D>
where
    Dim<D>: Space<D>,
{
    pub fn new(
        system: &'s StokesSystem<D>,
        space: SurfaceSpace<'a, D>,
        cycle: SurfaceCycle<'a, D>,
        schur: SchurInverse<'a, D>,
        films: Option<SharedFilms<'s>>,
    ) -> Self {
        let [r, z] = [0, 1].map(|_| vec![0.0; space.pressure_dim()]);
        Self {
            forces: PressureForces::new(system),
            r,
            z,
            p: vec![0.0; system.pressure.dim()],
            load: vec![0.0; system.velocity_dim()],
            own_load: vec![0.0; space.velocity_dim()],
            wide: vec![0.0; space.velocity_dim()],
            system,
            space,
            cycle,
            schur,
            films,
        }
    }

    /// The levels of the cycle, for another smoother.
    pub fn into_levels(self) -> VCycle<'a, D> {
        self.cycle.levels
    }
}

impl<const D: usize> Preconditioner<f64> for SurfaceTriangular<'_, '_, D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Self {
            system,
            space,
            cycle,
            schur,
            forces,
            r: rhs,
            z: answer,
            p,
            load,
            own_load,
            wide,
            films: network,
        } = self;
        let ranks = space.ranks;
        let [ru, rp, rf] = space.parts(r);
        let [zu, zp, zf] = space.parts_mut(z);
        let films = zf.iter_mut().zip(rf).zip(system.row_inverses());
        films.for_each(|((z, r), inverse)| *z = -inverse * r);
        vector::convert(-1.0, rp, rhs);
        space.pressures.remove_mean(ranks, rhs);
        schur.apply(rhs, answer);
        answer.iter_mut().zip(&space.pressures.is_free).filter(|e| !*e.1).for_each(|(z, _)| *z = 0.0);
        space.pressures.remove_mean(ranks, answer);
        vector::convert(1.0, answer, zp);
        p[space.level.pressure.owned.clone()].copy_from_slice(answer);
        space.pressures.plan.update::<f32, 1>(ranks, p);
        PressureSpace::expand(&system.pressure, p);
        forces.set(system, p, zf, load);
        space.gather_velocities(load, own_load);
        vector::convert(1.0, own_load, wide);
        vector::residual_from_product(ru, wide);
        cycle.apply(space, wide, zu);
        let twists = zu[space.level.owned_nodal_dim()..].chunks_exact_mut(rigid::<D>());
        let held = twists.zip(&space.own_bodies).filter(|(_, body)| system.space.is_held(**body as usize));
        held.for_each(|(twist, _)| twist.fill(0.0));
        if let Some(network) = network {
            network.apply(space, rf, z);
        }
    }
}
