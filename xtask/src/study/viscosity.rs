//! Relative viscosity of sheared spheres against their fraction.

use std::f64::consts::PI;

use gluey::Tally;
use gluey_verify::literature::viscosity_of_spheres;

use super::drawing::{Known, StudySeries, curve, draw};
use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};
use super::steady::steady;

const FILE: &str = "viscosity.toml";
const LUBRICATION: &str = "lubrication";
const REPULSION: &str = "lubrication, repulsion";
const GLUEY: &str = "gluey";
const INELASTIC: &str = "inelastic";
const MODELS: [&str; 4] = [LUBRICATION, REPULSION, GLUEY, INELASTIC];

/// Spheres in the box, of volume 1.
const COUNT: u32 = 200;
const COUNT_IF_QUICK: u32 = 12;

/// Repulsion of spheres in contact over `6 pi` viscosity, radius squared and shear rate, which is what shear
/// pushes two spheres together with; and the gap, in radii, over which it falls to 1/e. Not fitted, and not
/// varied.
const REPULSION_AT_CONTACT: f64 = 10.0;
const RANGE: f64 = 1e-3;

/// Sheared frictionless spheres, read off the figures of Sierou and Brady (2002) and Gallier et al. (2014),
/// which spread by 15 %.
const SHEARED: [(f64, f64); 5] = [(0.1, 1.35), (0.2, 1.9), (0.3, 3.05), (0.4, 5.9), (0.45, 9.0)];

pub const STUDY: Study = Study {
    title: "Viscosity of sheared spheres",
    text: "Two hundred equal spheres in a box that is sheared for ever, from a configuration of equilibrium to a strain of four: relative \
           viscosity and normal stress differences in the steady state, with 95 % intervals from block averages after the transient. \
           Four models: lubrication forces in films thinner than the mesh and no contact; the same with a repulsion of short range, \
           without which films between smooth spheres become thinner without end, its one force and range neither fitted to the \
           published spheres nor theirs, so that how near it comes to them is no evidence; the gluey contact, and inelastic contact, both \
           without lubrication forces, so that the flow knows of a film what the mesh resolves. The viscosity of the latter two is \
           that of the tractions plus that of the contact forces, whose metric is Stokes drag. The same box at every fraction. \
           Beside them: hard spheres in equilibrium (Riest et al. 2015, 10.1039/C4SM02816A), dilute suspensions in extension \
           (Batchelor and Green 1972: 1 + 2.5 &phi; + 7.6 &phi;&sup2;), and sheared frictionless spheres (Sierou and Brady 2002, \
           Gallier et al. 2014; read off their figures, which spread by 15 %).",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let fractions = if quick { &[0.1, 0.3][..] } else { &[0.1, 0.2, 0.3, 0.4, 0.45][..] };
    let count = if quick { COUNT_IF_QUICK } else { COUNT };
    let mut points = Vec::new();
    for &fraction in fractions {
        for model in MODELS {
            let point =
                StudyPoint::new(format!("{}-{fraction}", model.replace(", ", "-")), model, fraction, FILE)
                    .with("suspension.volume_fraction", fraction)
                    .with("suspension.count", count);
            let point = with_model(point, radius(fraction, count));
            points.push(if quick { point.with("time.end", 0.5) } else { point });
        }
    }
    points
}

/// Of spheres that fill this fraction of the unit box.
fn radius(fraction: f64, count: u32) -> f64 {
    (3.0 * fraction / (4.0 * PI * f64::from(count))).cbrt()
}

fn with_model(point: StudyPoint, radius: f64) -> StudyPoint {
    let lubricated =
        |point: StudyPoint| point.with("contact.strategy", "none").with("flow.lubrication", "deficit");
    match point.model {
        LUBRICATION => lubricated(point),
        REPULSION => lubricated(point)
            .with("repulsion.force", REPULSION_AT_CONTACT * 6.0 * PI * radius * radius)
            .with("repulsion.range", RANGE),
        model => point.with("contact.strategy", model).with("flow.lubrication", "none"),
    }
}

/// What is taken of the rheology: viscosity, share of contacts, normal stress differences.
const COLUMNS: [&str; 4] = ["viscosity", "viscosity_of_contacts", "N1", "N2"];

/// Columns of the rheology with a picture, each with its label, in the order in which they are drawn.
const DRAWN: [(usize, &str, &str); 3] = [
    (2, "first-normal-stress", "*N*_{1} / viscous stress"),
    (3, "second-normal-stress", "*N*_{2} / viscous stress"),
    (0, "viscosity", "relative viscosity"),
];

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let (mut rows, mut drawn) = (Vec::new(), DRAWN.map(|_| MODELS.map(StudySeries::new)));
    for run in done {
        let Some((begin, estimates)) = steady(run, &COLUMNS)? else { continue };
        let [eta, contacts, n1, n2] = [0, 1, 2, 3].map(|k| &estimates[k]);
        let shown = |x: f64| format!("{x:.4}");
        let smallest = run.report.min_gap_over_a.map_or(String::new(), |gap| format!("{gap:.1e}"));
        let resolved = if eta.is_resolved { "yes" } else { "no" };
        let numbers = [run.point.at, begin, eta.mean, eta.half_width, contacts.mean];
        let numbers = numbers.into_iter().chain([n1.mean, n1.half_width, n2.mean, n2.half_width]).map(shown);
        let Tally { closed_films, halved_steps, .. } = run.report.tally;
        let ends = [resolved.to_owned(), smallest, closed_films.to_string(), halved_steps.to_string()];
        rows.push([run.point.model.to_owned()].into_iter().chain(numbers).chain(ends).collect());
        for (series, (k, ..)) in drawn.iter_mut().zip(DRAWN) {
            let point = (run.point.at, estimates[k].mean, estimates[k].half_width);
            StudySeries::add(series, run.point.model, point);
        }
    }
    let drawing = |(series, (k, name, label)): (&[StudySeries; 4], (usize, &'static str, &str))| {
        let known = if k == 0 { known() } else { Vec::new() };
        (name, draw(["volume fraction *φ*", label], [false, k == 0], series, known))
    };
    let mut drawings: Vec<_> = drawn.iter().zip(DRAWN).map(drawing).collect();
    // The page begins with the last one.
    drawings.rotate_right(1);
    let columns = "model,phi,strain_skipped,viscosity,viscosity_half_width,viscosity_of_contacts,N1,N1_half_width,N2,N2_half_width,\
                   blocks_independent,min_gap_over_a,closed_films,halved_steps"
        .to_owned();
    Ok(Findings { columns, rows, drawings, remarks: remarks() })
}

fn known() -> Known {
    vec![
        curve("equilibrium", viscosity_of_spheres, 46),
        curve("1 + 2.5 *φ* + 7.6 *φ*^{2}", |phi| 1.0 + 2.5 * phi + 7.6 * phi * phi, 30),
        ("sheared, frictionless".to_owned(), SHEARED.to_vec()),
    ]
}

fn remarks() -> Vec<String> {
    vec![
        "What limits these numbers: intervals are those of one run, whose start is one configuration; \
         where <code>blocks_independent</code> is <em>no</em> the run is too short for its interval. Contact forces of the gluey model \
         stand for those of the film, in the metric of Stokes drag: their stress is that of the model, not of a film."
            .to_owned(),
    ]
}
