//! Order, reversal, rotation and checkpoint of the integrators.

use gluey_geom::{Dim, Matrix, Particle, Twist, Vector, Wrench};
use gluey_motion::{BackgroundFlow, Configuration, Hydrodynamics, Integrator, LinearFlow, NoForces, Scheme};

fn unit<const D: usize>(axis: usize) -> Vector<D> {
    Vector::<D>::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 })
}

/// A particle off the centre of a rigidly turning flow, so that the exact answer is a circle.
fn turning<const D: usize>() -> LinearFlow<D> {
    let mut gradient = Matrix::<D>::zeros();
    (gradient[(0, 1)], gradient[(1, 0)]) = (-1.0, 1.0);
    LinearFlow { gradient, origin: Vector::zeros() }
}

/// Velocities in a multiple of the flow.
fn twists<const D: usize>(
    flow: LinearFlow<D>,
    shear_factor: f64,
    particles: &[Particle<D>],
) -> Vec<Twist<D>> {
    let now = Configuration { shear_factor, ..Configuration::at(0.0, particles) };
    BackgroundFlow::new(flow).predict(&now).expect("no forces").twists
}

/// A step in a multiple of the turning flow.
fn step<const D: usize>(factor: f64, integrator: &mut Integrator<D>, dt: f64, particles: &mut [Particle<D>]) {
    let twists = twists(turning(), factor, particles);
    integrator.advance(dt, particles, &twists);
}

fn quarter_turn_error<const D: usize>(scheme: Scheme, step_count: usize) -> f64 {
    let mut particles = [Particle::new(unit::<D>(0), 0.1)];
    let mut integrator = Integrator::new(scheme);
    let dt = std::f64::consts::FRAC_PI_2 / step_count as f64;
    for _ in 0..step_count {
        step(1.0, &mut integrator, dt, &mut particles);
    }
    let turned = Dim::<D>::rotate(&particles[0].pose.orientation, &unit::<D>(0));
    assert!((turned - unit::<D>(1)).norm() < 1e-12, "a constant spin turns exactly");
    (particles[0].pose.position - unit::<D>(1)).norm()
}

fn check_order<const D: usize>() {
    for (scheme, order) in [(Scheme::Euler, 1.0), (Scheme::AdamsBashforth2, 2.0)] {
        let errors = [40, 80, 160, 320].map(|n| quarter_turn_error::<D>(scheme, n));
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!((slope - order).abs() < 0.1, "{scheme}: slope {slope}, errors {errors:?}");
        }
    }
}

#[test]
fn euler_is_first_order_and_adams_bashforth_second() {
    check_order::<2>();
    check_order::<3>();
}

#[test]
fn the_linear_form_is_what_advance_does() {
    let dt = 0.1;
    for (scheme, rates) in [(Scheme::Euler, [0.1, 0.1]), (Scheme::AdamsBashforth2, [0.1, 0.15])] {
        let mut integrator = Integrator::new(scheme);
        let mut particles = [Particle::new(Vector::<2>::new(1.0, 0.3), 0.1)];
        for rate in rates {
            assert!((integrator.velocity_weight(dt) - rate).abs() < 1e-16);
            let mut drift = [Vector::zeros()];
            integrator.drift(dt, &mut drift);
            let twists = twists(turning(), 1.0, &particles);
            let expected =
                particles[0].pose.position + (twists[0].velocity * integrator.velocity_weight(dt) + drift[0]);
            integrator.advance(dt, &mut particles, &twists);
            assert_eq!(particles[0].pose.position, expected);
        }
    }
}

/// Error of coming back after `n` steps there and `n` back.
fn return_error(scheme: Scheme, n: usize, turn: fn(&mut Integrator<2>)) -> f64 {
    let dt = 1.0 / n as f64;
    let mut integrator = Integrator::new(scheme);
    let start = Vector::<2>::new(1.0, 0.3);
    let mut particles = [Particle::new(start, 0.1)];
    for factor in [1.0, -1.0] {
        for _ in 0..n {
            step(factor, &mut integrator, dt, &mut particles);
        }
        turn(&mut integrator);
    }
    (particles[0].pose.position - start).norm()
}

#[test]
fn reversal_keeps_second_order_and_ignoring_it_does_not() {
    let slope = |turn| {
        let errors = [100, 200].map(|n| return_error(Scheme::AdamsBashforth2, n, turn));
        (f64::log2(errors[0] / errors[1]), errors[1])
    };
    let (reversed, error) = slope(Integrator::reverse);
    assert!(reversed > 1.9 && error < 1e-4, "slope {reversed}, error {error:e}");
    let (ignored, _) = slope(|_| ());
    assert!(ignored < 1.2, "slope {ignored}");
    assert!(slope(Integrator::restart).0 > 1.9);
}

#[test]
fn the_step_after_a_reversal_goes_back_over_the_last() {
    let dt = 0.01;
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let mut particles = [Particle::new(Vector::<2>::new(1.0, 0.3), 0.1)];
    for _ in 0..9 {
        step(1.0, &mut integrator, dt, &mut particles);
    }
    let before = particles[0].pose.position;
    step(1.0, &mut integrator, dt, &mut particles);
    integrator.reverse();
    step(-1.0, &mut integrator, dt, &mut particles);
    let error = (particles[0].pose.position - before).norm();
    assert!(error < dt.powi(3), "{error:e}");
}

#[test]
fn a_checkpoint_resumes_bit_for_bit() {
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let mut particles = [Particle::new(Vector::<3>::new(1.0, 0.3, 0.2), 0.1)];
    for _ in 0..5 {
        step(1.0, &mut integrator, 0.1, &mut particles);
    }
    let bytes = postcard::to_stdvec(&integrator).expect("serialises");
    let mut resumed: Integrator<3> = postcard::from_bytes(&bytes).expect("comes back");
    let mut others = particles;
    for _ in 0..5 {
        step(1.0, &mut integrator, 0.1, &mut particles);
        step(1.0, &mut resumed, 0.1, &mut others);
    }
    assert_eq!(particles, others);
}

#[test]
fn schemes_have_names() {
    let names = [Scheme::Euler, Scheme::AdamsBashforth2].map(|scheme| scheme.to_string());
    assert_eq!(names, ["euler", "adams-bashforth-2"]);
}

fn check_shear<const D: usize>() {
    let particles = [Particle::new(Vector::<D>::repeat(0.75), 0.1)];
    let twists = twists(LinearFlow::shear(2.0, 0.5), -1.0, &particles);
    assert_eq!(twists[0].velocity, unit::<D>(0) * -0.5);
    // Clockwise at half the shear rate, reversed; about z in 3D.
    let spin = Dim::<D>::spin_slice(&twists[0].spin);
    assert_eq!(spin.last(), Some(&1.0));
    assert!(spin.iter().rev().skip(1).all(|w| *w == 0.0));
}

#[test]
fn shear_carries_and_turns() {
    check_shear::<2>();
    check_shear::<3>();
}

#[test]
fn forces_are_refused_where_none_are_answered_to() {
    let mut flow = BackgroundFlow::new(turning::<2>());
    let particles = [Particle::new(Vector::<2>::new(1.0, 0.3), 0.1)];
    let pushed = Configuration { wrenches: &[Wrench::default()], ..Configuration::at(0.0, &particles) };
    assert_eq!((flow.answers_to_forces(), flow.predict(&pushed)), (false, Err(NoForces)));
}
