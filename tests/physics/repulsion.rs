//! Particles that repel each other, in every model of their motion.

use std::f64::consts::PI;

use gluey::Case;
use gluey_contact::Repulsion;
use gluey_geom::Vector;
use gluey_motion::approach_mobility;
use gluey_suspension::{Container, for_each_pair};

use crate::runs::{self, beside, case, centers, column, ran};

/// Six discs at 0.2 in a box that is sheared, which repel each other.
fn discs(cells_per_radius: f64, rest: &str) -> Case {
    case(&format!(
        "name = \"s\"\ndimension = 2\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = 0.2, count = 6, seed = 3, min_gap = 0.05 }}\n\
         contact = {{ strategy = \"none\" }}\n{rest}\n\
         [flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = {cells_per_radius:?}\n\
         coarsest_level = 2\n"
    ))
}

/// Two spheres in a fluid at rest part as their mobility says: `dg/dt = 2 m(g) F(g) / (6 pi a)`.
#[test]
fn a_pair_at_rest_parts_as_its_mobility_says() {
    let case = case(
        "name = \"pair\"\ndimension = 3\nshear_rate = 0.0\nrepulsion = { force = 0.2, range = 0.2 }\n\
         particles = [{ position = [0.448, 0.5, 0.5], radius = 0.05 },\n\
                      { position = [0.552, 0.5, 0.5], radius = 0.05 }]\n\
         time = { step = 0.002, end = 0.4 }\ncontact = { strategy = \"none\" }\n\
         flow = { hydrodynamics = \"pair-mobility\" }",
    );
    let (gaps, rows) = ran(&case, |csv| (column(csv, "gap12_over_a"), centers::<3>(csv, 2)));
    let speed =
        |gap: f64| 2.0 * 0.2 * (-gap / 0.2f64).exp() * approach_mobility(gap) / (6.0 * PI * 0.05 * 0.05);
    let (mut gap, substep, mut worst) = (0.08, 0.0001, 0.0f64);
    for (step, found) in gaps.iter().enumerate() {
        if step > 0 {
            for _ in 0..20 {
                gap += substep * speed(gap + 0.5 * substep * speed(gap));
            }
        }
        worst = worst.max((found - gap).abs());
    }
    println!("gap from {} to {gap}, worst {worst:e}", gaps[0]);
    assert!(gap > 0.3 && worst < 1.5e-5, "{worst:e}");
    let middle = rows.iter().map(|x| (x[0] + x[1]) * 0.5).next_back().expect("a row");
    assert!((middle - Vector::repeat(0.5)).norm() < 1e-14, "{middle}");
}

/// Repulsion moves particles as forces do that are given one by one: two discs, and one of them off a wall.
#[test]
fn the_flow_answers_as_to_given_forces() {
    let text = |forces: [&str; 2], repulsion: &str| {
        format!(
            "name = \"two\"\ndimension = 2\nshear_rate = 0.0\n{repulsion}\ndomain.boundary = \"periodic\"\n\
             particles = [{{ position = [0.05, 0.125], radius = 0.1{} }},\n\
                          {{ position = [0.85, 0.125], radius = 0.08{} }}]\n\
             time = {{ step = 1e-8, end = 1e-8 }}\ncontact = {{ strategy = \"none\" }}\n\
             flow = {{ formulation = \"unfitted\", mesh = {{ cells_per_radius = 3.0 }} }}",
            forces[0], forces[1]
        )
    };
    let law = Repulsion { force: 2.0, range: 0.2 * 0.09, radius: 0.09 };
    // Across the border, 0.2 apart; and the wall below.
    let pair = law.at::<2>(0.02, [0.1, 0.08]);
    let [first, second] = [(0.025, 0.1), (0.045, 0.08)].map(|(gap, a)| law.at::<2>(gap, [a, f64::INFINITY]));
    let given = [(pair, first), (-pair, second)].map(|(x, y)| format!(", force = [{x:e}, {y:e}]"));
    let move_of = |text: &str| {
        let rows = ran(&case(text), |csv| centers::<2>(csv, 2));
        [0, 1].map(|k| rows[1][k] - rows[0][k])
    };
    let found = move_of(&text(["", ""], "repulsion = { force = 2.0, range = 0.2 }"));
    let exact = move_of(&text([&given[0], &given[1]], ""));
    println!("{found:?} {exact:?}");
    assert!(found[0].x > 0.0 && found[1].x < 0.0 && found[0].y > 0.0);
    for k in 0..2 {
        assert!((found[k] - exact[k]).norm() < 1e-6 * exact[k].norm(), "{found:?} {exact:?}");
    }
}

