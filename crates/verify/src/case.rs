//! What a chapter of the book is made of: computations, the table of their results, numbers taken from it.

use std::collections::BTreeMap;
use std::fmt::Write;

use gluey_contact::{ContactError, FilmError, GapError};
use gluey_motion::PairMobilityError;
use gluey_stokes::StokesError;
use gluey_stokes::fem::MeshError;
use gluey_suspension::packing::PackingError;
use gluey_testkit::cpu_seconds;
use gluey_testkit::reference::TableError;

use crate::number::Number;
use crate::plot::Plot;

/// The extent of what is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Extent {
    /// What takes a minute.
    Quick,
    /// Everything.
    Full,
}

impl Extent {
    /// What is for this extent.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        if self == Self::Quick { quick } else { full }
    }
}

/// A reason for which a computation has no result.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// In mesh, assembly or solution.
    #[error(transparent)]
    Stokes(#[from] StokesError),
    /// In the mobility of two spheres.
    #[error(transparent)]
    Mobility(#[from] PairMobilityError),
    /// In the films of a step.
    #[error(transparent)]
    Films(#[from] FilmError),
    /// In contacts.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// In films and contacts of a step.
    #[error(transparent)]
    Gaps(#[from] GapError),
    /// In the configuration of particles.
    #[error(transparent)]
    Packing(#[from] PackingError),
    /// In the reference data.
    #[error(transparent)]
    Reference(#[from] TableError),
    /// The reference data have no such row.
    #[error("the reference has no row for {0}")]
    NoReference(String),
    /// A motion did not come to where it is measured.
    #[error("the line of centres has not made half a turn after {0} steps")]
    NoHalfTurn(usize),
}

impl From<MeshError> for VerifyError {
    fn from(error: MeshError) -> Self {
        Self::Stokes(error.into())
    }
}

/// A chapter of the book.
pub struct VerificationCase {
    /// Name of its files.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// What is computed, what the exact solution is and where it is from.
    pub text: &'static str,
    /// Names of the numbers that tell one computation from another.
    pub keys: &'static [&'static str],
    /// Names of what is measured in each.
    pub measures: &'static [&'static str],
    /// The computations.
    pub tasks: fn(Extent) -> Vec<Task>,
    /// The numbers that are judged.
    pub numbers: fn(&CaseTables) -> Vec<Number>,
    /// The picture.
    pub plot: fn(&CaseTables) -> Plot,
}

type Work = dyn Fn() -> Result<Vec<f64>, VerifyError> + Send + Sync;

/// A computation.
pub struct Task {
    /// Name of the formulation, or of what stands in its place.
    pub method: &'static str,
    /// Values of the keys of its case.
    pub at: Vec<f64>,
    work: Box<Work>,
}

impl Task {
    /// A computation whose work gives the measures of its case.
    pub fn new(
        method: &'static str,
        at: &[f64],
        work: impl Fn() -> Result<Vec<f64>, VerifyError> + Send + Sync + 'static,
    ) -> Self {
        Self { method, at: at.to_vec(), work: Box::new(work) }
    }

    /// Computes; the time is that of this thread.
    ///
    /// # Errors
    /// The errors of the work.
    pub fn run(&self) -> Result<TaskResult, VerifyError> {
        let start = cpu_seconds();
        let values = (self.work)()?;
        Ok(TaskResult { method: self.method, at: self.at.clone(), values, cpu_s: cpu_seconds() - start })
    }
}

/// The result of a computation.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskResult {
    /// Name of the formulation.
    pub method: &'static str,
    /// Values of the keys.
    pub at: Vec<f64>,
    /// Values of the measures.
    pub values: Vec<f64>,
    /// CPU time in seconds.
    pub cpu_s: f64,
}

/// The results of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CaseTable {
    keys: &'static [&'static str],
    measures: &'static [&'static str],
    rows: Vec<TaskResult>,
}

/// Name of the column of CPU times.
pub const CPU_TIME: &str = "CPU seconds";

impl CaseTable {
    /// The table of a case; a computation without a result has NaN in place of its measures.
    pub fn new<'a>(
        case: &VerificationCase,
        results: impl Iterator<Item = (&'a Task, Option<TaskResult>)>,
    ) -> Self {
        let missing = |task: &Task| TaskResult {
            method: task.method,
            at: task.at.clone(),
            values: vec![f64::NAN; case.measures.len()],
            cpu_s: f64::NAN,
        };
        let rows = results.map(|(task, row)| row.unwrap_or_else(|| missing(task))).collect();
        Self { keys: case.keys, measures: case.measures, rows }
    }

