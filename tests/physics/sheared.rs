//! Suspensions that are sheared for ever.

use gluey::Case;
use gluey_geom::Vector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::runs::{self, beside, centers, column, ran, rms_distance};

/// Six discs at 0.2, or three spheres, in a box that is sheared.
fn case(dimension: usize, rest: &str) -> Case {
    let (count, fraction) = if dimension == 2 { (6, 0.2) } else { (3, 0.1) };
    let text = format!(
        "name = \"s\"\ndimension = {dimension}\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = {fraction}, count = {count}, seed = 3, min_gap = 0.05 }}\n\
         contact = {{ strategy = \"none\" }}\n{rest}\n\
         [flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = 2.0\nroot_cells = 1\ncoarsest_level = 2\n"
    );
    runs::case(&text)
}

/// Over more than a unit of strain, with the tilt wrapped round twice.
#[test]
fn the_viscosity_is_continuous_and_the_same_by_two_routes() {
    let case = case(2, "time = { step = 0.05, end = 1.6 }\nrheology = { every = 2 }");
    let [viscosity, other] = ran(&case, |csv| {
        ["viscosity", "viscosity_by_dissipation"].map(|name| column(&beside(csv, "rheology"), name))
    });
    assert_eq!(viscosity.len(), 17);
    let miss = viscosity.iter().zip(&other).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    assert!(miss < 5e-3, "{miss}");
    // Second differences see a jump where the tilt wraps round, at a strain of 0.5 and of 1.5.
    let bend = viscosity.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs()).fold(0.0, f64::max);
    let range = viscosity.iter().fold(0.0f64, |range, v| range.max((v - viscosity[0]).abs()));
    println!("routes {miss:.1e}, bend {bend:.1e}, range {range:.1e}");
    assert!(bend < 0.5 * range && viscosity.iter().all(|v| (1.3..2.5).contains(v)), "{viscosity:?}");
}

/// The particles of a case as a list, moved and copied, in a box of so many copies along x.
fn moved(case: &Case, by: &[f64], copies: usize) -> Case {
    let mut moved = case.clone();
    let (lower, upper) = (case.lower(), case.upper());
    moved.particles.clear();
    for copy in 0..copies {
        for particle in &case.particles {
            let mut particle = particle.clone();
            for (d, x) in particle.position.iter_mut().enumerate() {
                *x = lower[d] + (*x + by[d] - lower[d]).rem_euclid(upper[d] - lower[d]);
            }
            particle.position[0] += copy as f64 * (upper[0] - lower[0]);
            moved.particles.push(particle);
        }
    }
    let mut corner = upper;
    corner[0] = lower[0] + copies as f64 * (corner[0] - lower[0]);
    moved.domain.upper = Some(corner);
    moved.check().unwrap_or_else(|error| panic!("{error}"));
    moved
}

/// How far particles went, less what the shear takes along where they began and less the way of the first, in
/// mean radii, and the viscosity in every row.
fn way_and_viscosity<const D: usize>(case: &Case) -> (Vec<Vector<D>>, Vec<f64>) {
    let count = case.particles.len();
    ran(case, |csv| {
        let rows = centers::<D>(csv, count);
        let way = |k: usize| {
            let mut way = rows[rows.len() - 1][k] - rows[0][k];
            way[0] -= case.time.end * rows[0][k][1];
            way
        };
        let ways = (0..count).map(|k| (way(k) - way(0)) / case.mean_radius()).collect();
        (ways, column(&beside(csv, "rheology"), "viscosity"))
    })
}

/// A run past the strain where the tilt wraps round does not know where the seam is: two copies of the cell
/// side by side go the same way, and so do all particles moved by any vector, up to the error of the mesh.
/// The cell of the copies is another one from the strain on where only the tilt of the one wraps round.
fn runs_do_not_know_the_seam<const D: usize>(end: f64, same: f64, [copied, shifted]: [[f64; 2]; 2]) {
    let mut case = case(D, &format!("time = {{ step = 0.1, end = {end:?} }}"));
    case.flow.tolerance = 1e-9;
    let (ways, viscosity) = way_and_viscosity::<D>(&case);
    let largest = |differences: &mut dyn Iterator<Item = f64>| differences.fold(0.0, f64::max);
    let miss = |ran: &(Vec<Vector<D>>, Vec<f64>), rows: usize| {
        let of_rows = &mut viscosity.iter().zip(&ran.1).take(rows).map(|(a, b)| (a - b).abs());
        [largest(&mut ways.iter().zip(&ran.0).map(|(a, b)| (a - b).norm())), largest(of_rows)]
    };
    let check = |what: &str, found: [f64; 2], measured: [f64; 2]| {
        println!("{D}D, {what}: {found:?}");
        assert!(found[0] <= 3.0 * measured[0] && found[1] <= 3.0 * measured[1], "{D}D, {what}: {found:?}");
    };
    let two = way_and_viscosity::<D>(&moved(&case, &[0.0; 3][..D], 2));
    check("2 x 1 copies", miss(&two, usize::MAX), copied);
    // Up to a strain of 0.4.
    check("2 x 1 copies at first", [0.0, miss(&two, 5)[1]], [0.0, same]);
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..2 {
        let by: Vec<f64> = (0..D).map(|_| random.random_range(0.0..1.0)).collect();
        let there = way_and_viscosity::<D>(&moved(&case, &by, 1));
        check(&format!("moved by {by:.3?}"), miss(&there, usize::MAX), shifted);
    }
}

