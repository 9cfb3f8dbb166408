//! Runs a case from beginning to end.
//!
//! The dimension of a case is matched here and nowhere else: below, everything is compiled for it.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use gluey_contact::{ContactModel, PairContact};
use gluey_geom::{Dim, Particle, Space, Vector};
use gluey_motion::{LinearFlow, PairMobility, PairMobilityError};
use thiserror::Error;

use crate::case::{Case, CaseError, Hydrodynamics};
use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::flow::{FlowError, StokesFlow, stokes_flow};
use crate::output::csv::CsvWriter;
use crate::output::vtk::{Frame, VtkWriter};
use crate::output::{OutputError, prepare_folder_of};
use crate::progress::{Progress, ProgressState};
use crate::report::RunReport;
use crate::simulation::{Simulation, StepError};
use crate::trajectory::Trajectory;

/// Part of the radius that particles may stick out of the box: rounding errors of contact with a wall.
const ROUNDING: f64 = 1e-10;

/// What a run writes, and where.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// The trajectory, one row a step; its folder is created when missing.
    pub csv: PathBuf,
    /// Fields and particles for ParaView.
    pub vtk: Option<VtkOptions>,
    /// Where to write checkpoints: at interrupts, and as often as `checkpoint_every` says.
    pub checkpoint: Option<PathBuf>,
    /// Steps between checkpoints, at least 1.
    pub checkpoint_every: Option<usize>,
    /// A checkpoint of the same case to go on from.
    pub resume: Option<PathBuf>,
    /// Set from outside to stop after the current step.
    pub interrupt: Option<Arc<AtomicBool>>,
}

/// Output for ParaView.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VtkOptions {
    /// Folder for the files.
    pub folder: PathBuf,
    /// Steps between files, at least 1.
    pub every: usize,
}

impl RunOptions {
    /// Writes the trajectory to `csv` and nothing else.
    pub fn csv(csv: impl Into<PathBuf>) -> Self {
        Self { csv: csv.into(), ..Self::default() }
    }
}

