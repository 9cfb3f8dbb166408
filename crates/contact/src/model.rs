//! The interface of contact models: the step they correct, and the report on it.

use gluey_geom::{Matrix, Pose, Twist, Vector, Wrench};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::projection::Effort;
use crate::{ContactError, ContactState, Domain, MemoryError, PairKey, Repulsion, TwistMobility, Wall};

/// The step `x^{n+1} = x^n + c u^n + drift` whose velocities are to be corrected. One entry per particle.
#[derive(Clone, Copy, Debug)]
pub struct StepGeometry<'a, const D: usize> {
    /// Centres at the beginning of the step.
    pub positions: &'a [Vector<D>],
    /// Radii.
    pub radii: &'a [f64],
    /// Displacement known before the velocity (the history of a multi-step scheme).
    pub drift: &'a [Vector<D>],
    /// `c`: the displacement a unit velocity makes.
    pub velocity_weight: f64,
    /// Length of the step. `dt - c` is the weight of the last step's velocities in the drift.
    pub dt: f64,
}

/// The step `x^{n+1} = x^n + c u^n + drift` of bodies that also turn, by the vector `c w^n + drift`. One
/// entry per body.
#[derive(Clone, Copy, Debug)]
pub struct BodyStep<'a, const D: usize> {
    /// Centres and orientations at the beginning of the step.
    pub poses: &'a [Pose<D>],
    /// Radii of round bodies; not used by models that know the bodies' shapes.
    pub radii: &'a [f64],
    /// Displacement and rotation known before the velocity (the history of a multi-step scheme).
    pub drift: &'a [Twist<D>],
    /// `c`: the displacement a unit velocity makes.
    pub velocity_weight: f64,
    /// Length of the step. `dt - c` is the weight of the last step's velocities in the drift.
    pub dt: f64,
}

impl<const D: usize> BodyStep<'_, D> {
    /// Displacements of the centres with these velocities.
    pub(crate) fn moves(&self, twists: &[Twist<D>]) -> Vec<Vector<D>> {
        let moves = twists.iter().zip(self.drift);
        moves.map(|(twist, drift)| twist.velocity * self.velocity_weight + drift.velocity).collect()
    }
}

/// Corrects predicted velocities so that bodies do not overlap.
pub trait ContactModel<const D: usize> {
    /// Corrects `twists`; on an error they and the memory are as before.
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError>;

    /// The contacts of the last step, sorted by pair: those with a force or a memory.
    fn contacts(&self) -> &[Contact];

    /// Everything the next step depends on.
    fn checkpoint(&self) -> ContactState;

    /// Goes on from a checkpoint; on an error the memory is as before.
    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError>;

    /// Tells that the flow was reversed, so that remembered forces change their sign.
    fn reverse(&mut self);

    /// Tells how the images across the border in `y` slide: their tilt at the beginning of the next step and
    /// its growth in the step, lengths along `x` (see [`Domain`]). Models without periods have none that do.
    fn set_sliding(&mut self, _tilt: f64, _tilt_step: f64) {}

    /// The forces that act in the flow, of a model that has such; [`ContactModel::correct_bodies`] is not
    /// called then.
    fn in_flow(&mut self) -> Option<&mut dyn FlowForces<D>> {
        None
    }
}

/// Contacts whose forces act in the flow of a step. The flow with the forces of before gives motions,
/// [`FlowForces::correct`] forces that keep bodies apart and motions with these, and so on until the forces
/// no longer change; [`FlowForces::finish`] ends the step.
pub trait FlowForces<const D: usize> {
    /// Tells how the surroundings move: tilt and its growth as [`ContactModel::set_sliding`], and by which
    /// factor walls move along themselves, 1 as given and -1 reversed.
    fn set_surroundings(&mut self, tilt: f64, tilt_step: f64, shear_factor: f64);

    /// Tells the rate by which velocities and forces count now, over that by which the critical load does.
    fn set_rate(&mut self, rate: f64);

    /// Lets pairs repel each other from now on; the flow of a step has their forces at its beginning.
    fn set_repulsion(&mut self, law: Repulsion);

