//! `index.html`: one self-contained page with the figures, the runs and how they compare.

use gluey::progress::duration;
use gluey_verify::Judgement;

use super::findings::FigureTable;
use super::plan::FigureName;
use super::rows;
use super::summary::{self, Summary};
use super::verdict::{self, Claim, ClaimKind, JudgedClaim};
use crate::book::page::{self, BAD, TEXT, TITLE, escape, number};
use gluey_pictures::Canvas;

/// A figure with what is said about it.
pub struct Section {
    /// Which figure.
    pub figure: FigureName,
    /// The drawing.
    pub drawing: Canvas,
    /// Exact solution and runs in numbers.
    pub table: Option<FigureTable>,
}

/// What a reader of the paper asks first: why not its viscosity ratio.
const SETTING_OF_PAPER: &str = "All runs of <code>paper</code> have one setting, stated under every figure: viscosity ratio \
r = 100, a ramp of one cell and two Uzawa steps from a multiplier of zero, so that the update [10] acts (without it, one solve, \
the overlap in figure 5 is 1.7 times as large). The paper has r = 10<sup>3</sup> and does not give ramp, number of steps or mesh. With \
r = 10<sup>3</sup> the cells cut by both spheres of figure 7 lock them at a distance of 0.09 a, so that nothing overlaps and no contact acts, \
and in 2D inelastic contact changes the orbit by less than 1 %.";

/// The page.
pub fn html(summary: &Summary, sections: &[Section]) -> String {
    let sections: String = sections.iter().map(|section| html_of(section, &summary.rows)).collect();
    page::document("gluey: the paper's figures", &(head(summary) + &runs(&summary.runs) + &sections))
}

fn head(summary: &Summary) -> String {
    let quick =
        "a coarse mesh, large time steps and shorter runs. The statements about later times are left out.";
    format!(
        "<h1>Contact problems for particles in a shear flow</h1>\n<p>The figures of Verdon, Lefebvre-Lepot, Lobry and \
         Laure (2010), computed by gluey {} in {}. Thin grey lines are exact solutions; the dotted line is the \
         formulation <code>unfitted</code>, in which lubrication keeps particles apart and no contact acts, as in the exact \
         solutions, and in their box, in figure 9 that of the paper's runs too; all others are in the formulation \
         <code>paper</code>. Lengths are in units of the box, times in units of \
         1/shear rate.</p>\n{}<p>{SETTING_OF_PAPER}</p>\n{}",
        summary.version,
        duration(summary.wall_s),
        page::notes(summary.quick.then_some(quick), &summary.failures),
        counts(&summary.rows)
    )
}

/// How much was reproduced, with what was not by name.
fn counts(rows: &[JudgedClaim]) -> String {
    let groups = [
        (ClaimKind::Paper, "statements of the paper", "are reproduced", "not reproduced"),
        (ClaimKind::Exact, "comparisons with exact solutions", "hold", "not within its limit"),
    ];
    let mut text = String::new();
    for (kind, what, hold, not) in groups {
        let (held, count) = verdict::count(rows, kind);
        if count > 0 {
            text += &format!("<p>Of {count} {what} {held} {hold}, {} do not.</p>\n", count - held);
        }
        let missed = rows.iter().filter(|row| row.claim.kind == kind && row.outcome != Judgement::Yes);
        let line = |row: &JudgedClaim| {
            let Claim { figure, statement, run, measure, .. } = row.claim;
            let [statement, run, measure] = [statement, run, measure].map(|text| escape(text));
            let measured = format!("{run}: {measure} = {}", number(row.value));
            format!("<li><a href=\"#{figure}\">{figure}</a>, {not}: {statement} ({measured})</li>\n")
        };
        let missed: String = missed.map(line).collect();
        if !missed.is_empty() {
            text += &format!("<ul>\n{missed}</ul>\n");
        }
    }
    text
}