/// Shear presses two spheres together that repel each other, in steps in which repulsion alone would take
/// them apart by several of its ranges: the order in the step is two.
#[test]
fn steps_are_longer_than_repulsion_is_stiff() {
    let ends = [0.1, 0.05, 0.025, 0.0125].map(|step| {
        let case = case(&format!(
            "name = \"pair\"\ndimension = 3\nshear_rate = 1.0\nrepulsion = {{ force = 50.0, range = 0.005 }}\n\
             particles = [{{ position = [0.65, 0.495, 0.5], radius = 0.05 }},\n\
                          {{ position = [0.35, 0.505, 0.5], radius = 0.05 }}]\n\
             time = {{ step = {step}, end = 40.0 }}\ncontact = {{ strategy = \"none\" }}\n\
             flow = {{ hydrodynamics = \"pair-mobility\" }}"
        ));
        let (gaps, rows) = ran(&case, |csv| (column(csv, "gap12_over_a"), centers::<3>(csv, 2)));
        let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        let last = rows.last().expect("a row");
        [smallest, (last[1] - last[0]).y / 0.05]
    });
    println!("smallest gap, offset at the end: {ends:?}");
    let off: Vec<f64> = ends.iter().map(|end| (end[1] - ends[3][1]).abs()).collect();
    assert!(off[0] < 5e-3 && off[1] < 0.45 * off[0] && off[2] < 0.3 * off[1], "{off:?}");
}

/// Energy of repulsion where discs of the radius `a` are.
fn energy(law: &Repulsion, centers: &[Vector<2>], strain: f64) -> f64 {
    let container = Container::periodic(&Vector::<2>::repeat(1.0)).tilted(strain);
    let mut sum = 0.0;
    for_each_pair(&container, centers, 2.0 * law.radius + law.reach(), |pair| {
        sum += law.range * law.at::<2>(pair.arm.norm() - 2.0 * law.radius, [law.radius; 2]);
    });
    sum
}

/// What shear and repulsion do to the fluid is dissipated: the stress, with the share of repulsion, times the
/// rate, less what goes into the energy of repulsion.
#[test]
fn power_is_dissipated_or_stored() {
    let case = discs(4.0, "time = { step = 0.005, end = 0.1 }\nrepulsion = { force = 10.0, range = 0.3 }");
    let names = ["viscosity", "viscosity_by_dissipation", "viscosity_of_repulsion", "strain"];
    let (columns, rows) =
        ran(&case, |csv| (names.map(|name| column(&beside(csv, "rheology"), name)), centers::<2>(csv, 6)));
    let [viscosity, by_dissipation, share, strain] = columns;
    let law = case.repulsion().expect("a law");
    let energies: Vec<f64> = rows.iter().zip(&strain).map(|(x, strain)| energy(&law, x, *strain)).collect();
    let (mut worst, mut largest) = (0.0f64, [0.0f64; 2]);
    for k in 1..energies.len() - 1 {
        let stored = (energies[k + 1] - energies[k - 1]) / 0.01;
        worst = worst.max((viscosity[k] - stored - by_dissipation[k]).abs() / by_dissipation[k]);
        largest = [largest[0].max(stored.abs()), largest[1].max(share[k].abs())];
    }
    println!("miss {worst:.1e}; stored up to {:.2}, share of repulsion up to {:.2}", largest[0], largest[1]);
    assert!(worst < 6e-3 && largest.iter().all(|part| *part > 0.1), "{worst} {largest:?}");
}

#[test]
fn runs_resume_bit_by_bit() {
    let case = discs(
        2.0,
        "shear_rate = 2.0\ntime = { step = 0.05, end = 0.4, reverse_at = 0.25 }\n\
         repulsion = { force = 0.5 }",
    );
    runs::resumes_bit_by_bit(&case, 3, &["rheology"]);
}
