//! Particles that move through contact, alone or on ranks.

use gluey_contact::{
    Contact, ContactError, ContactModel, ContactParams, ContactReport, ContactState, Domain, GammaUpdate,
    PairContact, StepGeometry, Wall, WithFixed,
};
use gluey_distributed::{ContactLoad, SharedContact};
use gluey_geom::{Twist, Vector};
use gluey_testkit::packing::Packing;

use crate::support::on_ranks;

pub const RADIUS: f64 = 0.5;
pub const SIZES: [usize; 4] = [2, 3, 4, 8];

/// Particles on their way.
#[derive(Clone)]
pub struct Setting<const D: usize> {
    pub positions: Vec<Vector<D>>,
    /// Radii over [`RADIUS`], in turn.
    pub sizes: [f64; 3],
    pub domain: Domain<D>,
    pub params: ContactParams,
    /// Particles that move as they are told.
    pub held: Vec<usize>,
    pub dt: f64,
    pub steps: usize,
    /// Shear rate, of images that slide too.
    pub rate: f64,
    /// Of the vortices and of what is random.
    pub strength: f64,
    /// Rate of a strain that presses all together.
    pub squeeze: f64,
    /// Velocity of the first particle along x, if it is driven.
    pub piston: Option<f64>,
    /// The step before which the flow is reversed.
    pub reversal: usize,
    /// What is remembered at the beginning.
    pub memory: ContactState,
}

/// What became of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Course<const D: usize> {
    pub positions: Vec<Vector<D>>,
    /// Velocities of the last step.
    pub velocities: Vec<Vector<D>>,
    pub contacts: Vec<Contact>,
    pub memory: ContactState,
    pub reports: Vec<ContactReport>,
    pub error: Option<ContactError>,
    pub loads: Vec<ContactLoad>,
}

/// A model of contact, alone or shared.
pub trait Model<const D: usize>: ContactModel<D> {
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<(ContactReport, ContactLoad), ContactError>;
}

impl<const D: usize> Model<D> for PairContact<D, WithFixed> {
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<(ContactReport, ContactLoad), ContactError> {
        Ok((self.correct(step, twists)?, ContactLoad::default()))
    }
}

impl<const D: usize> Model<D> for SharedContact<'_, D> {
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<(ContactReport, ContactLoad), ContactError> {
        Ok((self.correct(step, twists)?, self.load()))
    }
}

/// Gluey by the scheme of two steps.
pub fn consistent() -> ContactParams {
    ContactParams { gamma_update: GammaUpdate::Consistent, ..ContactParams::default() }
}

/// A packing, and the box it fills.
pub fn packed<const D: usize>(count: usize, fraction: f64) -> (Setting<D>, f64) {
    let Packing { positions, side } = Packing::<D>::fluid(count, fraction, 1);
    let setting = Setting {
        positions,
        sizes: [1.0, 0.95, 0.98],
        domain: Domain::default(),
        params: consistent(),
        held: Vec::new(),
        dt: 0.05,
        steps: 6,
        rate: 1.0,
        strength: 1.5,
        squeeze: 0.0,
        piston: None,
        reversal: usize::MAX,
        memory: ContactState::default(),
    };
    (setting, side)
}

/// Walls a radius below and above a box; the lower one rises.
pub fn floor_and_ceiling<const D: usize>(domain: Domain<D>, side: f64) -> Domain<D> {
    let up = Vector::from_fn(|d, _| f64::from(u8::from(d == 1)));
    let floor = Wall { normal: up, offset: -RADIUS, speed: 0.3 };
    domain.with_wall(floor).with_wall(Wall { normal: -up, offset: -side - RADIUS, speed: 0.0 })
}

impl<const D: usize> Setting<D> {
    pub fn alone(&self) -> PairContact<D, WithFixed> {
        let mut contact =
            PairContact::with_mobility(self.params.clone(), WithFixed::new(self.held.iter().copied()))
                .within(self.domain.clone());
        contact.resume(self.memory.clone()).unwrap();
        contact
    }

