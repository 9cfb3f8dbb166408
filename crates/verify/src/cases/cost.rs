//! What an error costs: CPU time of a solve against the error of the speed of approach at a gap of a radius.

use crate::case::{CPU_TIME, Case, Table, Tables};
use crate::method::METHODS;
use crate::number::{Kind, Number};
use crate::plot::Plot;
use crate::statistics::{mean, rms};

/// Tables it is taken from, with the keys of their rows.
const SOURCES: [(&str, &[(&str, f64)]); 2] = [
    ("discs", &[("refined film", 0.0), ("gap", 1.0), ("angle", 135.0)]),
    ("spheres", &[("gap", 1.0), ("angle", 135.0)]),
];

/// The chapter.
pub const CASE: Case = Case {
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
fn points(table: &Table, method: &str, at: &[(&str, f64)]) -> Vec<(f64, f64, f64)> {
    let point = |cells: f64| {
        let at = [at, &[("a/h", cells)]].concat();
        (cells, mean(&table.values(CPU_TIME, method, &at)), rms(&table.values("approach", method, &at)))
    };
    table.steps("a/h", method, at).into_iter().map(point).collect()
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (name, at) in SOURCES {
        let table = tables.of(name);
        for method in METHODS {
            for (cells, seconds, error) in points(&table, method.name, at) {
                let number = |kind, what: &str, value| {
                    Number::new(kind, format!("{name}, a/h = {cells}, {what}"), method.name, value)
                };
                numbers.push(number(Kind::Remark, "CPU seconds per solve", seconds));
                numbers.push(number(Kind::Size, "rms error", error));
            }
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    Plot::of_methods(
        "CPU seconds per solve",
        "rms relative error of the approach",
        &["discs", "spheres"],
        |method, thing| {
            let (name, at) = SOURCES[thing];
            points(&tables.of(name), method, at)
                .into_iter()
                .map(|(_, seconds, error)| (seconds, error))
                .collect()
        },
    )
}
