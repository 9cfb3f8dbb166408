//! The tables beside the trajectory that only some cases have: rheology, and what holds particles.

use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Space};
use gluey_motion::Hydrodynamics;

use super::contacts::Contacts;
use super::error::RunError;
use super::stress::with_contacts;
use crate::case::Case;
use crate::hydrodynamics::HydrodynamicsError;
use crate::output::csv::gaps_path;
use crate::output::rheology::{self, Rheology};
use crate::output::{Draft, Mark, OutputError, ResultPaths, RowsError, drafts, forces};
use crate::rheology::{RheologyError, RheologyMeans};
use crate::simulation::{Simulation, StepError};

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
pub(super) struct Tables {
    rheology: Option<Draft>,
    forces: Option<Draft>,
}

/// How far the tables had come.
#[derive(Clone, Debug)]
pub(super) struct TableMarks {
    pub rheology: Option<Mark>,
    pub forces: Option<Mark>,
}

/// Drafts of the tables of a case that earlier runs left.
pub(super) fn earlier_drafts(case: &Case, csv: &Path) -> Result<Vec<PathBuf>, OutputError> {
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

impl Tables {
    /// Starts those that a case has.
    pub fn create<const D: usize>(case: &Case, csv: &Path) -> Result<Self, RowsError> {
        let create = |path: Option<PathBuf>, header: String| {
            path.map(|path| Draft::with_header(&path, &header)).transpose()
        };
        let [rheology, forces] = paths(case, csv);
        Ok(Self {
            rheology: create(rheology, rheology::header::<D>(case.shear_stress.is_some()))?,
            forces: create(forces, forces::header::<D>(case.given_particles()))?,
        })
    }

    /// Goes on with them at these marks.
    pub fn resume(csv: &Path, marks: &TableMarks) -> Result<Self, RowsError> {
        let paths = ResultPaths::of_csv(csv);
        let resume = |path: PathBuf, mark: &Option<Mark>| {
            mark.as_ref().map(|mark| Draft::resume(&path, mark)).transpose()
        };
        Ok(Self {
            rheology: resume(paths.rheology(), &marks.rheology)?,
            forces: resume(paths.forces(), &marks.forces)?,
        })
    }

    /// Adds the rows of the step that was predicted and corrected last.
    pub fn write<const D: usize, H>(
        &mut self,
        simulation: &Simulation<D, H, Contacts<'_, D>>,
        smallest_gap_over_a: Option<f64>,
    ) -> Result<(), RunError>
    where
        Dim<D>: Space<D>,
        H: Hydrodynamics<D>,
        HydrodynamicsError: From<H::Error>,
    {
        let (step, time) = (simulation.step_index(), simulation.time());
        if let (Some(rheology), Some(stress)) = (&mut self.rheology, simulation.stress()) {
            let stress = with_contacts(*stress, simulation.contact(), simulation.particles())
                .map_err(|source| StepError::Contact { step, time, source })?;
            let strain = simulation.strain();
            let time_and_rate = simulation.time_and_rate();
            let row = Rheology { time, strain, stress: &stress, smallest_gap_over_a, time_and_rate };
            rheology.write(&rheology::line(&row))?;
        }
        if let (Some(forces), Some(holding)) = (&mut self.forces, simulation.holding()) {
            forces.write(&forces::line(time, holding))?;
        }
        Ok(())
    }

    /// How far they have come.
    pub fn marks(&self) -> TableMarks {
        TableMarks {
            rheology: self.rheology.as_ref().map(Draft::mark),
            forces: self.forces.as_ref().map(Draft::mark),
        }
    }

    /// Gives the complete files their names.
    pub fn finish(self) -> Result<(), OutputError> {
        self.rheology.map_or(Ok(()), Draft::finish)?;
        self.forces.map_or(Ok(()), Draft::finish)
    }
}
