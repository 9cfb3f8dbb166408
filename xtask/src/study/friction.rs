//! Rheology of rough spheres with friction against their fraction.

use gluey::Tally;
use gluey_verify::literature::{
    boyer_viscosity, eilers_viscosity, maron_pierce_viscosity, zarraga_viscosity,
};

use super::drawing::{StudySeries, curve, draw};
use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};
use super::steady::steady;

const FILE: &str = "friction.toml";
/// Coefficients of friction, and how they are called.
const FRICTIONS: [(f64, &str); 4] =
    [(0.0, "*μ* = 0"), (0.3, "*μ* = 0.3"), (0.5, "*μ* = 0.5"), (1.0, "*μ* = 1")];

pub const STUDY: Study = Study {
    title: "Rough spheres with friction",
    text: "A hundred equal spheres of the roughness 0.005 radii in a box that is sheared for ever, from a configuration of equilibrium \
           without contacts to a strain of five, for friction 0, 0.3, 0.5 and 1: relative viscosity, shares of contacts and of their tangential forces, normal \
           stress differences and particle pressure in the steady state, with 95 % intervals from block averages after the transient. \
           Contact forces act in the flow. Beside them closures: Eilers (1941) with a largest fraction of 0.64, Maron and Pierce (1956) with 0.585, Zarraga, Hill and Leighton (2000, \
           10.1122/1.551083), Boyer, Guazzelli and Pouliquen (2011, 10.1103/PhysRevLett.107.188301); normal stresses as measured for fractions \
           from 0.1 to 0.45 (Dai, Bertevas, Qi and Tanner 2013, 10.1122/1.4774325: N2 = -4.4 &phi;&sup3; and N1 = -0.8 &phi;&sup3; times the shear stress).",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let fractions = if quick { &[0.2, 0.4][..] } else { &[0.2, 0.3, 0.4, 0.45, 0.5][..] };
    let frictions = if quick { &FRICTIONS[1..3] } else { &FRICTIONS[..] };
    let mut points = Vec::new();
    for &fraction in fractions {
        for &(friction, model) in frictions {
            let point = StudyPoint::new(format!("{fraction}-friction-{friction}"), model, fraction, FILE)
                .with("suspension.volume_fraction", fraction)
                .with("contact.friction", format!("{friction:?}"));
            points.push(if quick { point.with("suspension.count", 8).with("time.end", 0.4) } else { point });
        }
    }
    points
}

/// What is taken of the rheology.
const COLUMNS: [&str; 7] = [
    "viscosity",
    "viscosity_by_dissipation",
    "viscosity_of_contacts",
    "viscosity_of_friction",
    "N1",
    "N2",
    "particle_pressure",
];

/// A picture: its name, its label, and what is drawn of the means of the columns, with half an error bar.
struct Drawn {
    name: &'static str,
    label: &'static str,
    is_logarithmic: bool,
    of: fn(&[[f64; 2]]) -> [f64; 2],
    known: fn() -> Vec<(String, Vec<(f64, f64)>)>,
}

const DRAWN: [Drawn; 5] = [
    Drawn {
        name: "viscosity",
        label: "relative viscosity",
        is_logarithmic: true,
        of: |means| means[0],
        known: closures,
    },
    Drawn {
        name: "contacts",
        label: "share of contacts in the viscosity",
        is_logarithmic: false,
        of: |means| means[2].map(|number| number / means[0][0]),
        known: Vec::new,
    },
    Drawn {
        name: "first-normal-stress",
        label: "*N*_{1} / shear stress",
        is_logarithmic: false,
        of: |means| means[4].map(|number| number / means[0][0]),
        known: || vec![curve("Dai et al. (2013)", |phi| -0.8 * phi.powi(3), 45)],
    },
    Drawn {
        name: "second-normal-stress",
        label: "*N*_{2} / shear stress",
        is_logarithmic: false,
        of: |means| means[5].map(|number| number / means[0][0]),
        known: || vec![curve("Dai et al. (2013)", |phi| -4.4 * phi.powi(3), 45)],
    },
    Drawn {
        name: "particle-pressure",
        label: "particle pressure / viscous stress",
        is_logarithmic: true,
        of: |means| means[6],
        known: Vec::new,
    },
];

fn closures() -> Vec<(String, Vec<(f64, f64)>)> {
    vec![
        curve("Eilers, 0.64", |phi| eilers_viscosity(phi, 0.64), 50),
        curve("Maron-Pierce, 0.585", |phi| maron_pierce_viscosity(phi, 0.585), 50),
        curve("Zarraga et al.", zarraga_viscosity, 50),
        curve("Boyer et al.", boyer_viscosity, 50),
    ]
}

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let mut rows = Vec::new();
    let mut series: Vec<Vec<StudySeries>> = DRAWN
        .iter()
        .map(|_| FRICTIONS.iter().map(|friction| StudySeries::new(friction.1)).collect())
        .collect();
    for run in done {
        let Some((begin, estimates)) = steady(run, &COLUMNS)? else { continue };
        let means: Vec<[f64; 2]> = estimates.iter().map(|one| [one.mean, one.half_width]).collect();
        let place = FRICTIONS.iter().position(|(_, model)| *model == run.point.model).unwrap_or(0);
        for (series, drawn) in series.iter_mut().zip(&DRAWN) {
            let [mean, half_width] = (drawn.of)(&means);
            series[place].points.push((run.point.at, mean, half_width));
        }
        let numbers =
            [run.point.at, FRICTIONS[place].0, begin].into_iter().chain(means.as_flattened().iter().copied());
        let Tally { halved_steps, .. } = run.report.tally;
        let cells = run.report.cells_per_radius.map_or(String::new(), |cells| format!("{cells:.2}"));
        let resolved = if estimates[0].is_resolved { "yes" } else { "no" };
        let ends = [resolved.to_owned(), cells, halved_steps.to_string()];
        rows.push(numbers.map(|x| format!("{x:.4}")).chain(ends).collect());
    }
    let drawing = |(series, drawn): (Vec<StudySeries>, &Drawn)| {
        let picture =
            draw("volume fraction *φ*", drawn.label, drawn.is_logarithmic, &series, (drawn.known)());
        (drawn.name, picture)
    };
    let drawings = series.into_iter().zip(&DRAWN).map(drawing).collect();
    let columns = "phi,friction,strain_skipped,viscosity,viscosity_half_width,viscosity_by_dissipation,viscosity_by_dissipation_half_width,\
                   viscosity_of_contacts,viscosity_of_contacts_half_width,viscosity_of_friction,viscosity_of_friction_half_width,\
                   N1,N1_half_width,N2,N2_half_width,particle_pressure,particle_pressure_half_width,blocks_independent,cells_per_radius,halved_steps";
    Ok(Findings { columns, rows, drawings, remarks: remarks() })
}

fn remarks() -> Vec<String> {
    vec![
        "What limits these numbers: intervals are those of one run, whose start is one configuration; where <code>blocks_independent</code> is \
         <em>no</em> the run is too short for its interval. The largest fraction of a closure depends on friction, which the closures do not know: \
         that of Eilers is near the one of spheres without friction, those of the others were fitted to real, frictional spheres."
            .to_owned(),
    ]
}