#[test]
fn runs_do_not_know_where_the_seam_is() {
    runs_do_not_know_the_seam::<2>(0.7, 1e-6, [[4.7e-4, 1.2e-3], [9.2e-4, 1.1e-3]]);
    runs_do_not_know_the_seam::<3>(0.2, 2.1e-10, [[1e-10, 2.1e-10], [5.5e-5, 7.4e-5]]);
}

/// Forward and back: the error is of second order in the time step.
#[test]
fn sheared_back_the_discs_return() {
    let error = |step: f64| {
        let case = case(2, &format!("time = {{ step = {step}, end = 1.2, reverse_at = 0.6 }}"));
        let rows = ran(&case, |csv| centers::<2>(csv, 6));
        rms_distance(&rows[rows.len() - 1], &rows[0]) / case.mean_radius()
    };
    let [coarse, fine] = [0.1, 0.05].map(error);
    println!("rms distance from the start: {coarse:.2e} {fine:.2e}");
    assert!(fine < 5e-3 && coarse > 2.5 * fine, "{coarse} {fine}");
}

#[test]
fn in_an_oscillating_shear_the_discs_return_in_every_cycle() {
    let case = case(2, "time = { step = 0.05, end = 1.6, strain_amplitude = 0.2 }");
    let (strains, rows) =
        ran(&case, |csv| (column(&beside(csv, "rheology"), "strain"), centers::<2>(csv, 6)));
    let expected = (0..=32).map(|step| case.strain_after(step));
    assert!(strains.iter().zip(expected).all(|(found, exact)| (found - exact).abs() < 1e-12), "{strains:?}");
    let largest = strains.iter().fold(0.0f64, |largest, strain| largest.max(strain.abs()));
    assert!((largest - 0.2).abs() < 1e-12, "{largest}");
    let moved = |step: usize| rms_distance(&rows[step], &rows[0]) / case.mean_radius();
    let [quarter, first, second] = [4, 16, 32].map(moved);
    println!("rms distance in radii: after a quarter {quarter:.1e}, one cycle {first:.1e}, two {second:.1e}");
    // Measured: 9.4e-4, 1.0e-3; a quarter of that in steps half as long.
    assert!(quarter > 0.1 && first < 1.1e-3 && second < 1.2e-3, "{quarter} {first} {second}");
}

#[test]
fn runs_resume_bit_by_bit_with_their_rheology() {
    for dimension in [2, 3] {
        let steps = if dimension == 2 { 12.0 } else { 4.0 };
        let time = format!("shear_rate = 2.0\ntime = {{ step = 0.05, end = {} }}", 0.05 * steps);
        runs::resumes_bit_by_bit(&case(dimension, &time), 2, &["rheology"]);
    }
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    runs::threads_give_the_same_bits(&case(3, "time = { step = 0.1, end = 0.2 }"), &["rheology"]);
}

/// Spheres that settle in a periodic box: the mean velocity of fluid and spheres is zero, so they fall slower
/// than one alone.
#[test]
fn weight_is_balanced_by_a_gradient_of_the_pressure() {
    let case = case(3, "shear_rate = 1e-3\ngravity = [0.0, 0.0, -1.0]\ntime = { step = 0.01, end = 0.02 }");
    let rows = ran(&case, |csv| centers::<3>(csv, 3));
    let a = case.mean_radius();
    let mean = (0..3).map(|k| (rows[1][k].z - rows[0][k].z) / 0.01).sum::<f64>() / 3.0;
    let alone = -2.0 / 9.0 * a * a;
    assert!(mean / alone > 0.2 && mean / alone < 0.8, "{mean} {alone}");
}

#[test]
fn what_does_not_go_together_is_refused() {
    let text = |boundary: &str, flow: &str| {
        format!(
            "name = \"s\"\ndimension = 2\nparticles = [{{ position = [0.5, 0.5], radius = 0.1 }}]\n\
             time = {{ step = 0.1, end = 1.0 }}\ndomain = {{ boundary = \"{boundary}\" }}\n{flow}"
        )
    };
    for (flow, wanted) in [
        ("flow = { formulation = \"paper\" }", "unfitted"),
        ("flow = { formulation = \"unfitted\" }\nrheology = { every = 0 }", "1 or more"),
    ] {
        let error = Case::parse(&text("sheared", flow), "s.toml").expect_err("refused");
        let message = format!("{error:?}{error}");
        assert!(message.contains(wanted), "{message}");
    }
}
