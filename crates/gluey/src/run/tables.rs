//! The tables of a run: trajectory, near pairs and what steps cost, and those that only some cases have:
//! rheology, and what holds particles.

use std::path::{Path, PathBuf};

use gluey_contact::ContactReport;
use gluey_motion::Hydrodynamics;

use super::contacts::Surrounded;
use super::error::RunError;
use super::stress::with_contacts;
use crate::case::Case;
use crate::checkpoint::{Checkpoint, TableMarks};
use crate::hydrodynamics::HydrodynamicsError;
use crate::measures::Instant;
use crate::output::csv::{CsvWriter, gaps_path};
use crate::output::rheology::{self, Rheology};
use crate::output::solver_log::{SolverLog, SolverRow};
use crate::output::{Draft, DraftMark, FileError, ResultPaths, RowsError, drafts, forces};
use crate::rheology::{RheologyError, RheologyMeans};
use crate::simulation::{Simulation, StepError};
use crate::trajectory::TrajectoryRow;

/// Means of the rheology that a run has written, if it writes any.
///
/// # Errors
/// If its table cannot be read back.
pub(super) fn means_of_rheology(case: &Case, csv: &Path) -> Result<Option<RheologyMeans>, RheologyError> {
    if !case.has_rheology() {
        return Ok(None);
    }
    RheologyMeans::read(&ResultPaths::of_csv(csv).rheology(), None)
}

/// The tables of a run in progress.
#[derive(Debug)]
pub(super) struct RunTables {
    trajectory: CsvWriter,
    rheology: Option<Draft>,
    forces: Option<Draft>,
    solver: SolverLog,
}

/// Drafts of the tables of a case that earlier runs left.
pub(super) fn earlier_drafts(case: &Case, csv: &Path) -> Result<Vec<PathBuf>, FileError> {
    let solver = ResultPaths::of_csv(csv).solver();
    let of_all = [Some(csv.to_owned()), gaps_path(csv, case.particles.len()), Some(solver)];
    let tables = of_all.into_iter().chain(paths(case, csv)).flatten();
    Ok(tables.map(|table| drafts(&table)).collect::<Result<Vec<_>, _>>()?.concat())
}

/// The files of rheology and forces, where a case has them.
fn paths(case: &Case, csv: &Path) -> [Option<PathBuf>; 2] {
    let paths = ResultPaths::of_csv(csv);
    [case.has_rheology().then(|| paths.rheology()), case.gives_motions().then(|| paths.forces())]
}

/// Contacts of a particle that stick and that slide, in the mean, where there are no walls.
fn contacts_per_particle<const D: usize, H: Hydrodynamics<D>, C: Surrounded<D>>(
    simulation: &Simulation<D, H, C>,
) -> [f64; 2] {
    let ContactReport { active_count, sliding_count, .. } = simulation.gaps().contacts;
    let sticking_count = active_count - sliding_count;
    [sticking_count, sliding_count].map(|pairs| 2.0 * pairs as f64 / simulation.particles().len() as f64)
}

impl RunTables {
    /// Starts those that a case has.
    pub fn create<const D: usize>(case: &Case, csv: &Path) -> Result<Self, RowsError> {
        let create = |path: Option<PathBuf>, header: String| {
            path.map(|path| Draft::with_header(&path, &header)).transpose()
        };
        let [rheology, forces] = paths(case, csv);
        Ok(Self {
            trajectory: CsvWriter::create::<D>(csv, case.particles.len(), case.acts_in_flow())?,
            rheology: create(
                rheology,
                rheology::header::<D>(case.shear_stress.is_some(), case.acts_in_flow()),
            )?,
            forces: create(forces, forces::header::<D>(case.given_particles()))?,
            solver: SolverLog::create(csv)?,
        })
    }

    /// Goes on with them where they were at a checkpoint of a run of so many particles; `visit` sees the rows
    /// of the trajectory up to there.
    pub fn resume<const D: usize>(
        csv: &Path,
        checkpoint: &Checkpoint<D>,
        particle_count: usize,
        visit: impl FnMut(&Instant<D>),
    ) -> Result<Self, RowsError> {
        let TableMarks { trajectory, gaps, rheology, forces, solver } = &checkpoint.tables;
        let paths = ResultPaths::of_csv(csv);
        let resume = |path: PathBuf, mark: &Option<DraftMark>| {
            mark.as_ref().map(|mark| Draft::resume(&path, mark)).transpose()
        };
        Ok(Self {
            rheology: resume(paths.rheology(), rheology)?,
            forces: resume(paths.forces(), forces)?,
            solver: SolverLog::resume(csv, solver, &checkpoint.phases)?,
            trajectory: CsvWriter::resume(csv, trajectory, gaps.as_ref(), particle_count, visit)?,
        })
    }

    /// Adds the rows of the step that was predicted and corrected last, and gives the smallest gap of any
    /// pair in mean radii, if there is one.
    pub fn write<const D: usize, H, C>(
        &mut self,
        case: &Case,
        simulation: &Simulation<D, H, C>,
    ) -> Result<Option<f64>, RunError>
    where
        H: Hydrodynamics<D>,
        C: Surrounded<D>,
        HydrodynamicsError: From<H::Error>,
    {
        let (step, time) = (simulation.step_index(), simulation.time());
        let (particles, twists) = (simulation.particles(), simulation.twists());
        let row = TrajectoryRow { time, particles, twists, domain: simulation.contact().domain() };
        let smallest_gap_over_a = self.trajectory.write(&row, &simulation.contact().pair_forces(case))?;
        if let (Some(rheology), Some(stress)) = (&mut self.rheology, simulation.stress()) {
            let stress = with_contacts(*stress, simulation.contact(), particles)
                .map_err(|source| StepError::Contact { step, time, source })?;
            let strain = simulation.strain();
            let row = Rheology {
                time,
                strain,
                stress: &stress,
                contacts_per_particle: case.acts_in_flow().then(|| contacts_per_particle(simulation)),
                smallest_gap_over_a,
                time_and_rate: simulation.time_and_rate(),
            };
            rheology.write(&rheology::line(&row))?;
        }
        if let (Some(forces), Some(holding)) = (&mut self.forces, simulation.holding()) {
            forces.write(&forces::line(time, holding))?;
        }
        Ok(smallest_gap_over_a)
    }

    /// Adds what a step cost.
    pub fn write_effort(&mut self, row: &SolverRow<'_>) -> Result<(), RowsError> {
        self.solver.write(row)
    }

    /// The file of the trajectory until it is complete.
    pub fn path(&self) -> &Path {
        self.trajectory.path()
    }

    /// How far they have come.
    pub fn marks(&self) -> TableMarks {
        let (trajectory, gaps) = self.trajectory.marks();
        let [rheology, forces] = [&self.rheology, &self.forces].map(|table| table.as_ref().map(Draft::mark));
        TableMarks { trajectory, gaps, rheology, forces, solver: self.solver.mark() }
    }

    /// Gives the complete files their names.
    pub fn finish(self) -> Result<(), FileError> {
        self.trajectory.finish()?;
        [self.rheology, self.forces].into_iter().flatten().try_for_each(Draft::finish)?;
        self.solver.finish()
    }
}
