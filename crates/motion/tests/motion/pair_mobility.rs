//! The pair mobility against the exact trajectory of two spheres in unbounded shear.

use gluey_geom::{Particle, Vector};
use gluey_motion::{
    Configuration, Hydrodynamics, Integrator, LinearFlow, PairMobility, PairMobilityError, Scheme,
};

const RADIUS: f64 = 0.05;
const REFERENCE: &str = include_str!("../../../../data/reference/pair3d_trajectory_unbounded.csv");

fn start() -> [Particle<3>; 2] {
    [[0.3, 0.525, 0.5], [0.7, 0.475, 0.5]].map(|x| Particle::new(Vector::<3>::from(x), RADIUS))
}

/// Rows `t, gap/a, theta, x1, y1, x2, y2, omega_z` at the multiples of 0.05.
fn reference() -> Vec<Vec<f64>> {
    let rows = REFERENCE.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    let rows = rows.map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect::<Vec<f64>>());
    rows.filter(|row| (row[0] / 0.05 - (row[0] / 0.05).round()).abs() < 1e-9).collect()
}

#[test]
fn the_exact_trajectory_is_followed() {
    let (substeps, rows) = (100, reference());
    assert!(rows.len() > 300);
    let dt = 0.05 / substeps as f64;
    let mut particles = start();
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let (mut worst_gap, mut worst_position, mut worst_spin) = (0f64, 0f64, 0f64);
    for row in &rows {
        let steps = (row[0] / dt).round() as usize;
        let gap = particles[0].gap(&particles[1]) / RADIUS;
        let there = flow.predict(&Configuration::at(row[0], &particles)).expect("a good pair");
        let exact = Vector::<3>::new(row[3], row[4], 0.5);
        worst_gap = worst_gap.max((gap - row[1]).abs());
        worst_position = worst_position.max((particles[0].pose.position - exact).norm() / RADIUS);
        worst_spin = worst_spin.max((there.twists[0].spin[2] - row[7]).abs());
        for n in 0..substeps {
            let now = Configuration::at((steps + n) as f64 * dt, &particles);
            let predicted = flow.predict(&now).expect("a good pair");
            integrator.advance(dt, &mut particles, &predicted.twists);
        }
    }
    println!("gap/a {worst_gap:e}, position/a {worst_position:e}, spin {worst_spin:e}");
    assert!(worst_gap < 1e-6, "{worst_gap:e}");
    assert!(worst_position < 1e-6, "{worst_position:e}");
    assert!(worst_spin < 1e-6, "{worst_spin:e}");
}

#[test]
fn a_gap_offset_lets_the_pair_overlap() {
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5)).with_gap_offset(0.2);
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let mut particles = start();
    let mut smallest = f64::INFINITY;
    for n in 0..200 {
        let predicted = flow.predict(&Configuration::at(0.05 * n as f64, &particles)).expect("a good pair");
        integrator.advance(0.05, &mut particles, &predicted.twists);
        smallest = smallest.min(particles[0].gap(&particles[1]) / RADIUS);
    }
    assert!((smallest + 0.177).abs() < 5e-3, "{smallest}");
}

#[test]
fn overlapping_spheres_turn_as_one() {
    let mut particles = start();
    particles[1].pose.position = particles[0].pose.position + Vector::<3>::new(0.04, 0.04, 0.0);
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
    let predicted = flow.predict(&Configuration::at(0.0, &particles)).expect("overlap is not an error");
    let n = Vector::<3>::new(1.0, 1.0, 0.0).normalize();
    let [first, second] = [0, 1].map(|k| predicted.twists[k].velocity);
    assert!((second - first).dot(&n).abs() < 1e-15);
}

#[test]
fn bad_pairs_are_named() {
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
    let [one, mut two] = start();
    let mut error = |particles: &[Particle<3>]| flow.predict(&Configuration::at(0.0, particles)).unwrap_err();
    assert_eq!(error(&[one]), PairMobilityError::ParticleCount { count: 1 });
    assert_eq!(error(&[one, one]), PairMobilityError::NoDirection { distance: 0.0 });
    two.radius = 0.06;
    assert_eq!(error(&[one, two]), PairMobilityError::UnequalRadii { first: 0.05, second: 0.06 });
    two = start()[1];
    two.pose.position.x = f64::NAN;
    assert!(matches!(error(&[one, two]), PairMobilityError::NoDirection { .. }));
}

/// The package carries a copy of the table, for it cannot reach outside its folder.
#[test]
fn the_packaged_table_is_the_reference() {
    let packaged = include_str!("../../data/sphere_pair_mobility_unbounded.csv");
    assert!(packaged == include_str!("../../../../data/reference/sphere_pair_mobility_unbounded.csv"));
}
