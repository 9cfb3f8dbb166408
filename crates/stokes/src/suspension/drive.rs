//! What drives the flow of a configuration.
//!
//! Where the stress is given, the rate follows. The mean shear stress is `r A + B`, with `A` of the flow at
//! the rate one and `B` of the flow that forces between particles make at rest, their own share included.
//! Both are solved for on one mesh, so the rate `r = (sigma - B) / A` is exact. Velocities count by the
//! strain, `u_1 + u_2 / r`, as at the rate one. Contacts scale with the flow; their stress is known after the
//! step only and is no part of what is given.

use gluey_geom::{Vector, Wrench};
use gluey_motion::{Configuration, NextLoads, Prediction};

use super::Suspension;
use crate::error::StokesError;
use crate::flow::{Conditions, Flow, FlowSolver, FlowsOfStep, GivenOf, Stress, added};
use crate::space::Discretisation;

/// Conditions that drive the flow of a configuration.
pub struct Drive<'a, const D: usize> {
    /// All, but for [`Drive::pushes`].
    pub conditions: Conditions<'a, D>,
    /// Forces and torques whose flow at rest has a share in the stress that is given; elsewhere no entries.
    pub pushes: &'a [Wrench<D>],
    control: Option<StressControl>,
}

/// A shear stress that is given.
struct StressControl {
    stress: f64,
    /// The shear rate one, or minus one.
    direction: f64,
    viscosity: f64,
    volume: f64,
    /// Shear stress of the forces between particles themselves, and of contacts at this rate.
    of_pairs: f64,
    of_contacts: f64,
}

/// The forces between particles drive them faster than the stress that is given.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "shear_stress = {stress}: the suspension would flow backwards, for the stress of its repulsion at rest is \
     {at_rest:.6}; take a larger stress or less repulsion"
)]
pub struct NotDriven {
    /// The stress that is given.
    pub stress: f64,
    /// That at rest.
    pub at_rest: f64,
}

impl<const D: usize> Suspension<D> {
    /// Hands `solve` what drives the flow of a configuration in a fluid of this viscosity.
    ///
    /// In a box without walls the flow is relative to the undisturbed one. Where all particles are free
    /// there, forces that always act on them are balanced by a uniform one on all of the box, which is a mean
    /// gradient of the pressure; those of the configuration are between particles, and their sum is zero.
    /// Where some are held, these carry all of it; the mean gradient is the one given, or stops the mean
    /// flow.
    pub fn driven<T>(
        &self,
        configuration: &Configuration<'_, D>,
        viscosity: f64,
        solve: impl FnOnce(&Drive<'_, D>) -> T,
    ) -> T {
        let (undisturbed, is_sheared) = (self.undisturbed(configuration.shear_factor), self.is_sheared());
        let in_contact = configuration.contacts.map_or(&[][..], |contacts| &contacts.wrenches);
        let without = self.acting(configuration);
        let acting = added(&without, in_contact);
        let given = self.given_bodies(configuration, &acting);
        let control = self.control(configuration, viscosity);
        let wall = |x: &Vector<D>| undisturbed.velocity(x);
        let conditions = match is_sheared {
            true => Conditions::in_linear_flow(&undisturbed.gradient),
            false => Conditions::boundary(&wall),
        };
        let conditions = match given[..] {
            [] if control.is_some() => conditions.with_wrenches(in_contact),
            [] => conditions.with_wrenches(&acting),
            _ if is_sheared && self.force_density.is_none() => {
                conditions.with_bodies(&given).without_mean_flow()
            }
            _ => conditions.with_bodies(&given),
        };
        let density = self.density();
        let uniform = |_: &Vector<D>| density;
        let conditions =
            if density.norm() > 0.0 { conditions.with_force(Some(&uniform)) } else { conditions };
        let stress = is_sheared && given.is_empty() && (configuration.with_stress || control.is_some());
        let pushes = match control {
            Some(_) if without.iter().any(|wrench| wrench.force.amax() > 0.0) => &without[..],
            _ => &[],
        };
        solve(&Drive { conditions: Conditions { stress, ..conditions }, pushes, control })
    }

    /// Force per unit of volume on fluid and particles.
    fn density(&self) -> Vector<D> {
        if self.is_sheared() && self.given.is_empty() {
            let total: Vector<D> = self.wrenches.iter().map(|wrench| wrench.force).sum();
            return -total / self.domain.extent().product();
        }
        self.force_density.unwrap_or_else(Vector::zeros)
    }

    /// What is known of each particle; no entries where all are free.
    fn given_bodies(&self, configuration: &Configuration<'_, D>, acting: &[Wrench<D>]) -> Vec<GivenOf<D>> {
        let (factor, is_sheared) = (configuration.shear_factor, self.is_sheared());
        let undisturbed = self.undisturbed(factor);
        let place = |index: usize| &configuration.particles[index].pose.position;
        let of_body = |index: usize| match self.given_twist(index, factor) {
            Some(twist) if is_sheared => GivenOf::Twist(twist - undisturbed.twist(place(index))),
            Some(twist) => GivenOf::Twist(twist),
            None => GivenOf::Wrench(acting.get(index).copied().unwrap_or_default()),
        };
        (0..self.given.len()).map(of_body).collect()
    }

    fn control(&self, configuration: &Configuration<'_, D>, viscosity: f64) -> Option<StressControl> {
        let stress = self.shear_stress.filter(|_| self.is_sheared())?;
        Some(StressControl {
            stress,
            direction: self.shear_rate * configuration.shear_factor,
            viscosity,
            volume: self.domain.extent().product(),
            of_pairs: configuration.pair_stress[(0, 1)],
            of_contacts: configuration.contacts.map_or(0.0, |contacts| contacts.stress[(0, 1)]),
        })
    }
}

impl<const D: usize> Drive<'_, D> {
    /// The shear rate over that by which velocities count, from the stresses of the flow under the conditions
    /// and of that which the pushes make at rest, if there are any. Positive also while the shear is
    /// reversed; one where no stress is given.
    ///
    /// # Errors
    /// [`NotDriven`] if it is negative.
    pub fn rate(&self, driven: Option<&Stress<D>>, pushed: Option<&Stress<D>>) -> Result<f64, NotDriven> {
        let Some(control) = &self.control else { return Ok(1.0) };
        let StressControl { stress, direction, viscosity, volume, of_pairs, of_contacts } = *control;
        let of_bodies = |stress: Option<&Stress<D>>| stress.map_or(0.0, |it| it.of_bodies(volume)[(0, 1)]);
        let at_rate_one = viscosity * direction + of_bodies(driven) + of_contacts;
        if self.pushes.is_empty() {
            return Ok(direction * stress / at_rate_one);
        }
        let at_rest = of_pairs + of_bodies(pushed);
        let rate = (direction * stress - at_rest) / at_rate_one;
        match rate > 0.0 {
            true => Ok(rate),
            false => Err(NotDriven { stress, at_rest: direction * at_rest }),
        }
    }
}

