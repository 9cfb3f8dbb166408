//! What goes with a shear stress: one that is given instead of a shear rate, and the one that is written.

use super::error::Key;
use super::findings::CaseFindings;
use super::{Boundary, Case, ParticleSpec};

/// The choice of a stress.
const STRESS: &str = "`shear_stress`";
/// The choice of a table of the rheology.
const TABLE: &str = "`[rheology]`";
/// What neither goes with.
const GIVEN: &str = "a particle that is held or driven";

/// Notes a stress beside a rate, or in a box that is not sheared for ever.
pub(super) fn check_shear_stress(case: &Case, root: &Key, findings: &mut CaseFindings) {
    if case.shear_stress.is_none() {
        return;
    }
    let key = root.name("shear_stress");
    if case.shear_rate != 1.0 {
        let found = format!("shear_rate = {}", case.shear_rate);
        findings.unfit(key.clone(), STRESS, "no shear_rate beside it", found);
    }
    if !case.is_sheared() {
        let needs = format!("domain.boundary = \"{}\"", Boundary::Sheared);
        findings.unfit(key, STRESS, needs, format!("\"{}\"", case.domain.boundary));
    }
}

/// Notes a table of the rheology in a box that has none.
pub(super) fn check_rheology(case: &Case, key: Key, findings: &mut CaseFindings) {
    if case.rheology.is_none() {
        return;
    }
    if !case.is_sheared() {
        let needs = format!("domain.boundary = \"{}\"", Boundary::Sheared);
        findings.unfit(key, TABLE, needs, format!("\"{}\"", case.domain.boundary));
    } else if case.shear_rate == 0.0 {
        findings.unfit(key, TABLE, "a shear rate that is not 0", "shear_rate = 0");
    }
}

/// Notes the same where what holds or drives particles makes the stress none of the suspension.
pub(super) fn check_stress_of_free(case: &Case, key: Key, findings: &mut CaseFindings) {
    if case.rheology.is_some() && case.gives_motions() {
        findings.unfit(key, TABLE, "free particles", GIVEN);
    }
}

/// Notes what acts from outside on a suspension that is driven by a stress: then it is not the stress alone
/// that tells the rate.
pub(super) fn check_stress_alone(case: &Case, root: &Key, findings: &mut CaseFindings) {
    if case.shear_stress.is_none() {
        return;
    }
    let forces = |particle: &ParticleSpec| particle.force.is_some() || particle.torque.is_some();
    let found = [
        (case.gravity.is_some(), "`gravity`"),
        (case.body_force.is_some(), "`body_force`"),
        (case.particles.iter().any(forces), "a force or torque on a particle"),
        (case.gives_motions(), GIVEN),
    ];
    for (_, found) in found.into_iter().filter(|(is_there, _)| *is_there) {
        let needs = "free particles that nothing acts on from outside";
        findings.unfit(root.name("shear_stress"), STRESS, needs, found);
    }
}
