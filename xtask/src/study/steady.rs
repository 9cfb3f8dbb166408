//! Means over runs: the steady state of one, and one number of several.

use gluey_suspension::statistics::{Estimate, mser};
use gluey_verify::statistics::{mean, scatter};

use super::point::Done;

/// Contacts of a sphere, and those of them that stick, in the mean; other columns are those of the rheology.
pub const CONTACTS: [&str; 2] = ["contacts", "sticking_contacts"];

/// Means and half widths of columns in the steady state, and the strain at which it begins; nothing without
/// one.
pub fn steady(done: &Done, columns: &[&str]) -> anyhow::Result<Option<(f64, Vec<Estimate>)>> {
    let Some(table) = &done.rheology else { return Ok(None) };
    let skip = mser(table.column("viscosity")?).length;
    let strain = table.column("strain")?;
    let mut estimates = Vec::new();
    for name in columns {
        let series = match CONTACTS.iter().position(|contacts| contacts == name) {
            Some(which) => contacts(done, which == 1)?,
            None => table.column(name)?.to_vec(),
        };
        let Some(estimate) = Estimate::of(series.get(skip..).unwrap_or(&[])) else { return Ok(None) };
        estimates.push(estimate);
    }
    Ok(strain.get(skip).map(|&begin| (begin, estimates)))
}

/// Contacts of a particle in each step, or those that stick alone. A contact is one of two particles.
fn contacts(done: &Done, stick: bool) -> anyhow::Result<Vec<f64>> {
    let [active, sliding] = ["active_contacts", "sliding_contacts"].map(|name| done.steps.column(name));
    let count = done.case.particles.len() as f64;
    let of_step =
        |(active, sliding): (&f64, &f64)| 2.0 * (active - if stick { *sliding } else { 0.0 }) / count;
    Ok(active?.iter().zip(sliding?).map(of_step).collect())
}

/// The mean of numbers of several runs, and its standard error, which is none for one.
pub fn mean_of_runs(numbers: &[f64]) -> (f64, f64) {
    (mean(numbers), scatter(numbers) / (numbers.len() as f64).sqrt())
}
