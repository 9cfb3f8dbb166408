//! The book as a page, and its numbers as a table.

use gluey::progress::duration;
use gluey_verify::{Judged, Judgement, VerificationCase};

use super::book::{Book, Chapter, sentence};
use crate::book::page::{self, BAD, TEXT, TITLE, escape, number};

/// The page.
pub fn html(book: &Book) -> String {
    let chapters: String = book.chapters.iter().map(chapter).collect();
    page::document("gluey: verification", &(head(book) + &chapters))
}

/// All numbers: `case;number;formulation;value;wanted;verdict;reason`.
pub fn csv(book: &Book) -> String {
    let mut text = "case;number;formulation;value;wanted;verdict;reason\n".to_owned();
    for (case, judged) in book.judged() {
        let value = judged.value.map_or_else(String::new, |value| value.to_string());
        let wanted = judged.verdict.map_or_else(String::new, |(wanted, _)| wanted.to_string());
        let verdict = match judged.verdict {
            None => "",
            Some((_, Judgement::Yes)) => "yes",
            Some((_, Judgement::No)) => "no",
            Some((_, Judgement::NotMeasured)) => "not measured",
        };
        let Judged { what, method, reason, .. } = judged;
        let fields = [case.name, what, method, &value, &wanted, verdict, reason];
        text += &(fields.join(";") + "\n");
    }
    text
}

/// Title, state of the sources, and all that fails.
fn head(book: &Book) -> String {
    let commit = book.commit.as_deref().map_or_else(String::new, |commit| format!(", commit {commit}"));
    let (version, commit, time) = (env!("CARGO_PKG_VERSION"), escape(&commit), duration(book.wall_s));
    let quick = book.quick.then_some("fewer positions and coarser meshes.");
    let (limits, held, free) = book.counts();
    let missed = book.judged().filter(|(_, judged)| judged.is_failure()).map(
        |(VerificationCase { name, .. }, judged)| {
            let said = escape(&sentence(judged));
            format!("<p class=\"bad\"><a href=\"#{name}\">{name}</a>, {said}</p>\n")
        },
    );
    format!(
        "<h1>What gluey computes beside exact solutions</h1>\n<p>gluey {version}{commit}, computed in {time}. Every \
         formulation solves the same cases; a number without a limit is shown and decides nothing.</p>\n\
         {}<p>Of {limits} numbers with a limit {held} are within it; {free} have none.</p>\n{}",
        page::notes(quick, &book.failures),
        missed.collect::<String>()
    )
}

fn chapter(Chapter { case, judged, drawing, .. }: &Chapter) -> String {
    let VerificationCase { name, title, text, measures, .. } = case;
    let table = match measures.is_empty() {
        true => String::new(),
        false => format!("<p>All computations: <a href=\"{name}.csv\">{name}.csv</a>.</p>\n"),
    };
    let (text, svg, numbers) = (escape(text), drawing.inline_svg(), numbers(judged));
    format!("<section id=\"{name}\">\n<h2>{title}</h2>\n<p>{text}</p>\n{svg}\n{numbers}{table}</section>\n")
}

/// One line a number, one group of columns a formulation; then the reasons of limits, each once with its
/// formulation.
fn numbers(judged: &[Judged]) -> String {
    let methods = unique(judged.iter().map(|judged| judged.method.clone()));
    let title = |method: &String| [("th", escape(method)), (TITLE, "limit".into()), (TITLE, String::new())];
    let head = page::row([(TITLE, String::new())].into_iter().chain(methods.iter().flat_map(title)));
    let line = |what: String| {
        let of =
            |method: &String| judged.iter().find(|judged| judged.what == what && judged.method == *method);
        let empty = ["td"; 3].map(|tag| (tag, String::new()));
        let own = methods.iter().flat_map(|method| of(method).map_or_else(|| empty.clone(), cells));
        page::row([(TEXT, escape(&what))].into_iter().chain(own))
    };
    let lines = unique(judged.iter().map(|judged| judged.what.clone())).into_iter().map(line);
    let reasons = judged.iter().filter(|judged| !judged.reason.is_empty());
    let reasons = unique(reasons.map(|judged| format!("{}: {}", judged.method, judged.reason)));
    let reasons = reasons.iter().map(|reason| format!("<p class=\"reason\">{}</p>\n", escape(reason)));
    let (lines, reasons) = (lines.collect::<String>(), reasons.collect::<String>());
    format!("<table class=\"rows\">{head}{lines}</table>\n{reasons}")
}

fn cells(judged: &Judged) -> [(&'static str, String); 3] {
    let wanted = judged.verdict.map_or("none".to_owned(), |(wanted, _)| wanted.to_string());
    let (tag, mark) = match judged.verdict.map(|(_, outcome)| outcome) {
        None => (TEXT, ""),
        Some(Judgement::Yes) => (TEXT, "within"),
        Some(Judgement::No) => (BAD, "not within"),
        Some(Judgement::NotMeasured) => (BAD, "not measured"),
    };
    [("td", number(judged.value)), (TEXT, wanted), (tag, mark.to_owned())]
}

/// The items in order, each once.
fn unique(items: impl Iterator<Item = String>) -> Vec<String> {
    let mut seen = std::collections::HashSet::new();
    items.filter(|item| seen.insert(item.clone())).collect()
}
