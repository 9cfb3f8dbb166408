//! Particles of a case that are held or driven, and what drives the fluid beside them.

use gluey_geom::{Twist, Vector};

use super::error::Key;
use super::findings::CaseFindings;
use super::forces::{is_given, vector};
use super::{Boundary, Case, Formulation, Hydrodynamics, ParticleSpec};

impl Case {
    /// Whether any particle is held or driven.
    pub fn gives_motions(&self) -> bool {
        self.particles.iter().any(ParticleSpec::is_given_motion)
    }

    /// Velocity and spin of each particle of a checked case that is held or driven; no entries where all are
    /// free.
    pub(crate) fn given_twists<const D: usize>(&self) -> Vec<Option<Twist<D>>> {
        if !self.gives_motions() {
            return Vec::new();
        }
        let twist = |particle: &ParticleSpec| {
            let mut twist = Twist { velocity: vector::<D>(&particle.velocity), ..Twist::default() };
            let numbers = particle.spin.iter().flatten();
            numbers.enumerate().for_each(|(k, number)| twist.spin[k] = *number);
            particle.is_given_motion().then_some(twist)
        };
        self.particles.iter().map(twist).collect()
    }

    /// Indices of the particles that are held or driven.
    pub(crate) fn given_particles(&self) -> impl Iterator<Item = usize> + '_ {
        let particles = self.particles.iter().enumerate();
        particles.filter(|(_, particle)| particle.is_given_motion()).map(|(index, _)| index)
    }

    /// The force per unit of volume on fluid and particles of a checked case, where it is given.
    pub(crate) fn force_density<const D: usize>(&self) -> Option<Vector<D>> {
        self.body_force.is_some().then(|| vector(&self.body_force))
    }
}

/// Notes what does not go with a motion that is given to a particle.
pub(super) fn check_motion(case: &Case, particle: &ParticleSpec, key: &Key, findings: &mut CaseFindings) {
    if !particle.is_given_motion() {
        return;
    }
    let motion = if particle.held { "held" } else { "velocity" };
    let name = if particle.held || particle.velocity.is_some() { motion } else { "spin" };
    let mut unfit = |at: &str, needs: &str, found: &str| {
        findings.unfit(key.name(at), format!("`{at}`"), needs, found);
    };
    for (at, is_there) in [("velocity", particle.velocity.is_some()), ("spin", particle.spin.is_some())] {
        if particle.held && is_there {
            unfit(at, "a particle that is not held", "held = true");
        }
    }
    for (at, is_there) in [("force", particle.force.is_some()), ("torque", particle.torque.is_some())] {
        if is_there {
            let found = format!("`{name}`, by which it moves whatever acts on it");
            unfit(at, "a particle that is free", &found);
        }
    }
    if let Some((needs, found)) = other_model(case) {
        unfit(name, &needs, &found);
    }
}

/// What the finite-element flow around held bodies needs, and what a case has instead.
fn other_model(case: &Case) -> Option<(String, String)> {
    let (flow, needed) = (&case.flow, Formulation::Unfitted);
    match (flow.hydrodynamics, flow.formulation) {
        (Hydrodynamics::Stokes, formulation) if formulation == needed => None,
        (Hydrodynamics::Stokes, formulation) => {
            Some((format!("flow.formulation = \"{needed}\""), format!("\"{formulation}\"")))
        }
        (other, _) => {
            Some((format!("flow.hydrodynamics = \"{}\"", Hydrodynamics::Stokes), format!("\"{other}\"")))
        }
    }
}

/// Notes a force on fluid and particles that nothing carries, or that does nothing.
pub(super) fn check_force_density(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let Some(force) = case.body_force.as_ref().filter(|force| force.len() == case.dimension) else { return };
    let mut unfit = |needs: &str, found: &str| findings.unfit(key.clone(), "`body_force`", needs, found);
    if let Some((needs, found)) = other_model(case) {
        return unfit(&needs, &found);
    }
    let axes = ["x", "y", "z"].iter().zip(force).enumerate();
    let walled = axes.filter(|(axis, (_, f))| **f != 0.0 && case.period(*axis).is_none());
    let walled: Vec<&str> = walled.map(|(_, (name, _))| *name).collect();
    if let [first, ..] = walled[..] {
        let found = format!("domain.boundary = \"{}\"", case.domain.boundary);
        return unfit(&format!("a period along {first}"), &found);
    }
    let has_walls = case.domain.boundary != Boundary::Sheared;
    if is_given(&case.body_force) && !has_walls && !case.particles.is_empty() && !case.gives_motions() {
        unfit("a particle that is held, or walls", "neither");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_are_those_that_are_given() {
        let text = r#"
            name = "driven"
            dimension = 2
            particles = [{ position = [0.2, 0.5], radius = 0.05, held = true },
                         { position = [0.4, 0.5], radius = 0.05 },
                         { position = [0.6, 0.5], radius = 0.05, velocity = [0.5, -1.0] },
                         { position = [0.8, 0.5], radius = 0.05, spin = [2.0] }]
            time = { step = 1.0, end = 1.0 }
            flow = { formulation = "unfitted" }"#;
        let case = Case::parse(text, "driven.toml").expect("a good case");
        let twists = case.given_twists::<2>();
        let velocity = |k: usize| twists[k].map(|twist| (twist.velocity.x, twist.velocity.y, twist.spin[0]));
        assert_eq!(
            [0, 1, 2, 3].map(velocity),
            [Some((0.0, 0.0, 0.0)), None, Some((0.5, -1.0, 0.0)), Some((0.0, 0.0, 2.0))]
        );
        assert_eq!(case.given_particles().collect::<Vec<_>>(), [0, 2, 3]);
        assert!(!case.has_rheology() && !case.has_forces());
        let written = Case::parse(&case.to_toml().expect("text"), "written.toml").expect("a good case");
        assert_eq!(written.particles, case.particles);
    }
}
