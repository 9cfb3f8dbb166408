//! Particles that do not come back in an oscillating shear.

use std::f64::consts::PI;

use gluey::Tally;

use super::drawing::{StudySeries, draw};
use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};

const FILES: [&str; 2] = ["reversibility-2d.toml", "reversibility-3d.toml"];
/// Amplitudes of the strain in 2D and 3D.
const AMPLITUDES: [&[f64]; 2] = [&[0.2, 0.4, 0.6, 1.0, 1.6], &[0.5, 1.0]];
/// Cycles in 2D and 3D.
const CYCLES: [usize; 2] = [8, 4];
/// A particle that is farther than this from where it was a cycle before, in radii, did not come back.
const AWAY: f64 = 0.05;

const LUBRICATION: &str = "lubrication";
const GLUEY: &str = "gluey";
const ROUGH: &str = "gluey, rough";
const INELASTIC: &str = "inelastic";
/// Rough contact with films and friction, whose forces act in the flow.
const FRICTIONS: [(&str, f64); 2] = [("rough, friction 0", 0.0), ("rough, friction 0.5", 0.5)];
const MODELS: [&str; 6] = [LUBRICATION, GLUEY, ROUGH, INELASTIC, FRICTIONS[0].0, FRICTIONS[1].0];
/// Floor of gamma of rough discs and spheres, in squares of the radius. Discs are hardly pressed: at no
/// amplitude do they come to -0.05.
const FLOORS: [f64; 2] = [-0.002, -0.05];
/// Roughness of surfaces in contact, discs and spheres, in radii. Films keep discs farther than 0.005 apart.
const ROUGHNESS: [f64; 2] = [0.01, 0.005];

pub const STUDY: Study = Study {
    title: "Who comes back in an oscillating shear",
    text: "Thirty discs at an area fraction of 0.55 and twelve spheres at 0.4 in a box whose shear strain goes to &gamma;<sub>0</sub>, to \
           &minus;&gamma;<sub>0</sub> and back, again and again. Stokes flow is reversible: whatever does not come back is due to \
           contacts, or to time steps. Shown is the share of particles that are more than 0.05 radii from where they were a cycle \
           before, mean of the second half of the cycles, and their root mean square displacement in a cycle. Six models: lubrication \
           forces and no contact; lubrication forces and contact of surfaces with a roughness of 0.01 radii (discs, which films keep farther than 0.005 apart) and 0.005 (spheres), with friction 0 and 0.5; and without lubrication forces the gluey contact, the gluey contact of rough particles, whose memory \
           does not fall below &minus;0.002 a&sup2; (discs, which are hardly pressed) and &minus;0.05 a&sup2; (spheres), and inelastic contact. Experiments with spheres (Pine et al. 2005, \
           10.1038/nature04380) find that they come back up to an amplitude of about 0.14 &phi;<sup>&minus;1.93</sup>, 0.8 at 0.4; \
           particles of models without contact memory come to rest in arrangements without collisions below such an amplitude.",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let dimensions = if quick { 0..1 } else { 0..2 };
    let mut points = Vec::new();
    for place in dimensions {
        let amplitudes = if quick { &[0.4, 1.6] } else { AMPLITUDES[place] };
        let cycles = if quick { 2 } else { CYCLES[place] };
        for &amplitude in amplitudes {
            points.extend(MODELS.iter().map(|model| point(place, model, amplitude, cycles)));
        }
    }
    points
}

fn point(place: usize, model: &'static str, amplitude: f64, cycles: usize) -> StudyPoint {
    let name = format!("{}d-{}-{amplitude}", place + 2, model.replace(", ", "-").replace(' ', "-"));
    let point = StudyPoint::new(name, model, amplitude, FILES[place])
        .with("time.strain_amplitude", amplitude)
        .with("time.end", 4.0 * amplitude * cycles as f64);
    if let Some((_, friction)) = FRICTIONS.iter().find(|(name, _)| *name == model) {
        return point.rough(*friction).with("contact.roughness", ROUGHNESS[place]);
    }
    match model {
        LUBRICATION => point.with("contact.strategy", "none").with("flow.lubrication", "deficit"),
        INELASTIC => point.with("contact.strategy", "inelastic").with("flow.lubrication", "none"),
        _ => {
            let point = point.with("contact.strategy", "gluey").with("flow.lubrication", "none");
            if model == ROUGH {
                point.with("contact.gamma_min", FLOORS[place] * radius(place).powi(2))
            } else {
                point
            }
        }
    }
}

