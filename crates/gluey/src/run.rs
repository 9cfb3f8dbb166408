//! Runs a case from beginning to end.
//!
//! The dimension of a case is matched here and nowhere else: below, everything is compiled for it.

mod checkpoint_file;
mod contacts;
mod error;
#[cfg(feature = "ranks")]
mod flow_pieces;
mod frames;
mod last_step;
mod last_steps;
mod log;
mod options;
mod overwrite_guard;
#[cfg(feature = "ranks")]
mod ranks;
mod record;
mod recorder;
mod removal;
mod resumption;
mod rows;
mod runs_of_folder;
mod sharing;
mod stale_files;
mod start;
mod stress;
mod tables;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

use gluey_parallel::Communicator;

pub use error::RunError;
pub use last_steps::{Ended, LastSteps};
pub use options::{RecordOptions, RunOptions, VtkOptions, XyzOptions};
pub use overwrite_guard::OccupiedError;
#[cfg(feature = "ranks")]
pub use ranks::run_shared;
pub use record::{Machine, RecordError, RecordedOptions, RunRecord, RunState, in_full};
pub use resumption::{ResumeError, Resumption};
pub(crate) use runs_of_folder::TABLE_OF_STUDY;
pub use runs_of_folder::{FolderError, recorded_runs};

use crate::case::{Case, Hydrodynamics};
use crate::checkpoint::{Checkpoint, CheckpointError, FlowPieces};
use crate::hydrodynamics::{HydrodynamicsError, pair_mobility, stokes};
use crate::output::solver_log::SolverRow;
use crate::output::{FileError, ResultClaim};
use crate::progress::{Notice, Progress, ProgressState};
use crate::report::RunReport;
use crate::simulation::{RestoreError, Simulation, StepError};
use crate::tally::Tally;
use contacts::{CaseContact, Surrounded};
use frames::{Frames, StreamOptions};
use last_step::LastStep;
use last_steps::{OfRun, locked};
use log::Log;
use recorder::Recorder;
use rows::RowFiles;
use sharing::RunRanks;
use start::simulation;

/// Part of the radius that particles may stick out of the box: rounding errors of contact with a wall.
const ROUNDING: f64 = 1e-10;

/// Runs `case`, writes what `options` ask for and reports to `progress`.
pub fn run(case: &Case, options: &RunOptions, progress: &dyn Progress) -> Result<RunReport, RunError> {
    case.check()?;
    crate::memory::check_within(case, options.memory_limit)?;
    let (_claims, log) = prepare(case, options, progress)?;
    let outcome = match case.dimension {
        2 => run_2d(case, options, &log),
        _ => run_3d(case, options, &log),
    };
    log.end(&outcome);
    Ok(outcome?.expect("a process without others writes the results"))
}

/// Takes possession of the results, and begins the log beside them.
fn prepare<'a>(
    case: &Case,
    options: &RunOptions,
    progress: &'a dyn Progress,
) -> Result<(Vec<ResultClaim>, Log<'a>), RunError> {
    let claims = claim_outputs(case, options, progress)?;
    overwrite_guard::check_free(case, options)?;
    stale_files::remove(case, options)?;
    let log = Log::begin(case, options, progress)?;
    if options.resume.is_none() {
        Notice::of_idle_keys(case).iter().for_each(|notice| log.notice(notice));
    }
    Ok((claims, log))
}

fn run_2d(case: &Case, options: &RunOptions, log: &Log<'_>) -> Result<Option<RunReport>, RunError> {
    match case.flow.hydrodynamics {
        Hydrodynamics::Stokes => run_alone(case, options, log, stokes::<2>(case)?),
        Hydrodynamics::PairMobility => Err(HydrodynamicsError::unfit(case).into()),
    }
}

fn run_3d(case: &Case, options: &RunOptions, log: &Log<'_>) -> Result<Option<RunReport>, RunError> {
    match case.flow.hydrodynamics {
        Hydrodynamics::PairMobility => run_alone(case, options, log, pair_mobility(case)),
        Hydrodynamics::Stokes => run_alone(case, options, log, stokes::<3>(case)?),
    }
}

/// Runs `case` in one process.
fn run_alone<const D: usize, H>(
    case: &Case,
    options: &RunOptions,
    log: &Log<'_>,
    hydrodynamics: H,
) -> Result<Option<RunReport>, RunError>
where
    H: gluey_motion::Hydrodynamics<D>,
    HydrodynamicsError: From<H::Error>,
{
    let contact = CaseContact::of_case(case, |contact| contact);
    RunInProgress::start(case, options, log, hydrodynamics, contact, &RunRanks::alone())?.finish()
}

