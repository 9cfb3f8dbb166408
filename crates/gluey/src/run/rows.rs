//! The tables of a run and the measures of their rows, on rank zero.

use gluey_motion::Hydrodynamics;

use super::checkpoint_file::CheckpointFile;
use super::contacts::Surrounded;
use super::error::RunError;
use super::options::RunOptions;
use super::tables::{RunTables, earlier_drafts};
use crate::case::Case;
use crate::checkpoint::Checkpoint;
use crate::hydrodynamics::HydrodynamicsError;
use crate::measures::{Instant, RunMeasures};
use crate::output::ResultPaths;
use crate::progress::{Notice, Progress};
use crate::simulation::Simulation;

/// The tables of a run in progress and the measures of their rows.
pub(super) struct RowFiles<const D: usize> {
    pub tables: RunTables,
    pub measures: RunMeasures<D>,
}

impl<const D: usize> RowFiles<D> {
    /// Those of a run at time 0, or at the checkpoint to go on from, and the place of its checkpoints, if it
    /// has one.
    pub fn open(
        case: &Case,
        options: &RunOptions,
        progress: &dyn Progress,
        checkpoint: Option<&Checkpoint<D>>,
    ) -> Result<(Self, Option<CheckpointFile>), RunError> {
        let drafts = earlier_drafts(case, &options.csv)?;
        let file = CheckpointFile::new(options, !drafts.is_empty());
        if checkpoint.is_none() && !drafts.is_empty() {
            let has_checkpoint = options.checkpoint.as_ref().is_some_and(|file| file.exists());
            let folder = has_checkpoint.then(|| ResultPaths::of_csv(&options.csv).folder().to_owned());
            progress.notice(&Notice::EarlierDrafts { drafts, folder });
        }
        let mut measures = RunMeasures::new(case);
        let tables = match checkpoint {
            None => RunTables::create::<D>(case, &options.csv)?,
            Some(checkpoint) => {
                let visit = |row: &Instant<D>| measures.add(row);
                RunTables::resume(&options.csv, checkpoint, case.particles.len(), visit)?
            }
        };
        Ok((Self { tables, measures }, file))
    }

    /// Adds the rows of the step that was predicted and corrected last.
    pub fn write<H, C>(&mut self, case: &Case, simulation: &Simulation<D, H, C>) -> Result<(), RunError>
    where
        H: Hydrodynamics<D>,
        C: Surrounded<D>,
        HydrodynamicsError: From<H::Error>,
    {
        let smallest_gap_over_a = self.tables.write(case, simulation)?;
        let (time, particles) = (simulation.time(), simulation.particles());
        let centers = particles.iter().map(|particle| particle.pose.position).collect();
        self.measures.add(&Instant { time, centers, smallest_gap_over_a });
        Ok(())
    }
}