    /// Begins a step with the forces of the last one, turned with the lines of centres.
    ///
    /// # Errors
    /// Those of pairs that are not there.
    fn begin(&mut self, step: &BodyStep<'_, D>) -> Result<(), ContactError>;

    /// Whether velocities change their sign with the flow: not where rough surfaces push each other, which do
    /// not pull.
    fn is_reversible(&self) -> bool;

    /// The forces, sorted by pair.
    fn forces(&self) -> &[ContactForce<D>];

    /// Minus the mean product of the forces, normal and tangential ones, and the lines between centres, its
    /// symmetric part, in a box that is periodic in all directions.
    fn stresses(&self) -> [Matrix<D>; 2];

    /// The smallest gap that a pair may have; unit: length.
    fn smallest_gap(&self, pair: PairKey, radii: &[f64]) -> f64;

    /// Tells of pairs with films in the next correction. Others move along straight lines.
    fn set_standing_gaps(&mut self, gaps: Vec<StandingGap>);

    /// What the forces load the particles of a step with, in the flow that is computed next.
    ///
    /// # Errors
    /// Those of pairs that are not there.
    fn loads(&mut self, step: &BodyStep<'_, D>) -> Result<Vec<Wrench<D>>, ContactError>;

    /// Corrects `twists`, those of a flow in which the forces of the last [`FlowForces::loads`] act, so that
    /// no gap is below the smallest one at the end of the step, with the forces that this takes in this
    /// mobility.
    ///
    /// # Errors
    /// [`ContactError`]; twists and forces are as before then.
    fn correct(
        &mut self,
        step: &BodyStep<'_, D>,
        mobility: &mut dyn TwistMobility<D>,
        twists: &mut [Twist<D>],
    ) -> Result<FlowContactReport, ContactError>;

    /// Takes over the gaps that the contacts of the last correction have after a step with these motions.
    ///
    /// # Errors
    /// Those of pairs that are not there.
    fn measure_gaps(&mut self, step: &BodyStep<'_, D>, twists: &[Twist<D>]) -> Result<(), ContactError>;

    /// Ends a step: remembers what its last correction found.
    fn finish(&mut self);
}

/// Gap of a film as seen along a straight line: `g + (I - Phi(g)) / R(g)` of an impulse `I`, with the gap `g`
/// at the beginning of the step. What the velocities of the step add to it is linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandingGap {
    /// The two sides.
    pub pair: PairKey,
    /// At the end of a step in which the two stand still against each other.
    pub gap: f64,
    /// Where they touch.
    pub floor: f64,
}

/// The force of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce<const D: usize> {
    /// The two particles.
    pub pair: PairKey,
    /// From the first to its partner, of length one.
    pub normal: Vector<D>,
    /// Force on the partner; the first has the opposite one. Both act in the middle of the gap. Unit: that of
    /// the mobility, viscosity times length times velocity (viscosity times velocity in 2D).
    pub force: Vector<D>,
    /// From the centre of the first to that of its partner, or to the wall.
    pub branch: Vector<D>,
    /// Velocity of the partner's surface beyond that of the first, across the normal.
    pub slip: Vector<D>,
    /// Gap at the end of the step.
    pub gap: f64,
    /// The smallest gap that roughness leaves.
    pub floor: f64,
    /// Whether the tangential force is all that the normal one allows: the surfaces slip. Else they stick.
    pub slides: bool,
}

impl<const D: usize> ContactForce<D> {
    /// A force of which nothing else is known.
    pub(crate) fn known(pair: PairKey, normal: Vector<D>, force: Vector<D>) -> Self {
        let (branch, slip) = (Vector::zeros(), Vector::zeros());
        Self { pair, normal, force, branch, slip, gap: 0.0, floor: 0.0, slides: false }
    }

    /// The normal force, positive apart.
    pub fn pressing(&self) -> f64 {
        self.normal.dot(&self.force)
    }

    /// The tangential force on the partner.
    pub fn tangential(&self) -> Vector<D> {
        self.force - self.normal * self.pressing()
    }
}

/// Report on a correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlowContactReport {
    /// Effort and outcome.
    pub contact: ContactReport,
    /// Change of the forces against those of the flow, over their size, by the power that they have.
    pub change: f64,
}

/// A contact at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Contact {
    /// The two particles.
    pub pair: PairKey,
    /// Force over `6 pi eta`, positive apart; unit: length^2/time.
    pub lambda: f64,
    /// Memory after the step, `<= 0`; unit: length^2.
    pub gamma: f64,
    /// Gap at the end of the step; unit: length.
    pub gap: f64,
}

/// The pair with the smallest gap.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct WorstPair {
    /// The two particles.
    pub pair: PairKey,
    /// Their gap at the end of the step; unit: length.
    pub gap: f64,
}

/// Effort and outcome of one correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ContactReport {
    /// Iterations of the projection over all linearisations, of the island that took most (sweeps of the
    /// velocity correction).
    pub iterations: usize,
    /// Linearisations of the island that took most.
    pub passes: usize,
    /// Largest residual of the last projections, `max |min(gap, ||A|| (lambda - floor))|`; unit: length.
    pub residual: f64,
    /// Pairs that took part.
    pub pair_count: usize,
    /// Pairs with a force.
    pub active_count: usize,
    /// Those of them whose friction is all that their cone allows: they slip, all of them without friction.
    /// None where forces do not act in the flow.
    pub sliding_count: usize,
    /// The smallest gap among the pairs that took part.
    pub worst: Option<WorstPair>,
}

