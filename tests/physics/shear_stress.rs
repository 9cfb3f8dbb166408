//! Suspensions that are sheared at a given stress.

use gluey::Case;
use gluey_geom::Vector;

use crate::runs::{self, beside, case, centers, column, failure, ran};

/// Discs at 0.3 or spheres at 0.15 in a sheared box, which may repel each other.
fn suspension(dimension: usize, rest: &str) -> Case {
    let (count, fraction) = if dimension == 2 { (8, 0.3) } else { (3, 0.15) };
    case(&format!(
        "name = \"s\"\ndimension = {dimension}\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = {fraction}, count = {count}, seed = 5, min_gap = 0.05 }}\n\
         contact = {{ strategy = \"none\" }}\n{rest}\n\
         [flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = 2.0\nroot_cells = 1\ncoarsest_level = 2\n"
    ))
}

/// Columns of the rheology, and centres.
struct Seen<const D: usize> {
    time: Vec<f64>,
    rate: Vec<f64>,
    viscosity: Vec<f64>,
    rows: Vec<Vec<Vector<D>>>,
}

fn seen<const D: usize>(case: &Case) -> Seen<D> {
    ran(case, |csv| {
        let [time, rate, viscosity] =
            ["time", "shear_rate", "viscosity"].map(|name| column(&beside(csv, "rheology"), name));
        Seen { time, rate, viscosity, rows: centers(csv, case.particles.len()) }
    })
}

/// Without forces of their own discs go through the same states as at the rate one, bit for bit, and time is
/// the integral of the viscosity over the stress.
#[test]
fn without_forces_time_is_the_integral_of_the_viscosity() {
    let time = "time = { step = 0.05, end = 1.0 }";
    let at_stress = seen::<2>(&suspension(2, &format!("shear_stress = 2.5\n{time}")));
    let (viscosity, rows) = ran(&suspension(2, time), |csv| {
        (column(&beside(csv, "rheology"), "viscosity"), centers::<2>(csv, 8))
    });
    assert_eq!(at_stress.rows, rows);
    assert_eq!(at_stress.viscosity, viscosity);
    let mut sum = 0.0;
    for (k, viscosity) in viscosity.iter().enumerate() {
        if k > 0 {
            sum += 0.025 * (at_stress.viscosity[k - 1] + viscosity) / 2.5;
        }
        assert!((at_stress.time[k] - sum).abs() < 1e-14, "{k}: {} {sum}", at_stress.time[k]);
        assert!((at_stress.rate[k] * viscosity - 2.5).abs() < 1e-14);
    }
    println!("strain 1 at a stress of 2.5 takes {sum:.4}");
    assert!(sum > 0.5);
}

/// With repulsion the rate is that which makes the stress what it is to be: at this rate viscosity and
/// velocities are the same.
fn at_the_rate_that_follows_the_stress_is_that_given<const D: usize>(measured: [f64; 2]) {
    let rest = |step: f64| {
        format!("repulsion = {{ force = 5.0, range = 0.2 }}\ntime = {{ step = {step:e}, end = {step:e} }}")
    };
    let mut viscosities = Vec::new();
    for stress in [20.0, 100.0] {
        let text = format!("shear_stress = {stress:?}\n{}", rest(1e-6));
        let at_stress = seen::<D>(&suspension(D, &text));
        let rate = at_stress.rate[0];
        let at_rate = suspension(D, &format!("shear_rate = {rate:?}\n{}", rest(1e-6 / rate)));
        let (viscosity, rows) = ran(&at_rate, |csv| {
            (column(&beside(csv, "rheology"), "viscosity"), centers::<D>(csv, at_rate.particles.len()))
        });
        let miss = (rate * viscosity[0] / stress - 1.0).abs();
        let moves = |rows: &[Vec<Vector<D>>]| -> Vec<Vector<D>> {
            rows[1].iter().zip(&rows[0]).map(|(after, before)| after - before).collect()
        };
        let [by_strain, by_time] = [moves(&at_stress.rows), moves(&rows)];
        let differences = by_strain.iter().zip(&by_time).map(|(a, b)| (a - b).norm());
        let difference = differences.fold(0.0, f64::max);
        let largest = by_time.iter().map(|way| way.norm()).fold(0.0, f64::max);
        println!("{D}D, {stress}: rate {rate:.4}, stress {miss:.1e}, ways {:.1e}", difference / largest);
        assert!(miss < 3.0 * measured[0] && difference < 3.0 * measured[1] * largest, "{miss} {difference}");
        viscosities.push(at_stress.viscosity[0]);
    }
    // The relative viscosity depends on the stress: repulsion counts less at the larger one.
    assert!((viscosities[0] - viscosities[1]).abs() > 2e-3, "{viscosities:?}");
}

#[test]
fn with_repulsion_the_rate_makes_the_stress() {
    at_the_rate_that_follows_the_stress_is_that_given::<2>([4.1e-8, 7.2e-8]);
    at_the_rate_that_follows_the_stress_is_that_given::<3>([6.1e-7, 9.4e-6]);
}

/// Sheared forth and back in equal strains: at first the rate is that of free discs, then it depends on the
/// way.
#[test]
fn sheared_back_the_rate_changes_its_sign() {
    let case = suspension(2, "shear_stress = 3.0\ntime = { step = 0.05, end = 0.4, reverse_at = 0.2 }");
    let seen = seen::<2>(&case);
    assert!(seen.rate[..4].iter().all(|rate| *rate > 0.0) && seen.rate[4..].iter().all(|rate| *rate < 0.0));
    assert!(seen.time.windows(2).all(|time| time[1] > time[0]));
    let moved: f64 = seen.rows[8].iter().zip(&seen.rows[0]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    println!("farthest from the start: {:.1e} radii", moved / case.mean_radius());
    assert!(moved < 1e-2 * case.mean_radius(), "{moved}");
}

#[test]
fn a_stress_below_that_at_rest_is_told() {
    let rest = "repulsion = { force = 50.0, range = 0.5 }\ntime = { step = 0.1, end = 0.2 }";
    let error = failure(&suspension(2, &format!("shear_stress = 0.01\n{rest}")));
    let source = std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default();
    assert!(
        source.starts_with("shear_stress = 0.01: the suspension would flow backwards"),
        "{error}: {source}"
    );
}

#[test]
fn runs_resume_bit_by_bit() {
    let rest = "shear_stress = 20.0\nrepulsion = { force = 5.0, range = 0.2 }";
    let case2 = suspension(2, &format!("{rest}\ntime = {{ step = 0.05, end = 0.4, reverse_at = 0.25 }}"));
    runs::resumes_bit_by_bit(&case2, 3, &["rheology"]);
    let case3 = suspension(3, &format!("{rest}\ntime = {{ step = 0.05, end = 0.2 }}"));
    runs::resumes_bit_by_bit(&case3, 2, &["rheology"]);
    runs::threads_give_the_same_bits(&case3, &["rheology"]);
}
