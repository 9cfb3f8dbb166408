//! How fast films close at the default tolerance, against solves that are converged: the speed is the smaller
//! the thinner the film, and no part of the error may be judged by anything that grows as the film closes.

use gluey_geom::{Aabb, Matrix, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, Flow, FlowParams, Refinement};

use crate::support::flow_solver;

const RADIUS: f64 = 0.1;

/// Gaps in radii: from what the mesh nearly resolves down to where a film counts as closed.
const GAPS: [f64; 9] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 3e-9, 1e-9];

/// The flow around balls in the linear flow of a gradient, in a box that is periodic in all directions.
fn flow<const D: usize>(balls: &[Ball<D>], level: u8, gradient: &Matrix<D>, tolerance: f64) -> Flow<D> {
    let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; D], [true; D], balls).unwrap();
    let params = FlowParams { tolerance, ..FlowParams::for_dimension(D) };
    let mut solver = flow_solver::<D>(params);
    solver.solve_under(mesh, balls, &Conditions::in_linear_flow(gradient)).unwrap()
}

/// Simple shear along the first axis, and a strain that has none of the symmetries of the bodies.
fn gradient<const D: usize>(is_oblique: bool) -> Matrix<D> {
    let mut gradient = Matrix::<D>::zeros();
    gradient[(0, 1)] = 1.0;
    if is_oblique {
        gradient[(0, 0)] = 0.7;
        gradient[(D - 1, D - 1)] = -0.7;
    }
    gradient
}

/// Rate of change of the distance of two balls.
fn opening<const D: usize>(flow: &Flow<D>, balls: &[Ball<D>], [i, j]: [usize; 2]) -> f64 {
    let branch = balls[j].center() - balls[i].center();
    // Each body beside the undisturbed flow first: that has no rounding where both move with it.
    let half = flow.strain * branch * 0.5;
    let relative = (flow.twists[j].velocity + half) - (flow.twists[i].velocity - half);
    relative.dot(&branch.normalize())
}

/// What a solve at the default tolerance says of two balls that approach, beside a converged one.
struct Approach {
    /// Speeds at which they do.
    speeds: [f64; 2],
    /// Relative error of the force of the film between them, its resistance times the speed without the
    /// rounding of velocities.
    force_error: f64,
}

/// Two balls that approach in shear, the line of their centres at 135 degrees to the flow.
fn pair<const D: usize>(level: u8, gap: f64) -> Approach {
    let mut arm = Vector::<D>::zeros();
    (arm[0], arm[1]) = (-1.0, 1.0);
    let arm = arm.normalize() * (RADIUS * (1.0 + 0.5 * gap));
    // A little off the centre, so that the balls lie on no line of the mesh.
    let mut center = Vector::<D>::repeat(0.4985);
    center[0] = 0.503;
    let balls = [center - arm, center + arm].map(|center| Ball::new(center, RADIUS));
    let flows = [FlowParams::for_dimension(D).tolerance, 1e-9]
        .map(|tolerance| flow(&balls, level, &gradient(false), tolerance));
    let speeds = [0, 1].map(|k| opening(&flows[k], &balls, [0, 1]));
    let forces = flows.map(|flow| flow.films[0].wrenches[0].force.dot(&arm));
    Approach { speeds, force_error: forces[0] / forces[1] - 1.0 }
}

/// Whether speeds differ by no more than this part of them and what doubles leave of a difference of
/// velocities: at a gap of 1e-9 radii discs close at 1e-14 of the speed of their surfaces.
fn is_close([speed, converged]: [f64; 2], relative: f64) -> bool {
    (speed - converged).abs() < relative * converged.abs() + 2.0 * f64::EPSILON * RADIUS
}

/// At every gap a pair of discs and one of spheres close as fast as converged solves say, to 0.003 and 0.3 %.
#[test]
fn thin_films_close_at_the_right_speed() {
    for gap in GAPS {
        let [discs, spheres] = [pair::<2>(6, gap), pair::<3>(5, gap)];
        for (name, pair, of_speed, of_force) in
            [("discs", discs, 3e-5, 3e-5), ("spheres", spheres, 3e-3, 3e-3)]
        {
            let Approach { speeds, force_error } = pair;
            let told = format!("{name}, gap {gap:e}: speeds {speeds:?}, force off by {force_error:.1e}");
            eprintln!("{told}");
            assert!(is_close(speeds, of_speed) && force_error.abs() < of_force, "{told}");
        }
    }
}

/// Eight spheres that nearly touch, at the corners of a cube: films at different speeds, in one network.
#[test]
fn films_of_a_cluster_close_at_the_right_speeds() {
    let radius = 0.08;
    for gap in [1e-2, 1e-5, 1e-8] {
        let edge = radius * (2.0 + gap);
        let place = |k: usize| Vector::<3>::from_fn(|d, _| 0.5037 + edge * ((k >> d & 1) as f64 - 0.5));
        let balls: Vec<Ball<3>> = (0..8).map(|k| Ball::new(place(k), radius)).collect();
        let flows = [1e-6, 1e-9].map(|tolerance| flow(&balls, 5, &gradient(true), tolerance));
        let pairs = (0..8usize).flat_map(|i| [1, 2, 4].map(|bit| [i, i | bit])).filter(|[i, j]| i != j);
        let speeds: Vec<[f64; 2]> =
            pairs.map(|pair| [0, 1].map(|k| opening(&flows[k], &balls, pair))).collect();
        let largest = speeds.iter().map(|speeds| speeds[1].abs()).fold(0.0, f64::max);
        let error = speeds.iter().map(|[a, b]| (a - b).abs()).fold(0.0, f64::max) / largest;
        eprintln!("gap {gap:e}: {error:.1e} of the largest speed, {} iterations", flows[0].iteration_count);
        assert!(speeds.len() == 12 && error < 3e-3, "gap {gap:e}: {error}");
    }
}
