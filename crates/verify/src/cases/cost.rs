//! What an error costs: CPU time of a solve against the error of the speed of approach at a gap of a radius.

use itertools::iproduct;

use crate::case::{CPU_TIME, CaseTable, CaseTables, VerificationCase};
use crate::method::METHODS;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::statistics::{mean, rms};

/// Tables it is taken from, with the keys of their rows.
const SOURCES: [(&str, &[(&str, f64)]); 2] =
    [("discs", &[("gap", 1.0), ("angle", 135.0)]), ("spheres", &[("gap", 1.0), ("angle", 135.0)])];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "cost",
    title: "Cost against error",
    text: "Taken from the chapters on two discs (direct solver) and two spheres (multigrid): CPU time of one solve from nothing, \
           with its mesh, on one core, beside the rms error of the speed of approach at a gap of one radius. Seconds depend on \
           the machine and have no limit.",
    keys: &[],
    measures: &[],
    tasks: |_| Vec::new(),
    numbers,
    plot,
};

/// Cells per radius, seconds and error.
fn points(table: &CaseTable, method: &str, at: &[(&str, f64)]) -> Vec<(f64, f64, f64)> {
    let point = |cells: f64| {
        let at = [at, &[("a/h", cells)]].concat();
        (cells, mean(&table.values(CPU_TIME, method, &at)), rms(&table.values("approach", method, &at)))
    };
    table.steps("a/h", method, at).into_iter().map(point).collect()
}

fn numbers(tables: &CaseTables) -> Vec<Number> {
    let mut numbers = Vec::new();
    for ((name, at), method) in iproduct!(SOURCES, METHODS) {
        for (cells, seconds, error) in points(&tables.of(name), method.name, at) {
            let what = |what: &str| format!("{name}, a/h = {cells}, {what}");
            numbers.push(Number::new(
                NumberKind::Remark,
                what("CPU seconds per solve"),
                method.name,
                seconds,
            ));
            numbers.push(Number::new(NumberKind::Size, what("rms error"), method.name, error));
        }
    }
    let spheres = tables.of("spheres");
    let enough = "spheres, CPU seconds for 1 % at a gap of a and 5 % at 0.2 a";
    let reached = METHODS.iter().filter_map(|method| Some((method.name, cheapest(&spheres, method.name)?)));
    let number = |(method, seconds)| Number::new(NumberKind::Remark, enough.to_owned(), method, seconds);
    numbers.extend(reached.map(number));
    numbers
}

/// Seconds on the coarsest mesh on which errors at all places are at most one per cent at a gap of a radius
/// and five at a fifth of that.
fn cheapest(table: &CaseTable, method: &str) -> Option<f64> {
    let holds = |cells: f64| {
        [(1.0, 0.01), (0.2, 0.05)].into_iter().all(|(gap, most)| {
            let at = [("a/h", cells), ("gap", gap), ("angle", 135.0)];
            let errors = table.values("approach", method, &at);
            !errors.is_empty() && errors.iter().all(|error| error.abs() <= most)
        })
    };
    let cells = table.steps("a/h", method, &[]).into_iter().find(|&cells| holds(cells))?;
    Some(mean(&table.values(CPU_TIME, method, &[("a/h", cells), ("gap", 0.2), ("angle", 135.0)])))
}

fn plot(tables: &CaseTables) -> Plot {
    let (x, y) = ("CPU seconds per solve", "rms relative error of the approach");
    Plot::of_methods(x, y, &["discs", "spheres"], |method, thing| {
        let (name, at) = SOURCES[thing];
        let points = points(&tables.of(name), method, at).into_iter();
        points.map(|(_, seconds, error)| (seconds, error)).collect()
    })
}
