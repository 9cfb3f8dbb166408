//! Whether a case can be compared with a reference solution.

use super::{Boundary, Case, Hydrodynamics};
use crate::reference::{MIDDLE, RADIUS, ReferenceSolution};

/// How far from the reference's a particle may start, in radii.
const START_TOLERANCE: f64 = 1e-6;

/// First mismatch that keeps `case` from being compared with `reference`: what is required, and the case's
/// value in its place.
pub(super) fn mismatch(case: &Case, reference: &ReferenceSolution) -> Option<(String, String)> {
    let mut all = flow(case, reference).into_iter().chain(surroundings(case, reference));
    let first = all.find(|(is_so, ..)| !is_so);
    let first = first.map(|(_, needs, found)| (needs, found));
    first.or_else(|| first_stranger(case, reference))
}

/// A requirement of a comparison: whether it is met, what it is, and what the case has.
type Requirement = (bool, String, String);

fn flow(case: &Case, reference: &ReferenceSolution) -> Vec<Requirement> {
    let (dimension, count) = (reference.dimension(), reference.particle_count());
    let hydrodynamics =
        if reference.is_in_box() { Hydrodynamics::Stokes } else { Hydrodynamics::PairMobility };
    let (model, particles, rate) = (case.flow.hydrodynamics, case.particles.len(), case.shear_rate);
    let turned = [("reverse_at", case.time.reverse_at), ("strain_amplitude", case.time.strain_amplitude)];
    let turned = turned.into_iter().find(|(_, value)| value.is_some());
    let is_free = !case.has_forces() && case.repulsion().is_none();
    vec![
        (
            case.dimension == dimension,
            format!("dimension {dimension}"),
            format!("dimension {}", case.dimension),
        ),
        (particles == count, format!("{count} particles"), format!("{particles} particles")),
        (model == hydrodynamics, format!("flow.hydrodynamics = \"{hydrodynamics}\""), format!("\"{model}\"")),
        (is_free, "particles without forces and torques".into(), "some".into()),
        (rate == 1.0, "shear_rate = 1".into(), rate.to_string()),
        (
            turned.is_none(),
            "a shear that is not reversed".into(),
            format!("time.{}", turned.map_or("", |(name, _)| name)),
        ),
    ]
}

/// Flow in a box needs that box and its boundary; without walls the height at which the shear is at rest
/// counts.
fn surroundings(case: &Case, reference: &ReferenceSolution) -> Vec<Requirement> {
    let (lower, upper, boundary) = (case.lower(), case.upper(), case.domain.boundary);
    if !reference.is_in_box() {
        let middle = 0.5 * (lower[1] + upper[1]);
        let needs = format!("a box whose middle is at y = {MIDDLE}");
        return vec![(is_near(middle, MIDDLE), needs, format!("its middle at y = {middle}"))];
    }
    let is_unit = lower.iter().all(|&x| is_near(x, 0.0)) && upper.iter().all(|&x| is_near(x, 1.0));
    let needed = format!("domain.boundary = \"{}\"", Boundary::Couette);
    vec![
        (is_unit, "the unit box, from 0 to 1".into(), format!("a box from {lower:?} to {upper:?}")),
        (boundary == Boundary::Couette, needed, format!("\"{boundary}\"")),
    ]
}

/// The first particle that is not one of the reference's at its start.
fn first_stranger(case: &Case, reference: &ReferenceSolution) -> Option<(String, String)> {
    let mut particles = case.particles.iter().zip(reference.starts()).enumerate();
    particles.find_map(|(index, (particle, start))| {
        let start = &start[..reference.dimension()];
        let moves = particle.position.iter().zip(start).map(|(found, wanted)| found - wanted);
        let is_there = moves.fold(0.0, f64::hypot) <= START_TOLERANCE * RADIUS;
        let needs = format!("particle {} of radius {RADIUS} at {start:?}", index + 1);
        let found = format!("radius {} at {:?}", particle.radius, particle.position);
        (!(is_there && particle.radius == RADIUS)).then_some((needs, found))
    })
}

/// Whether `x` is `wanted` but for rounding.
fn is_near(x: f64, wanted: f64) -> bool {
    (x - wanted).abs() <= 1e-12
}
