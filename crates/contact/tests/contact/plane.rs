//! A sphere pressed on a plane and pulled off it: the gluey law in closed form (Maury 2007, DOI
//! 10.1051/proc:071812; Lefebvre 2009, DOI 10.1051/m2an/2008042).
//!
//! Predicted velocity `u* = -cos t` towards the plane, from the gap `h < 1`. Contact begins when
//! `sin t1 = h`. In contact `d gamma / dt = -a cos t`, so that `gamma = -a (sin t - h)` comes back to 0 at
//! `t2 = pi - t1`; afterwards the gap is again `h - sin t`. With a floor `gamma_min = -a m`, `m < 1 - h`,
//! contact ends when `sin t = 1 - m`, and afterwards the gap is `1 - m - sin t`.

use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, Domain, GammaUpdate, PairContact, PairKey, StepGeometry, Wall,
};
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::{Integrator, Scheme};
use gluey_testkit::convergence_order;

const RADIUS: f64 = 0.3;
const GAP: f64 = 0.35;
const END: f64 = 3.0;
/// Step counts that divide no time of the exact solution.
const STEP_COUNTS: [usize; 4] = [53, 106, 212, 424];

#[derive(Debug)]
struct Fall {
    begin: f64,
    end: f64,
    last_gap: f64,
}

fn fall<const D: usize>(params: ContactParams, scheme: Scheme, step_count: usize) -> Fall {
    let normal = Vector::<D>::from_fn(|d, _| 1.0 - 0.4 * d as f64).normalize();
    let wall = Wall::new(&Vector::repeat(0.1), &normal);
    let start = Vector::repeat(0.1) + normal * (RADIUS + GAP);
    let mut particles = [Particle::<D>::new(start, RADIUS)];
    let mut contact = PairContact::<D>::new(params).within(Domain::default().with_wall(wall));
    let mut integrator = Integrator::<D>::new(scheme);
    let dt = END / step_count as f64;
    let (mut begin, mut end) = (f64::NAN, f64::NAN);
    for n in 0..step_count {
        let time = n as f64 * dt;
        let velocity = normal * -time.cos();
        let mut twists = [Twist { velocity, ..Twist::default() }];
        let mut drift = [Vector::zeros()];
        integrator.drift(dt, &mut drift);
        let positions = [particles[0].pose.position];
        let step = StepGeometry {
            positions: &positions,
            radii: &[RADIUS],
            drift: &drift,
            velocity_weight: integrator.velocity_weight(dt),
            dt,
        };
        contact.correct(&step, &mut twists).expect("a good step");
        integrator.advance(dt, &mut particles, &twists);
        if let [touch] = contact.contacts() {
            assert_eq!(touch.pair, PairKey::wall(0, 0));
            assert!(touch.gamma <= 0.0 && touch.gap > -1e-14);
            begin = if begin.is_nan() { time } else { begin };
            // A pair that was released may be pulled a little longer by the history of the scheme, its gap
            // open.
            end = if touch.gap < 1e-12 { time + dt } else { end };
        }
    }
    let last_gap = wall.distance(&particles[0].pose.position) - RADIUS;
    Fall { begin, end, last_gap }
}

/// Errors of the beginning, the end and the last gap; the order of the last.
fn errors<const D: usize>(params: &ContactParams, scheme: Scheme, exact: &Fall) -> (Vec<[f64; 3]>, f64) {
    let table: Vec<[f64; 3]> = STEP_COUNTS
        .iter()
        .map(|&count| {
            let found = fall::<D>(params.clone(), scheme, count);
            [found.begin - exact.begin, found.end - exact.end, found.last_gap - exact.last_gap].map(f64::abs)
        })
        .collect();
    let steps: Vec<f64> = STEP_COUNTS.iter().map(|count| END / *count as f64).collect();
    let order = convergence_order(&steps, &table.iter().map(|row| row[2]).collect::<Vec<_>>());
    println!("{:?} {scheme:?}, order of the last gap {order:.2}", params.gamma_update);
    for (dt, row) in steps.iter().zip(&table) {
        println!("  dt {dt:.4}: begins off by {:.1e}, ends {:.1e}, last gap {:.1e}", row[0], row[1], row[2]);
        assert!(row[0] <= 1.01 * dt, "begins {} steps off", row[0] / dt);
        // To the end of a step; by Euler also a step for the sum that stands for the integral of `cos`, and
        // one for the memory that is cut off at 0.
        let step_count = if scheme == Scheme::Euler { 4.0 } else { 2.0 };
        assert!(row[1] <= step_count * dt, "ends {} steps off", row[1] / dt);
    }
    (table, order)
}

fn check<const D: usize>() {
    let begin = GAP.asin();
    let smooth = Fall { begin, end: std::f64::consts::PI - begin, last_gap: GAP - END.sin() };
    let floor: f64 = 0.4;
    let release = std::f64::consts::PI - (1.0 - floor).asin();
    let rough = Fall { begin, end: release, last_gap: 1.0 - floor - END.sin() };
    for (gamma_min, exact) in [(None, smooth), (Some(-RADIUS * floor), rough)] {
        let tuning = |gamma_update| ContactParams { gamma_update, gamma_min, ..Default::default() };
        let (_, order) = errors::<D>(&tuning(GammaUpdate::Paper), Scheme::Euler, &exact);
        assert!(order > 0.8, "first order, not {order}");
        let (table, order) = errors::<D>(&tuning(GammaUpdate::Consistent), Scheme::AdamsBashforth2, &exact);
        assert!(order > 1.5 || table[3][2] < 1e-5, "second order, not {order}");
    }
    let inelastic = ContactParams { law: ContactLaw::Inelastic, ..Default::default() };
    let exact = Fall { begin, end: std::f64::consts::FRAC_PI_2, last_gap: 1.0 - END.sin() };
    let (_, order) = errors::<D>(&inelastic, Scheme::Euler, &exact);
    assert!(order > 0.8, "first order, not {order}");
}

#[test]
fn a_sphere_leaves_the_plane_when_the_push_is_pulled_out() {
    check::<2>();
    check::<3>();
}
