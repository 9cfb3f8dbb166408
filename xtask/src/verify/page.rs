//! The book as a page, and its numbers as a table.

use std::fmt::Write;

use gluey::progress::duration;
use gluey_verify::{Judged, Outcome};

use super::{Book, Chapter};
use crate::book::page::{self, escape, number};

/// The page.
pub fn html(book: &Book) -> String {
    let mut body = String::new();
    write_body(&mut body, book).expect("writing to a String cannot fail");
    page::document("gluey: verification", &body)
}

/// All numbers: `case;number;formulation;value;wanted;verdict;reason`.
pub fn csv(book: &Book) -> String {
    let mut text = "case;number;formulation;value;wanted;verdict;reason\n".to_owned();
    for (case, judged) in book.judged() {
        let value = judged.value.map_or_else(String::new, |value| value.to_string());
        let wanted = judged.verdict.map_or_else(String::new, |(wanted, _)| wanted.to_string());
        let verdict = match judged.verdict {
            None => "",
            Some((_, Outcome::Yes)) => "yes",
            Some((_, Outcome::No)) => "no",
            Some((_, Outcome::NotMeasured)) => "not measured",
        };
        let Judged { what, method, reason, .. } = judged;
        let fields = [case.name, what, method, &value, &wanted, verdict, reason];
        text += &(fields.join(";") + "\n");
    }
    text
}

/// A number with its limit, in words.
pub fn sentence(judged: &Judged) -> String {
    let value = judged.value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.4e}"));
    let wanted = judged.verdict.map_or_else(String::new, |(wanted, _)| format!(" ({wanted})"));
    format!("{}, {}: {value}{wanted}", judged.what, judged.method)
}

fn write_body(out: &mut String, book: &Book) -> std::fmt::Result {
    let commit = book.commit.as_deref().map_or_else(String::new, |commit| format!(", commit {commit}"));
    writeln!(
        out,
        "<h1>What gluey computes beside exact solutions</h1>\n<p>gluey {}{}, computed in {}. Every formulation solves the same \
         cases; a number without a limit is shown and decides nothing.</p>",
        env!("CARGO_PKG_VERSION"),
        escape(&commit),
        duration(book.wall_s)
    )?;
    if book.quick {
        let note = "Computed with <code>--quick</code>: fewer positions and coarser meshes.";
        writeln!(out, "<p class=\"note\">{note}</p>")?;
    }
    for failure in &book.failures {
        writeln!(out, "<p class=\"note bad\">{}: {}</p>", escape(&failure.what), escape(&failure.error))?;
    }
    let (limits, held, free) = book.counts();
    writeln!(out, "<p>Of {limits} numbers with a limit {held} are within it; {free} have none.</p>")?;
    for (case, judged) in book.judged().filter(|(_, judged)| judged.is_failure()) {
        let name = case.name;
        writeln!(out, "<p class=\"bad\"><a href=\"#{name}\">{name}</a>, {}</p>", escape(&sentence(judged)))?;
    }
    book.chapters.iter().try_for_each(|chapter| write_chapter(out, chapter))
}

fn write_chapter(out: &mut String, chapter: &Chapter) -> std::fmt::Result {
    let case = chapter.case;
    writeln!(out, "<section id=\"{}\">\n<h2>{}</h2>\n<p>{}</p>", case.name, case.title, escape(case.text))?;
    writeln!(out, "{}", chapter.drawing.inline_svg())?;
    write_numbers(out, &chapter.judged)?;
    if !case.measures.is_empty() {
        let name = case.name;
        writeln!(out, "<p>All computations: <a href=\"{name}.csv\">{name}.csv</a>.</p>")?;
    }
    writeln!(out, "</section>")
}

/// One line a number, one group of columns a formulation.
fn write_numbers(out: &mut String, judged: &[Judged]) -> std::fmt::Result {
    let methods = unique(judged.iter().map(|judged| judged.method.as_str()));
    write!(out, "<table class=\"rows\"><tr><th class=\"t\"></th>")?;
    for method in &methods {
        write!(out, "<th>{}</th><th class=\"t\">limit</th><th class=\"t\"></th>", escape(method))?;
    }
    writeln!(out, "</tr>")?;
    for what in unique(judged.iter().map(|judged| judged.what.as_str())) {
        write!(out, "<tr><td class=\"t\">{}</td>", escape(what))?;
        for method in &methods {
            match judged.iter().find(|judged| judged.what == what && judged.method == *method) {
                Some(judged) => write_cells(out, judged)?,
                None => write!(out, "<td></td><td></td><td></td>")?,
            }
        }
        writeln!(out, "</tr>")?;
    }
    writeln!(out, "</table>")?;
    write_reasons(out, judged)
}

fn write_cells(out: &mut String, judged: &Judged) -> std::fmt::Result {
    let (wanted, class, mark) = match judged.verdict {
        None => ("none".to_owned(), "t", ""),
        Some((wanted, Outcome::Yes)) => (wanted.to_string(), "t", "within"),
        Some((wanted, Outcome::No)) => (wanted.to_string(), "t bad", "not within"),
        Some((wanted, Outcome::NotMeasured)) => (wanted.to_string(), "t bad", "not measured"),
    };
    let value = number(judged.value);
    write!(out, "<td>{value}</td><td class=\"t\">{wanted}</td><td class=\"{class}\">{mark}</td>")
}

/// The reasons of limits, each once with its formulation.
fn write_reasons(out: &mut String, judged: &[Judged]) -> std::fmt::Result {
    let with_reason = judged.iter().filter(|judged| !judged.reason.is_empty());
    let reasons: Vec<String> =
        with_reason.map(|judged| format!("{}: {}", judged.method, judged.reason)).collect();
    for reason in unique(reasons.iter().map(String::as_str)) {
        writeln!(out, "<p class=\"reason\">{}</p>", escape(reason))?;
    }
    Ok(())
}

/// The items in order, each once.
fn unique<'a>(items: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut unique = Vec::new();
    for item in items {
        if !unique.contains(&item) {
            unique.push(item);
        }
    }
    unique
}
