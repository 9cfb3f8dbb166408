//! The page of a study and its table.

use std::fmt::Write;

use super::point::Done;
use super::{Findings, Study};
use crate::book::Failure;
use crate::book::page::{self, escape};
use gluey::progress::duration;

/// What a study took.
pub struct Effort {
    run_count: usize,
    run_s: f64,
    wall_s: f64,
    /// Cells per radius as built, of the coarsest mesh and of the finest.
    cells: [f64; 2],
}

impl Effort {
    /// Of these runs; earlier runs count with the time that they took then.
    pub fn of(done: &[Done], wall_s: f64) -> Self {
        let run_s = done.iter().map(|done| done.report.wall_s).sum();
        let built = || done.iter().filter_map(|done| done.report.cells_per_radius);
        let cells = [built().fold(f64::INFINITY, f64::min), built().fold(0.0, f64::max)];
        Self { run_count: done.len(), run_s, wall_s, cells }
    }
}

/// The table as CSV.
pub fn csv(findings: &Findings) -> String {
    let mut text = findings.columns.join(",") + "\n";
    findings.rows.iter().for_each(|row| text += &(row.join(",") + "\n"));
    text
}

/// The page.
pub fn html(
    study: &Study,
    findings: &Findings,
    effort: &Effort,
    failures: &[Failure],
    quick: bool,
) -> String {
    let mut body = String::new();
    write_body(&mut body, study, findings, failures, quick).expect("writing to a String cannot fail");
    let Effort { run_count, run_s, wall_s, cells: [least, most] } = effort;
    if least <= most {
        body += &format!(
            "<p>Cells per radius of the smallest particle, as built: {least:.2} to {most:.2}.</p>\n"
        );
    }
    body += &format!(
        "<p>{run_count} runs of {} in all; this command took {}. gluey {}.</p>\n",
        duration(*run_s),
        duration(*wall_s),
        env!("CARGO_PKG_VERSION")
    );
    page::document(&format!("gluey: {}", study.title), &body)
}

fn write_body(
    out: &mut String,
    study: &Study,
    findings: &Findings,
    failures: &[Failure],
    quick: bool,
) -> std::fmt::Result {
    writeln!(out, "<h1>{}</h1>\n<p>{}</p>", study.title, study.text)?;
    if quick {
        let note = "Computed with <code>--quick</code>: few points, short runs; nothing here is a result.";
        writeln!(out, "<p class=\"note\">{note}</p>")?;
    }
    for failure in failures {
        writeln!(out, "<p class=\"note bad\">{}: {}</p>", escape(&failure.what), escape(&failure.error))?;
    }
    for (_, drawing) in &findings.drawings {
        writeln!(out, "{}", drawing.svg())?;
    }
    findings.remarks.iter().try_for_each(|remark| writeln!(out, "<p>{remark}</p>"))?;
    let cells = |tag: &str, row: &mut dyn Iterator<Item = String>| -> String {
        row.map(|cell| format!("<{tag}>{}</{tag}>", escape(&cell))).collect()
    };
    let head = cells("th", &mut findings.columns.iter().map(|name| (*name).to_owned()));
    writeln!(out, "<table>\n<tr>{head}</tr>")?;
    for row in &findings.rows {
        writeln!(out, "<tr>{}</tr>", cells("td", &mut row.iter().cloned()))?;
    }
    writeln!(out, "</table>")
}
