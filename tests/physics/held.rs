//! Particles that are held or driven among free ones.

use std::f64::consts::PI;
use std::path::Path;

use gluey::{Case, RunError};
use gluey_geom::Vector;
use gluey_motion::approach_mobility;
use gluey_testkit::reference::Table;

use crate::runs::{self, beside, case, centers, column, failure, ran, rms_distance, vectors};

/// A case without contact in `unfitted`.
fn unfitted(dimension: usize, cells_per_radius: f64, rest: &str) -> Case {
    case(&format!(
        "name = \"h\"\ndimension = {dimension}\ncontact = {{ strategy = \"none\" }}\n{rest}\n\
         flow = {{ formulation = \"unfitted\", mesh = {{ cells_per_radius = {cells_per_radius:?}, root_cells = 1 }} }}\n"
    ))
}

fn small(what: &str, value: f64, measured: f64) {
    println!("{what}: {value:.2e}");
    assert!(value <= 3.0 * measured, "{what}: {value:e}, was {measured:e}");
}

/// Fluid that is driven through a square or simple cubic lattice that is held: the drag is that of the
/// tables, and all of what drives the fluid is carried.
#[test]
fn the_permeability_of_a_bed_is_that_of_its_lattice() {
    for (dimension, force, arrangement, count, drag, error) in [
        (2, "1.0, 0.0", "square", 4, 51.526_948_961_8, 2.6e-4),
        (3, "1.0, 0.0, 0.0", "simple-cubic", 8, 6.775_920_03, 1.5e-4),
    ] {
        let case = unfitted(
            dimension,
            3.2,
            &format!(
                "shear_rate = 0.0\nbody_force = [{force}]\ntime = {{ step = 0.1, end = 0.1 }}\n\
                 domain = {{ boundary = \"sheared\" }}\nsuspension = {{ volume_fraction = 0.2, \
                 count = {count}, arrangement = \"{arrangement}\", held = true }}"
            ),
        );
        let (speed, forces, moved) = ran(&case, |csv| {
            let path = beside(csv, "forces");
            let force = |k: usize| column(&path, &format!("force{k}x"))[0];
            let moved = column(csv, "x1")[1] - column(csv, "x1")[0];
            (column(&path, "mean_velocity_x")[0], (1..=count).map(force).collect::<Vec<_>>(), moved)
        });
        let unit = if dimension == 2 { 1.0 } else { 6.0 * PI * case.mean_radius() };
        let share = -1.0 / count as f64;
        let miss = forces.iter().map(|force| (force / share - 1.0).abs()).fold(0.0, f64::max);
        small("share of the force", miss, 1.5e-8);
        small("drag", (-share / (unit * speed) / drag - 1.0).abs(), error);
        assert_eq!(moved, 0.0);
    }
}

/// One that is driven through fluid whose mean is at rest: the drag of the lattice of its images.
#[test]
fn the_drag_on_a_driven_particle_is_that_of_its_images() {
    for (dimension, radius, velocity, drag, error) in [
        (2, (0.1 / PI).sqrt(), "0.0, 2.0", 24.831_675_248_8, 8.4e-5),
        (3, (0.15 / (4.0 * PI)).cbrt(), "0.0, 2.0, 0.0", 2.507_045_34, 3.5e-4),
    ] {
        let center = if dimension == 2 { "0.3, 0.45" } else { "0.3, 0.45, 0.52" };
        let text = format!(
            "shear_rate = 0.0\ndomain = {{ boundary = \"sheared\" }}\ntime = {{ step = 1e-3, end = 1e-3 }}\n\
             particles = [{{ position = [{center}], radius = {radius:?}, velocity = [{velocity}] }}]"
        );
        let force = ran(&unfitted(dimension, 3.2, &text), |csv| column(&beside(csv, "forces"), "force1y")[0]);
        let unit = if dimension == 2 { 2.0 } else { 12.0 * PI * radius };
        small(&format!("drag {dimension}D"), (force / unit / drag - 1.0).abs(), error);
    }
}

