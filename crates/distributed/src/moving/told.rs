//! What rank zero tells the others between two flows.

use gluey_geom::{Dim, Matrix, Particle, Space, Vector, Wrench};
use gluey_motion::Configuration;
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::Suspension;

/// A frame with the fields of the last flow that rank zero wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameName {
    /// Which of several streams of frames it belongs to.
    pub stream: u32,
    /// Its step.
    pub step: u32,
}

/// What rank zero wants of the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Order {
    End,
    Predict,
    Show(FrameName),
    Remember,
    Keep(u64),
    Contact,
}

impl Order {
    /// What rank zero wants, on all ranks.
    pub fn share(self, ranks: &Ranks) -> Self {
        let mut numbers = match self {
            Self::End => [0.0; 3],
            Self::Predict => [1.0, 0.0, 0.0],
            Self::Show(FrameName { stream, step }) => [2.0, f64::from(stream), f64::from(step)],
            Self::Remember => [3.0, 0.0, 0.0],
            Self::Contact => [5.0, 0.0, 0.0],
            Self::Keep(name) => [4.0, (name >> 32) as f64, (name & u64::from(u32::MAX)) as f64],
        };
        ranks.share(&mut numbers);
        let [order, first, second] = numbers.map(|number| number as u32);
        match order {
            0 => Self::End,
            1 => Self::Predict,
            2 => Self::Show(FrameName { stream: first, step: second }),
            3 => Self::Remember,
            5 => Self::Contact,
            _ => Self::Keep(u64::from(first) << 32 | u64::from(second)),
        }
    }
}

/// For rank zero between two flows: has the others, who
/// [`SharedSuspension::follow_and_show`](super::SharedSuspension::follow_and_show), show the fields of the
/// last one.
pub fn ask_for_fields(ranks: &Ranks, frame: FrameName) {
    Order::Show(frame).share(ranks);
}

/// For rank zero between two flows: has the others keep, under a name, what the flow after the step that was
/// checkpointed last starts from.
pub fn ask_to_keep(ranks: &Ranks, name: u64) {
    Order::Keep(name).share(ranks);
}

/// What rank zero tells the others: a [`Configuration`], in numbers of which all know how many there are.
#[derive(Clone, Debug)]
pub(super) struct Told<const D: usize>
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

impl<const D: usize> Told<D>
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
        let mut told = numbers.into_iter();
        let mut next = || told.next().unwrap_or_default();
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
