//! Settling velocity of spheres against their fraction.

use std::f64::consts::PI;

use gluey_verify::literature::{settling_lost_in_box, settling_of_spheres};

use super::drawing::{Known, StudySeries, curve, draw};
use super::findings::{Findings, Study};
use super::point::{Done, StudyPoint};
use super::steady::mean_of_runs;

const FILE: &str = "settling.toml";
const MODEL: &str = "equilibrium";

pub const STUDY: Study = Study {
    title: "Settling of spheres",
    text: "Mean velocity of a hundred equal spheres of equal weight in a periodic box without mean flow, at the first instant after they were \
           at rest in equilibrium, over that of a single sphere: mean of many configurations with twice its standard error. What a box \
           of a hundred lacks is added by the correction of Ladd 1990 (10.1063/1.458830). Beside it: the polynomial through published \
           simulations of the same, 1 &minus; 6.5464 &phi; (1 &minus; 3.348 &phi; + 7.426 &phi;&sup2; &minus; 10.034 &phi;&sup3; + 5.882 \
           &phi;&#8308;), dilute suspensions (Batchelor 1972, 1 &minus; 6.55 &phi;), and experiments, whose particles have long left \
           equilibrium (Richardson and Zaki 1954, (1 &minus; &phi;)<sup>4.65</sup>).",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let fractions = if quick { &[0.1, 0.3][..] } else { &[0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4][..] };
    let seeds = if quick { 2 } else { 10 };
    let mut points = Vec::new();
    for &fraction in fractions {
        for seed in 1..=seeds {
            let point = StudyPoint::new(format!("{fraction}-{seed}"), MODEL, fraction, FILE);
            points.push(point.with("suspension.volume_fraction", fraction).with("suspension.seed", seed));
        }
    }
    points
}

/// Mean velocity of a first step along the weight over that of a single sphere.
fn velocity(done: &Done) -> anyhow::Result<f64> {
    let (case, table) = (&done.case, &done.trajectory);
    let weight = case.gravity.iter().flatten().copied().fold(0.0, |sum, x| sum + x.abs());
    let mut sum = 0.0;
    for (index, particle) in case.particles.iter().enumerate() {
        let y = table.column(&format!("y{}", index + 1))?;
        // A sphere of volume V settles at w V / (6 pi a).
        let alone = weight * 4.0 / 3.0 * PI * particle.radius.powi(3) / (6.0 * PI * particle.radius);
        sum += (y[0] - y[1]) / (case.time.step * alone);
    }
    Ok(sum / case.particles.len() as f64)
}

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let mut fractions: Vec<f64> = done.iter().map(|run| run.point.at).collect();
    fractions.dedup();
    let (mut rows, mut in_box, mut corrected) = (Vec::new(), Vec::new(), Vec::new());
    for phi in fractions {
        let runs: Vec<&Done> = done.iter().filter(|run| run.point.at == phi).collect();
        let velocities = runs.iter().map(|run| velocity(run)).collect::<Result<Vec<_>, _>>()?;
        let (mean, error) = mean_of_runs(&velocities);
        let lost = settling_lost_in_box(phi, runs[0].case.particles.len());
        let numbers = [phi, mean, mean + lost, error, settling_of_spheres(phi)].map(|x| format!("{x:.4}"));
        rows.push([velocities.len().to_string()].into_iter().chain(numbers).collect());
        in_box.push((phi, mean, 2.0 * error));
        corrected.push((phi, mean + lost, 2.0 * error));
    }
    let series = [
        StudySeries { label: "100 spheres, corrected for the box".to_owned(), points: corrected },
        StudySeries { label: "100 spheres in their box".to_owned(), points: in_box },
    ];
    let columns = "configurations,phi,in_box,corrected,standard_error,polynomial".to_owned();
    let drawing = draw(["volume fraction *φ*", "settling velocity"], [false; 2], &series, known());
    Ok(Findings { columns, rows, drawings: vec![("settling", drawing)], remarks: Vec::new() })
}

fn known() -> Known {
    vec![
        curve("equilibrium", settling_of_spheres, 45),
        curve("1 − 6.55 *φ*", |phi| 1.0 - 6.55 * phi, 12),
        curve("(1 − *φ*)^{4.65}", |phi| (1.0 - phi).powf(4.65), 45),
    ]
}
