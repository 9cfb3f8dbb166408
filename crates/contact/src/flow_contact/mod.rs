//! Contacts whose forces act in the flow: rough surfaces with friction, or smooth ones with a memory.
//!
//! Rough surfaces come no nearer than their roughness. There they push each other by `F_n >= 0` and hold each
//! other by `|F_t| <= mu F_n`, or slip. The fluid between them acts all the time, with the true gap: a force
//! on a pair moves it by as little as the film between allows. So forces are sought in a mobility that has
//! the films ([`TwistMobility`]), and act in the flow of the step: their own flow is a part of it.
//!
//! A step is an iteration. A flow with the forces of before gives motions; [`FlowContact::correct`] finds the
//! forces with which the mobility keeps pairs apart; where these are others, a flow with them comes next.
//! What the mobility lacks of the flow shrinks the change each time, from the third flow on accelerated.
//!
//! Pairs may repel each other besides. The flow has the repulsion of the beginning of the step; what that of
//! the step is beyond it acts in the mobility alone, and so do steps that are as long as they like.

mod anderson;
mod coulomb;
mod course;
mod near;
mod newton;
mod pair_repulsion;
mod params;
mod solve;
mod sweeps;
mod touch;

use std::f64::consts::PI;

use gluey_geom::{Matrix, Twist, Vector, Wrench};

use crate::memory::GammaRule;
use crate::model::validate;
use crate::neighbours::NeighbourList;
use crate::pair_contact::Centers;
use crate::{
    BodyStep, Contact, ContactError, ContactForce, ContactModel, ContactReport, ContactState, Domain,
    FlowContactReport, FlowForces, ForceState, LoneDrag, MemoryError, PairKey, PairState, Partner, Repulsion,
    StandingGap, StepGeometry, TwistMobility,
};
use anderson::Anderson;
use coulomb::PairForce;
use near::{KnownForce, NearPairs};
use solve::Outcome;
use touch::{Touch, mean_radius};

pub use params::{FlowContactParams, Friction, NormalLaw};

/// Flows that the acceleration remembers.
const WINDOW: usize = 6;
/// Tangential forces within this share of the most are at the edge of their cone.
const AT_EDGE: f64 = 1e-9;
/// Pairs are known up to this gap beyond the roughness, in mean radii, wherever forces push particles.
const SPARE: f64 = 0.1;

/// Contacts between discs or spheres, and with walls, whose forces act in the flow.
#[derive(Debug)]
pub struct FlowContact<const D: usize> {
    params: FlowContactParams,
    domain: Domain<D>,
    walls_along: Vec<Vector<D>>,
    shear_factor: f64,
    rate: f64,
    neighbours: NeighbourList<D>,
    centers: Centers<D>,
    forces: Vec<ContactForce<D>>,
    repulsion: Option<Repulsion>,
    /// Forces by which pairs repelled each other in the last step, and in that of the last correction,
    /// sorted.
    repelled: [Vec<(PairKey, f64)>; 2],
    /// Those that act in the last flow.
    in_flow: Vec<ContactForce<D>>,
    /// Those of pairs with films, sorted.
    standing_gaps: Vec<StandingGap>,
    /// Memory of smooth surfaces after the last step.
    memory: ContactState,
    /// The rule by which that changes in the step of the last correction.
    rule: Option<GammaRule>,
    contacts: Vec<Contact>,
    /// Motions without the forces that the last correction began with, in the same step.
    free: Option<Vec<Twist<D>>>,
    /// Whether the next correction is of a flow that none was of.
    is_new_flow: bool,
    acceleration: Anderson,
}

impl<const D: usize> FlowContact<D> {
    /// Contacts within walls and periodic directions.
    pub fn new(params: FlowContactParams, domain: Domain<D>) -> Self {
        Self {
            params,
            domain,
            walls_along: Vec::new(),
            shear_factor: 1.0,
            rate: 1.0,
            neighbours: NeighbourList::default(),
            centers: Centers::default(),
            forces: Vec::new(),
            in_flow: Vec::new(),
            standing_gaps: Vec::new(),
            repulsion: None,
            repelled: Default::default(),
            memory: ContactState::default(),
            rule: None,
            contacts: Vec::new(),
            free: None,
            is_new_flow: true,
            acceleration: Anderson::new(WINDOW),
        }
    }

