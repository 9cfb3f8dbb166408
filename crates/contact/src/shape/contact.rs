//! The contact step of shapes: find pairs, project, re-linearise, remember.

use gluey_geom::{Dim, Pose, Twist, Vector};

use super::Shape;
use super::bodies::Bodies;
use super::closest::frame;
use super::problem::ShapeProjection;
use crate::broadphase::{BestOf, Broadphase};
use crate::model::{is_positive, validate_sizes};
use crate::record::ContactRecord;
use crate::{
    BodyStep, Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, ContactState,
    MemoryError, Mobility, PairKey, PairState, Partner, StokesDrag,
};

/// Contacts between shapes by one of the contact laws `none`, `inelastic` and `gluey`.
///
/// The memory is the pair's: where shapes touch at several points, their forces add up to the `lambda` that
/// gamma integrates, and only the point where they are closest can pull. The mobility is that of spheres of
/// [`Shape::drag_radius`], with [`Mobility::own`] for translation and `3/(4 a^2)` times it for rotation.
///
/// Set [`ContactParams::exact_gap`] wherever shapes may lie along each other: without it the gap is linear in
/// the rotation, and ends that swing into each other within a step are not seen. Not for steps in which a
/// shape moves by its own thickness. Walls are fixed shapes here ([`crate::WithFixed`]); there are no
/// periods. Contacts are solved for all at once, by one thread.
#[derive(Debug)]
pub struct ShapeContact<const D: usize, S, M = StokesDrag> {
    params: ContactParams,
    shapes: Vec<S>,
    mobility: M,
    record: ContactRecord,
    broadphase: BestOf,
}

impl<const D: usize, S: Shape<D>> ShapeContact<D, S> {
    /// The model of bodies with these shapes, each of which feels its own drag only.
    pub fn new(params: ContactParams, shapes: Vec<S>) -> Self {
        Self::with_mobility(params, shapes, StokesDrag)
    }
}

/// Bodies are sought as far as this many times their displacement without contact, or this part of their
/// size.
const SLACK: (f64, f64) = (2.0, 0.1);

impl<const D: usize, S: Shape<D>, M: Mobility<D>> ShapeContact<D, S, M> {
    /// The model with another mobility of single bodies; one that couples them does not compile.
    pub fn with_mobility(params: ContactParams, shapes: Vec<S>, mobility: M) -> Self {
        const { assert!(!M::COUPLED, "shapes feel their own drag only") };
        Self { params, shapes, mobility, record: ContactRecord::default(), broadphase: BestOf::default() }
    }

    /// The shapes of the bodies.
    pub fn shapes(&self) -> &[S] {
        &self.shapes
    }
}

impl<const D: usize, S: Shape<D>, M: Mobility<D>> ContactModel<D> for ShapeContact<D, S, M> {
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        validate(&self.shapes, step, twists, &self.record.state)?;
        match self.params.law {
            ContactLaw::None => return Ok(ContactReport::default()),
            law @ ContactLaw::VelocityCorrection => return Err(ContactError::NotForShapes { law }),
            ContactLaw::Inelastic | ContactLaw::Gluey => {}
        }
        let moves = twists.iter().zip(step.drift);
        let free: Vec<Twist<D>> =
            moves.map(|(twist, drift)| *twist * step.velocity_weight + *drift).collect();
        let slack =
            |(move_, shape): (&Twist<D>, &S)| (SLACK.0 * move_.velocity.norm()).max(SLACK.1 * shape.reach());
        let mut slacks: Vec<f64> = free.iter().zip(&self.shapes).map(slack).collect();
        let bodies = Bodies::new(&self.shapes, step, &free, &self.mobility);
        let (problem, report) = loop {
            let pairs = near(&mut self.broadphase, &bodies, &self.record.state, &slacks);
            let mut problem = ShapeProjection::new(&bodies, &self.params, &pairs, &self.record.state)?;
            let report = problem.solve()?;
            if !widen(&mut slacks, &problem.moved) {
                break (problem, report);
            }
        };
        self.record.replace(|contacts| contacts.extend(problem.contacts()));
        for (twist, change) in twists.iter_mut().zip(&problem.changes) {
            *twist = *twist + *change;
        }
        Ok(report)
    }

    fn contacts(&self) -> &[Contact] {
        &self.record.contacts
    }

    fn checkpoint(&self) -> ContactState {
        self.record.state.clone()
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.record.resume(state)
    }

    fn reverse(&mut self) {
        self.record.reverse();
    }
}

/// Widens the search where contact pushed bodies farther than partners were sought; whether it did.
fn widen<const D: usize>(slacks: &mut [f64], moved: &[Twist<D>]) -> bool {
    let mut was_narrow = false;
    for (slack, moved) in slacks.iter_mut().zip(moved) {
        let distance = moved.velocity.norm();
        if distance > *slack {
            (*slack, was_narrow) = (2.0 * distance, true);
        }
    }
    was_narrow
}

/// Pairs whose balls meet, and those that remember; sorted.
fn near<const D: usize, S: Shape<D>>(
    broadphase: &mut BestOf,
    bodies: &Bodies<'_, D, S>,
    state: &ContactState,
    slacks: &[f64],
) -> Vec<(u32, u32)> {
    let (centers, radii) = bodies.balls(slacks);
    let mut pairs = Vec::new();
    broadphase.meeting(&centers, &radii, centers.len(), &mut pairs);
    pairs.extend(state.pairs.iter().filter_map(|state| match state.pair.second {
        Partner::Particle { index, .. } => Some((state.pair.first, index)),
        Partner::Wall(_) => None,
    }));
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Checks everything a step depends on.
fn validate<const D: usize, S: Shape<D>>(
    shapes: &[S],
    step: &BodyStep<'_, D>,
    twists: &[Twist<D>],
    state: &ContactState,
) -> Result<(), ContactError> {
    let count = step.poses.len();
    validate_sizes([count, shapes.len(), step.drift.len(), twists.len()], step.velocity_weight, step.dt)?;
    for particle in 0..count {
        let shape = &shapes[particle];
        let bad =
            [shape.rounding(), shape.reach(), shape.drag_radius()].into_iter().find(|&r| !is_positive(r));
        if let Some(radius) = bad {
            return Err(ContactError::BadRadius { particle, radius });
        }
        if let Some(quantity) = not_finite(&step.poses[particle], &twists[particle], &step.drift[particle]) {
            return Err(ContactError::NotFinite { particle, quantity: quantity.to_owned() });
        }
    }
    let nobody = |pair: PairKey| pair.particles().1.is_none_or(|second| second >= count);
    match state.pairs.iter().find(|state| nobody(state.pair)) {
        Some(&PairState { pair, .. }) => Err(ContactError::UnknownParticle { pair, count }),
        None => Ok(()),
    }
}

/// The first quantity of a body that is infinite or not a number.
fn not_finite<const D: usize>(pose: &Pose<D>, twist: &Twist<D>, drift: &Twist<D>) -> Option<&'static str> {
    let linear = |x: &Vector<D>| x.iter().all(|x| x.is_finite());
    let angular = |twist: &Twist<D>| Dim::<D>::spin_slice(&twist.spin).iter().all(|x| x.is_finite());
    let quantities = [
        (linear(&pose.position), "position"),
        (frame(&pose.orientation).iter().all(|x| x.is_finite()), "orientation"),
        (linear(&twist.velocity), "velocity"),
        (angular(twist), "spin"),
        (linear(&drift.velocity) && angular(drift), "drift"),
    ];
    quantities.into_iter().find_map(|(is_finite, quantity)| (!is_finite).then_some(quantity))
}
