//! What drives a flow: boundary, forces, and of the bodies either wrenches or twists.

use std::borrow::Cow;

use gluey_geom::{Matrix, Twist, Vector, Wrench};

use crate::error::StokesError;
use crate::formulation::Problem;

/// A vector field in the box.
pub type Field<'a, const D: usize> = &'a dyn Fn(&Vector<D>) -> Vector<D>;

/// Conditions that drive a flow.
///
/// Wrenches are those that something other than the fluid exerts on the bodies (weight, contact, a hand that
/// holds them); the fluid exerts the opposite. They come on top of what `force` exerts on the bodies: on the
/// nodes inside in `paper`, on the body as the mesh sees it in `unfitted`.
#[derive(Clone, Copy)]
pub struct Conditions<'a, const D: usize> {
    /// Velocity on the outer boundary. The same function, which must be divergence-free, is the undisturbed
    /// flow inside.
    pub boundary: Field<'a, D>,
    /// Force per unit of volume, on fluid and bodies alike.
    pub force: Option<Field<'a, D>>,
    /// Strain of a linear flow that velocities, spins and pressures are relative to, see
    /// [`Conditions::in_linear_flow`]; zero for none.
    pub strain: Matrix<D>,
    /// What is known of the bodies.
    pub bodies: Given<'a, D>,
    /// Whether [`crate::Flow::stress`] is wanted; `unfitted` only.
    pub stress: bool,
    /// See [`Conditions::without_mean_flow`].
    pub without_mean: bool,
}