    /// The same with walls that move along themselves with these velocities, in their order.
    #[must_use]
    pub fn with_walls_along(self, velocities: Vec<Vector<D>>) -> Self {
        Self { walls_along: velocities, ..self }
    }

    /// Walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        &self.domain
    }

    /// Laws and tuning.
    pub fn params(&self) -> &FlowContactParams {
        &self.params
    }

    /// The forces of [`ContactModel::contacts`], one for each, over `6 pi eta`: pressing is their lambda.
    pub fn forces_of_contacts(&self) -> Vec<ContactForce<D>> {
        let is_contact = |pair| self.contacts.binary_search_by_key(&pair, |contact| contact.pair).is_ok();
        let forces = self.forces.iter().filter(|one| is_contact(one.pair));
        forces.map(|one| ContactForce { force: one.force / self.unit(), ..*one }).collect()
    }

    /// Force of a `lambda` of one.
    fn unit(&self) -> f64 {
        6.0 * PI * self.params.viscosity
    }

    /// The pair of this name, checked.
    fn touch(&self, pair: PairKey, step: &BodyStep<'_, D>) -> Result<Touch<D>, ContactError> {
        ContactError::unless_known(pair, step.poses.len(), self.domain.walls.len())?;
        let touch = Touch::new(pair, step, &self.domain, self.params.roughness());
        let mut touch = touch.ok_or(ContactError::Coincident { pair })?;
        if let Partner::Wall(wall) = pair.second {
            let along = self.walls_along.get(wall as usize).copied().unwrap_or_else(Vector::zeros);
            touch.slide += along * self.shear_factor;
        }
        let standing = self.standing_gaps.binary_search_by_key(&pair, |standing| standing.pair);
        standing.into_iter().for_each(|k| touch.follow(&self.standing_gaps[k]));
        if self.params.law == NormalLaw::None {
            touch.floor = f64::NEG_INFINITY;
        }
        Ok(touch)
    }

    /// What the forces in the flow load the particles with.
    fn loads_in_flow(&self, step: &BodyStep<'_, D>) -> Result<Vec<Wrench<D>>, ContactError> {
        let mut loads = vec![Wrench::default(); step.poses.len()];
        for force in &self.in_flow {
            self.touch(force.pair, step)?.add_to(&force.force, &mut loads);
        }
        Ok(loads)
    }

    /// Motions without the forces in the flow, accelerated; those of before where the flow is the same.
    fn without_contacts(
        &mut self,
        step: &BodyStep<'_, D>,
        mobility: &mut dyn TwistMobility<D>,
        flow: &[Twist<D>],
    ) -> Result<Vec<Twist<D>>, ContactError> {
        if let Some(free) = self.free.take_if(|_| !self.is_new_flow) {
            return Ok(free);
        }
        let mut free = vec![Twist::default(); step.poses.len()];
        mobility.respond(&self.loads_in_flow(step)?, &mut free);
        free.iter_mut().zip(flow).for_each(|(free, flow)| *free = *flow - *free);
        self.accelerate(step, &mut free);
        self.is_new_flow = false;
        Ok(free)
    }

    /// From the third flow on, goes on from a combination of the motions without forces.
    fn accelerate(&mut self, step: &BodyStep<'_, D>, free: &mut [Twist<D>]) {
        let Some(before) = &self.free else { return };
        let change: Vec<Twist<D>> = free.iter().zip(before).map(|(free, before)| *free - *before).collect();
        let touches = self.forces.iter().filter_map(|force| self.touch(force.pair, step).ok());
        let residual: Vec<Vector<D>> = touches.map(|touch| touch.velocity(&change) - touch.slide).collect();
        self.acceleration.next_twists(free, residual.iter().flatten().copied().collect());
    }

    /// The pairs that are near, with the forces that keep them apart, and the motions with these.
    fn solve(
        &mut self,
        step: &BodyStep<'_, D>,
        geometry: &StepGeometry<'_, D>,
        mobility: &mut dyn TwistMobility<D>,
        free: &[Twist<D>],
    ) -> Result<(NearPairs<D>, Outcome<D>), ContactError> {
        validate(geometry, free, &self.domain)?;
        let moves = step.moves(free);
        self.neighbours.margin = self.margin(step.radii);
        self.neighbours.begin(geometry, &self.domain, &moves)?;
        self.rule = match &self.params.law {
            NormalLaw::Rough { .. } | NormalLaw::None => None,
            NormalLaw::Smooth(law) => Some(GammaRule::new(law, step.velocity_weight, step.dt)),
        };
        let mut known = self.known_forces();
        loop {
            let mut near = self.near(step, mobility, &known)?;
            let outcome = near.solve(step, &self.params, self.rate, mobility, free)?;
            let moved = step.moves(&outcome.twists);
            let order = self.neighbours.order.iter();
            let by_place: Vec<Vector<D>> = order.map(|&particle| moved[particle as usize]).collect();
            if self.neighbours.is_sufficient(&self.domain, geometry, &by_place) {
                return Ok((near, outcome));
            }
            known = near.forces_by_pair();
            self.neighbours.extend(geometry, &self.domain, &moves, &moved)?;
        }
    }

    /// How far pairs are known, over the sum of their radii.
    fn margin(&self, radii: &[f64]) -> f64 {
        let of_contact = 0.5 * (self.params.roughness() + SPARE);
        let smallest = radii.iter().copied().fold(f64::INFINITY, f64::min);
        // Walls have no radius.
        let share = if self.domain.walls.is_empty() { 0.5 } else { 1.0 };
        self.repulsion.map_or(of_contact, |law| of_contact.max(share * law.reach() / smallest))
    }

    /// The pairs with a force or a memory, sorted.
    fn known_forces(&self) -> Vec<KnownForce<D>> {
        let remembered = self.memory.pairs.iter().map(|state| state.pair);
        let remembered = remembered.chain(self.repelled[0].iter().map(|(pair, _)| *pair));
        let forces = self.forces.iter().map(|force| (force.pair, force.force));
        let mut known: Vec<_> = forces.chain(remembered.map(|pair| (pair, Vector::zeros()))).collect();
        // Stable: forces come first.
        known.sort_by_key(|(pair, _)| *pair);
        known.dedup_by_key(|(pair, _)| *pair);
        let force = |(pair, force)| KnownForce { pair, force: PairForce::of_contact(force) };
        known.into_iter().map(force).collect()
    }

    /// The force by which a pair repelled each other in the last step.
    fn repelled(&self, pair: PairKey) -> f64 {
        let place = self.repelled[0].binary_search_by_key(&pair, |(pair, _)| *pair);
        place.map_or(0.0, |k| self.repelled[0][k].1)
    }

    /// The candidates of the search and the pairs with known forces, sorted.
    fn near(
        &self,
        step: &BodyStep<'_, D>,
        mobility: &dyn TwistMobility<D>,
        known: &[KnownForce<D>],
    ) -> Result<NearPairs<D>, ContactError> {
        let found = self.neighbours.candidates.iter().map(|candidate| self.neighbours.key(candidate));
        let mut pairs: Vec<PairKey> = found.chain(known.iter().map(|known| known.pair)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut near = NearPairs::default();
        for pair in pairs {
            let mut touch = self.touch(pair, step)?;
            touch.compliance = mobility.of_pair(pair);
            if let Some(rule) = &self.rule {
                let PairState { gamma, lambda, .. } = self.memory.get(pair);
                touch.least = rule.floor(gamma, lambda) * self.unit();
            }
            if let Some(law) = self.repulsion {
                touch.repel(law, self.repelled(pair), self.rate, step);
            }
            let place = known.binary_search_by_key(&pair, |known| known.pair);
            let none = PairForce::of_contact(Vector::zeros());
            near.forces.push(place.map_or(none, |k| known[k].force));
            near.takes_part.push(place.is_ok() && touch.can_yield());
            near.touches.push(touch);
        }
        Ok(near)
    }

    /// Takes over what was found.
    fn take_over(
        &mut self,
        step: &BodyStep<'_, D>,
        near: &NearPairs<D>,
        outcome: &Outcome<D>,
    ) -> FlowContactReport {
        let Outcome { iterations, residual, .. } = *outcome;
        let contact = ContactReport { iterations, residual, passes: 1, ..ContactReport::default() };
        let mut report = FlowContactReport { contact, change: 0.0 };
        let (mut change, mut size, mut forces) = (0.0, 0.0, Vec::new());
        let friction = self.params.friction;
        let mut repelled = Vec::new();
        for (touch, PairForce { contact: force, excess }) in near.parts() {
            repelled.extend(touch.repulsion.map(|law| (touch.pair, law.now + excess)));
            let before = self.in_flow.binary_search_by_key(&touch.pair, |before| before.pair);
            let before = before.map_or(Vector::zeros(), |k| self.in_flow[k].force);
            if touch.repulsion.is_some() && force.amax().max(before.amax()) == 0.0 {
                continue;
            }
            let gap = touch.gap_at_end(step, &outcome.twists);
            report.contact.count_pair(gap, touch.normal.dot(force), || touch.pair);
            change += touch.power(&(force - before));
            size += touch.power(force).max(touch.power(&before));
            let (most, held) =
                (friction.most(touch.normal.dot(force), self.rate), touch.across(force).norm());
            if force.amax() > 0.0 {
                let slides = held >= (1.0 - AT_EDGE) * most;
                report.contact.sliding_count += usize::from(slides);
                let slip = touch.across(&touch.velocity(&outcome.twists));
                let (branch, floor) = (touch.branch(), self.smallest_gap(touch.pair, step.radii));
                let known = ContactForce::known(touch.pair, touch.normal, *force);
                forces.push(ContactForce { branch, slip, gap, floor, slides, ..known });
            }
        }
        report.change = if change > 0.0 { (change / size).sqrt() } else { 0.0 };
        self.forces = forces;
        self.repelled[1] = repelled;
        report
    }
}

