//! Forces and torques on the particles of a case.

use std::f64::consts::PI;

use gluey_contact::FlowContactParams;
use gluey_contact::Repulsion;
use gluey_geom::ball_volume;
use gluey_geom::{Dim, Vector, Wrench};

use super::{Case, Metric, ParticleSpec, RepulsionSpec};

impl Case {
    /// Whether anything beside fluid, contact and what drives particles acts, that stays when the shear is
    /// reversed.
    pub fn has_forces(&self) -> bool {
        let of_particle = |particle: &ParticleSpec| is_given(&particle.force) || is_given(&particle.torque);
        is_given(&self.gravity) || is_given(&self.body_force) || self.particles.iter().any(of_particle)
    }

    /// The law by which particles repel each other, if they do.
    pub fn repulsion(&self) -> Option<Repulsion> {
        let (RepulsionSpec { force, range }, radius) = (&self.repulsion, self.mean_radius());
        (*force > 0.0).then_some(Repulsion { force: *force, range: range * radius, radius })
    }

    /// Whether forces of contacts act in the flow.
    pub(crate) fn acts_in_flow(&self) -> bool {
        self.contact.metric() == Metric::Flow
    }

    /// Contacts of a checked case whose forces act in the flow, in a fluid of viscosity one; `None` where
    /// they do not.
    pub(crate) fn flow_contact(&self) -> Option<FlowContactParams> {
        let unit_of_load = match self.shear_stress {
            Some(_) => 1.0,
            None => 6.0 * PI * self.mean_radius().powi(2) * self.shear_rate.abs(),
        };
        self.contact.in_flow(unit_of_load)
    }

    /// Force and torque on each particle of a checked case; no entries where there are none on any.
    pub(crate) fn wrenches<const D: usize>(&self) -> Vec<Wrench<D>> {
        let acts = |particle: &ParticleSpec| is_given(&particle.force) || is_given(&particle.torque);
        if !(is_given(&self.gravity) || self.particles.iter().any(acts)) {
            return Vec::new();
        }
        let gravity = vector(&self.gravity);
        let wrench = |particle: &ParticleSpec| {
            let mut torque = Dim::<D>::zero_spin();
            let numbers = particle.torque.iter().flatten();
            numbers.enumerate().for_each(|(k, number)| torque[k] = *number);
            Wrench { force: gravity * ball_volume::<D>(particle.radius) + vector(&particle.force), torque }
        };
        self.particles.iter().map(wrench).collect()
    }
}

/// The coordinates of a checked case, zero where they are not given.
pub(super) fn vector<const D: usize>(numbers: &Option<Vec<f64>>) -> Vector<D> {
    numbers.as_ref().map_or(Vector::zeros(), |numbers| Vector::<D>::from_fn(|d, _| numbers[d]))
}

/// Whether any of the numbers is not zero.
pub(super) fn is_given(numbers: &Option<Vec<f64>>) -> bool {
    numbers.iter().flatten().any(|&number| number != 0.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn weight_and_force_add_up() {
        let text = r#"
            name = "weights"
            dimension = 2
            gravity = [0.0, -2.0]
            particles = [{ position = [0.3, 0.5], radius = 0.1 }, { position = [0.7, 0.5], radius = 0.2 }]
            time = { step = 1.0, end = 1.0 }"#;
        let mut case = Case::parse(text, "weights.toml").expect("a good case");
        case.particles[1].force = Some(vec![0.5, 0.0]);
        case.particles[1].torque = Some(vec![-0.25]);
        let wrenches = case.wrenches::<2>();
        assert!((wrenches[0].force - Vector::<2>::new(0.0, -0.02 * PI)).norm() < 1e-15);
        assert!((wrenches[1].force - Vector::<2>::new(0.5, -0.08 * PI)).norm() < 1e-15);
        assert_eq!([wrenches[0].torque[0], wrenches[1].torque[0]], [0.0, -0.25]);
        case.gravity = Some(vec![0.0, 0.0]);
        assert!(case.has_forces());
        case.particles[1] = ParticleSpec::new(vec![0.7, 0.5], 0.2);
        assert!(!case.has_forces() && case.wrenches::<2>().is_empty());
    }
}
