//! The block triangular preconditioner around surfaces, as in the serial solver: `z_p = -S^-1 r_p`,
//! `z_u = V (r_u + B^T z_p)`, the forces of films with the pressures.

use gluey_geom::{Dim, Space};
use gluey_linalg::{Preconditioner, vector};
use gluey_stokes::part::{PressureForces, VCycle};
use gluey_stokes::{PressureSpace, StokesSystem};

use super::films::SharedFilms;
use super::space::SurfaceSpace;
use crate::bodies::rigid;
use crate::schur::SchurInverse;

/// The preconditioner.
pub struct SurfaceTriangular<'s, 'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'s StokesSystem<D>,
    space: SurfaceSpace<'a, D>,
    cycle: VCycle<D>,
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
    /// Velocities of the part, the same at ghosts as at their owners.
    ru: Vec<f64>,
    zu: Vec<f64>,
    films: Option<SharedFilms<'s>>,
}

impl<'s, 'a, const D: usize> SurfaceTriangular<'s, 'a, D>
where
    Dim<D>: Space<D>,
{
    pub fn new(
        system: &'s StokesSystem<D>,
        space: SurfaceSpace<'a, D>,
        cycle: VCycle<D>,
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
            ru: vec![0.0; system.velocity_dim()],
            zu: vec![0.0; system.velocity_dim()],
            system,
            space,
            cycle,
            schur,
            films,
        }
    }

    /// The cycle, for other surfaces.
    pub fn into_cycle(self) -> VCycle<D> {
        self.cycle
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
            ru: whole,
            zu: answers,
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
        space.set_velocities(wide, whole);
        space.update_velocities(whole);
        cycle.apply(whole, answers);
        space.copy_velocities(answers, zu);
        let twists = zu[space.level.owned_nodal_dim()..].chunks_exact_mut(rigid::<D>());
        let held = twists.zip(&space.own_bodies).filter(|(_, body)| system.space.is_held(**body as usize));
        held.for_each(|(twist, _)| twist.fill(0.0));
        if let Some(network) = network {
            network.apply(space, rf, z);
        }
    }
}
