//! What each step cost, as comma-separated values: a row per step, beside the trajectory.
//!
//! The columns up to `cells_raised` are the same on every run of a case. The rest are seconds of wall
//! time since the row before, phase by phase; `output_s` is that of the step's own rows and frames. A resumed
//! run keeps the seconds of rows that an earlier one had written.

use std::fmt;
use std::path::Path;

use gluey_contact::{ContactReport, FilmReport, GapReport};
use gluey_motion::FlowStatistics;

use super::append_log::{Draft, DraftMark, RowsError};
use super::{FileError, ResultPaths};
use crate::phases::PhaseTable;
use crate::tally::StepMotion;

/// What is the same on every run.
const FACTS: &str = "step,t,strain,cells,unknowns,solves,iterations,residual,\
     contact_pairs,active_contacts,sliding_contacts,contact_iterations,flows_in_contact,contact_change,parts,step_error_over_radius,closed_films,film_push_over_radius,\
     penalties_doubled,cells_raised";

/// Phases of a step, as [`PhaseTable`] names them, and the columns of their seconds.
pub const PHASES: [(&str, &str); 7] = [
    ("mesh and assembly", "mesh_and_assembly_s"),
    ("solver set-up", "solver_set_up_s"),
    ("solve", "solve_s"),
    ("flow", "other_flow_s"),
    ("contact", "contact_s"),
    ("motion", "motion_s"),
    ("output", "output_s"),
];

/// A step, and what it took.
#[derive(Clone, Copy, Debug)]
pub struct SolverRow<'a> {
    /// Steps done before.
    pub step: usize,
    /// Time.
    pub time: f64,
    /// Shear strain so far, less what was sheared back.
    pub strain: f64,
    /// The flow.
    pub flow: &'a FlowStatistics,
    /// The correction for contact.
    pub gaps: &'a GapReport,
    /// How the particles were moved.
    pub motion: &'a StepMotion,
    /// Wall time since the run began, this step's included.
    pub phases: &'a PhaseTable,
}

impl fmt::Display for SolverRow<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FlowStatistics { dof_count, iteration_count, residual, .. } = self.flow;
        let ContactReport { pair_count, active_count, .. } = self.gaps.contacts;
        write!(
            f,
            "step {}, t = {:.4}: {dof_count} unknowns, {iteration_count} iterations to {residual:.1e}, \
             {active_count} of {pair_count} contacts act",
            self.step, self.time
        )
    }
}

/// Writes rows as they come, like [`super::csv::CsvWriter`], to `<stem>-solver.csv` beside the trajectory.
#[derive(Debug)]
pub struct SolverLog {
    draft: Draft,
    /// Wall time up to the last row.
    before: [f64; PHASES.len()],
}

impl SolverLog {
    /// Starts the file beside the trajectory `csv`.
    pub fn create(csv: &Path) -> Result<Self, RowsError> {
        let header = format!("{FACTS},{}", PHASES.map(|(_, column)| column).join(","));
        let draft = Draft::with_header(&ResultPaths::of_csv(csv).solver(), &header)?;
        Ok(Self { draft, before: Default::default() })
    }

    /// Goes on with the file at `mark`, after so much wall time.
    pub(crate) fn resume(csv: &Path, mark: &DraftMark, phases: &PhaseTable) -> Result<Self, RowsError> {
        Ok(Self { draft: Draft::resume(&ResultPaths::of_csv(csv).solver(), mark)?, before: seconds(phases) })
    }

    /// Adds one row, which is with the operating system when this returns.
    pub fn write(&mut self, row: &SolverRow<'_>) -> Result<(), RowsError> {
        let now = seconds(row.phases);
        let spent = now.iter().zip(self.before).map(|(now, before)| format!("{:.6}", now - before));
        let spent: Vec<String> = spent.collect();
        self.before = now;
        self.draft.write_varying(&facts(row), &spent.join(","))
    }

    /// How far the file has come.
    pub(crate) fn mark(&self) -> DraftMark {
        self.draft.mark()
    }

    /// Gives the complete file its name.
    pub fn finish(self) -> Result<(), FileError> {
        self.draft.finish()
    }
}

/// What is the same on every run, with the comma behind it.
fn facts(row: &SolverRow<'_>) -> String {
    let SolverRow { step, time, strain, flow, gaps, motion, .. } = row;
    let FlowStatistics { cell_count, dof_count, solve_count, iteration_count, residual, .. } = flow;
    let FlowStatistics { penalties_doubled, cells_raised, .. } = flow;
    let ContactReport { pair_count, active_count, sliding_count, iterations, .. } = gaps.contacts;
    let FilmReport { closed_count, largest_push } = gaps.films;
    let (flows, change) = (gaps.changes.len(), gaps.changes.last().copied().unwrap_or(0.0));
    let StepMotion { parts, error, .. } = motion;
    format!(
        "{step},{time:.16e},{strain:.16e},{cell_count},{dof_count},{solve_count},{iteration_count},\
         {residual:.3e},{pair_count},{active_count},{sliding_count},{iterations},{flows},{change:.3e},{parts},{error:.3e},{closed_count},{largest_push:.3e},\
         {penalties_doubled},{cells_raised},"
    )
}

/// Seconds of each phase, none where it has not occurred.
fn seconds(phases: &PhaseTable) -> [f64; PHASES.len()] {
    PHASES.map(|(phase, _)| {
        let found = phases.rows().iter().find(|(name, _)| name == phase);
        found.map_or(0.0, |(_, seconds)| *seconds)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_those_since_the_row_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let csv = folder.path().join("t.csv");
        let (flow, gaps) = (FlowStatistics { iteration_count: 9, ..Default::default() }, Default::default());
        let mut phases = PhaseTable::default();
        let mut log = SolverLog::create(&csv).expect("a file");
        for step in 0..2 {
            phases.add("solve", 1.5 + step as f64);
            let (time, strain) = (step as f64, 0.0);
            let (flow, gaps, motion) = (&flow, &gaps, &StepMotion { parts: 2, ..StepMotion::default() });
            let row = SolverRow { step, time, strain, flow, gaps, motion, phases: &phases };
            log.write(&row).expect("a row");
        }
        log.finish().expect("complete");
        let text = std::fs::read_to_string(ResultPaths::of_csv(&csv).solver()).expect("a file");
        let table = crate::table::NumberTable::parse(&text).expect("a table");
        assert_eq!(table.column("solve_s"), Ok(&[1.5, 2.5][..]));
        assert_eq!(table.column("iterations"), Ok(&[9.0, 9.0][..]));
        assert_eq!(table.column("parts"), Ok(&[2.0, 2.0][..]));
        assert_eq!(table.column("output_s"), Ok(&[0.0, 0.0][..]));
    }
}
