//! Rheology of rough spheres with friction against their fraction.

use gluey_verify::literature::{
    boyer_viscosity, eilers_viscosity, maron_pierce_viscosity, zarraga_viscosity,
};

use super::drawing::{Known, curve};
use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};
use super::rough::{Across, DrawnMean, PARTICLE_PRESSURE, SHARE_OF_CONTACTS, over_viscosity, rough_findings};

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
                .rough(friction);
            points.push(if quick { point.with("suspension.count", 8).with("time.end", 0.4) } else { point });
        }
    }
    points
}

const ACROSS: Across = Across { name: "phi", label: "volume fraction *φ*", is_logarithmic: false };

const DRAWN: [DrawnMean; 5] = [
    DrawnMean::new("viscosity", "relative viscosity", true, |means| means[0]).beside(closures),
    SHARE_OF_CONTACTS,
    DrawnMean::new("first-normal-stress", "*N*_{1} / shear stress", false, |means| over_viscosity(means, 4))
        .beside(|| vec![curve("Dai et al. (2013)", |phi| -0.8 * phi.powi(3), 45)]),
    DrawnMean::new("second-normal-stress", "*N*_{2} / shear stress", false, |means| over_viscosity(means, 5))
        .beside(|| vec![curve("Dai et al. (2013)", |phi| -4.4 * phi.powi(3), 45)]),
    PARTICLE_PRESSURE,
];

fn closures() -> Known {
    vec![
        curve("Eilers, 0.64", |phi| eilers_viscosity(phi, 0.64), 50),
        curve("Maron-Pierce, 0.585", |phi| maron_pierce_viscosity(phi, 0.585), 50),
        curve("Zarraga et al.", zarraga_viscosity, 50),
        curve("Boyer et al.", boyer_viscosity, 50),
    ]
}

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let models = FRICTIONS.map(|(_, model)| model);
    Ok(Findings { remarks: remarks(), ..rough_findings(done, &ACROSS, &models, &DRAWN)? })
}

fn remarks() -> Vec<String> {
    vec![
        "What limits these numbers: intervals are those of one run, whose start is one configuration; where <code>blocks_independent</code> is \
         <em>no</em> the run is too short for its interval. The largest fraction of a closure depends on friction, which the closures do not know: \
         that of Eilers is near the one of spheres without friction, those of the others were fitted to real, frictional spheres."
            .to_owned(),
    ]
}