/// Makes sure before the first step that files can be written, and that no other run writes them.
fn claim_outputs(
    case: &Case,
    options: &RunOptions,
    progress: &dyn Progress,
) -> Result<Vec<ResultClaim>, RunError> {
    let streams = StreamOptions::of_run(case, options);
    let results = [Some(options.csv.as_path()), options.checkpoint.as_deref()];
    let results = results.into_iter().flatten().chain(streams.iter().map(|stream| stream.folder.as_path()));
    let claims = results.map(ResultClaim::new).collect::<Result<Vec<_>, _>>()?;
    for lock in claims.iter().filter_map(ResultClaim::unguarded) {
        progress.notice(&Notice::NotLocked { lock: lock.to_owned() });
    }
    Ok(claims)
}

/// A run in progress, on each of the ranks that share it.
struct RunInProgress<'a, const D: usize, H, C> {
    case: &'a Case,
    options: &'a RunOptions,
    progress: &'a dyn Progress,
    simulation: Simulation<D, H, C>,
    tally: Tally,
    /// On rank zero.
    rows: Option<RowFiles<D>>,
    frames: Frames<D>,
    last: Arc<Mutex<LastStep<D>>>,
    sharing: &'a RunRanks<'a>,
    started: Instant,
    saved: Instant,
    first_step: usize,
    wall_before_s: f64,
}