/// Two that are driven towards each other in a large periodic box: the force is that of the exact resistance.
#[test]
fn two_that_are_driven_together_resist_as_they_should() {
    let text = |a: f64, centers: [&str; 2], velocities: [&str; 2]| {
        format!(
            "shear_rate = 0.0\ndomain = {{ boundary = \"sheared\" }}\n\
             time = {{ step = {:?}, end = {:?} }}\n\
             particles = [{{ position = [{}], radius = {a}, velocity = [{}] }},\n\
                          {{ position = [{}], radius = {a}, velocity = [{}] }}]",
            0.1 * a,
            0.2 * a,
            centers[0],
            velocities[0],
            centers[1],
            velocities[1]
        )
    };
    // Gaps of 0.3, 0.2 and 0.1 radii.
    let discs = unfitted(2, 6.4, &text(0.04, ["0.454, 0.5", "0.546, 0.5"], ["0.5, 0.0", "-0.5, 0.0"]));
    let forces = ran(&discs, |csv| column(&beside(csv, "forces"), "force1x"));
    let table = Table::parse(include_str!("../../data/reference/pair2d_resistance.csv")).expect("a table");
    let of_gap = |gap: f64| {
        let gaps = table.column("xi").expect("gaps");
        let row = gaps.iter().position(|xi| (xi - gap).abs() < 1e-9).expect("a row");
        table.column("n").expect("resistances")[row]
    };
    for (row, (gap, measured)) in [(0.3, 4.9e-3), (0.2, 3e-3), (0.1, 4.9e-3)].into_iter().enumerate() {
        let exact = of_gap(gap);
        small(&format!("discs at {gap}"), (forces[row] / exact - 1.0).abs(), measured);
    }
    let spheres = unfitted(
        3,
        3.2,
        &text(0.1, ["0.385, 0.5, 0.5", "0.615, 0.5, 0.5"], ["0.5, 0.0, 0.0", "-0.5, 0.0, 0.0"]),
    );
    let forces = ran(&spheres, |csv| vectors::<3>(&beside(csv, "forces"), "force2"));
    for (row, (gap, measured)) in [(0.3, 2.4e-2), (0.2, 1.9e-2), (0.1, 2.8e-3)].into_iter().enumerate() {
        let exact = -6.0 * PI * 0.1 * 0.5 / approach_mobility(gap);
        small(&format!("spheres at {gap}"), (forces[row].x / exact - 1.0).abs(), measured);
    }
}

/// The force that holds a particle beside a free one under shear also holds it as a force, and the free one
/// moves alike: between walls, in Couette flow and in a sheared box. In so short a step films do not care
/// which side yields.
#[test]
fn what_holds_a_particle_is_a_force_like_any_other() {
    for (dimension, boundary, measured) in
        [(2, "periodic", 9e-8), (2, "couette", 8e-8), (2, "sheared", 2.6e-8), (3, "sheared", 8.8e-7)]
    {
        let at = |x: f64, y: f64| if dimension == 2 { format!("{x}, {y}") } else { format!("{x}, {y}, 0.5") };
        let text = |held: &str| {
            format!(
                "time = {{ step = 1e-6, end = 1e-6 }}\ndomain = {{ boundary = \"{boundary}\" }}\n\
                 particles = [{{ position = [{}], radius = 0.1, {held} }},\n\
                              {{ position = [{}], radius = 0.12 }}]",
                at(0.4, 0.6),
                at(0.62, 0.72)
            )
        };
        let read = |csv: &Path| {
            let path = beside(csv, "forces");
            let of = |name: &str| column(&path, name)[0];
            let axes = ["x", "y", "z"];
            let force: Vec<f64> = axes[..dimension].iter().map(|d| of(&format!("force1{d}"))).collect();
            let torque: Vec<f64> = match dimension {
                2 => vec![of("torque1")],
                _ => axes.iter().map(|d| of(&format!("torque1{d}"))).collect(),
            };
            (force, torque)
        };
        let moves = |csv: &Path| {
            let of = |name: &str| column(csv, name);
            let move_of = |name: String| (of(&name)[1] - of(&name)[0]) / 1e-6;
            let names = [1, 2].into_iter().flat_map(|k| ["x", "y"].map(|d| format!("{d}{k}")));
            let spin = if dimension == 2 { "omega" } else { "omegaz" };
            let spins = [1, 2].map(|k| match dimension {
                2 => of(&format!("{spin}{k}"))[0],
                _ => of(&format!("omega{k}z"))[0],
            });
            names.map(move_of).chain(spins).collect::<Vec<f64>>()
        };
        let held = unfitted(dimension, 3.0, &text("held = true"));
        let ((force, torque), with_hold) = ran(&held, |csv| (read(csv), moves(csv)));
        let free = text(&format!("force = {force:?}, torque = {torque:?}"));
        let with_force = ran(&unfitted(dimension, 3.0, &free), moves);
        let misses = with_hold.iter().zip(&with_force).map(|(a, b)| (a - b).abs());
        let miss = misses.fold(0.0, f64::max);
        assert_eq!(with_hold[..2], [0.0; 2]);
        assert!(with_hold[2].abs() + with_hold[3].abs() > 0.01, "{with_hold:?}");
        small(&format!("{boundary} {dimension}D"), miss, measured);
    }
}

