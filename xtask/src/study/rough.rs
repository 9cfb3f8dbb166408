//! Rheology of rough spheres in the steady state: a row for each run, and pictures against what was varied.

use gluey::Tally;

use super::drawing::{Known, StudySeries, draw};
use super::findings::Findings;
use super::point::Done;
use super::steady::{CONTACTS, steady};

/// What is taken of the steady state.
const COLUMNS: [&str; 9] = [
    "viscosity",
    "viscosity_by_dissipation",
    "viscosity_of_contacts",
    "viscosity_of_friction",
    "N1",
    "N2",
    "particle_pressure",
    CONTACTS[0],
    CONTACTS[1],
];

/// A picture of the means of the columns.
pub struct DrawnMean {
    name: &'static str,
    label: &'static str,
    is_logarithmic: bool,
    of: fn(&[[f64; 2]]) -> [f64; 2],
    known: fn() -> Known,
}

pub const SHARE_OF_CONTACTS: DrawnMean =
    DrawnMean::new("share-of-contacts", "share of contacts in the viscosity", false, |means| {
        over_viscosity(means, 2)
    });
pub const PARTICLE_PRESSURE: DrawnMean =
    DrawnMean::new("particle-pressure", "particle pressure / viscous stress", true, |means| means[6]);

/// A column over the viscosity.
pub fn over_viscosity(means: &[[f64; 2]], column: usize) -> [f64; 2] {
    means[column].map(|number| number / means[0][0])
}

impl DrawnMean {
    /// A picture with its name, its label, and what is drawn of means of the columns, with half an error bar.
    pub const fn new(
        name: &'static str,
        label: &'static str,
        is_logarithmic: bool,
        of: fn(&[[f64; 2]]) -> [f64; 2],
    ) -> Self {
        Self { name, label, is_logarithmic, of, known: Vec::new }
    }

    /// The same beside known curves.
    pub const fn beside(self, known: fn() -> Known) -> Self {
        Self { known, ..self }
    }

    /// Draws points; series at 0 or infinity of a logarithmic axis are limits, lines from side to side.
    fn draw(&self, across: &Across, mut series: Vec<StudySeries>) -> (&'static str, gluey_pictures::Canvas) {
        let mut known = (self.known)();
        if across.is_logarithmic {
            let is_limit = |series: &mut StudySeries| {
                series.points.iter().any(|point| point.0 == 0.0 || point.0.is_infinite())
            };
            let limits: Vec<_> = series.extract_if(.., is_limit).collect();
            let places = || series.iter().flat_map(|series| &series.points).map(|point| point.0);
            let ends = [places().fold(f64::INFINITY, f64::min) / 2.0, places().fold(0.0, f64::max) * 2.0];
            let line = |y: f64| ends.map(|x| (x, y)).to_vec();
            known.extend(limits.iter().map(|limit| (limit.label.clone(), line(limit.points[0].1))));
        }
        let is_logarithmic = [across.is_logarithmic, self.is_logarithmic];
        (self.name, draw([across.label, self.label], is_logarithmic, &series, known))
    }
}

/// The axis of what was varied.
pub struct Across {
    /// Its name in the table.
    pub name: &'static str,
    /// Its label in pictures.
    pub label: &'static str,
    /// Whether it is logarithmic.
    pub is_logarithmic: bool,
}

/// A row for each run, and the pictures, with a series for each model.
pub fn rough_findings(
    done: &[Done],
    across: &Across,
    models: &[&str],
    drawn: &[DrawnMean],
) -> anyhow::Result<Findings> {
    let mut rows = Vec::new();
    let mut series: Vec<Vec<_>> =
        drawn.iter().map(|_| models.iter().map(|model| StudySeries::new(model)).collect()).collect();
    for run in done {
        let Some((begin, estimates)) = steady(run, &COLUMNS)? else { continue };
        let means: Vec<[f64; 2]> = estimates.iter().map(|one| [one.mean, one.half_width]).collect();
        for (series, drawn) in series.iter_mut().zip(drawn) {
            let [mean, half_width] = (drawn.of)(&means);
            StudySeries::add(series, run.point.model, (run.point.at, mean, half_width));
        }
        let contact = &run.case.contact;
        let numbers = [run.point.at, contact.friction, contact.friction_load, begin];
        let numbers = numbers.into_iter().chain(means.as_flattened().iter().copied());
        let Tally { halved_steps, .. } = run.report.tally;
        let cells = run.report.cells_per_radius.map_or(String::new(), |cells| format!("{cells:.2}"));
        let resolved = if estimates[0].is_resolved { "yes" } else { "no" };
        let ends = [resolved.to_owned(), cells, halved_steps.to_string()];
        rows.push(numbers.map(|x| format!("{x:.4}")).chain(ends).collect());
    }
    let drawings = drawn.iter().zip(series).map(|(drawn, series)| drawn.draw(across, series)).collect();
    let means: String = COLUMNS.iter().map(|name| format!("{name},{name}_half_width,")).collect();
    let columns = format!(
        "{},friction,friction_load,strain_skipped,{means}blocks_independent,cells_per_radius,halved_steps",
        across.name
    );
    Ok(Findings { columns, rows, drawings, remarks: Vec::new() })
}
