//! Shear thickening of rough spheres whose contacts have friction above a critical load only (Mari, Seto,
//! Morris and Denn 2014, DOI 10.1122/1.4890747), against the shear rate.

use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};
use super::rough::{Across, DrawnMean, PARTICLE_PRESSURE, SHARE_OF_CONTACTS, over_viscosity, rough_findings};

const FILE: &str = "friction.toml";
/// Critical loads over `6 pi` viscosity, radius squared and shear rate: the shear rate is one over it.
const LOADS: [f64; 4] = [100.0, 10.0, 1.0, 0.1];
const FRICTIONLESS: &str = "friction 0";
const CRITICAL: &str = "friction 0.5 above the critical load";
const FRICTIONAL: &str = "friction 0.5";
const MODELS: [&str; 3] = [FRICTIONLESS, CRITICAL, FRICTIONAL];

pub const STUDY: Study = Study {
    title: "Shear thickening",
    text: "A hundred equal spheres of the roughness 0.005 radii at a fraction of 0.5 in a box that is sheared for ever, to a strain of \
           five, from a configuration of equilibrium without contacts. Contacts have a friction of 0.5 where their normal force is above a critical load \
           <em>F</em><sub>c</sub>, and none below (Mari, Seto, Morris and Denn 2014, 10.1122/1.4890747): at a low shear rate few are above it, \
           at a high one most. The shear rate is over <em>F</em><sub>c</sub> / 6 &pi; &eta; a&sup2;. Lines are the limits: \
           no friction, and friction under any load. Viscosity, shares of contacts and friction, contacts of a sphere and those that stick, \
           in the steady state, with 95 % intervals from block averages after the transient.",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let critical = LOADS.map(|load| (format!("load-{load}"), CRITICAL, 1.0 / load, 0.5, load));
    let limits = [(FRICTIONLESS, 0.0, 0.0), (FRICTIONAL, f64::INFINITY, 0.5)];
    let limits = limits.map(|(model, rate, friction)| (model.replace(' ', "-"), model, rate, friction, 0.0));
    let chosen = critical.into_iter().skip(usize::from(quick)).chain(limits);
    let point = |(name, model, rate, friction, load): (String, &'static str, f64, f64, f64)| {
        let point = StudyPoint::new(name, model, rate, FILE)
            .with("name", "thickening")
            .coarsely()
            .with("suspension.volume_fraction", 0.5)
            .rough(friction)
            .with("contact.friction_load", format!("{load:?}"));
        if quick { point.with("suspension.count", 8).with("time.end", 0.4) } else { point }
    };
    chosen.map(point).collect()
}

const ACROSS: Across = Across {
    name: "shear_rate_over_critical",
    label: "shear rate × 6 *π* *η* *a*^{2} / *F*_{c}",
    is_logarithmic: true,
};

const DRAWN: [DrawnMean; 6] = [
    DrawnMean::new("viscosity", "relative viscosity", false, |means| means[0]),
    SHARE_OF_CONTACTS,
    DrawnMean::new("share-of-friction", "share of friction in the viscosity", false, |means| {
        over_viscosity(means, 3)
    }),
    DrawnMean::new("contacts", "contacts of a sphere", false, |means| means[7]),
    DrawnMean::new("sticking-contacts", "contacts of a sphere that stick", false, |means| means[8]),
    PARTICLE_PRESSURE,
];

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    rough_findings(done, &ACROSS, &MODELS, &DRAWN)
}
