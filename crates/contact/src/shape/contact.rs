//! The contact step of shapes: find pairs, project, re-linearise, remember.

use gluey_geom::{Dim, Space, Twist, Vector};

use super::problem::Problem;
use super::{Shape, ShapeStep};
use crate::broadphase::{BestOf, Broadphase};
use crate::model::{is_positive, validate_sizes};
use crate::{
    Contact, ContactError, ContactLaw, ContactParams, ContactReport, ContactState, MemoryError, Mobility,
    PairKey, PairState, Partner, Quantity, StokesDrag,
};

/// Contacts between shapes by one of the contact laws `none`, `inelastic` and `gluey`.
///
/// The memory is the pair's: where shapes touch at several points, their forces add up to the `lambda` that gamma integrates, and
/// only the point where they are closest can pull. The mobility is that of spheres of [`Shape::drag_radius`], with
/// [`Mobility::own`] for translation and `3/(4 a^2)` times it for rotation.
///
/// Set [`ContactParams::exact_gap`] wherever shapes may lie along each other: without it the gap is linear in the rotation, and
/// ends that swing into each other within a step are not seen. Not for steps in which a shape moves by its own thickness. Walls
/// are fixed shapes here ([`crate::WithFixed`]); there are no periods. Contacts are solved for all at once, by one thread.
#[derive(Debug)]
pub struct ShapeContact<const D: usize, M = StokesDrag> {
    params: ContactParams,
    mobility: M,
    state: ContactState,
    contacts: Vec<Contact>,
    broadphase: BestOf,
}

impl<const D: usize> ShapeContact<D> {
    /// The model in which every shape feels its own drag only.
    pub fn new(params: ContactParams) -> Self {
        Self::with_mobility(params, StokesDrag)
    }
}

/// Bodies are sought as far as this many times their displacement without contact, or this part of their size.
const SLACK: (f64, f64) = (2.0, 0.1);

impl<const D: usize, M: Mobility<D>> ShapeContact<D, M> {
    /// The model with another mobility of single bodies; one that couples them does not compile.
    pub fn with_mobility(params: ContactParams, mobility: M) -> Self {
        const { assert!(!M::COUPLED, "shapes feel their own drag only") };
        let (state, contacts) = (ContactState::default(), Vec::new());
        Self { params, mobility, state, contacts, broadphase: BestOf::default() }
    }

    /// The contacts of the last step, sorted by pair: those with a force or a memory.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Everything the next step depends on.
    pub fn checkpoint(&self) -> ContactState {
        self.state.clone()
    }

    /// Goes on from a checkpoint; on an error the memory is as before.
    pub fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.state = state.checked()?;
        self.contacts.clear();
        Ok(())
    }

    /// Tells that the flow was reversed, so that remembered forces change their sign.
    pub fn reverse(&mut self) {
        self.state.pairs.iter_mut().for_each(|pair| pair.lambda = -pair.lambda);
    }

    /// Corrects `twists`; on an error they and the memory are as before.
    pub fn correct<S: Shape<D>>(
        &mut self,
        step: &ShapeStep<'_, D, S>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError>
    where
        Dim<D>: Space<D>,
    {
        validate(step, twists, &self.state)?;
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
        let mut slacks: Vec<f64> = free.iter().zip(step.shapes).map(slack).collect();
        let (problem, report) = loop {
            let pairs = self.near(step, &slacks);
            let mut problem = Problem::new(step, &self.params, &self.mobility, &free, &pairs, &self.state)?;
            let report = problem.solve()?;
            // Contact may have pushed bodies farther than partners were sought.
            let mut is_wide = true;
            for (slack, moved) in slacks.iter_mut().zip(&problem.moved) {
                let distance = moved.velocity.norm();
                if distance > *slack {
                    (*slack, is_wide) = (2.0 * distance, false);
                }
            }
            if is_wide {
                break (problem, report);
            }
        };
        self.contacts = problem.contacts();
        self.state.pairs.clear();
        self.state.pairs.extend(self.contacts.iter().map(|&Contact { pair, lambda, gamma, .. }| PairState {
            pair,
            gamma,
            lambda,
        }));
        for (twist, change) in twists.iter_mut().zip(&problem.changes) {
            *twist = *twist + *change;
        }
        Ok(report)
    }

    /// Pairs whose balls meet, and those that remember; sorted.
    fn near<S: Shape<D>>(&mut self, step: &ShapeStep<'_, D, S>, slacks: &[f64]) -> Vec<(u32, u32)>
    where
        Dim<D>: Space<D>,
    {
        let centers: Vec<Vector<D>> = step.poses.iter().map(|pose| pose.position).collect();
        let radii: Vec<f64> =
            step.shapes.iter().zip(slacks).map(|(shape, slack)| shape.reach() + slack).collect();
        let mut pairs = Vec::new();
        self.broadphase.meeting(&centers, &radii, centers.len(), &mut pairs);
        pairs.extend(self.state.pairs.iter().filter_map(|state| match state.pair.second {
            Partner::Particle { index, .. } => Some((state.pair.first, index)),
            Partner::Wall(_) => None,
        }));
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

/// Checks everything a step depends on.
fn validate<const D: usize, S: Shape<D>>(
    step: &ShapeStep<'_, D, S>,
    twists: &[Twist<D>],
    state: &ContactState,
) -> Result<(), ContactError>
where
    Dim<D>: Space<D>,
{
    let count = step.poses.len();
    validate_sizes(
        [count, step.shapes.len(), step.drift.len(), twists.len()],
        step.velocity_weight,
        step.dt,
    )?;
    for particle in 0..count {
        let shape = &step.shapes[particle];
        for radius in [shape.rounding(), shape.reach(), shape.drag_radius()] {
            if !is_positive(radius) {
                return Err(ContactError::BadRadius { particle, radius });
            }
        }
        let (twist, drift) = (&twists[particle], &step.drift[particle]);
        let turns = |twist: &Twist<D>| Dim::<D>::spin_slice(&twist.spin).iter().all(|x| x.is_finite());
        for (is_finite, quantity) in [
            (is_finite(&step.poses[particle].position), Quantity::Position),
            (
                super::closest::frame(&step.poses[particle].orientation).iter().all(|x| x.is_finite()),
                Quantity::Orientation,
            ),
            (is_finite(&twist.velocity), Quantity::Velocity),
            (turns(twist), Quantity::Spin),
            (is_finite(&drift.velocity) && turns(drift), Quantity::Drift),
        ] {
            if !is_finite {
                return Err(ContactError::NotFinite { particle, quantity });
            }
        }
    }
    let nobody = |pair: PairKey| pair.particles().1.is_none_or(|second| second >= count);
    match state.pairs.iter().find(|state| nobody(state.pair)) {
        Some(&PairState { pair, .. }) => Err(ContactError::UnknownParticle { pair, count }),
        None => Ok(()),
    }
}

fn is_finite<const D: usize>(vector: &Vector<D>) -> bool {
    vector.iter().all(|x| x.is_finite())
}
