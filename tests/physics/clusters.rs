//! Clusters of up to a thousand touching discs, from the case to the end of a run: contact converges, and
//! nothing overlaps.

use std::fs;

use gluey::case::ParticleSpec;
use gluey::{Case, RunError, RunOptions, RunReport, Silent, StepError};
use gluey_contact::{ContactError, SolverKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::runs::run;

const RADIUS: f64 = 0.5;

/// Discs in the middle of a square box, on the coarsest mesh there may be.
fn case(side: f64, centers: impl Iterator<Item = [f64; 2]>) -> Case {
    let text = format!(
        "name = \"cluster\"\ndimension = 2\n[domain]\nupper = [{side}, {side}]\n\
         [[particles]]\nposition = [1.0, 1.0]\nradius = {RADIUS}\n\
         [time]\nstep = 0.005\nend = 0.01\n[flow]\nformulation = \"paper\"\n\
         [flow.mesh]\ncells_per_radius = 1.0\ncoarsest_level = 0\nband = 0.0\n"
    );
    let mut case = Case::parse(&text, "cluster.toml").expect("a good case");
    case.particles = centers.map(|center| ParticleSpec::new(center.to_vec(), RADIUS)).collect();
    let middle = |d: usize| {
        let bounds = case.particles.iter().map(|particle| particle.position[d]);
        let (low, high) =
            bounds.fold((f64::INFINITY, 0.0), |(low, high), x| (f64::min(low, x), f64::max(high, x)));
        0.5 * (low + high)
    };
    let shift = [0, 1].map(|d| (0.5 * side - middle(d)).round());
    for particle in &mut case.particles {
        (0..2).for_each(|d| particle.position[d] += shift[d]);
    }
    case
}

/// The report of a run, and its trajectory.
fn report(case: &Case) -> (RunReport, String) {
    let folder = tempfile::TempDir::new().expect("a folder");
    let csv = folder.path().join("out.csv");
    let report = run(case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error:?}"));
    println!("{report}");
    assert!(report.min_gap_over_a.is_some_and(|gap| gap > -1e-9), "{report}");
    (report, fs::read_to_string(csv).expect("a trajectory"))
}

#[test]
fn a_thousand_discs_on_a_square_lattice() {
    // Neighbours touch exactly: there are more contacts than degrees of freedom can tell apart.
    let case = case(40.0, (0..1000).map(|i| [f64::from(i % 32), f64::from(i / 32)]));
    assert_eq!(report(&case).0.steps, 2);
}

#[test]
fn a_thousand_discs_densely_packed_out_of_order() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut near = move |x: f64| 1.01 * x + random.random_range(-0.004..0.004);
    let row = 0.75f64.sqrt();
    let site = |i: i32| [f64::from(i % 32) + 0.5 * f64::from(i / 32 % 2), row * f64::from(i / 32)];
    let case = case(40.0, (0..1000).map(site).map(|[x, y]| [near(x), near(y)]));
    assert_eq!(report(&case).0.steps, 2);
}

/// In the direction in which the shear presses them together.
fn chain(count: i32) -> Case {
    case(
        f64::from(count),
        (0..count).map(move |i| [0.8 * f64::from(i), 0.6 * f64::from(count - i)].map(|x| x * (1.0 + 1e-12))),
    )
}

#[test]
fn two_hundred_discs_in_a_row() {
    assert_eq!(report(&chain(200)).0.steps, 2);
}

#[test]
fn the_solver_of_contact_does_not_change_the_motion() {
    let mut case = chain(12);
    let mut trajectory = |solver: SolverKind| {
        case.contact.solver = solver;
        let numbers = |row: &str| row.split(',').map(|x| x.parse::<f64>().expect("a number")).collect();
        report(&case).1.lines().skip(1).map(numbers).collect::<Vec<Vec<f64>>>()
    };
    let auto = trajectory(SolverKind::Auto);
    for solver in SolverKind::ALL {
        let other = trajectory(solver);
        let pairs = auto.iter().flatten().zip(other.iter().flatten());
        let difference = pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        assert!(difference < 1e-9, "{solver}: {difference:e}");
    }
}

#[test]
fn a_solver_that_does_not_converge_is_an_error_with_its_numbers() {
    let mut case = chain(400);
    case.contact.solver = SolverKind::Uzawa;
    case.time.end = case.time.step;
    let folder = tempfile::TempDir::new().expect("a folder");
    let error = run(&case, &RunOptions::csv(folder.path().join("out.csv")), &Silent).expect_err("too slow");
    let RunError::Step(StepError::Contact { source, .. }) = &error else { panic!("{error:?}") };
    let ContactError::NotConverged { residual, tolerance, iterations, history, .. } = source else {
        panic!("{source}")
    };
    assert!(residual > tolerance && *iterations == 500_000, "{source}");
    assert!(history.entries.len() > 15 && history.entries.is_sorted_by_key(|entry| entry.0));
    assert!(source.to_string().contains("after 500000 iterations; worst contact: particles"), "{source}");
}