/// The flow could not be computed.
#[derive(Debug, Error)]
pub enum HydrodynamicsError {
    /// By the analytic model of two spheres.
    #[error(transparent)]
    PairMobility(#[from] PairMobilityError),
    /// By the finite-element solver.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The model does not exist in this dimension.
    #[error("there is no {hydrodynamics} hydrodynamics in {dimension}D")]
    Unfit {
        /// The model.
        hydrodynamics: Hydrodynamics,
        /// The dimension.
        dimension: usize,
    },
}

impl HydrodynamicsError {
    fn unfit(case: &Case) -> Self {
        Self::Unfit { hydrodynamics: case.flow.hydrodynamics, dimension: case.dimension }
    }
}

/// A run came to nothing.
#[derive(Debug, Error)]
pub enum RunError {
    /// The case makes no sense.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A checkpoint could not be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The flow could not be set up.
    #[error("the flow could not be set up")]
    Flow(#[from] HydrodynamicsError),
    /// A step failed.
    #[error(transparent)]
    Step(#[from] StepError<HydrodynamicsError>),
    /// A particle touched the boundary of the box, where the flow is prescribed.
    #[error(
        "particle {particle} reached the boundary of the box in step {step} (t = {time}): it sticks out by {excess:.3e}"
    )]
    LeftBox {
        /// Its number, from 1.
        particle: usize,
        /// Steps done.
        step: usize,
        /// Time.
        time: f64,
        /// How far.
        excess: f64,
    },
    /// The run was asked to stop.
    #[error("interrupted after step {step} of {steps} (t = {time})")]
    Interrupted {
        /// Steps done.
        step: usize,
        /// Steps in all.
        steps: usize,
        /// Time reached.
        time: f64,
        /// Where the run can go on from.
        checkpoint: Option<PathBuf>,
    },
}

/// Runs `case`, writes what `options` ask for and reports to `progress`.
pub fn run(case: &Case, options: &RunOptions, progress: &dyn Progress) -> Result<RunReport, RunError> {
    case.check()?;
    crate::memory::check(case)?;
    prepare_outputs(options)?;
    match case.dimension {
        2 => run_2d(case, options, progress),
        _ => run_3d(case, options, progress),
    }
}

fn run_2d(case: &Case, options: &RunOptions, progress: &dyn Progress) -> Result<RunReport, RunError> {
    match case.flow.hydrodynamics {
        Hydrodynamics::Stokes => Run::start(case, options, progress, stokes::<2>(case)?)?.finish(),
        Hydrodynamics::PairMobility => Err(HydrodynamicsError::unfit(case).into()),
    }
}

fn run_3d(case: &Case, options: &RunOptions, progress: &dyn Progress) -> Result<RunReport, RunError> {
    match case.flow.hydrodynamics {
        Hydrodynamics::PairMobility => Run::start(case, options, progress, pair_mobility(case))?.finish(),
        Hydrodynamics::Stokes => Run::start(case, options, progress, stokes::<3>(case)?)?.finish(),
    }
}

/// The finite-element flow of `case`.
fn stokes<const D: usize>(case: &Case) -> Result<StokesFlow<D>, HydrodynamicsError>
where
    Dim<D>: Space<D>,
{
    Ok(stokes_flow(case)?)
}

/// Two spheres in the shear of `case`, unbounded.
fn pair_mobility(case: &Case) -> PairMobility {
    let middle = 0.5 * (case.lower()[1] + case.upper()[1]);
    let shear = LinearFlow::shear(case.shear_rate, middle);
    PairMobility::new(shear).with_gap_offset(case.flow.pair_mobility.gap_offset)
}

/// Finds out before the first step whether files can be written.
fn prepare_outputs(options: &RunOptions) -> Result<(), OutputError> {
    prepare_folder_of(&options.csv)?;
    options.checkpoint.as_deref().map_or(Ok(()), prepare_folder_of)?;
    options.vtk.as_ref().map_or(Ok(()), |vtk| prepare_folder_of(&vtk.folder.join("fields.pvd")))
}

/// A run on its way.
struct Run<'a, const D: usize, H>
where
    Dim<D>: Space<D>,
{
    case: &'a Case,
    options: &'a RunOptions,
    progress: &'a dyn Progress,
    simulation: Simulation<D, H, PairContact<D>>,
    trajectory: Trajectory<D>,
    csv: CsvWriter,
    vtk: Option<(usize, VtkWriter)>,
    started: Instant,
    first_step: usize,
    wall_before_s: f64,
}

impl<'a, const D: usize, H> Run<'a, D, H>
where
    Dim<D>: Space<D>,
    PairContact<D>: ContactModel<D>,
    H: gluey_motion::Hydrodynamics<D>,
    HydrodynamicsError: From<H::Error>,
{
    /// At time 0, or at the checkpoint to resume.
    fn start(
        case: &'a Case,
        options: &'a RunOptions,
        progress: &'a dyn Progress,
        hydrodynamics: H,
    ) -> Result<Self, RunError> {
        let particles = particles(case);
        let surroundings = case.surroundings();
        let radii = particles.iter().map(|particle| particle.radius).collect();
        let mut trajectory = Trajectory::new(radii, surroundings.periods);
        let contact = PairContact::new(case.contact.params()).within(surroundings);
        let mut simulation =
            Simulation::new(particles, case.time.scheme, case.time.step, hydrodynamics, contact);
        let mut wall_before_s = 0.0;
        if let Some(path) = &options.resume {
            let checkpoint = Checkpoint::read(case, path)?;
            trajectory = checkpoint.trajectory;
            wall_before_s = checkpoint.wall_s;
            *simulation.phases_mut() = checkpoint.phases;
            if !simulation.restore(checkpoint.state) {
                return Err(CheckpointError::Damaged { path: path.clone() }.into());
            }
        }
        let mut csv = CsvWriter::create::<D>(&options.csv, case.particles.len())?;
        csv.write_all(&trajectory)?;
        let vtk = options.vtk.as_ref().map(|vtk| vtk_writer(vtk, trajectory.times())).transpose()?;
        let first_step = simulation.step_index();
        let started = Instant::now();
        Ok(Self {
            case,
            options,
            progress,
            simulation,
            trajectory,
            csv,
            vtk,
            started,
            first_step,
            wall_before_s,
        })
    }

    /// Runs to the end.
    fn finish(mut self) -> Result<RunReport, RunError> {
        while self.simulation.step_index() < self.case.step_count() {
            self.observe()?;
            self.advance()?;
            self.save_if_due()?;
        }
        self.observe()?;
        let wall_s = self.wall_s();
        let flow = self.simulation.statistics();
        self.csv.finish()?;
        Ok(RunReport::of(self.case, &self.trajectory, &flow, wall_s, self.simulation.phases()))
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

    fn write(&mut self) -> Result<(), OutputError> {
        let simulation = &self.simulation;
        let (step, time) = (simulation.step_index(), simulation.time());
        self.trajectory.push(time, simulation.particles(), simulation.twists());
        self.csv.write(&self.trajectory.row(self.trajectory.len() - 1))?;
        match &mut self.vtk {
            Some((every, writer)) if step.is_multiple_of(*every) => writer.write(&Frame {
                step,
                time,
                particles: simulation.particles(),
                twists: simulation.twists(),
                contacts: simulation.contacts(),
                domain: simulation.contact().domain(),
                fields: simulation.fields().as_ref(),
            }),
            _ => Ok(()),
        }
    }

    /// Moves the particles, and reverses the shear when it is time.
    fn advance(&mut self) -> Result<(), RunError> {
        self.tell("motion");
        self.simulation.advance();
        self.check_inside()?;
        let now = self.simulation.time() * (1.0 + 1e-12);
        if self.case.time.reverse_at.is_some_and(|at| now >= at) && !self.simulation.is_reversed() {
            self.simulation.reverse_shear();
        }
        Ok(())
    }

    /// The finite-element flow has no meaning for particles that stick out of the box. Contact keeps them from its walls,
    /// but not from the sides that Couette flow passes through.
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
        let due = self.options.checkpoint_every.is_some_and(|every| step.is_multiple_of(every.max(1)));
        if let Some(path) = self.options.checkpoint.as_ref().filter(|_| interrupted || due) {
            self.checkpoint().write(self.case, path)?;
        }
        match interrupted && step < steps {
            true => {
                let checkpoint = self.options.checkpoint.clone();
                Err(RunError::Interrupted { step, steps, time: self.simulation.time(), checkpoint })
            }
            false => Ok(()),
        }
    }

    fn checkpoint(&self) -> Checkpoint<D> {
        Checkpoint {
            state: self.simulation.state(),
            trajectory: self.trajectory.clone(),
            phases: self.simulation.phases().clone(),
            wall_s: self.wall_s(),
        }
    }

    fn tell(&self, phase: &str) {
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

/// The writer and its interval; of the steps done, those with files stay listed.
fn vtk_writer(options: &VtkOptions, times: &[f64]) -> Result<(usize, VtkWriter), OutputError> {
    let every = options.every.max(1);
    let done: Vec<(usize, f64)> = times.iter().copied().enumerate().step_by(every).collect();
    Ok((every, VtkWriter::create(&options.folder, &done)?))
}

/// The particles of a checked case.
fn particles<const D: usize>(case: &Case) -> Vec<Particle<D>>
where
    Dim<D>: Space<D>,
{
    let position = |coordinates: &[f64]| Vector::<D>::from_fn(|axis, _| coordinates[axis]);
    case.particles.iter().map(|spec| Particle::new(position(&spec.position), spec.radius)).collect()
}
