//! Two particles pressed together at a constant speed, then pulled apart at the same speed: the gluey law in
//! closed form.
//!
//! Predicted speeds `-v` until `T`, then `+v` (each particle, along the line of centres). Contact begins at
//! `t1 = D0 / 2v`, lasts as long in pull as in push, and ends at `2 T - t1`; afterwards
//! `D = 2 v (t - 2T + t1)`. With a floor `gamma_min` it ends at `T + |gamma_min| / (a v)`, where that is
//! earlier.

use gluey_contact::{
    ContactLaw, ContactParams, GammaUpdate, Mobility, PairContact, StepGeometry, StokesDrag,
};
use gluey_geom::{Twist, Vector};

const SPEED: f64 = 1.0;
const RADIUS: f64 = 0.5;
const FIRST_GAP: f64 = 0.3;
const TURN: f64 = 1.0;
const END: f64 = 2.0;

/// Gap at `END` by explicit Euler.
fn end_gap<const D: usize, M: Mobility<D>>(params: ContactParams, mobility: M, step_count: usize) -> f64 {
    let mut contact = PairContact::with_mobility(params, mobility);
    // Obliquely, so that no coordinate is special.
    let axis = Vector::<D>::from_fn(|d, _| 1.0 - 0.3 * d as f64).normalize();
    let distance = 2.0 * RADIUS + FIRST_GAP;
    let mut positions = [axis * (-0.5 * distance), axis * (0.5 * distance)];
    let dt = END / step_count as f64;
    for n in 0..step_count {
        let sign = if (n as f64 + 0.5) * dt < TURN { 1.0 } else { -1.0 };
        let mut twists = [Twist::<D>::default(); 2];
        (twists[0].velocity, twists[1].velocity) = (axis * (sign * SPEED), axis * (-sign * SPEED));
        let step = StepGeometry {
            positions: &positions,
            radii: &[RADIUS; 2],
            drift: &[Vector::zeros(); 2],
            velocity_weight: dt,
            dt,
        };
        contact.correct(&step, &mut twists).expect("a good step");
        for (position, twist) in positions.iter_mut().zip(&twists) {
            *position += twist.velocity * dt;
        }
    }
    (positions[1] - positions[0]).norm() - 2.0 * RADIUS
}

fn tuning(gamma_update: GammaUpdate) -> ContactParams {
    ContactParams { gamma_update, ..Default::default() }
}

fn check<const D: usize>() {
    let begin = FIRST_GAP / (2.0 * SPEED);
    let exact = 2.0 * SPEED * (END - 2.0 * TURN + begin);
    for step_count in [52, 104, 208] {
        let dt = END / step_count as f64;
        let error = end_gap::<D, _>(tuning(GammaUpdate::Paper), StokesDrag, step_count) - exact;
        assert!(error.abs() <= 2.0 * SPEED * dt * 1.01, "{step_count} steps: {error}");
        // The impulse of a pair is exact in every step, so the end is exact whatever the step.
        let error = end_gap::<D, _>(tuning(GammaUpdate::Consistent), StokesDrag, step_count) - exact;
        assert!(error.abs() < 1e-12, "{step_count} steps: {error:e}");
    }
    let inelastic = ContactParams { law: ContactLaw::Inelastic, ..Default::default() };
    let error = end_gap::<D, _>(inelastic, StokesDrag, 52) - 2.0 * SPEED * (END - TURN);
    assert!(error.abs() < 1e-12, "inelastic contact opens at once: {error:e}");
}

#[test]
fn a_contact_lasts_as_long_in_pull_as_in_push() {
    check::<2>();
    check::<3>();
}

#[test]
fn a_floor_of_gamma_releases_earlier() {
    let pull = 0.25;
    let gamma_min = Some(-RADIUS * SPEED * pull);
    let exact = 2.0 * SPEED * (END - TURN - pull);
    let rough = |gamma_update| ContactParams { gamma_min, ..tuning(gamma_update) };
    let error = end_gap::<3, _>(rough(GammaUpdate::Consistent), StokesDrag, 52) - exact;
    assert!(error.abs() < 1e-12, "{error:e}");
    for step_count in [52, 104, 208] {
        let error = end_gap::<3, _>(rough(GammaUpdate::Paper), StokesDrag, step_count) - exact;
        assert!(error.abs() <= 2.02 * SPEED * END / step_count as f64, "{error}");
    }
}

/// `M` times a common factor.
struct Heavier(f64);

impl<const D: usize> Mobility<D> for Heavier {
    fn own(&self, _particle: usize, radius: f64) -> f64 {
        1.0 / (self.0 * radius)
    }
}

#[test]
fn a_common_factor_of_the_mass_changes_nothing() {
    for gamma_update in [GammaUpdate::Paper, GammaUpdate::Consistent] {
        let one = end_gap::<2, _>(tuning(gamma_update), StokesDrag, 52);
        let other = end_gap::<2, _>(tuning(gamma_update), Heavier(37.0), 52);
        assert!((one - other).abs() < 1e-12, "{gamma_update:?}: {one} {other}");
    }
}
