//! What the books of figures and of verification and the pages of studies share: files written whole, jobs
//! side by side, the frame of a page.

pub mod files;
pub mod page;
pub mod progress;
pub mod schedule;

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::Path;

use gluey_pictures::{Axis, Canvas, Chart, Curve};
use serde::Serialize;

/// Something that did not work.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct BookFailure {
    /// The run, figure or file.
    pub what: String,
    /// Why.
    pub error: String,
}

impl BookFailure {
    /// Names what failed, with the error and its causes.
    pub fn new(what: String, error: &(dyn Error + 'static)) -> Self {
        Self { what, error: chain(error) }
    }
}

/// Values of results; what stands in the place of others goes to the failures, with the name of each.
pub fn keep<T>(
    what: String,
    result: Result<T, impl Into<anyhow::Error>>,
    failures: &mut Vec<BookFailure>,
) -> Option<T> {
    result.map_err(|error| failures.push(BookFailure::new(what, &*error.into()))).ok()
}

/// Writes a drawing as `<name>.svg` and `<name>.png`; the second may fail.
pub fn write_drawing(
    out: &Path,
    name: &str,
    drawing: &Canvas,
    failures: &mut Vec<BookFailure>,
) -> anyhow::Result<()> {
    files::write(&out.join(format!("{name}.svg")), drawing.svg().as_bytes())?;
    match keep(format!("{name}.png"), drawing.png(), failures) {
        Some(png) => files::write(&out.join(format!("{name}.png")), &png),
        None => Ok(()),
    }
}

/// A chart without notes and marks.
pub fn chart(x: Axis, y: Axis, curves: Vec<Curve>) -> Chart {
    Chart { x, y, curves, notes: Vec::new(), marks: Vec::new() }
}

/// A linear axis.
pub fn linear(label: &str, min: f64, max: f64, tick: f64) -> Axis {
    Axis { label: label.to_owned(), min, max, tick, log: false }
}

/// Runs at a time: as many as wanted, else one for each core.
pub fn jobs(wanted: Option<NonZeroUsize>) -> usize {
    wanted.or(std::thread::available_parallelism().ok()).map_or(1, usize::from)
}

/// An error with its causes.
pub fn chain(error: &(dyn Error + 'static)) -> String {
    let causes = std::iter::successors(error.source(), |&cause| cause.source());
    causes.fold(error.to_string(), |text, cause| {
        let cause = cause.to_string();
        if text.contains(&cause) { text } else { format!("{text}: {cause}") }
    })
}