/// A disc that is driven between free ones, and back: they return, at the second order of the scheme.
#[test]
fn driven_back_the_others_return() {
    let distance = |step: f64| {
        let case = unfitted(
            2,
            3.0,
            &format!(
                "shear_rate = 0.0\ntime = {{ step = {step:?}, end = 0.8, reverse_at = 0.4 }}\n\
                 domain = {{ boundary = \"sheared\" }}\nparticles = [\n\
                 {{ position = [0.2, 0.5], radius = 0.08, velocity = [1.0, 0.0], spin = [3.0] }},\n\
                 {{ position = [0.45, 0.6], radius = 0.08 }}, {{ position = [0.45, 0.38], radius = 0.1 }},\n\
                 {{ position = [0.8, 0.52], radius = 0.08, held = true }}]"
            ),
        );
        ran(&case, |csv| {
            let rows = centers::<2>(csv, 4);
            let (last, middle) = (rows.len() - 1, rows.len() / 2);
            assert!((rows[middle][0].x - 0.6).abs() < 1e-12 && rows[middle][3] == rows[0][3]);
            assert!(rms_distance(&rows[middle], &rows[0]) > 0.1);
            rms_distance(&rows[last], &rows[0]) / 0.08
        })
    };
    let [coarse, fine] = [0.04, 0.02].map(distance);
    println!("rms distance from the start, in radii: {coarse:.2e} {fine:.2e}");
    assert!(fine < 3e-3 && coarse > 2.5 * fine, "{coarse:e} {fine:e}");
}

/// Of a flow between walls at rest that is driven by a force, `u = 4 y (1 - y)`: a small disc in the middle
/// moves like the fluid there but for Faxen's term, and the mean is two thirds.
#[test]
fn fluid_is_driven_between_walls() {
    let case = unfitted(
        2,
        3.0,
        "shear_rate = 0.0\nbody_force = [8.0, 0.0]\ntime = { step = 1e-3, end = 1e-3 }\n\
         domain = { boundary = \"periodic\", upper = [2.0, 1.0] }\n\
         particles = [{ position = [0.5, 0.5], radius = 0.04 }]",
    );
    let speed = ran(&case, |csv| (column(csv, "x1")[1] - column(csv, "x1")[0]) / 1e-3);
    small("speed", (speed - (1.0 - 2.0 * 0.04 * 0.04)).abs(), 1.6e-5);
}

/// A disc that sinks onto a held one and slides off it, beside a driven one, with contact: what is held moves
/// as it is told, and nothing overlaps.
#[test]
fn contact_does_not_move_what_is_held() {
    for lubrication in ["none", "deficit"] {
        let case = case(&format!(
            "name = \"h\"\ndimension = 2\nshear_rate = 0.0\ngravity = [0.0, -200.0]\n\
             domain = {{ boundary = \"periodic\" }}\n\
             contact = {{ strategy = \"gluey\" }}\ntime = {{ step = 0.02, end = 0.8 }}\n\
             particles = [{{ position = [0.6, 0.4], radius = 0.1, held = true }},\n\
             {{ position = [0.62, 0.66], radius = 0.1 }},\n\
             {{ position = [0.15, 0.4], radius = 0.1, velocity = [0.0, 0.05] }}]\n\
             flow = {{ formulation = \"unfitted\", lubrication = \"{lubrication}\", \
             mesh = {{ cells_per_radius = 2.0 }} }}"
        ));
        let (rows, gaps) = ran(&case, |csv| (centers::<2>(csv, 3), column(csv, "gap12_over_a")));
        assert!(rows.iter().all(|row| row[0] == rows[0][0] && row[2].x == rows[0][2].x));
        assert!((rows[40][2].y - 0.44).abs() < 1e-12, "{}", rows[40][2].y);
        let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        println!("{lubrication}: {least:.2e}, {:?}", rows[40][1]);
        assert!((-1e-10..0.1).contains(&least), "{gaps:?}");
    }
}

