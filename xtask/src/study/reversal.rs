//! Viscosity of smooth and rough spheres against the strain after the shear is reversed (Gadala-Maria and
//! Acrivos 1980, J. Rheol. 24, 799).

use super::drawing::{StudySeries, draw};
use super::findings::{Findings, Study};
use super::point::{COARSE_STEP, Done, StudyPoint};
use super::steady::mean_of_runs;

const FILE: &str = "friction.toml";
/// Fractions with the names of their pictures.
const FRACTIONS: [(f64, [&str; 2]); 2] =
    [(0.4, ["viscosity-0.4", "contacts-0.4"]), (0.45, ["viscosity-0.45", "contacts-0.45"])];
/// Models with their friction; smooth spheres have no contact at all.
const MODELS: [(&str, Option<f64>); 3] =
    [("smooth", None), ("rough, friction 0", Some(0.0)), ("rough, friction 0.5", Some(0.5))];
/// Configurations of each point, and where the shear is reversed and ends.
const SEEDS: u32 = 3;
const REVERSED_AT: f64 = 3.0;
const END: f64 = 5.04;
/// Strain before the reversal that is looked at, and that of a mean: three steps.
const BEFORE: f64 = 0.96;
const BIN: f64 = 3.0 * COARSE_STEP;

pub const STUDY: Study = Study {
    title: "Reversal of the shear",
    text: "A hundred equal spheres at fractions of 0.4 and 0.45 in a box that is sheared to a strain of three, from configurations of equilibrium \
           without contacts, and then the other way: relative viscosity, and the share of contacts in it, against the strain after the reversal, in means over a \
           strain of 0.12, three steps. Points are means of three configurations with twice their standard error. Three models: smooth spheres, \
           between which only the flow acts, films of lubrication included, and rough ones, of the roughness 0.005 radii, with friction 0 and 0.5. \
           Stokes flow is reversible: smooth spheres go back where they came from, and their viscosity is the same before and after, as in a mirror, but for \
           films that closed. Contacts open at the reversal, since they push and do not pull: the viscosity falls at once, and comes back when \
           spheres have found contacts on their other sides (Gadala-Maria and Acrivos 1980, J. Rheol. 24, 799; Blanc, Peters and Lemaire 2011, J. Rheol. \
           55, 835; Peters et al. 2016, J. Rheol. 60, 715; Ness and Sun 2015, arXiv 1509.01530).",
    points,
    findings,
};

fn points(quick: bool) -> Vec<StudyPoint> {
    let (fractions, seeds) = if quick { (&FRACTIONS[1..], 2) } else { (&FRACTIONS[..], SEEDS) };
    let mut points = Vec::new();
    for &(fraction, _) in fractions {
        for (model, friction) in MODELS {
            for seed in 1..=seeds {
                let name = format!("{fraction}-{}-{seed}", model.replace(", ", "-").replace(' ', "-"));
                let point = StudyPoint::new(name, model, fraction, FILE)
                    .with("name", "reversal")
                    .coarsely()
                    .with("suspension.volume_fraction", fraction)
                    .with("suspension.seed", seed);
                let point = match friction {
                    Some(friction) => point.rough(friction),
                    None => point.with("contact.strategy", "none"),
                };
                let [at, end] = if quick { [0.96, 1.56] } else { [REVERSED_AT, END] };
                let point = point.with("time.reverse_at", at).with("time.end", end);
                points.push(if quick { point.with("suspension.count", 12) } else { point });
            }
        }
    }
    points
}

/// Strain after the reversal, viscosity and share of contacts: means over bins of strain.
fn bins(run: &Done) -> anyhow::Result<Vec<[f64; 3]>> {
    let (Some(table), Some(at)) = (&run.rheology, run.case.time.reverse_at) else { return Ok(Vec::new()) };
    let [t, viscosity, contacts] = ["t", "viscosity", "viscosity_of_contacts"].map(|name| table.column(name));
    let (t, viscosity, contacts) = (t?, viscosity?, contacts?);
    let begin = |row: &usize| BIN * ((t[*row] - at) / BIN + 1e-6).floor();
    let rows = (0..t.len().saturating_sub(1)).filter(|row| begin(row) > -BEFORE - 1e-6);
    let mean = |rows: &[usize]| {
        let sum = |numbers: &[f64]| rows.iter().map(|row| numbers[*row]).sum::<f64>();
        let (count, whole) = (rows.len() as f64, sum(viscosity));
        [sum(t) / count - at, whole / count, sum(contacts) / whole]
    };
    Ok(rows.collect::<Vec<_>>().chunk_by(|a, b| begin(a) == begin(b)).map(mean).collect())
}

/// Strain after the reversal with the viscosity, and with the share of contacts: means of runs with twice
/// their standard errors.
fn means(runs: &[Vec<[f64; 3]>]) -> Vec<[(f64, f64, f64); 2]> {
    let count = runs.iter().map(Vec::len).min().unwrap_or(0);
    let mean = |bin: usize, which: usize| {
        let (mean, error) = mean_of_runs(&runs.iter().map(|run| run[bin][which]).collect::<Vec<_>>());
        (runs[0][bin][0], mean, 2.0 * error)
    };
    (0..count).map(|bin| [mean(bin, 1), mean(bin, 2)]).collect()
}

fn findings(done: &[Done]) -> anyhow::Result<Findings> {
    let (mut rows, mut drawings) = (Vec::new(), Vec::new());
    for (fraction, names) in FRACTIONS {
        let mut series = [(); 2].map(|()| MODELS.map(|(model, _)| StudySeries::new(model)));
        for (place, (model, _)) in MODELS.into_iter().enumerate() {
            // Points of a bin stand side by side.
            let aside = 0.2 * BIN * (place as f64 - 1.0);
            let runs = done.iter().filter(|run| run.point.at == fraction && run.point.model == model);
            let runs = runs.map(bins).collect::<Result<Vec<_>, _>>()?;
            for [viscosity, share] in means(&runs) {
                for (series, (strain, mean, error)) in series.iter_mut().zip([viscosity, share]) {
                    StudySeries::add(series, model, (strain + aside, mean, error));
                }
                let numbers = [fraction, viscosity.0, viscosity.1, viscosity.2, share.1, share.2];
                let numbers = numbers.map(|x| format!("{:.4}", x + 0.0)).into_iter();
                rows.push([model.to_owned(), runs.len().to_string()].into_iter().chain(numbers).collect());
            }
        }
        if series.iter().flatten().any(|series| !series.points.is_empty()) {
            let labels = ["relative viscosity", "share of contacts in the viscosity"];
            for ((name, label), series) in names.into_iter().zip(labels).zip(series) {
                drawings.push((
                    name,
                    draw(["strain after the reversal", label], [false; 2], &series, Vec::new()),
                ));
            }
        }
    }
    let columns =
        "model,configurations,phi,strain,viscosity,viscosity_twice_error,share_of_contacts,share_twice_error";
    Ok(Findings { columns: columns.to_owned(), rows, drawings, remarks: Vec::new() })
}
