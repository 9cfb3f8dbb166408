//! Whether a case can be compared with a reference solution.

use super::{Boundary, Case, Hydrodynamics};
use crate::reference::{MIDDLE, RADIUS, Reference};

/// How far from the reference's a particle may start, in radii.
const START_TOLERANCE: f64 = 1e-6;

/// Requirement of a comparison, and the case's value in its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mismatch {
    pub needs: String,
    pub found: String,
}

/// First mismatch that keeps `case` from being compared with `reference`.
pub(super) fn mismatch(case: &Case, reference: &Reference) -> Option<Mismatch> {
    other_flow(case, reference)
        .or_else(|| other_box(case, reference))
        .or_else(|| first_stranger(case, reference))
}

fn other_flow(case: &Case, reference: &Reference) -> Option<Mismatch> {
    let (dimension, count) = (reference.dimension(), reference.particle_count());
    let hydrodynamics =
        if reference.is_in_box() { Hydrodynamics::Stokes } else { Hydrodynamics::PairMobility };
    let found = case.flow.hydrodynamics;
    let turned = [("reverse_at", case.time.reverse_at), ("strain_amplitude", case.time.strain_amplitude)];
    let turned = turned.into_iter().find(|(_, value)| value.is_some());
    unless(case.dimension == dimension, format!("dimension {dimension}"), || {
        format!("dimension {}", case.dimension)
    })
    .or_else(|| {
        let found = || format!("{} particles", case.particles.len());
        unless(case.particles.len() == count, format!("{count} particles"), found)
    })
    .or_else(|| {
        let needs = format!("flow.hydrodynamics = \"{hydrodynamics}\"");
        unless(found == hydrodynamics, needs, || format!("\"{found}\""))
    })
    .or_else(|| {
        let needs = "particles without forces and torques";
        unless(!case.has_forces() && case.repulsion().is_none(), needs, || "some".to_owned())
    })
    .or_else(|| unless(case.shear_rate == 1.0, "shear_rate = 1", || format!("{}", case.shear_rate)))
    .or_else(|| {
        let found = || format!("time.{}", turned.map_or("", |(name, _)| name));
        unless(turned.is_none(), "a shear that is not reversed", found)
    })
}

/// Flow in a box needs that box and its boundary; without walls the height at which the shear is at rest
/// counts.
fn other_box(case: &Case, reference: &Reference) -> Option<Mismatch> {
    let (lower, upper, boundary) = (case.lower(), case.upper(), case.domain.boundary);
    if !reference.is_in_box() {
        let middle = 0.5 * (lower[1] + upper[1]);
        let needs = format!("a box whose middle is at y = {MIDDLE}");
        return unless(is_near(middle, MIDDLE), needs, || format!("its middle at y = {middle}"));
    }
    let is_unit = lower.iter().all(|&x| is_near(x, 0.0)) && upper.iter().all(|&x| is_near(x, 1.0));
    unless(is_unit, "the unit box, from 0 to 1", || format!("a box from {lower:?} to {upper:?}")).or_else(
        || {
            let needs = format!("domain.boundary = \"{}\"", Boundary::Couette);
            unless(boundary == Boundary::Couette, needs, || format!("\"{boundary}\""))
        },
    )
}

/// The first particle that is not one of the reference's at its start.
fn first_stranger(case: &Case, reference: &Reference) -> Option<Mismatch> {
    let mut particles = case.particles.iter().zip(reference.starts()).enumerate();
    particles.find_map(|(index, (particle, start))| {
        let start = &start[..reference.dimension()];
        let moves = particle.position.iter().zip(start).map(|(found, wanted)| found - wanted);
        let is_there = moves.fold(0.0, f64::hypot) <= START_TOLERANCE * RADIUS;
        let needs = format!("particle {} of radius {RADIUS} at {start:?}", index + 1);
        unless(is_there && particle.radius == RADIUS, needs, || {
            format!("radius {} at {:?}", particle.radius, particle.position)
        })
    })
}

/// A mismatch unless `is_so`.
fn unless(is_so: bool, needs: impl Into<String>, found: impl FnOnce() -> String) -> Option<Mismatch> {
    (!is_so).then(|| Mismatch { needs: needs.into(), found: found() })
}

/// Whether `x` is `wanted` but for rounding.
fn is_near(x: f64, wanted: f64) -> bool {
    (x - wanted).abs() <= 1e-12
}