#[test]
fn what_is_driven_into_each_other_is_told() {
    let text = |strategy: &str, lubrication: &str| {
        format!(
            "name = \"h\"\ndimension = 2\nshear_rate = 0.0\ncontact = {{ strategy = \"{strategy}\" }}\n\
             time = {{ step = 0.1, end = 1.0 }}\ndomain = {{ boundary = \"periodic\" }}\n\
             particles = [{{ position = [0.3, 0.5], radius = 0.1, velocity = [0.5, 0.0] }},\n\
             {{ position = [0.7, 0.5], radius = 0.1, held = true }}]\n\
             flow = {{ formulation = \"unfitted\", lubrication = \"{lubrication}\", \
             mesh = {{ cells_per_radius = 2.0 }} }}"
        )
    };
    for (strategy, lubrication, wanted) in
        [("none", "deficit", "would close"), ("gluey", "none", "make them overlap")]
    {
        let error = failure(&case(&text(strategy, lubrication)));
        let message = format!("{:#}", Chain(&error));
        assert!(message.contains(wanted) && message.contains("particles 1 and 2"), "{message}");
    }
}

/// An error with its causes.
struct Chain<'a>(&'a RunError);

impl std::fmt::Display for Chain<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut error: Option<&dyn std::error::Error> = Some(self.0);
        while let Some(now) = error {
            write!(f, "{now}: ")?;
            error = now.source();
        }
        Ok(())
    }
}

fn among_free_ones(dimension: usize, rest: &str) -> Case {
    let z = if dimension == 2 { "" } else { ", 0.5" };
    let zero = if dimension == 2 { "" } else { ", 0.0" };
    unfitted(
        dimension,
        2.0,
        &format!(
            "domain = {{ boundary = \"sheared\" }}\n{rest}\nparticles = [\n\
             {{ position = [0.2, 0.5{z}], radius = 0.1, velocity = [0.3, 0.1{zero}] }},\n\
             {{ position = [0.5, 0.62{z}], radius = 0.1 }},\n\
             {{ position = [0.75, 0.42{z}], radius = 0.1, held = true }}]"
        ),
    )
}

#[test]
fn runs_resume_bit_by_bit() {
    let time = "time = { step = 0.02, end = 0.16, reverse_at = 0.1 }";
    runs::resumes_bit_by_bit(&among_free_ones(2, time), 3, &["forces"]);
    let time = "time = { step = 0.02, end = 0.08 }\nbody_force = [0.0, 0.0, 3.0]";
    runs::resumes_bit_by_bit(&among_free_ones(3, time), 2, &["forces"]);
}

#[test]
fn threads_do_not_matter() {
    runs::threads_give_the_same_bits(&among_free_ones(3, "time = { step = 0.02, end = 0.04 }"), &["forces"]);
}

/// What is held carries what is driven, and nothing flows on the mean unless a force is given.
#[test]
fn forces_on_the_box_are_balanced() {
    for (rest, force) in [("", None), ("body_force = [0.0, 2.0]", Some(2.0))] {
        let case = among_free_ones(2, &format!("{rest}\ntime = {{ step = 0.02, end = 0.02 }}"));
        ran(&case, |csv| {
            let path = beside(csv, "forces");
            let [force1, force3, body_force, mean] = ["force1", "force3", "body_force_", "mean_velocity_"]
                .map(|name| vectors::<2>(&path, name)[0]);
            let sum = force1 + force3 + body_force;
            small("sum", sum.norm() / force1.norm(), 3e-13);
            match force {
                None => small("mean", mean.norm(), 1e-16),
                Some(force) => {
                    assert_eq!(body_force, Vector::<2>::new(0.0, force));
                    assert!(mean.y > 0.01, "{mean:?}");
                }
            }
        });
    }
}