impl<const D: usize> FlowForces<D> for FlowContact<D> {
    fn set_surroundings(&mut self, tilt: f64, tilt_step: f64, shear_factor: f64) {
        self.domain.set_sliding(tilt, tilt_step);
        self.shear_factor = shear_factor;
    }

    fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
    }

    fn set_repulsion(&mut self, law: Repulsion) {
        self.repulsion = Some(law);
    }

    fn begin(&mut self, step: &BodyStep<'_, D>) -> Result<(), ContactError> {
        (self.free, self.is_new_flow) = (None, true);
        self.acceleration.restart();
        let turned = self.forces.iter().map(|force| {
            let touch = self.touch(force.pair, step)?;
            let (pressing, tangential) = (force.pressing(), force.tangential());
            let across = touch.across(&tangential);
            let scale = if across.norm() > 0.0 { tangential.norm() / across.norm() } else { 0.0 };
            Ok(ContactForce {
                normal: touch.normal,
                force: touch.normal * pressing + across * scale,
                branch: touch.branch(),
                ..*force
            })
        });
        turned.collect::<Result<_, ContactError>>().map(|forces| self.forces = forces)
    }

    fn is_reversible(&self) -> bool {
        self.forces.is_empty() || matches!(self.params.law, NormalLaw::Smooth(_))
    }

    fn forces(&self) -> &[ContactForce<D>] {
        &self.forces
    }

    fn stresses(&self) -> [Matrix<D>; 2] {
        let volume: f64 = self.domain.lattice.periods().iter().flatten().product();
        let moment = |one: &ContactForce<D>, force: Vector<D>| {
            let product = one.branch * force.transpose();
            (product + product.transpose()) * (-0.5 / volume)
        };
        let normal = self.forces.iter().map(|one| moment(one, one.normal * one.pressing()));
        let tangential = self.forces.iter().map(|one| moment(one, one.tangential()));
        [normal.sum(), tangential.sum()]
    }

    fn loads(&mut self, step: &BodyStep<'_, D>) -> Result<Vec<Wrench<D>>, ContactError> {
        self.in_flow.clone_from(&self.forces);
        self.is_new_flow = true;
        self.loads_in_flow(step)
    }

    fn smallest_gap(&self, pair: PairKey, radii: &[f64]) -> f64 {
        self.params.roughness() * mean_radius(pair, radii)
    }

    fn set_standing_gaps(&mut self, mut gaps: Vec<StandingGap>) {
        gaps.sort_unstable_by_key(|standing| standing.pair);
        self.standing_gaps = gaps;
    }

    fn correct(
        &mut self,
        step: &BodyStep<'_, D>,
        mobility: &mut dyn TwistMobility<D>,
        twists: &mut [Twist<D>],
    ) -> Result<FlowContactReport, ContactError> {
        let free = self.without_contacts(step, mobility, twists)?;
        let mut centers = std::mem::take(&mut self.centers);
        let found = self.solve(step, &centers.of(step), mobility, &free);
        self.centers = centers;
        let (near, outcome) = found?;
        twists.copy_from_slice(&outcome.twists);
        self.free = Some(free);
        Ok(self.take_over(step, &near, &outcome))
    }

    fn measure_gaps(&mut self, step: &BodyStep<'_, D>, twists: &[Twist<D>]) -> Result<(), ContactError> {
        for k in 0..self.forces.len() {
            self.forces[k].gap = self.touch(self.forces[k].pair, step)?.gap_at_end(step, twists);
        }
        Ok(())
    }

    fn finish(&mut self) {
        let unit = self.unit();
        let gamma = |pair: PairKey, lambda: f64| {
            let PairState { gamma, lambda: last, .. } = self.memory.get(pair);
            self.rule.map_or(0.0, |rule| rule.update(gamma, last, lambda))
        };
        let contact = |force: &ContactForce<D>| {
            let lambda = force.pressing() / unit;
            Contact { pair: force.pair, lambda, gamma: gamma(force.pair, lambda), gap: force.gap }
        };
        self.contacts = self.forces.iter().map(contact).collect();
        self.repelled.swap(0, 1);
        if self.rule.is_some() {
            let state = |one: &Contact| PairState { pair: one.pair, gamma: one.gamma, lambda: one.lambda };
            self.memory.pairs = self.contacts.iter().map(state).collect();
        }
        self.contacts.retain(|contact| contact.gamma < 0.0 || contact.lambda != 0.0);
    }
}

