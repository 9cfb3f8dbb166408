//! What the books of figures and of verification share: files written whole, jobs side by side, the frame of
//! a page.

pub mod files;
pub mod page;
pub mod progress;
pub mod schedule;

use std::error::Error;
use std::path::Path;

use serde::Serialize;

use files::WriteError;
use gluey_pictures::Canvas;

/// Something that did not work.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// The run, figure or file.
    pub what: String,
    /// Why.
    pub error: String,
}

impl Failure {
    /// Names what failed, with the error and its causes.
    pub fn new(what: String, error: &dyn Error) -> Self {
        Self { what, error: chain(error) }
    }
}

/// Writes a drawing as `<name>.svg` and `<name>.png`; the second may fail.
pub fn write_drawing(
    out: &Path,
    name: &str,
    drawing: &Canvas,
    failures: &mut Vec<Failure>,
) -> Result<(), WriteError> {
    files::write(&out.join(format!("{name}.svg")), drawing.svg().as_bytes())?;
    match drawing.png() {
        Ok(png) => files::write(&out.join(format!("{name}.png")), &png)?,
        Err(error) => failures.push(Failure::new(format!("{name}.png"), &error)),
    }
    Ok(())
}

/// An error with its causes.
pub fn chain(error: &dyn Error) -> String {
    let causes = std::iter::successors(error.source(), |&cause| cause.source());
    causes.fold(error.to_string(), |text, cause| {
        let cause = cause.to_string();
        if text.contains(&cause) { text } else { format!("{text}: {cause}") }
    })
}