    /// Velocities of a shear, vortices and something random.
    fn twists(&self, positions: &[Vector<D>], sign: f64) -> Vec<Twist<D>> {
        let center = positions.iter().sum::<Vector<D>>() / positions.len() as f64;
        let flow = |(k, x): (usize, &Vector<D>)| {
            let mut u = Vector::<D>::zeros();
            u[1] = self.strength * (0.3 * (0.7 * x[0]).sin() - 0.1 * (k as f64).sin());
            u[D - 1] += 0.2 * self.strength * (0.9 * x[1] + 0.3 * x[0]).cos();
            u[0] += self.rate * x[1];
            u -= (x - center) * self.squeeze;
            if let (0, Some(speed)) = (k, self.piston) {
                u[0] = speed;
            }
            u * sign
        };
        positions.iter().enumerate().map(|of| Twist { velocity: flow(of), ..Twist::default() }).collect()
    }

    pub fn run(&self, model: &mut impl Model<D>) -> Course<D> {
        let mut positions = self.positions.clone();
        let radii: Vec<f64> = (0..positions.len()).map(|k| RADIUS * self.sizes[k % 3]).collect();
        let (mut reports, mut loads, mut error, mut velocities) = (Vec::new(), Vec::new(), None, Vec::new());
        let height = self.domain.lattice.periods()[1].unwrap_or(0.0);
        let mut drift = vec![Vector::zeros(); positions.len()];
        let (mut tilt, mut sign, dt) = (0.0, 1.0, self.dt);
        for n in 0..self.steps {
            if n == self.reversal {
                sign = -1.0;
                model.reverse();
                drift.iter_mut().for_each(|drift| *drift = -*drift);
            }
            model.set_sliding(tilt, sign * self.rate * height * dt);
            let mut twists = self.twists(&positions, sign);
            let predicted = twists.clone();
            // As in a scheme of two steps.
            let velocity_weight = if n == 0 { dt } else { 1.5 * dt };
            let step =
                StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight, dt };
            match model.step(&step, &mut twists) {
                Ok((report, load)) => {
                    reports.push(report);
                    loads.push(load);
                }
                Err(failure) => {
                    assert_eq!(format!("{twists:?}"), format!("{predicted:?}"), "velocities are as before");
                    error = Some(failure);
                    break;
                }
            }
            for ((x, twist), drift) in positions.iter_mut().zip(&twists).zip(&mut drift) {
                *x += twist.velocity * velocity_weight + *drift;
                *drift = twist.velocity * (-0.5 * dt);
            }
            tilt += sign * self.rate * height * dt;
            velocities = twists.iter().map(|twist| twist.velocity).collect();
        }
        let (contacts, memory) = (model.contacts().to_vec(), model.checkpoint());
        Course { positions, velocities, contacts, memory, reports, error, loads }
    }

    /// The course on each of so many ranks: the same, to the bit.
    pub fn on(&self, size: usize) -> Course<D> {
        let courses = on_ranks(size, |ranks| self.run(&mut SharedContact::new(self.alone(), ranks)));
        let mut courses = courses.unwrap();
        assert!(courses.iter().all(|course| *course == courses[0]), "{size} ranks know the same");
        courses.swap_remove(0)
    }
}

/// Largest differences of two courses.
#[derive(Clone, Copy, Debug)]
pub struct Differences {
    pub places: f64,
    pub velocities: f64,
    pub lambda: f64,
    pub gamma: f64,
}

/// How far a course is from another one with the same contacts.
pub fn differences<const D: usize>(one: &Course<D>, other: &Course<D>) -> Differences {
    let names = |course: &Course<D>| course.contacts.iter().map(|contact| contact.pair).collect::<Vec<_>>();
    assert_eq!(names(one), names(other), "the contacts are the same");
    assert_eq!(one.reports.len(), other.reports.len());
    for (a, b) in one.reports.iter().zip(&other.reports) {
        assert_eq!(
            (a.pair_count, a.worst.is_some()),
            (b.pair_count, b.worst.is_some()),
            "as many pairs take part"
        );
    }
    let vectors =
        |a: &[Vector<D>], b: &[Vector<D>]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let of = |number: fn(&Contact) -> f64| {
        let pairs = one.contacts.iter().zip(&other.contacts);
        pairs.map(|(a, b)| (number(a) - number(b)).abs()).fold(0.0, f64::max)
    };
    Differences {
        places: vectors(&one.positions, &other.positions),
        velocities: vectors(&one.velocities, &other.velocities),
        lambda: of(|contact| contact.lambda),
        gamma: of(|contact| contact.gamma),
    }
}
