//! The input of a step, which rank zero sends to the others.

use gluey_geom::{Dim, Matrix, Particle, Space, Vector, Wrench};
use gluey_motion::Configuration;
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::Suspension;

/// The input of a step: a [`Configuration`], in numbers of which all ranks know how many there are.
#[derive(Clone, Debug)]
pub struct StepInput<const D: usize>
where
    Dim<D>: Space<D>,
{
    particles: Vec<Particle<D>>,
    wrenches: Vec<Wrench<D>>,
    pub shear_factor: f64,
    strain: f64,
    with_stress: bool,
    pair_stress: Matrix<D>,
}

impl<const D: usize> StepInput<D>
where
    Dim<D>: Space<D>,
{
    /// Nothing yet.
    pub fn new(suspension: &Suspension<D>) -> Self {
        let particles = suspension.particles(&vec![Vector::zeros(); suspension.radii.len()]);
        Self::of(suspension, &Configuration::at(0.0, &particles))
    }

    pub fn of(suspension: &Suspension<D>, configuration: &Configuration<'_, D>) -> Self {
        let Configuration { particles, shear_factor, strain, with_stress, pair_stress, .. } = *configuration;
        let mut wrenches = configuration.wrenches.to_vec();
        wrenches.resize(suspension.radii.len(), Wrench::default());
        Self { particles: particles.to_vec(), wrenches, shear_factor, strain, with_stress, pair_stress }
    }

    pub fn configuration(&self) -> Configuration<'_, D> {
        let Self { ref particles, ref wrenches, shear_factor, strain, with_stress, pair_stress } = *self;
        Configuration { time: 0.0, particles, wrenches, shear_factor, strain, with_stress, pair_stress }
    }

    /// Replaces all by what rank zero says.
    pub fn share(&mut self, ranks: &Ranks) {
        let with_stress = f64::from(u8::from(self.with_stress));
        let mut numbers = vec![self.shear_factor, self.strain, with_stress];
        numbers.extend(self.pair_stress.iter());
        numbers.extend(self.particles.iter().flat_map(|particle| particle.pose.position.iter()));
        for wrench in &self.wrenches {
            numbers.extend(wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)));
        }
        ranks.share(&mut numbers);
        let mut said = numbers.into_iter();
        let mut next = || said.next().unwrap_or_default();
        [self.shear_factor, self.strain] = [next(), next()];
        self.with_stress = next() > 0.0;
        self.pair_stress.iter_mut().for_each(|x| *x = next());
        for particle in &mut self.particles {
            particle.pose.position.iter_mut().for_each(|x| *x = next());
        }
        for wrench in &mut self.wrenches {
            wrench.force.iter_mut().for_each(|f| *f = next());
            (0..Dim::<D>::ROT).for_each(|k| wrench.torque[k] = next());
        }
    }
}