/// Radius of the particles of the cases, from their number and fraction.
fn radius(place: usize) -> f64 {
    match place {
        0 => (0.55 / (30.0 * PI)).sqrt(),
        _ => (0.4 * 3.0 / (12.0 * 4.0 * PI)).cbrt(),
    }
}

/// Share that did not come back in a cycle, and root mean square displacement in radii: means over the second
/// half of the cycles.
fn away(done: &Done) -> anyhow::Result<(f64, f64)> {
    let (case, table) = (&done.case, &done.trajectory);
    let a = case.mean_radius();
    let length = case.cycle_length().unwrap_or(1);
    let cycles = case.step_count() / length;
    let (mut share, mut rms, mut count) = (0.0, 0.0, 0.0);
    for cycle in cycles / 2..cycles {
        let mut squares = Vec::new();
        for particle in 1..=case.particles.len() {
            let mut square = 0.0;
            for axis in &["x", "y", "z"][..case.dimension] {
                let x = table.column(&format!("{axis}{particle}"))?;
                square += ((x[(cycle + 1) * length] - x[cycle * length]) / a).powi(2);
            }
            squares.push(square);
        }
        let total = squares.len() as f64;
        share += squares.iter().filter(|square| **square > AWAY * AWAY).count() as f64 / total;
        rms += (squares.iter().sum::<f64>() / total).sqrt();
        count += 1.0;
    }
    Ok((share / count, rms / count))
}

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let (mut rows, mut drawings) = (Vec::new(), Vec::new());
    for (dimension, names) in [(2, ["away-2d", "distance-2d"]), (3, ["away-3d", "distance-3d"])] {
        let (mut shares, mut distances) = (MODELS.map(StudySeries::new), MODELS.map(StudySeries::new));
        for run in done.iter().filter(|run| run.case.dimension == dimension) {
            let (share, distance) = away(run)?;
            let smallest = run.report.min_gap_over_a.map_or(String::new(), |gap| format!("{gap:.1e}"));
            let numbers =
                [format!("{}", run.point.at), format!("{share:.3}"), format!("{distance:.2e}"), smallest];
            let Tally { closed_films, halved_steps, .. } = run.report.tally;
            let counts = [closed_films, halved_steps].map(|count| count.to_string());
            let StudyPoint { model, at, .. } = run.point;
            let model_of = [dimension.to_string(), model.to_owned()];
            rows.push(model_of.into_iter().chain(numbers).chain(counts).collect());
            StudySeries::add(&mut shares, model, (at, share, 0.0));
            StudySeries::add(&mut distances, model, (at, distance, 0.0));
        }
        if shares.iter().all(|series| series.points.is_empty()) {
            continue;
        }
        let (x, of) = ("amplitude of the strain *γ*_{0}", if dimension == 2 { "discs" } else { "spheres" });
        let away = format!("share of {of} away");
        drawings.push((names[0], draw([x, &away], [false; 2], &shares, Vec::new())));
        let distance = "displacement in a cycle / *a*";
        drawings.push((names[1], draw([x, distance], [false, true], &distances, Vec::new())));
    }
    let columns = "dimension,model,amplitude,share_away,rms_over_a,min_gap_over_a,\
                   closed_films,halved_steps"
        .to_owned();
    Ok(Findings { columns, rows, drawings, remarks: Vec::new() })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn radii_are_those_of_the_cases() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/studies");
        for place in 0..2 {
            let case = point(place, ROUGH, 1.0, 1).case(&data).unwrap();
            assert!((case.mean_radius() - radius(place)).abs() < 1e-12);
            assert!(case.contact.gamma_min.is_some_and(|floor| floor < 0.0));
        }
    }
}
