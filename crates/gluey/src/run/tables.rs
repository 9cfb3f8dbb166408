//! The tables beside the trajectory that only some cases have: rheology, and what holds particles.

use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Space};
use gluey_motion::Hydrodynamics;

use super::contacts::Contacts;
use super::error::RunError;
use super::stress::with_contacts;
use crate::case::Case;
use crate::hydrodynamics::HydrodynamicsError;
use crate::output::forces::{self, ForcesWriter};
use crate::output::rheology::{self, Rheology, RheologyWriter};
use crate::output::{Mark, OutputError, RowsError};
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
    RheologyMeans::read(&rheology::rheology_path(csv), None)
}

/// The tables of a run in progress.
#[derive(Debug)]
pub(super) struct Tables {
    rheology: Option<RheologyWriter>,
    forces: Option<ForcesWriter>,
}

/// How far the tables had come.
#[derive(Clone, Debug)]
pub(super) struct TableMarks {
    pub rheology: Option<Mark>,
    pub forces: Option<Mark>,
}

impl Tables {
    /// Drafts that earlier runs of a case left.
    pub fn earlier_drafts(case: &Case, csv: &Path) -> Result<Vec<PathBuf>, OutputError> {
        let mut drafts = Vec::new();
        if case.has_rheology() {
            drafts.extend(rheology::earlier_drafts(csv)?);
        }
        if case.gives_motions() {
            drafts.extend(forces::earlier_drafts(csv)?);
        }
        Ok(drafts)
    }

    /// Starts those that a case has.
    pub fn create<const D: usize>(case: &Case, csv: &Path) -> Result<Self, RowsError> {
        let (has_rheology, has_forces) = (case.has_rheology(), case.gives_motions());
        let forces = || ForcesWriter::create::<D>(csv, case.given_particles());
        Ok(Self {
            rheology: has_rheology
                .then(|| RheologyWriter::create::<D>(csv, case.shear_stress.is_some()))
                .transpose()?,
            forces: has_forces.then(forces).transpose()?,
        })
    }

    /// Goes on with them at these marks.
    pub fn resume(csv: &Path, marks: &TableMarks) -> Result<Self, RowsError> {
        Ok(Self {
            rheology: marks.rheology.as_ref().map(|mark| RheologyWriter::resume(csv, mark)).transpose()?,
            forces: marks.forces.as_ref().map(|mark| ForcesWriter::resume(csv, mark)).transpose()?,
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
            let stress = with_contacts(stress, simulation.contact(), simulation.particles())
                .map_err(|source| StepError::Contact { step, time, source })?;
            let strain = simulation.strain();
            let time_and_rate = simulation.time_and_rate();
            rheology.write(&Rheology {
                time,
                strain,
                stress: &stress,
                smallest_gap_over_a,
                time_and_rate,
            })?;
        }
        if let (Some(forces), Some(holding)) = (&mut self.forces, simulation.holding()) {
            forces.write(time, &holding)?;
        }
        Ok(())
    }

    /// How far they have come.
    pub fn marks(&self) -> TableMarks {
        TableMarks {
            rheology: self.rheology.as_ref().map(RheologyWriter::mark),
            forces: self.forces.as_ref().map(ForcesWriter::mark),
        }
    }

    /// Gives the complete files their names.
    pub fn finish(self) -> Result<(), OutputError> {
        self.rheology.map_or(Ok(()), RheologyWriter::finish)?;
        self.forces.map_or(Ok(()), ForcesWriter::finish)
    }
}
