//! `index.html`: one self-contained page with the figures, the runs and how they compare.

use std::fmt::Write;

use gluey::progress::duration;
use gluey_verify::Outcome;

use super::findings::{self, Table};
use super::plan::FigureName;
use super::summary::{self, Summary};
use super::verdict::{self, Kind, Row};
use crate::book::page::{self, escape, number};
use gluey_pictures::Canvas;

/// A figure with what is said about it.
pub struct Section {
    /// Which figure.
    pub figure: FigureName,
    /// The drawing.
    pub drawing: Canvas,
    /// Exact solution and runs in numbers.
    pub table: Option<Table>,
}

/// What a reader of the paper asks first: why not its viscosity ratio.
const SETTING_OF_PAPER: &str = "All runs of <code>paper</code> have one setting, stated under every figure: viscosity ratio \
r = 100, a ramp of one cell and two Uzawa steps from a multiplier of zero, so that the update [10] acts (without it, one solve, \
the overlap in figure 5 is 1.7 times as large). The paper has r = 10<sup>3</sup> and does not give ramp, number of steps or mesh. With \
r = 10<sup>3</sup> the cells cut by both spheres of figure 7 lock them at a distance of 0.09 a, so that nothing overlaps and no contact acts, \
and in 2D inelastic contact changes the orbit by less than 1 %.";

/// The page.
pub fn html(summary: &Summary, sections: &[Section]) -> String {
    let mut body = String::new();
    write_body(&mut body, summary, sections).expect("writing to a String cannot fail");
    page::document("gluey: the paper's figures", &body)
}

fn write_body(out: &mut String, summary: &Summary, sections: &[Section]) -> std::fmt::Result {
    write_head(out, summary)?;
    sections.iter().try_for_each(|section| write_section(out, summary, section))
}

fn write_head(out: &mut String, summary: &Summary) -> std::fmt::Result {
    writeln!(
        out,
        "<h1>Contact problems for particles in a shear flow</h1>\n<p>The figures of Verdon, Lefebvre-Lepot, Lobry and \
         Laure (2010), computed by gluey {} in {}. Thin grey lines are exact solutions; the dotted line is the \
         formulation <code>unfitted</code>, in which lubrication keeps particles apart and no contact acts, as in the exact \
         solutions; all others are in the formulation <code>paper</code>. Lengths are in units of the box, times in units of \
         1/shear rate.</p>",
        summary.version,
        duration(summary.wall_s)
    )?;
    if summary.quick {
        writeln!(
            out,
            "<p class=\"note\">Computed with <code>--quick</code>: a coarse mesh, large time steps and shorter runs. The \
             statements about later times are left out.</p>"
        )?;
    }
    for failure in &summary.failures {
        writeln!(out, "<p class=\"note bad\">{}: {}</p>", escape(&failure.what), escape(&failure.error))?;
    }
    writeln!(out, "<p>{SETTING_OF_PAPER}</p>")?;
    write_counts(out, &summary.rows)?;
    write_runs(out, summary)
}

/// How much was reproduced, with what was not by name.
fn write_counts(out: &mut String, rows: &[Row]) -> std::fmt::Result {
    let groups = [
        (Kind::Paper, "statements of the paper", "are reproduced", "not reproduced"),
        (Kind::Exact, "comparisons with exact solutions", "hold", "not within its limit"),
    ];
    for (kind, what, hold, not) in groups {
        let (held, count) = verdict::count(rows, kind);
        if count > 0 {
            writeln!(out, "<p>Of {count} {what} {held} {hold}, {} do not.</p>", count - held)?;
        }
        let missed = rows.iter().filter(|row| row.kind == kind && row.outcome != Outcome::Yes);
        let missed: Vec<&Row> = missed.collect();
        if !missed.is_empty() {
            writeln!(out, "<ul>")?;
            for row in missed {
                let (figure, statement, run) = (row.figure, escape(row.statement), escape(row.run));
                let measure = escape(row.measure);
                let value = number(row.value);
                writeln!(
                    out,
                    "<li><a href=\"#{figure}\">{figure}</a>, {not}: {statement} ({run}: {measure} = {value})</li>"
                )?;
            }
            writeln!(out, "</ul>")?;
        }
    }
    Ok(())
}

