//! What rank zero tells the others between two flows.

use gluey_geom::{Dim, Space, Vector, Wrench};
use gluey_motion::Configuration;
use gluey_parallel::{Communicator, Ranks};

use super::Suspension;

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

/// For rank zero between two flows: has the others, who [`Suspension::follow_and_show`], show the fields of
/// the last one.
pub fn ask_for_fields(ranks: &Ranks, frame: FrameName) {
    Order::Show(frame).share(ranks);
}

/// For rank zero between two flows: has the others keep, under a name, what the flow after the step that was
/// checkpointed last starts from.
pub fn ask_to_keep(ranks: &Ranks, name: u64) {
    Order::Keep(name).share(ranks);
}

/// What rank zero tells the others.
#[derive(Clone, Debug)]
pub(super) struct Told<const D: usize>
where
    Dim<D>: Space<D>,
{
    pub positions: Vec<Vector<D>>,
    pub wrenches: Vec<Wrench<D>>,
    pub shear_factor: f64,
    /// Of the images in a box without walls.
    pub strain: f64,
    pub with_stress: bool,
    /// Shear stress of the forces between particles themselves, where the stress is given.
    pub pair_stress: f64,
}

impl<const D: usize> Told<D>
where
    Dim<D>: Space<D>,
{
    pub fn new(suspension: &Suspension<D>) -> Self {
        let count = suspension.radii.len();
        let wrenches = match suspension.wrenches.len() {
            0 => vec![Wrench::default(); count],
            _ => suspension.wrenches.clone(),
        };
        let positions = vec![Vector::zeros(); count];
        let (with_stress, pair_stress) = (false, 0.0);
        Self { positions, wrenches, shear_factor: 1.0, strain: 0.0, with_stress, pair_stress }
    }

    /// Takes over a configuration of the suspension.
    pub fn take(&mut self, suspension: &Suspension<D>, configuration: &Configuration<'_, D>) {
        *self = Self { shear_factor: configuration.shear_factor, ..Self::new(suspension) };
        let places = configuration.particles.iter().map(|particle| particle.pose.position);
        self.positions.iter_mut().zip(places).for_each(|(told, place)| *told = place);
        let wrenches = self.wrenches.iter_mut().zip(configuration.wrenches);
        wrenches.for_each(|(acting, more)| *acting = *acting + *more);
        self.pair_stress = configuration.pair_stress[(0, 1)];
        if suspension.is_sheared() {
            (self.strain, self.with_stress) = (configuration.strain, configuration.with_stress);
        }
    }

    /// Replaces all by what rank zero says.
    pub fn share(&mut self, ranks: &Ranks) {
        let with_stress = f64::from(u8::from(self.with_stress));
        let mut numbers = vec![self.shear_factor, self.strain, self.pair_stress, with_stress];
        numbers.extend(self.positions.iter().flatten());
        for wrench in &self.wrenches {
            numbers.extend(wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)));
        }
        ranks.share(&mut numbers);
        let mut told = numbers.into_iter();
        let mut next = || told.next().unwrap_or_default();
        [self.shear_factor, self.strain, self.pair_stress] = [next(), next(), next()];
        self.with_stress = next() > 0.0;
        for position in &mut self.positions {
            position.iter_mut().for_each(|x| *x = next());
        }
        for wrench in &mut self.wrenches {
            wrench.force.iter_mut().for_each(|f| *f = next());
            (0..Dim::<D>::ROT).for_each(|k| wrench.torque[k] = next());
        }
    }
}