/// Wrenches or motions that are known of the bodies, one entry each in their order; the other follows from
/// the flow.
#[derive(Clone, Copy, Debug)]
pub enum Given<'a, const D: usize> {
    /// Forces and torques on free bodies: the mobility problem. No entries: none on any of them.
    Wrenches(&'a [Wrench<D>]),
    /// Velocities and spins of held bodies: the resistance problem.
    Twists(&'a [Twist<D>]),
    /// The one or the other of each body: free bodies among held ones.
    Each(&'a [GivenOf<D>]),
}

/// A wrench or a motion that is known of one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GivenOf<const D: usize> {
    /// Force and torque on it: it is free.
    Wrench(Wrench<D>),
    /// Its velocity and spin: it is held.
    Twist(Twist<D>),
}

impl<const D: usize> GivenOf<D> {
    /// A body that is held at rest, or free without forces.
    pub fn at_rest(is_held: bool) -> Self {
        if is_held { Self::Twist(Twist::default()) } else { Self::Wrench(Wrench::default()) }
    }

    /// The force and torque on a body that is free.
    pub fn wrench(&self) -> Option<Wrench<D>> {
        match self {
            Self::Wrench(wrench) => Some(*wrench),
            Self::Twist(_) => None,
        }
    }

    /// The velocity and spin of a body that is held.
    pub fn twist(&self) -> Option<Twist<D>> {
        match self {
            Self::Wrench(_) => None,
            Self::Twist(twist) => Some(*twist),
        }
    }
}

impl<'a, const D: usize> Conditions<'a, D> {
    /// Free bodies without forces in a flow with this velocity on the boundary.
    pub fn boundary(boundary: Field<'a, D>) -> Self {
        Self {
            boundary,
            force: None,
            strain: Matrix::zeros(),
            bodies: Given::Wrenches(&[]),
            stress: false,
            without_mean: false,
        }
    }

    /// Free bodies without forces in the linear flow `G x`, whose trace is zero, in a box that is periodic in
    /// all directions.
    ///
    /// Velocity and pressure are those of the deviation `u - G x`, which is periodic and whose mean over
    /// fluid and bodies is zero; so are velocities and spins of bodies, given or found: relative to the
    /// undisturbed flow at the centre of the body. Forces, torques and stresslets are those of the whole
    /// flow.
    pub fn in_linear_flow(gradient: &Matrix<D>) -> Self {
        Self { strain: (gradient + gradient.transpose()) * 0.5, ..Self::at_rest() }
    }

    /// Free bodies without forces in a box at rest, where nothing moves.
    pub fn at_rest() -> Self {
        Self::boundary(&|_| Vector::zeros())
    }

    /// The same with a force per unit of volume.
    #[must_use]
    pub fn with_force(self, force: Option<Field<'a, D>>) -> Self {
        Self { force, ..self }
    }

    /// The wrenches on bodies that are all free; no entries where none act, or where any is held.
    pub(super) fn given_wrenches(&self) -> &'a [Wrench<D>] {
        match self.bodies {
            Given::Wrenches(wrenches) => wrenches,
            Given::Twists(_) | Given::Each(_) => &[],
        }
    }

    /// The same with the stress of the suspension.
    #[must_use]
    pub fn with_stress(self) -> Self {
        Self { stress: true, ..self }
    }

    /// The same with a uniform force on fluid and bodies, beside `force`, so that the mean velocity over both
    /// vanishes: around held bodies in a box that is periodic in all directions, where without it the mean
    /// gradient of the pressure is zero. It takes a solve more for each axis; `unfitted` only.
    #[must_use]
    pub fn without_mean_flow(self) -> Self {
        Self { without_mean: true, ..self }
    }

    /// The same with forces and torques on the bodies, which are free.
    #[must_use]
    pub fn with_wrenches(self, wrenches: &'a [Wrench<D>]) -> Self {
        Self { bodies: Given::Wrenches(wrenches), ..self }
    }

    /// The same with bodies that are held at these twists.
    #[must_use]
    pub fn with_twists(self, twists: &'a [Twist<D>]) -> Self {
        Self { bodies: Given::Twists(twists), ..self }
    }

    /// The same with free bodies among held ones, one entry for each.
    #[must_use]
    pub fn with_bodies(self, bodies: &'a [GivenOf<D>]) -> Self {
        Self { bodies: Given::Each(bodies), ..self }
    }

    /// # Errors
    /// [`StokesError::Count`] unless there is one entry for each of so many bodies, or none.
    pub fn check_count(&self, bodies: usize) -> Result<(), StokesError> {
        let (what, found) = match self.bodies {
            Given::Wrenches([]) => return Ok(()),
            Given::Wrenches(wrenches) => ("wrenches", wrenches.len()),
            Given::Twists(twists) => ("twists", twists.len()),
            Given::Each(each) => ("wrenches or twists", each.len()),
        };
        if found == bodies { Ok(()) } else { Err(StokesError::Count { what, found, bodies }) }
    }

    /// The wrenches on the bodies in a flow under these conditions: those given, or what they lack. All ranks
    /// call this.
    pub(super) fn wrenches(
        &self,
        problem: &Problem<D>,
        velocity: &[f64],
        pressure: &[f64],
    ) -> Result<Vec<Wrench<D>>, StokesError> {
        match self.bodies {
            Given::Wrenches([]) => Ok(vec![Wrench::default(); problem.all_bodies.len()]),
            Given::Wrenches(wrenches) => Ok(wrenches.to_vec()),
            Given::Twists(_) => problem.wrenches(velocity, pressure, self.force, &self.strain),
            Given::Each(bodies) => {
                let lacking = problem.wrenches(velocity, pressure, self.force, &self.strain)?;
                Ok(bodies.iter().zip(lacking).map(|(given, lacks)| given.wrench().unwrap_or(lacks)).collect())
            }
        }
    }

    /// Which of so many bodies are held; no entries where all are free.
    pub fn held(&self, count: usize) -> Vec<bool> {
        let held: Vec<bool> = match self.bodies {
            Given::Wrenches(_) => Vec::new(),
            Given::Twists(_) => vec![true; count],
            Given::Each(bodies) => bodies.iter().map(|given| given.twist().is_some()).collect(),
        };
        if held.contains(&true) { held } else { Vec::new() }
    }

    /// The twists of the bodies that are held, unless all are free.
    fn twists(&self) -> Option<Vec<Option<Twist<D>>>> {
        match self.bodies {
            Given::Wrenches(_) => None,
            Given::Twists(twists) => Some(twists.iter().map(|twist| Some(*twist)).collect()),
            Given::Each(bodies) => Some(bodies.iter().map(GivenOf::twist).collect()),
        }
    }

    /// The wrenches on free bodies, none on held ones; no entries where there are none on any.
    fn wrenches_on_free(&self) -> Vec<Wrench<D>> {
        match self.bodies {
            Given::Wrenches(wrenches) => wrenches.to_vec(),
            Given::Twists(_) => Vec::new(),
            Given::Each(bodies) => bodies.iter().map(|body| body.wrench().unwrap_or_default()).collect(),
        }
    }

    /// The field that carries the data, and its residual with the loads, of own cells and bodies.
    pub(super) fn data(&self, problem: &Problem<D>) -> Result<(Vec<f64>, Vec<f64>), StokesError> {
        let mut lift = problem.lift(self.boundary);
        if let Some(twists) = self.twists() {
            problem.set_twists(&twists, &mut lift)?;
        }
        let mut b = problem.right_hand_side(&lift, self.force);
        problem.add_strain(&self.strain, &mut b)?;
        problem.add_wrenches(&self.wrenches_on_free(), &mut b)?;
        problem.system.space.clear_held(&mut b);
        Ok((lift, b))
    }
}

/// The sums of wrenches of particles; no entries for none on any.
pub fn added<'a, const D: usize>(these: &'a [Wrench<D>], those: &'a [Wrench<D>]) -> Cow<'a, [Wrench<D>]> {
    match (these, those) {
        (these, []) => these.into(),
        ([], those) => those.into(),
        _ => these.iter().zip(those).map(|(this, that)| *this + *that).collect(),
    }
}
