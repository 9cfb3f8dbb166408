//! The gluey contact as a limit of lubrication (section 2.5 of the paper): two spheres that are pushed
//! together and pulled apart again.
//!
//! Without the film they would approach at `cos t`, in radii. With a film of resistance `s a / g` beside a
//! drag of one the gap follows `(1 + s a/g) dg/dt = -cos t`, so
//!
//! `g + s a ln(g / a) = I(t)`, `I = g_0 + s a ln(g_0 / a) - sin t`.
//!
//! For `s -> 0` the gap tends to `I` where that is positive; where it is negative the gap tends to zero and
//! `s a ln(g / a)` to `I`, which is the gluey memory `gamma` but for its unit. Both sides are computed by
//! what runs use: films by [`FilmMemory::open`], contact by [`PairContact`].

use gluey_contact::{ContactModel, ContactParams, Film, FilmMemory, GammaUpdate, PairContact, PairKey};
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::{Integrator, Scheme};

use crate::book;
use gluey_pictures::{Canvas, Curve, Stroke, stack};

const FRAME_HEIGHT: f64 = 210.0;
const STEP: f64 = 0.005;
/// Gap at the beginning, in radii.
const FIRST_GAP: f64 = 0.5;
/// The films, `s`, with their colours from light to dark. With smaller ones gaps fall below what positions
/// resolve.
const FILMS: [(f64, &str); 4] = [(0.2, "#a9cdb8"), (0.1, "#6db08b"), (0.05, "#3a9566"), (0.025, "#1b7f4d")];
const GLUEY: Stroke = Stroke { color: "#0b4f9e", width: 1.8, dashes: Some("9 4") };

/// Gap and memory over time, in radii.
struct Encounter {
    gap: Vec<(f64, f64)>,
    memory: Vec<(f64, f64)>,
}

/// Gaps above, memories below.
pub fn limit() -> Canvas {
    let label = |s: f64| format!("lubrication, *s* = {s}");
    let mut runs: Vec<(String, Stroke, Option<Encounter>)> = FILMS
        .map(|(s, color)| (label(s), Stroke { color, width: 1.8, dashes: None }, lubricated(s)))
        .into_iter()
        .collect();
    runs.push(("gluey contact".to_owned(), GLUEY, gluey()));
    let curves = |points: fn(&Encounter) -> &Vec<(f64, f64)>| -> Vec<Curve> {
        let curve = |(label, stroke, run): &(String, Stroke, Option<Encounter>)| Curve {
            label: Some(label.clone()),
            stroke: *stroke,
            pieces: run.iter().map(|run| points(run).clone()).collect(),
        };
        runs.iter().map(curve).collect()
    };
    let chart = |label: &str, [min, max]: [f64; 2], curves: Vec<Curve>| {
        book::chart(book::linear("*t*", 0.0, 3.2, 0.5), book::linear(label, min, max, 0.1), curves)
    };
    let mut gaps = chart("*D*/*a*", [0.0, 0.5], curves(|run| &run.gap));
    gaps.notes =
        vec!["Two spheres that approach at the velocity cos *t*, but for film or contact.".to_owned()];
    gaps.x.label.clear();
    let memories = chart("*s* ln *D*/*a*,  *γ*", [-0.7, 0.0], curves(|run| &run.memory));
    stack(&[gaps, memories], |_| FRAME_HEIGHT)
}

fn pair() -> [Particle<3>; 2] {
    [0.0, 2.0 + FIRST_GAP].map(|x| Particle::new(Vector::<3>::new(x, 0.0, 0.0), 1.0))
}

/// Velocities at which the gap changes at this rate.
fn twists(rate: f64) -> [Twist<3>; 2] {
    [-0.5, 0.5].map(|side| Twist { velocity: Vector::<3>::new(side * rate, 0.0, 0.0), ..Twist::default() })
}

fn steps() -> impl Iterator<Item = f64> {
    (0..(std::f64::consts::PI / STEP) as usize).map(|n| n as f64 * STEP)
}

/// With a film of resistance `s a / g`; `None` if it closes.
fn lubricated(s: f64) -> Option<Encounter> {
    let (mut particles, mut integrator) = (pair(), Integrator::new(Scheme::AdamsBashforth2));
    let mut films = FilmMemory::default();
    let mut run = Encounter { gap: Vec::new(), memory: Vec::new() };
    for t in steps() {
        let gap = particles[0].gap(&particles[1]);
        run.gap.push((t, gap));
        run.memory.push((t, s * gap.ln()));
        let mut twists = twists(-t.cos() / (1.0 + s / gap));
        let branch = particles[1].pose.position - particles[0].pose.position;
        let slide = Vector::zeros();
        let film =
            Film { pair: PairKey::new(0, 1), branch, slide, is_held: [false; 2], gap, curvature_radius: 1.0 };
        integrator.with_step(STEP, &particles, |step| films.open(step, &[film], &mut twists)).ok()?;
        integrator.advance(STEP, &mut particles, &twists);
    }
    Some(run)
}

/// With gluey contact; `None` if that fails.
fn gluey() -> Option<Encounter> {
    let (mut particles, mut integrator) = (pair(), Integrator::new(Scheme::AdamsBashforth2));
    let params =
        ContactParams { exact_gap: true, gamma_update: GammaUpdate::Consistent, ..Default::default() };
    let mut contact = PairContact::new(params);
    let mut run = Encounter { gap: Vec::new(), memory: Vec::new() };
    for t in steps() {
        let gamma: f64 = contact.contacts().iter().map(|contact| contact.gamma).sum();
        run.gap.push((t, particles[0].gap(&particles[1])));
        // Impulses move the two spheres by gamma / a each.
        run.memory.push((t, 2.0 * gamma));
        let mut twists = twists(-t.cos());
        integrator.with_step(STEP, &particles, |step| contact.correct_bodies(step, &mut twists)).ok()?;
        integrator.advance(STEP, &mut particles, &twists);
    }
    Some(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gap and the memory of the thinnest film against the exact solution and against gluey contact.
    #[test]
    fn thin_films_tend_to_gluey_contact() {
        let gluey = gluey().unwrap();
        let mut last = f64::INFINITY;
        for (s, _) in FILMS {
            let run = lubricated(s).unwrap();
            let constant = FIRST_GAP + s * FIRST_GAP.ln();
            for (&(t, gap), &(_, memory)) in run.gap.iter().zip(&run.memory) {
                assert!((gap + memory - (constant - t.sin())).abs() < 2e-3, "{s} {t}: {gap} {memory}");
            }
            let apart = |(own, other): (&(f64, f64), &(f64, f64))| (own.1 - other.1).abs();
            let differences = run.gap.iter().zip(&gluey.gap).chain(run.memory.iter().zip(&gluey.memory));
            let difference = differences.map(apart).fold(0.0, f64::max);
            assert!(difference < 0.8 * last && difference < 5.0 * s * (1.0 / s).ln(), "{s}: {difference}");
            last = difference;
        }
    }
}
