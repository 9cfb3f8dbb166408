//! What goes with a shear stress: one that is given instead of a shear rate, and the one that is written.

use super::error::{Key, Problem};
use super::findings::Findings;
use super::{Boundary, Case, ParticleSpec};

/// Notes a stress beside a rate, or in a box that is not sheared for ever.
pub(super) fn check_shear_stress(case: &Case, root: &Key, findings: &mut Findings) {
    if case.shear_stress.is_none() {
        return;
    }
    let mut unfit = |needs: &str, found: String| {
        let choice = "`shear_stress`".to_owned();
        findings.add(root.name("shear_stress"), Problem::Unfit { choice, needs: needs.to_owned(), found });
    };
    if case.shear_rate != 1.0 {
        unfit("no shear_rate beside it", format!("shear_rate = {}", case.shear_rate));
    }
    if !case.is_sheared() {
        let needs = format!("domain.boundary = \"{}\"", Boundary::Sheared);
        unfit(&needs, format!("\"{}\"", case.domain.boundary));
    }
}

/// Notes a table of the rheology in a box that has none.
pub(super) fn check_rheology(case: &Case, key: Key, findings: &mut Findings) {
    if case.rheology.is_none() {
        return;
    }
    let (needs, found) = match (case.is_sheared(), case.shear_rate == 0.0) {
        (false, _) => {
            (format!("domain.boundary = \"{}\"", Boundary::Sheared), format!("\"{}\"", case.domain.boundary))
        }
        (true, true) => ("a shear rate that is not 0".to_owned(), "shear_rate = 0".to_owned()),
        (true, false) => return,
    };
    findings.add(key, Problem::Unfit { choice: "`[rheology]`".to_owned(), needs, found });
}

/// Notes the same where what holds or drives particles makes the stress none of the suspension.
pub(super) fn check_stress_of_free(case: &Case, key: Key, findings: &mut Findings) {
    if case.rheology.is_some() && case.gives_motions() {
        let (choice, needs) = ("`[rheology]`".to_owned(), "free particles".to_owned());
        let found = "a particle that is held or driven".to_owned();
        findings.add(key, Problem::Unfit { choice, needs, found });
    }
}

/// Notes what acts from outside on a suspension that is driven by a stress: then it is not the stress alone
/// that tells the rate.
pub(super) fn check_stress_alone(case: &Case, root: &Key, findings: &mut Findings) {
    if case.shear_stress.is_none() {
        return;
    }
    let forces = |particle: &ParticleSpec| particle.force.is_some() || particle.torque.is_some();
    let found = [
        (case.gravity.is_some(), "`gravity`"),
        (case.body_force.is_some(), "`body_force`"),
        (case.particles.iter().any(forces), "a force or torque on a particle"),
        (case.gives_motions(), "a particle that is held or driven"),
    ];
    for (_, found) in found.into_iter().filter(|(is_there, _)| *is_there) {
        let (choice, needs) =
            ("`shear_stress`".to_owned(), "free particles that nothing acts on from outside");
        let problem = Problem::Unfit { choice, needs: needs.to_owned(), found: found.to_owned() };
        findings.add(root.name("shear_stress"), problem);
    }
}
