//! The page of a study and its table.

use gluey::progress::duration;

use super::findings::{Findings, Study};
use super::point::Done;
use crate::book::BookFailure;
use crate::book::page::{self, escape};

/// What a study of so many runs took, as HTML; earlier runs count with the time that they took then.
pub fn effort(done: &[Done], run_count: usize, wall_s: f64) -> String {
    let run_s = done.iter().map(|done| done.report.wall_s).sum();
    let built = || done.iter().filter_map(|done| done.report.cells_per_radius);
    let [least, most] = [built().fold(f64::INFINITY, f64::min), built().fold(0.0, f64::max)];
    let cells = match least <= most {
        true => {
            format!("<p>Cells per radius of the smallest particle, as built: {least:.2} to {most:.2}.</p>\n")
        }
        false => String::new(),
    };
    let (count, all, own) = (done.len(), duration(run_s), duration(wall_s));
    let version = env!("CARGO_PKG_VERSION");
    format!(
        "{cells}<p>{count} of {run_count} runs, {all} in all; this command took {own}. gluey {version}.</p>\n"
    )
}

/// The table as CSV; names lose their commas.
pub fn csv(findings: &Findings) -> String {
    let line =
        |row: &Vec<String>| row.iter().map(|cell| cell.replace(',', "")).collect::<Vec<_>>().join(",") + "\n";
    findings.columns.clone() + "\n" + &findings.rows.iter().map(line).collect::<String>()
}

/// The page.
pub fn html(
    study: &Study,
    findings: &Findings,
    failures: &[BookFailure],
    is_quick: bool,
    effort: &str,
) -> String {
    let Study { title, text, .. } = study;
    let notes =
        page::notes(is_quick.then_some("few points, short runs; nothing here is a result."), failures);
    let drawings = findings.drawings.iter().map(|(_, drawing)| drawing.svg() + "\n").collect::<String>();
    let remarks = findings.remarks.iter().map(|remark| format!("<p>{remark}</p>\n")).collect::<String>();
    let head = page::row(findings.columns.split_terminator(',').map(|name| ("th", escape(name))));
    let rows = findings.rows.iter().map(|row| page::row(row.iter().map(|cell| ("td", escape(cell)))));
    let table = format!("<table>\n{head}{}</table>\n", rows.collect::<String>());
    let body = format!("<h1>{title}</h1>\n<p>{text}</p>\n{notes}{drawings}{remarks}{table}{effort}");
    page::document(&format!("gluey: {title}"), &body)
}
