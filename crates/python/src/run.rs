//! Runs on a thread of their own, while the thread of the caller tells where they are and listens to Ctrl-C.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use gluey::output::vtk::VtkEncoding;
use gluey::{
    Notice, Progress, ProgressState, RecordOptions, ResultPaths, Resumption, RunError, RunOptions, RunReport,
    VtkOptions, XyzOptions,
};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::case::Case;
use crate::errors::{internal, of_case, of_resume, of_run};
use crate::pool::pool;

/// Time between looks for Ctrl-C, and at most between reports.
const INTERVAL: Duration = Duration::from_millis(50);

/// What is said at the first Ctrl-C.
const STOPPING: &str = "stopping after this step; once more to stop waiting for it";

/// Output of a run; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunOutput {
    out: PathBuf,
    force: bool,
    vtk: Option<usize>,
    xyz: Option<usize>,
    checkpoint_every: Option<usize>,
    checkpoint_minutes: Option<f64>,
}

impl RunOutput {
    fn options(self, case: &gluey::Case) -> RunOptions {
        let paths = ResultPaths::new(&self.out, case.file_stem());
        let encoding = VtkEncoding::default();
        RunOptions {
            csv: paths.csv(),
            vtk: self.vtk.map(|every| VtkOptions { folder: paths.vtk(), every, encoding }),
            xyz: self.xyz.map(|every| XyzOptions { folder: paths.xyz(), every, gzip: false }),
            checkpoint: Some(paths.checkpoint()),
            checkpoint_every: self.checkpoint_every,
            checkpoint_minutes: self.checkpoint_minutes,
            record: Some(RecordOptions { force: self.force }),
            ..RunOptions::default()
        }
    }
}

/// Runs a case to its end; `progress` is called with a dictionary, `notice` with a text and whether that is a
/// warning. Gives the folder of the results and what the names of its files begin with.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    case: &Case,
    output: RunOutput,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
    notice: Bound<'_, PyAny>,
) -> PyResult<(PathBuf, String)> {
    let options = output.options(case.inner());
    let listener = Listener { progress, notice };
    finish(py, case.inner().clone(), options, threads, &listener)
}

/// A run to go on with; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Which {
    folder: PathBuf,
    name: Option<String>,
    previous: bool,
}

/// Goes on with a run.
#[pyfunction]
pub fn resume(
    py: Python<'_>,
    which: Which,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
    notice: Bound<'_, PyAny>,
) -> PyResult<(PathBuf, String)> {
    let Which { folder, name, previous } = which;
    let found = Resumption::find(&folder, name.as_deref(), previous);
    let Resumption { case_file, options, .. } = found.map_err(|error| of_resume(py, &error))?;
    let case = gluey::Case::load(case_file).map_err(|error| of_case(py, &error))?;
    finish(py, case, options, threads, &Listener { progress, notice })
}

fn finish(
    py: Python<'_>,
    case: gluey::Case,
    options: RunOptions,
    threads: Option<usize>,
    listener: &Listener<'_>,
) -> PyResult<(PathBuf, String)> {
    let paths = ResultPaths::of_csv(&options.csv);
    let interrupt = Arc::new(AtomicBool::new(false));
    let options = RunOptions { interrupt: Some(interrupt.clone()), ..options };
    let watch = Arc::new(Watch::default());
    let (pool, shared) = (pool(threads)?, watch.clone());
    let name = case.name.clone();
    let thread = std::thread::spawn(move || {
        let outcome = pool.install(|| gluey::run(&case, &options, &*shared));
        shared.changed.notify_all();
        outcome
    });
    let outcome = follow(py, thread, &watch, &interrupt, listener, &name)?;
    outcome.map_err(|error| of_run(py, &error))?;
    Ok((paths.folder().to_owned(), paths.stem()))
}

/// Waits for the run. Ctrl-C, or an error of the listener, asks it to stop after its step, and is raised once
/// it has; another Ctrl-C is raised at once, and the run stops on its own.
fn follow(
    py: Python<'_>,
    thread: JoinHandle<Result<RunReport, RunError>>,
    watch: &Watch,
    interrupt: &AtomicBool,
    listener: &Listener<'_>,
    name: &str,
) -> PyResult<Result<RunReport, RunError>> {
    let mut stopped: Option<PyErr> = None;
    loop {
        py.detach(|| watch.wait(&thread));
        let is_over = thread.is_finished();
        let heard = if stopped.is_none() { watch.tell(py, listener, name) } else { Ok(()) };
        let signal = py.check_signals();
        match (&stopped, signal, heard) {
            (_, Ok(()), Ok(())) => {}
            (Some(_), Err(again), _) => return Err(again),
            (None, Err(error), _) | (_, Ok(()), Err(error)) => {
                interrupt.store(true, Ordering::Relaxed);
                if error.is_instance_of::<PyKeyboardInterrupt>(py) {
                    listener.notice.call1((STOPPING, false))?;
                }
                stopped = Some(error);
            }
        }
        if is_over {
            break;
        }
    }
    let outcome = thread.join().map_err(|_| internal("a thread of the run panicked"))?;
    match (stopped, outcome) {
        (None, outcome) => Ok(outcome),
        (Some(error), Err(cause)) if error.is_instance_of::<PyKeyboardInterrupt>(py) => Ok(Err(cause)),
        (Some(error), _) => Err(error),
    }
}

/// The functions that are told where a run is.
struct Listener<'py> {
    progress: Option<Bound<'py, PyAny>>,
    notice: Bound<'py, PyAny>,
}

/// The last words of a run.
#[derive(Default)]
struct Watch {
    told: Mutex<LastWords>,
    changed: Condvar,
}

#[derive(Default)]
struct LastWords {
    state: Option<ProgressState>,
    notices: Vec<String>,
}

impl Watch {
    /// Waits a little, or until the run is over.
    fn wait(&self, thread: &JoinHandle<Result<RunReport, RunError>>) {
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if !thread.is_finished() {
            drop(self.changed.wait_timeout(told, INTERVAL));
        }
    }

    /// Hands on what was told since the last time.
    fn tell(&self, py: Python<'_>, listener: &Listener<'_>, name: &str) -> PyResult<()> {
        let LastWords { state, notices } =
            std::mem::take(&mut *self.told.lock().unwrap_or_else(PoisonError::into_inner));
        for notice in notices {
            listener.notice.call1((notice, true))?;
        }
        if let (Some(progress), Some(state)) = (&listener.progress, state) {
            let told = PyDict::new(py);
            told.set_item("name", name)?;
            told.set_item("step", state.step)?;
            told.set_item("steps", state.steps)?;
            told.set_item("time", state.time)?;
            told.set_item("phase", state.phase)?;
            told.set_item("wall_s", state.wall_s)?;
            told.set_item("left_s", state.left_s)?;
            progress.call1((told,))?;
        }
        Ok(())
    }
}

impl Progress for Watch {
    fn report(&self, state: &ProgressState) {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).state = Some(*state);
    }

    fn notice(&self, notice: &Notice) {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).notices.push(notice.to_string());
    }
}
