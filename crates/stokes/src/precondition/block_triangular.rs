//! The block triangular preconditioner.

use gluey_linalg::{Preconditioner, Scalar, vector};
use gluey_parallel::Halo;

use crate::film::FilmCorrection;
use crate::operator::{PressureForces, StokesSystem};
use crate::precondition::Ties;
use crate::precondition::schur::SchurInverse;
use crate::precondition::velocity::VCycle;

/// `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`; the forces of terms join the pressures. The films' rows of
/// motions are made to hold ([`FilmCorrection`]) inside of the cycle in 3D, so that the fluid follows, and
/// after it, so that no step opens them.
pub struct BlockTriangular<'a, const D: usize> {
    system: &'a StokesSystem<D>,
    forces: &'a mut PressureForces<D>,
    cycle: &'a mut VCycle<D>,
    schur: &'a mut SchurInverse<D>,
    /// `r_p`, then `z_p` at all nodes.
    pressure: Vec<f32>,
    /// `z_p`.
    answer: Vec<f32>,
    films: Option<FilmCorrection<'a>>,
    /// Forces of terms before the cycle.
    term_forces: Vec<f64>,
    /// Of velocities and of pressures.
    halos: [Halo; 2],
}

impl<'a, const D: usize> BlockTriangular<'a, D> {
    pub fn new(
        system: &'a StokesSystem<D>,
        forces: &'a mut PressureForces<D>,
        cycle: &'a mut VCycle<D>,
        schur: &'a mut SchurInverse<D>,
        films: Option<FilmCorrection<'a>>,
    ) -> Self {
        let zeros = || vec![0.0; system.pressure.dim()];
        Self {
            system,
            forces,
            cycle,
            schur,
            pressure: zeros(),
            answer: zeros(),
            films,
            term_forces: Vec::new(),
            halos: [system.halos().velocities.clone(), system.pressure.halo().clone()],
        }
    }
}

impl<S: Scalar, const D: usize> Preconditioner<S> for BlockTriangular<'_, D> {
    fn apply(&mut self, r: &[S], z: &mut [S]) {
        let Self {
            system,
            forces,
            cycle,
            schur,
            pressure,
            answer,
            films,
            term_forces,
            halos: [of_velocities, of_pressures],
        } = self;
        let [ru, rp, rf] = system.parts(r);
        let [zu, zp, zf] = system.parts_mut(z);
        let answers = zf.iter_mut().zip(rf).zip(system.row_inverses());
        answers.for_each(|((z, r), inverse)| *z = S::from_f64(-inverse * r.to_f64()));
        vector::convert(-1.0, rp, pressure);
        system.pressure.remove_mean(pressure);
        of_pressures.update(pressure);
        schur.apply(&system.pressure, pressure, answer);
        of_pressures.clear(answer);
        system.pressure.remove_mean(answer);
        vector::convert(1.0, answer, zp);
        vector::copy(answer, pressure);
        of_pressures.update(pressure);
        system.pressure.expand(pressure);
        term_forces.clear();
        term_forces.extend(zf.iter().map(|z| z.to_f64()));
        let mut ties = films.as_mut().map(|films| {
            |twists: &mut [f64], loads: &mut [f64]| {
                films.apply(rf, twists, zf);
                films.loads(|row| zf[row].to_f64() - term_forces[row], loads);
            }
        });
        let ties = ties.as_mut().map(|ties| ties as Ties<'_>);
        cycle.answer(ru, |load| forces.set(system, pressure, term_forces, load), zu, of_velocities, ties);
        system.space.clear_held(zu);
        if let Some(films) = films {
            films.apply(rf, &mut zu[system.space.full_dim()..], zf);
        }
    }
}