    /// The values of a measure, or of [`CPU_TIME`], in the rows of a method where keys have these values.
    /// A name that the table does not have has no values.
    pub fn values(&self, measure: &str, method: &str, at: &[(&str, f64)]) -> Vec<f64> {
        let is_there = |row: &&TaskResult| row.method == method && self.is_at(row, at);
        self.rows.iter().filter(is_there).filter_map(|row| self.value(row, measure)).collect()
    }

    /// The different values of a key in the rows of a method, in order.
    pub fn steps(&self, key: &str, method: &str, at: &[(&str, f64)]) -> Vec<f64> {
        let mut values = self.values(key, method, at);
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    }

    /// The places at which a method was computed, each once and in the order of the rows: values of these
    /// keys.
    pub fn places<const N: usize>(
        &self,
        method: &str,
        keys: [&'static str; N],
    ) -> Vec<[(&'static str, f64); N]> {
        let mut places = Vec::new();
        for row in self.rows.iter().filter(|row| row.method == method) {
            let place = keys.map(|key| (key, self.value(row, key).unwrap_or(f64::NAN)));
            if !places.contains(&place) {
                places.push(place);
            }
        }
        places
    }

    /// The table as comma-separated values.
    pub fn csv(&self) -> String {
        let names = self.keys.iter().chain(self.measures);
        let mut text = names.fold("method".to_owned(), |line, name| line + "," + name);
        text += &format!(",{CPU_TIME}\n");
        for row in &self.rows {
            text += row.method;
            for value in row.at.iter().chain(&row.values).chain([&row.cpu_s]) {
                write!(text, ",{value}").expect("writing to a String cannot fail");
            }
            text.push('\n');
        }
        text
    }

    fn is_at(&self, row: &TaskResult, at: &[(&str, f64)]) -> bool {
        at.iter().all(|&(key, wanted)| self.value(row, key) == Some(wanted))
    }

    fn value(&self, row: &TaskResult, name: &str) -> Option<f64> {
        let of = |names: &[&str], values: &[f64]| names.iter().position(|n| *n == name).map(|i| values[i]);
        let time = (name == CPU_TIME).then_some(row.cpu_s);
        of(self.keys, &row.at).or_else(|| of(self.measures, &row.values)).or(time)
    }
}

/// The tables of all cases, by their names.
#[derive(Clone, Debug, Default)]
pub struct CaseTables(BTreeMap<&'static str, CaseTable>);

impl CaseTables {
    /// Adds the table of a case.
    pub fn insert(&mut self, name: &'static str, table: CaseTable) {
        self.0.insert(name, table);
    }

    /// The table of a case; empty if there is none.
    pub fn of(&self, name: &str) -> CaseTable {
        self.0.get(name).cloned().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> CaseTable {
        let case = VerificationCase {
            name: "test",
            title: "",
            text: "",
            keys: &["gap", "position"],
            measures: &["error"],
            tasks: |_| Vec::new(),
            numbers: |_| Vec::new(),
            plot: |_| Plot::default(),
        };
        let task = |gap: f64, position: f64, error: Option<f64>| {
            Task::new("soft", &[gap, position], move || {
                error.map(|error| vec![error]).ok_or(VerifyError::NoHalfTurn(3))
            })
        };
        let tasks = [task(1.0, 0.0, Some(0.1)), task(1.0, 1.0, Some(0.3)), task(0.5, 0.0, None)];
        CaseTable::new(&case, tasks.iter().map(|task| (task, task.run().ok())))
    }

    #[test]
    fn values_are_found_by_method_and_keys() {
        let table = table();
        assert_eq!(table.values("error", "soft", &[("gap", 1.0)]), [0.1, 0.3]);
        assert_eq!(table.steps("gap", "soft", &[]), [0.5, 1.0]);
        for (measure, method, key) in
            [("eror", "soft", "gap"), ("error", "hard", "gap"), ("error", "soft", "gpa")]
        {
            assert!(table.values(measure, method, &[(key, 1.0)]).is_empty());
        }
    }

    #[test]
    fn a_failed_computation_keeps_its_row_without_numbers() {
        let table = table();
        assert!(table.values("error", "soft", &[("gap", 0.5)])[0].is_nan());
        let lines: Vec<String> = table.csv().lines().map(str::to_owned).collect();
        assert_eq!(lines[0], "method,gap,position,error,CPU seconds");
        assert!(lines.len() == 4 && lines[3].starts_with("soft,0.5,0,NaN,"));
    }
}
