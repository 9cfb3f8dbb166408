//! Two equal, torque-free spheres in an unbounded linear flow, exactly (Batchelor and Green 1972,
//! DOI 10.1017/S0022112072002927), free or pushed along their line of centres ([`approach_mobility`]), by
//! contacts too.
//!
//! With a gap offset the mobility is evaluated at `gap + offset`: the spheres then approach faster than they
//! should and overlap, as they do in a fluid solver that does not resolve the lubrication film.

use std::f64::consts::PI;

use gluey_contact::{Film, LoneDrag, PairKey, TwistMobility};
use gluey_geom::{Dim, Particle, Twist, Vector, Wrench};

use crate::{Configuration, Hydrodynamics, LinearFlow, MobilityTable, Prediction, approach_mobility};

/// Reason why a pair has no velocities.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PairMobilityError {
    /// The model knows two spheres.
    #[error("the pair mobility moves exactly 2 spheres, not {count}")]
    ParticleCount {
        /// How many there were.
        count: usize,
    },
    /// The model knows equal spheres.
    #[error("the pair mobility needs equal positive radii, not {first} and {second}")]
    UnequalRadii {
        /// Radius of particle 0.
        first: f64,
        /// Radius of particle 1.
        second: f64,
    },
    /// The line of centres has no direction.
    #[error("the centres of particles 1 and 2 are a distance {distance} apart: no line of centres")]
    NoDirection {
        /// Zero or not a number.
        distance: f64,
    },
    /// The model knows opposite forces on the line of centres.
    #[error(
        "the pair mobility knows equal and opposite forces along the line of centres and no torques: {rest:e} of \
         the forces is none such"
    )]
    Wrenches {
        /// Size of what is left of forces and torques, relative to the largest.
        rest: f64,
    },
}

/// What may be left of forces beside those that the model knows: rounding.
const ROUNDING: f64 = 1e-9;

/// Exact pair hydrodynamics as a cheap [`Hydrodynamics`], in a fluid of viscosity 1.
///
/// Overlapping spheres (gap + offset <= 0) move as at contact: no relative normal velocity, tangential and
/// spin coefficients at their limits.
#[derive(Clone, Debug, PartialEq)]
pub struct PairMobility {
    flow: LinearFlow<3>,
    offset: f64,
    table: MobilityTable,
}

impl PairMobility {
    /// Two spheres in `flow`, exactly.
    pub fn new(flow: LinearFlow<3>) -> Self {
        Self { flow, offset: 0.0, table: MobilityTable::new() }
    }

    /// The same with the mobility evaluated at `gap + offset` (`offset` in radii), to imitate a soft solver.
    pub fn with_gap_offset(mut self, offset: f64) -> Self {
        self.offset = offset;
        self
    }

    /// The two, and the way from the first to the second.
    fn pair<'a>(&self, particles: &'a [Particle<3>]) -> Result<PairAt<'a>, PairMobilityError> {
        let [first, second] = equal_pair(particles)?;
        let r = second.pose.position - first.pose.position;
        let distance = r.norm();
        if !(distance > 0.0 && distance.is_finite()) {
            return Err(PairMobilityError::NoDirection { distance });
        }
        let gap = distance / first.radius - 2.0 + self.offset;
        Ok(PairAt { particles: [first, second], r, normal: r / distance, gap })
    }
}

/// Configuration of two spheres.
struct PairAt<'a> {
    particles: [&'a Particle<3>; 2],
    /// From the centre of the first to that of the second, and its direction.
    r: Vector<3>,
    normal: Vector<3>,
    /// Gap with its offset, in radii.
    gap: f64,
}

impl PairAt<'_> {
    /// Velocity of the second per force on it along the normal, the opposite of which acts on the first.
    fn yielding(&self) -> f64 {
        approach_mobility(self.gap) / (6.0 * PI * self.particles[0].radius)
    }
}

/// Mobility of a pair: exact for opposite forces along the line of centres, for others the drag that each has
/// alone.
#[derive(Clone, Copy, Debug)]
struct PushMobility {
    normal: Vector<3>,
    radii: [f64; 2],
    yielding: f64,
}

impl PushMobility {
    fn drag(&self) -> LoneDrag<'_> {
        LoneDrag { viscosity: 1.0, radii: &self.radii, is_held: &[] }
    }
}