impl<'a, const D: usize, H, C> RunInProgress<'a, D, H, C>
where
    H: gluey_motion::Hydrodynamics<D>,
    C: Surrounded<D>,
    HydrodynamicsError: From<H::Error>,
{
    /// At time 0, or at the checkpoint to resume. No rank sends or waits for messages here: they agree on the
    /// outcome.
    fn start(
        case: &'a Case,
        options: &'a RunOptions,
        progress: &'a dyn Progress,
        hydrodynamics: H,
        contact: C,
        sharing: &'a RunRanks<'a>,
    ) -> Result<Self, RunError> {
        let mut simulation = simulation(case, hydrodynamics, contact);
        let (mut tally, mut wall_before_s, mut checkpoint) = (Tally::default(), 0.0, None);
        if let Some(path) = &options.resume {
            let saved = Checkpoint::<D>::read(case, path)?.on(sharing.rank_count());
            (wall_before_s, tally, *simulation.phases_mut()) =
                (saved.wall_s, saved.tally, saved.phases.clone());
            let restored = simulation.restore(saved.state.clone()).map_err(RestoreError::widen);
            restored.map_err(|source| CheckpointError::Unfit { path: path.clone(), source })?;
            checkpoint = Some(saved);
        }
        let first_step = simulation.step_index();
        let opened = || RowFiles::open(case, options, progress, checkpoint.as_ref());
        let (rows, file) = sharing.is_first().then(opened).transpose()?.unzip();
        let frames = Frames::create(case, options, first_step, sharing)?;
        let recorder = |rows: &RowFiles<D>| Recorder::begin(case, options, first_step, rows.tables.path());
        let recorder = rows.as_ref().map(recorder).transpose()?.flatten();
        let on_their_way = frames.on_their_way();
        let last = LastStep::before(case, options, file.flatten(), recorder, on_their_way, first_step);
        if let (Some(list), None) = (&options.last_steps, sharing.keep_flow) {
            list.add(&(last.clone() as Arc<dyn OfRun>));
        }
        Ok(Self {
            case,
            options,
            progress,
            simulation,
            tally,
            rows,
            frames,
            last,
            sharing,
            started: Instant::now(),
            saved: Instant::now(),
            first_step,
            wall_before_s,
        })
    }

    /// Runs to the end; rank zero has a report.
    fn finish(mut self) -> Result<Option<RunReport>, RunError> {
        let outcome = self.steps_or_panic().map_err(|error| self.keep_last_good(error));
        if outcome.is_ok() {
            self.keep_for_a_later_end();
        }
        // Until the record says how it ended, the run is there.
        let _last = self.last.clone();
        let (recorder, step, progress) = (self.end_of_record(), self.steps_done(), self.progress);
        let outcome = outcome.and_then(|()| self.complete());
        match recorder {
            Some(recorder) => recorder.close(step, outcome, progress),
            None => outcome,
        }
    }

    /// The record, which nobody else writes any more.
    fn end_of_record(&self) -> Option<Recorder> {
        let mut last = self.last();
        last.is_ending = true;
        last.recorder.take()
    }

    /// Steps done at the last whole step, where it is kept.
    fn steps_done(&self) -> usize {
        self.last().step().unwrap_or(self.simulation.step_index())
    }

    /// Leaves a checkpoint of the last step, from which the run can go on to a later end. That there is no
    /// room for one is no reason for a complete run to fail.
    fn keep_for_a_later_end(&mut self) {
        if let Err(error) = self.save() {
            let (path, reason) = (error.path, error.source.to_string());
            self.progress.notice(&Notice::NoCheckpoint { path, reason });
        }
    }

    /// Gives all files their names.
    fn complete(self) -> Result<Option<RunReport>, RunError> {
        let wall_s = self.wall_s();
        self.frames.finish()?;
        let Some(RowFiles { tables, measures }) = self.rows else { return Ok(None) };
        tables.finish()?;
        let rheology = tables::means_of_rheology(self.case, &self.options.csv)?;
        let (flow, phases) = (self.simulation.statistics(), self.simulation.phases());
        let report = RunReport::of(self.case, &measures, flow, &self.tally, wall_s, phases);
        Ok(Some(RunReport { rheology, ..report }))
    }

    /// All steps. A panic of this or any other thread ends them as an error does; what it left half done is
    /// not used, for checkpoints are of the step before. Ranks that wait for this one end by its panic.
    fn steps_or_panic(&mut self) -> Result<(), RunError> {
        let outcome = catch_unwind(AssertUnwindSafe(|| self.all_steps()));
        outcome.unwrap_or_else(|payload| {
            let (step, time) = (self.simulation.step_index(), self.simulation.time());
            let error = RunError::Panicked { step, time, message: panic_message(payload.as_ref()) };
            if self.sharing.ranks.size() == 1 {
                return Err(error);
            }
            if let Some(recorder) = self.end_of_record() {
                // What is told of the run is the panic.
                let _ = recorder.close(self.steps_done(), Err(error), self.progress);
            }
            resume_unwind(payload)
        })
    }

    fn all_steps(&mut self) -> Result<(), RunError> {
        self.remember()?;
        while self.simulation.step_index() < self.case.step_count() {
            self.observe()?;
            let (step, time) = (self.simulation.step_index(), self.simulation.time());
            self.advance()?;
            self.log_effort(step, time)?;
            self.remember()?;
            self.save_if_due()?;
        }
        self.observe()?;
        self.log_effort(self.simulation.step_index(), self.simulation.time())?;
        // A frame that could not be written is known now.
        Ok(self.sharing.agreed(self.frames.flush())?)
    }

    /// Computes the velocities here and now, and writes them down.
    fn observe(&mut self) -> Result<(), RunError> {
        self.tell("flow");
        self.simulation.predict().map_err(StepError::widen)?;
        self.tell("contact");
        self.simulation.correct().map_err(StepError::widen)?;
        self.tell("output");
        let start = Instant::now();
        self.write()?;
        self.simulation.phases_mut().add("output", start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Counts what the step took that began then, and writes it down if it was done: the velocities at the
    /// end of a run are those of a step that a longer run does.
    fn log_effort(&mut self, step: usize, time: f64) -> Result<(), RunError> {
        let (simulation, strain) = (&self.simulation, self.case.strain_after(step));
        let (flow, motion, phases) = (simulation.statistics(), simulation.motion(), simulation.phases());
        let gaps = simulation.gaps();
        let row = SolverRow { step, time, strain, flow, gaps, motion, phases };
        self.progress.step(&row);
        let before = self.tally;
        self.tally.add(motion, &gaps.films, flow);
        Notice::of_first(&before, &self.tally, &row).iter().for_each(|notice| self.progress.notice(notice));
        let rows = self.rows.as_mut().filter(|_| motion.parts > 0);
        self.sharing.agreed(rows.map_or(Ok(()), |rows| Ok(rows.tables.write_effort(&row)?)))
    }

    /// Rows first, and the pieces that ranks have of frames; then the frames, which name these.
    fn write(&mut self) -> Result<(), RunError> {
        let Self { case, simulation, sharing, frames, .. } = self;
        let rows = self.rows.as_mut().map_or(Ok(()), |rows| rows.write(case, simulation));
        sharing.agreed(rows.and_then(|()| Ok(frames.write_pieces(case, simulation)?)))?;
        sharing.agreed(frames.write(case, simulation))
    }

    /// Moves the particles, and turns the shear round when it is time.
    fn advance(&mut self) -> Result<(), RunError> {
        self.tell("motion");
        self.simulation.advance().map_err(StepError::widen)?;
        self.check_inside()?;
        if self.case.is_reversed_after(self.simulation.step_index()) != self.simulation.is_reversed() {
            self.simulation.reverse_shear();
        }
        Ok(())
    }

    /// The finite-element flow has no meaning for particles that stick out of the box. Contact keeps them
    /// from its walls, but not from the sides that Couette flow passes through.
    fn check_inside(&self) -> Result<(), RunError> {
        if self.case.flow.hydrodynamics != Hydrodynamics::Stokes {
            return Ok(());
        }
        let (lower, upper) = (self.case.lower(), self.case.upper());
        for (index, particle) in self.simulation.particles().iter().enumerate() {
            for axis in (0..D).filter(|&axis| self.case.period(axis).is_none()) {
                let x = particle.pose.position[axis];
                let excess = (lower[axis] - x).max(x - upper[axis]) + particle.radius;
                if excess > ROUNDING * particle.radius {
                    let (step, time) = (self.simulation.step_index(), self.simulation.time());
                    return Err(RunError::LeftBox { particle: index + 1, step, time, excess });
                }
            }
        }
        Ok(())
    }

    /// Writes a checkpoint when it is time, and stops when asked to.
    fn save_if_due(&mut self) -> Result<(), RunError> {
        let (step, steps) = (self.simulation.step_index(), self.case.step_count());
        let interrupted =
            self.options.interrupt.as_ref().is_some_and(|interrupt| interrupt.load(Ordering::Relaxed));
        let minutes = self.saved.elapsed().as_secs_f64() / 60.0;
        let late = self.options.checkpoint_minutes.is_some_and(|most| minutes >= most);
        // One rank that is asked, or late, is enough.
        let [interrupted, late] = self.sharing.any([interrupted, late]);
        let due =
            self.options.checkpoint_every.is_some_and(|every| step.is_multiple_of(every.max(1))) || late;
        if interrupted || due {
            self.save()?;
            self.saved = Instant::now();
        }
        match interrupted && step < steps {
            true => {
                let checkpoint = self.options.checkpoint.clone();
                Err(Ended { step, steps, time: self.simulation.time(), checkpoint }.into())
            }
            false => Ok(()),
        }
    }

    /// Keeps the run as it is between two steps: a step that fails has already changed what the next would
    /// start from.
    fn remember(&mut self) -> Result<(), RunError> {
        if self.options.checkpoint.is_none() {
            return Ok(());
        }
        let state = self.simulation.state().map_err(|error| RunError::Store(error.into()))?;
        let Some(rows) = &self.rows else { return Ok(()) };
        let checkpoint = Checkpoint {
            state,
            tables: rows.tables.marks(),
            tally: self.tally,
            phases: self.simulation.phases().clone(),
            wall_s: self.wall_s(),
            ranks: self.sharing.rank_count(),
            pieces: None,
        };
        self.last().checkpoint = Some(checkpoint);
        Ok(())
    }

    fn last(&self) -> MutexGuard<'_, LastStep<D>> {
        locked(&self.last)
    }

    /// Writes what was remembered, after what it counts on.
    fn save(&mut self) -> Result<(), FileError> {
        let due = self.frames.flush().and_then(|()| self.last().is_due());
        // Ranks agree on nothing where there is nothing to write.
        if self.sharing.of_first(u64::from(!matches!(due, Ok(false)))) == 0 {
            return Ok(());
        }
        self.sharing.agreed(due)?;
        let pieces = self.keep_flow()?;
        let saved = self.last().save(pieces);
        self.sharing.agreed(saved)?.iter().for_each(|notice| self.progress.notice(notice));
        Ok(())
    }

    /// Has each rank that shares the flow write what its next one starts from. All is on disk then.
    fn keep_flow(&self) -> Result<Option<FlowPieces>, FileError> {
        let (Some(keep), Some(path)) = (self.sharing.keep_flow, &self.options.checkpoint) else {
            return Ok(None);
        };
        let name = self.last().name();
        let name = self.sharing.of_first(self.sharing.agreed(name)?);
        self.sharing.agreed(keep(path, name))
    }

    /// After an error that the case or the machine can be cured of, leaves a checkpoint of the last good
    /// step.
    fn keep_last_good(&mut self, error: RunError) -> RunError {
        let is_curable = matches!(
            error,
            RunError::Step(_) | RunError::LeftBox { .. } | RunError::Output(_) | RunError::Panicked { .. }
        );
        let step = self.last().step().filter(|_| is_curable).unwrap_or(0);
        let step = self.sharing.of_first(step as u64) as usize;
        let Some(path) = self.options.checkpoint.clone().filter(|_| step > 0) else {
            return error;
        };
        match self.save() {
            Ok(()) => RunError::Stopped { step, checkpoint: path, cause: Box::new(error) },
            Err(reason) => {
                self.progress.notice(&Notice::NoCheckpoint { path, reason: reason.source.to_string() });
                error
            }
        }
    }

    fn tell(&self, phase: &'static str) {
        let (step, steps) = (self.simulation.step_index(), self.case.step_count());
        let seconds = self.started.elapsed().as_secs_f64();
        let done = step - self.first_step;
        let left_s = (done > 0).then(|| seconds / done as f64 * (steps - step) as f64);
        let (time, wall_s) = (self.simulation.time(), self.wall_s());
        self.progress.report(&ProgressState { step, steps, time, phase, wall_s, left_s });
    }

    fn wall_s(&self) -> f64 {
        self.wall_before_s + self.started.elapsed().as_secs_f64()
    }
}

/// What a panic said.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message").to_owned()
}