impl ContactReport {
    /// The report on the pairs of both: effort is that of the island that took most.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        let smaller = |a: WorstPair, b: WorstPair| if (b.gap, b.pair) < (a.gap, a.pair) { b } else { a };
        let worst = match (self.worst, other.worst) {
            (Some(a), Some(b)) => Some(smaller(a, b)),
            (a, b) => a.or(b),
        };
        Self {
            iterations: self.iterations.max(other.iterations),
            passes: self.passes.max(other.passes),
            residual: self.residual.max(other.residual),
            pair_count: self.pair_count + other.pair_count,
            active_count: self.active_count + other.active_count,
            sliding_count: self.sliding_count + other.sliding_count,
            worst,
        }
    }

    /// Counts the effort of an island.
    pub(crate) fn count_effort(&mut self, effort: &Effort) {
        self.iterations = self.iterations.max(effort.iterations);
        self.passes = self.passes.max(effort.passes);
        self.residual = self.residual.max(effort.residual);
    }

    /// Counts a pair that took part.
    pub(crate) fn count_pair(&mut self, gap: f64, force: f64, pair: impl FnOnce() -> PairKey) {
        self.pair_count += 1;
        self.active_count += usize::from(force != 0.0);
        if self.worst.is_none_or(|worst| gap < worst.gap) {
            self.worst = Some(WorstPair { pair: pair(), gap });
        }
    }
}

/// Checks everything a step depends on.
pub(crate) fn validate<const D: usize>(
    step: &StepGeometry<'_, D>,
    twists: &[Twist<D>],
    domain: &Domain<D>,
) -> Result<(), ContactError> {
    let count = step.positions.len();
    validate_sizes([count, step.radii.len(), step.drift.len(), twists.len()], step.velocity_weight, step.dt)?;
    for particle in 0..count {
        let radius = step.radii[particle];
        if !is_positive(radius) {
            return Err(ContactError::BadRadius { particle, radius });
        }
        for (vector, quantity) in [
            (&step.positions[particle], "position"),
            (&twists[particle].velocity, "velocity"),
            (&step.drift[particle], "drift"),
        ] {
            if !vector.iter().all(|x| x.is_finite()) {
                return Err(ContactError::NotFinite { particle, quantity: quantity.to_owned() });
            }
        }
    }
    validate_walls(&domain.walls)?;
    validate_periods(step, domain)
}

/// Checks how many positions, radii (or shapes), drifts and velocities there are, and the step in time.
pub(crate) fn validate_sizes(lengths: [usize; 4], velocity_weight: f64, dt: f64) -> Result<(), ContactError> {
    let [positions, radii, drifts, twists] = lengths;
    if lengths != [positions; 4] {
        return Err(ContactError::LengthMismatch { positions, radii, drifts, twists });
    }
    if positions >= u32::MAX as usize {
        return Err(ContactError::TooManyParticles { count: positions });
    }
    if !(is_positive(velocity_weight) && is_positive(dt)) {
        return Err(ContactError::BadStep { velocity_weight, dt });
    }
    Ok(())
}

/// Whether a number is positive and finite.
pub(crate) fn is_positive(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}

/// Positions may be so many periods away from the origin: images are counted in `i32`.
const FARTHEST_PERIOD: f64 = 1e8;
/// The lattice may be sheared so far in a step: neighbours are found with room to spare.
const LARGEST_STRAIN: f64 = 0.5;

fn validate_walls<const D: usize>(walls: &[Wall<D>]) -> Result<(), ContactError> {
    for (wall, Wall { normal, offset, speed }) in walls.iter().enumerate() {
        let is_unit = (normal.norm() - 1.0).abs() <= 1e-12;
        if !(is_unit && offset.is_finite() && speed.is_finite()) {
            return Err(ContactError::BadWall { wall });
        }
    }
    Ok(())
}

fn validate_periods<const D: usize>(
    step: &StepGeometry<'_, D>,
    domain: &Domain<D>,
) -> Result<(), ContactError> {
    let farthest = |d: usize| step.positions.iter().map(|x| x[d].abs()).fold(0.0, f64::max);
    for (direction, period) in (0..D).filter_map(|d| domain.lattice.periods()[d].map(|period| (d, period))) {
        if !(is_positive(period) && farthest(direction) < FARTHEST_PERIOD * period) {
            return Err(ContactError::BadPeriod { direction, period });
        }
        if let Some(particle) = step.radii.iter().position(|radius| 4.0 * radius > period) {
            let radius = step.radii[particle];
            return Err(ContactError::ParticleTooLarge { particle, radius, direction, period });
        }
    }
    let [Some(length), Some(height)] = [0, 1].map(|d| domain.lattice.periods()[d]) else { return Ok(()) };
    let Domain { lattice, tilt_step, .. } = domain;
    // Images are as far along x as the rows of boxes are tilted.
    let farthest_shift = lattice.tilt().abs() * (1.0 + farthest(1) / height);
    if !(farthest_shift < FARTHEST_PERIOD * length && tilt_step.abs() <= LARGEST_STRAIN * height) {
        return Err(ContactError::BadTilt { tilt: lattice.tilt(), tilt_step: *tilt_step });
    }
    Ok(())
}