fn runs(runs: &[summary::CompletedRun]) -> String {
    if runs.is_empty() {
        return String::new();
    }
    let columns = "run|steps|wall time|cells|unknowns|smallest D/a|D/a at the end|reversibility error|end error|\
                   largest error / a";
    let columns = columns.split('|').map(|name| ("th", name));
    let head = page::row(columns.chain([(TITLE, "settings")]));
    let line = |summary::CompletedRun { name, settings, report }: &summary::CompletedRun| {
        let counts = [report.cells, report.dofs].map(|count| count.to_string());
        let numbers = [
            report.min_gap_over_a,
            report.end_gap_over_a,
            report.reversibility_error,
            report.end_gap_rel_error,
            report.max_abs_error_over_a,
        ];
        let first = [escape(name), report.steps.to_string(), duration(report.wall_s)].into_iter();
        let cells = first.chain(counts).chain(numbers.map(number)).map(|cell| ("td", cell));
        page::row(cells.chain([(TEXT, escape(&settings.line()))]))
    };
    format!("<h2>Runs</h2>\n<table>{head}{}</table>\n", runs.iter().map(line).collect::<String>())
}

fn html_of(section: &Section, rows: &[JudgedClaim]) -> String {
    let figure = section.figure;
    let (title, svg) = (&rows::text(figure).title, section.drawing.inline_svg());
    let of = |kind| rows.iter().filter(move |row| row.claim.figure == figure && row.claim.kind == kind);
    let groups: String = GROUPS.iter().map(|names| group(names, of(names.0))).collect();
    let table = section.table.as_ref().map_or_else(String::new, table);
    format!("<section id=\"{figure}\">\n<h2>{title}</h2>\n{svg}\n{groups}{table}</section>\n")
}

/// A kind of rows, its heading, and how what holds and what does not read.
type Group = (ClaimKind, &'static str, &'static str, &'static str);

const GROUPS: &[Group] = &[
    (ClaimKind::Paper, "the paper says", "reproduced", "not reproduced"),
    (ClaimKind::Exact, "against the exact solution", "within", "not within"),
    (ClaimKind::Guarantee, "guaranteed by construction", "as it must be", "broken"),
];

fn group<'a>(group: &Group, rows: impl Iterator<Item = &'a JudgedClaim>) -> String {
    let (_, heading, yes, no) = group;
    let line = |row: &JudgedClaim| {
        let (class, mark) = match row.outcome {
            Judgement::Yes => (TEXT, *yes),
            Judgement::No => (BAD, *no),
            Judgement::NotMeasured => (BAD, "not measured"),
        };
        let Claim { statement, run, measure, .. } = row.claim;
        let [statement, run, measure, wanted] =
            [statement, run, measure, &row.wanted].map(|text| (TEXT, escape(text)));
        let cells = [statement, run, measure, ("td", number(row.value)), wanted, (class, mark.to_owned())];
        page::row(cells) + &remark(row)
    };
    let lines: String = rows.map(line).collect();
    if lines.is_empty() {
        return lines;
    }
    let head = [heading, "run", "measured", "value", "limit", ""];
    let tags = [TITLE, TITLE, TITLE, "th", TITLE, "th"];
    format!("<table class=\"rows\">{}{lines}</table>\n", page::row(tags.into_iter().zip(head)))
}

/// Why a row does not hold, or fails.
fn remark(row: &JudgedClaim) -> String {
    let (class, text) = match (row.reason(), row.failure()) {
        (Some(reason), _) => ("td class=\"t reason\" colspan=\"6\"", format!("Why not: {}", escape(reason))),
        (_, Some(failure)) => ("td class=\"t bad\" colspan=\"6\"", format!("This row {}.", escape(&failure))),
        _ => return String::new(),
    };
    page::row([(class, text)])
}

fn table(table: &FigureTable) -> String {
    let head = page::row(
        [("th", String::new())].into_iter().chain(table.columns.iter().map(|name| ("th", escape(name)))),
    );
    let line = |(name, values): &(String, Vec<Option<f64>>)| {
        let cells = [escape(name)].into_iter().chain(values.iter().map(|value| number(*value)));
        page::row(cells.map(|cell| ("td", cell)))
    };
    format!("<table>{head}{}</table>\n", table.rows.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_without_runs_names_the_failure() {
        let failures = vec![crate::book::BookFailure { what: "pair-2d".into(), error: "a < b".into() }];
        let summary = Summary {
            version: "0",
            quick: true,
            wall_s: 1.0,
            figures: vec![],
            runs: vec![],
            failures,
            rows: vec![],
        };
        let page = html(&summary, &[]);
        assert!(
            page.contains("pair-2d: a &lt; b") && page.contains("--quick") && page.ends_with("</html>\n")
        );
    }
}