impl<const D: usize> ContactModel<D> for FlowContact<D> {
    /// In the metric of the drag that each particle has alone: the forces act in no flow.
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        let before = std::mem::take(&mut self.forces);
        self.in_flow.clear();
        self.is_new_flow = true;
        let mut drag = LoneDrag { viscosity: self.params.viscosity, radii: step.radii, is_held: &[] };
        self.free = None;
        match self.correct(step, &mut drag, twists) {
            Ok(report) => {
                self.finish();
                Ok(report.contact)
            }
            Err(error) => {
                self.forces = before;
                Err(error)
            }
        }
    }

    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn checkpoint(&self) -> ContactState {
        let numbers = |vector: &Vector<D>| std::array::from_fn(|d| vector.get(d).copied().unwrap_or(0.0));
        let state = |one: &ContactForce<D>| {
            let (normal, force) = (numbers(&one.normal), numbers(&one.force));
            ForceState { pair: one.pair, normal, force }
        };
        let in_flow = self.forces.iter().map(state).collect();
        ContactState { in_flow, repelled: self.repelled[0].clone(), ..self.memory.clone() }
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        let mut state = state.checked()?;
        let vector = |numbers: &[f64; 3]| Vector::<D>::from_fn(|d, _| numbers[d]);
        let force = |one: ForceState| ContactForce::known(one.pair, vector(&one.normal), vector(&one.force));
        self.forces = std::mem::take(&mut state.in_flow).into_iter().map(force).collect();
        self.repelled[0] = std::mem::take(&mut state.repelled);
        self.memory = state;
        self.contacts.clear();
        Ok(())
    }

    /// What pushed rough surfaces would pull them; smooth ones may pull.
    fn reverse(&mut self) {
        self.memory.reverse();
        match self.params.law {
            NormalLaw::Rough { .. } | NormalLaw::None => self.forces.clear(),
            NormalLaw::Smooth(_) => self.forces.iter_mut().for_each(|force| force.force = -force.force),
        }
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.domain.set_sliding(tilt, tilt_step);
    }

    fn in_flow(&mut self) -> Option<&mut dyn FlowForces<D>> {
        Some(self)
    }
}

#[cfg(test)]
mod tests;