impl TwistMobility<3> for PushMobility {
    fn respond(&mut self, loads: &[Wrench<3>], twists: &mut [Twist<3>]) {
        let push = self.normal * (0.5 * (loads[1].force - loads[0].force).dot(&self.normal));
        let mut rest = [loads[0], loads[1]];
        rest[0].force += push;
        rest[1].force -= push;
        self.drag().respond(&rest, twists);
        twists[0].velocity -= push * self.yielding;
        twists[1].velocity += push * self.yielding;
    }

    fn of_pair(&self, pair: PairKey) -> [f64; 2] {
        let [_, across] = TwistMobility::<3>::of_pair(&self.drag(), pair);
        [2.0 * self.yielding, across]
    }
}

impl Hydrodynamics<3> for PairMobility {
    type Error = PairMobilityError;

    fn predict(&mut self, configuration: &Configuration<'_, 3>) -> Result<Prediction<3>, PairMobilityError> {
        let flow = self.flow.scaled(configuration.shear_factor);
        let pair = self.pair(configuration.particles)?;
        let PairAt { particles: [first, second], r, normal: n, gap } = pair;
        let mobility = self.table.at(gap);
        let of_contacts = configuration.contacts.map_or(&[][..], |loads| &loads.wrenches);
        let push = (push(configuration.wrenches, &n)? + push(of_contacts, &n)?) * pair.yielding();

        let strain = flow.strain_rate() * r;
        let normal = n * n.dot(&strain);
        let relative = Dim::<3>::cross_spin(&flow.spin(), &r)
            + normal * mobility.one_minus_a
            + (strain - normal) * mobility.one_minus_b;
        // By symmetry the mid-point moves with the fluid.
        let middle = flow.velocity(&((first.pose.position + second.pose.position) * 0.5));
        let spin = flow.spin() + Dim::<3>::moment(&n, &(strain / r.norm())) * mobility.spin;
        let velocity = |side: f64| middle + (relative + n * (2.0 * push)) * side;
        let twists = [-0.5, 0.5].map(|side| Twist { velocity: velocity(side), spin });
        Ok(Prediction::of(twists.to_vec()))
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn near_mobility(
        &self,
        configuration: &Configuration<'_, 3>,
    ) -> Result<Option<Box<dyn TwistMobility<3>>>, PairMobilityError> {
        let pair = self.pair(configuration.particles)?;
        let radii = pair.particles.map(|particle| particle.radius);
        let mobility = PushMobility { normal: pair.normal, radii, yielding: pair.yielding() };
        Ok(Some(Box::new(mobility)))
    }

    fn films(&self, configuration: &Configuration<'_, 3>, reach: f64) -> Vec<Film<3>> {
        let Ok([first, second]) = equal_pair(configuration.particles) else { return Vec::new() };
        let branch = second.pose.position - first.pose.position;
        let gap = branch.norm() - 2.0 * first.radius;
        let (slide, curvature_radius) = (Vector::zeros(), first.radius);
        let film =
            Film { pair: PairKey::new(0, 1), branch, slide, is_held: [false; 2], gap, curvature_radius };
        let keeps_open = self.offset == 0.0 && gap > 0.0 && gap < reach;
        keeps_open.then_some(film).into_iter().collect()
    }
}

/// The force on the second sphere along `n`, the opposite of which acts on the first.
fn push(wrenches: &[Wrench<3>], n: &Vector<3>) -> Result<f64, PairMobilityError> {
    let [first, second] = wrenches else { return Ok(0.0) };
    let push = second.force.dot(n);
    let rest = (second.force - n * push).norm()
        + (first.force + second.force).norm()
        + first.torque.norm()
        + second.torque.norm();
    let size = first.force.norm().max(second.force.norm());
    if rest > ROUNDING * size {
        return Err(PairMobilityError::Wrenches { rest: rest / size });
    }
    Ok(push)
}

fn equal_pair(particles: &[Particle<3>]) -> Result<[&Particle<3>; 2], PairMobilityError> {
    let [first, second] = particles else {
        return Err(PairMobilityError::ParticleCount { count: particles.len() });
    };
    let (a, b) = (first.radius, second.radius);
    // Radii read from decimal text may differ in the last digit.
    if !(a > 0.0 && (a - b).abs() <= 1e-12 * a) {
        return Err(PairMobilityError::UnequalRadii { first: a, second: b });
    }
    Ok([first, second])
}