impl<const D: usize> FlowSolver<D> {
    /// The flow of a configuration on its mesh, or on the part of it that a rank has, and what it predicts;
    /// after each flow `next` tells the loads of contacts for another one, until it tells none. All ranks
    /// call this, with the same configuration.
    ///
    /// # Errors
    /// Those of [`FlowSolver::solve_on`], and [`NotDriven`].
    pub fn predict<E: From<StokesError> + From<NotDriven>>(
        &mut self,
        discretisation: &Discretisation<D>,
        suspension: &Suspension<D>,
        configuration: &Configuration<'_, D>,
        next: &mut NextLoads<'_, D>,
    ) -> Result<(Flow<D>, Prediction<D>), E> {
        let (balls, viscosity) = (suspension.balls(configuration), self.viscosity());
        let mut flows = self.flows_of_step(discretisation, &balls);
        let mut loads = configuration.contacts.cloned();
        let mut last = None;
        loop {
            let now = Configuration { contacts: loads.as_ref(), ..*configuration };
            flows.set_looseness(loads.as_ref().map_or(1.0, |loads| loads.looseness));
            let (mut flow, rate) =
                suspension.driven(&now, viscosity, |drive| flows.solve_driven::<E>(drive))?;
            last.iter().for_each(|last| flow.count_effort_of(last));
            let prediction = suspension.prediction(&now, viscosity, &flow, rate);
            match next(&prediction) {
                Some(more) => (loads, last) = (Some(more), Some(flow)),
                None => return Ok((flow, prediction)),
            }
        }
    }
}

impl<const D: usize> FlowsOfStep<'_, D> {
    /// The flow that this drives, and [`Drive::rate`]. All ranks call this.
    fn solve_driven<E: From<StokesError> + From<NotDriven>>(
        &mut self,
        drive: &Drive<'_, D>,
    ) -> Result<(Flow<D>, f64), E> {
        let mut found = None;
        let inverse_rate = |driven: &Flow<D>, pushed: &Flow<D>| {
            let rate = drive.rate(driven.stress.as_ref(), pushed.stress.as_ref())?;
            found = Some(rate);
            Ok::<_, E>(rate.recip())
        };
        let flow = self.solve_combined(&drive.conditions, drive.pushes, inverse_rate)?;
        let rate = found.map_or_else(|| drive.rate(flow.stress.as_ref(), None), Ok)?;
        Ok((flow, rate))
    }
}
