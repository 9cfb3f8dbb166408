//! The steady state of a run.

use gluey_suspension::statistics::{Estimate, mser};

use super::point::Done;

/// Means and half widths of columns of the rheology in the steady state, and the strain at which it begins;
/// nothing without one.
pub fn steady(done: &Done, columns: &[&str]) -> anyhow::Result<Option<(f64, Vec<Estimate>)>> {
    let Some(table) = &done.rheology else { return Ok(None) };
    let skip = mser(table.column("viscosity")?).length;
    let strain = table.column("strain")?;
    let mut estimates = Vec::new();
    for name in columns {
        let series = table.column(name)?.get(skip..).unwrap_or(&[]);
        let Some(estimate) = Estimate::of(series) else { return Ok(None) };
        estimates.push(estimate);
    }
    Ok(strain.get(skip).map(|&begin| (begin, estimates)))
}
