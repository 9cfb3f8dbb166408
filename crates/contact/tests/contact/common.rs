//! Set-up that the contact tests share: two spheres in unbounded shear, stepped as a simulation would.

use gluey_contact::{
    ContactModel, ContactParams, ContactReport, Film, FilmError, FilmMemory, FilmReport, PairContact,
    StepGeometry, film_reach,
};
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::{Configuration, Hydrodynamics, Integrator, LinearFlow, PairMobility, Scheme};

pub const RADIUS: f64 = 0.05;

/// The paper's pair of spheres (Fig. 7) with exact hydrodynamics at `gap + offset`.
pub struct Encounter {
    pub particles: [Particle<3>; 2],
    pub contact: PairContact<3>,
    pub integrator: Integrator<3>,
    pub smallest_gap: f64,
    flow: PairMobility,
    shear_factor: f64,
    dt: f64,
}

impl Encounter {
    pub fn new(offset: f64, params: ContactParams, scheme: Scheme, dt: f64) -> Self {
        let start = [[0.3, 0.525, 0.5], [0.7, 0.475, 0.5]];
        Self {
            particles: start.map(|x| Particle::new(Vector::<3>::from(x), RADIUS)),
            contact: PairContact::new(params),
            integrator: Integrator::new(scheme),
            smallest_gap: f64::INFINITY,
            flow: PairMobility::new(LinearFlow::shear(1.0, 0.5)).with_gap_offset(offset),
            shear_factor: 1.0,
            dt,
        }
    }

    /// Gap in radii.
    pub fn gap(&self) -> f64 {
        self.particles[0].gap(&self.particles[1]) / RADIUS
    }

    pub fn step(&mut self) -> ContactReport {
        let shear_factor = self.shear_factor;
        let now = Configuration { shear_factor, ..Configuration::at(0.0, &self.particles) };
        let mut twists = self.flow.predict(&now).expect("a good pair").twists;
        let mut drift = [Vector::zeros(); 2];
        self.integrator.drift(self.dt, &mut drift);
        let positions = self.particles.map(|particle| particle.pose.position);
        let step = StepGeometry {
            positions: &positions,
            radii: &[RADIUS; 2],
            drift: &drift,
            velocity_weight: self.integrator.velocity_weight(self.dt),
            dt: self.dt,
        };
        let report = self.contact.correct(&step, &mut twists).expect("a good step");
        self.integrator.advance(self.dt, &mut self.particles, &twists);
        self.smallest_gap = self.smallest_gap.min(self.gap());
        report
    }

    pub fn run(&mut self, time: f64) {
        for _ in 0..(time / self.dt).round() as usize {
            self.step();
        }
    }

    pub fn reverse(&mut self, factor: f64) {
        self.shear_factor = factor;
        self.integrator.reverse();
        self.contact.reverse();
    }
}

/// A scheme that keeps films open.
#[derive(Clone)]
pub struct FilmIntegrator<const D: usize> {
    pub scheme: Integrator<D>,
    memory: FilmMemory,
}

impl<const D: usize> FilmIntegrator<D> {
    pub fn new(scheme: Scheme) -> Self {
        Self { scheme: Integrator::new(scheme), memory: FilmMemory::default() }
    }

    /// Up to which gap films have to be known where images slide at this rate.
    pub fn film_reach(&self, dt: f64, particles: &[Particle<D>], twists: &[Twist<D>], rate: f64) -> f64 {
        self.scheme.with_step(dt, particles, |step| film_reach(step, twists, rate))
    }

    pub fn open_films(
        &mut self,
        dt: f64,
        particles: &[Particle<D>],
        films: &[Film<D>],
        twists: &mut [Twist<D>],
    ) -> Result<FilmReport, FilmError> {
        self.scheme.with_step(dt, particles, |step| self.memory.open(step, films, twists))
    }

    pub fn advance(&mut self, dt: f64, particles: &mut [Particle<D>], twists: &[Twist<D>]) {
        self.scheme.advance(dt, particles, twists);
    }

    pub fn reverse(&mut self) {
        self.scheme.reverse();
        self.memory.reverse();
    }
}