fn write_runs(out: &mut String, summary: &Summary) -> std::fmt::Result {
    if summary.runs.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "<h2>Runs</h2>\n<table><tr><th>run</th><th>steps</th><th>wall time</th><th>cells</th><th>unknowns</th>\
         <th>smallest D/a</th><th>D/a at the end</th><th>reversibility error</th><th>end error</th>\
         <th>largest error / a</th><th class=\"t\">settings</th></tr>"
    )?;
    for summary::Run { name, settings, report: run } in &summary.runs {
        writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td><td class=\"t\">{}</td></tr>",
            escape(name),
            run.steps,
            duration(run.wall_s),
            run.cells,
            run.dofs,
            number(run.min_gap_over_a),
            number(run.end_gap_over_a),
            number(run.reversibility_error),
            number(run.end_gap_rel_error),
            number(run.max_abs_error_over_a),
            escape(&settings.line())
        )?;
    }
    writeln!(out, "</table>")
}

fn write_section(out: &mut String, summary: &Summary, section: &Section) -> std::fmt::Result {
    let figure = section.figure;
    writeln!(
        out,
        "<section id=\"{figure}\">\n<h2>{}</h2>\n{}",
        findings::title(figure),
        section.drawing.inline_svg()
    )?;
    for group in GROUPS {
        let rows: Vec<&Row> =
            summary.rows.iter().filter(|row| row.figure == figure && row.kind == group.kind).collect();
        write_group(out, group, &rows)?;
    }
    if let Some(table) = &section.table {
        write_table(out, table)?;
    }
    writeln!(out, "</section>")
}

/// Rows of one kind, and how their outcome reads.
struct Group {
    kind: Kind,
    heading: &'static str,
    yes: &'static str,
    no: &'static str,
}

const GROUPS: &[Group] = &[
    Group { kind: Kind::Paper, heading: "the paper says", yes: "reproduced", no: "not reproduced" },
    Group { kind: Kind::Exact, heading: "against the exact solution", yes: "within", no: "not within" },
    Group {
        kind: Kind::Guarantee,
        heading: "guaranteed by construction",
        yes: "as it must be",
        no: "broken",
    },
];

fn write_group(out: &mut String, group: &Group, rows: &[&Row]) -> std::fmt::Result {
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "<table class=\"rows\"><tr><th class=\"t\">{}</th><th class=\"t\">run</th><th class=\"t\">measured</th>\
         <th>value</th><th class=\"t\">limit</th><th></th></tr>",
        group.heading
    )?;
    for row in rows {
        let (class, mark) = match row.outcome {
            Outcome::Yes => ("t", group.yes),
            Outcome::No => ("t bad", group.no),
            Outcome::NotMeasured => ("t bad", "not measured"),
        };
        writeln!(
            out,
            "<tr><td class=\"t\">{}</td><td class=\"t\">{}</td><td class=\"t\">{}</td><td>{}</td><td class=\"t\">{}</td>\
             <td class=\"{class}\">{mark}</td></tr>",
            escape(row.statement),
            escape(row.run),
            escape(row.measure),
            number(row.value),
            escape(&row.wanted)
        )?;
        if let Some(reason) = row.reason() {
            writeln!(out, "<tr><td class=\"t reason\" colspan=\"6\">Why not: {}</td></tr>", escape(reason))?;
        } else if let Some(failure) = row.failure() {
            writeln!(out, "<tr><td class=\"t bad\" colspan=\"6\">This row {}.</td></tr>", escape(&failure))?;
        }
    }
    writeln!(out, "</table>")
}

fn write_table(out: &mut String, table: &Table) -> std::fmt::Result {
    write!(out, "<table><tr><th></th>")?;
    table.columns.iter().try_for_each(|name| write!(out, "<th>{}</th>", escape(name)))?;
    writeln!(out, "</tr>")?;
    for (name, values) in &table.rows {
        write!(out, "<tr><td>{}</td>", escape(name))?;
        values.iter().try_for_each(|value| write!(out, "<td>{}</td>", number(*value)))?;
        writeln!(out, "</tr>")?;
    }
    writeln!(out, "</table>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_without_runs_names_the_failure() {
        let failures = vec![crate::book::Failure { what: "pair-2d".into(), error: "a < b".into() }];
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
