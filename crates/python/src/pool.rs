//! Threads of the computations.
//!
//! A process that Python forked has none of its parent's threads, so that it must not wait for them: pools
//! belong to a process.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::marker::Ungil;
use pyo3::{PyErr, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// As much as the main thread of a program has; unit: bytes.
const STACK: usize = 8 << 20;

/// The pool of this process, made when it is first needed, and the number of the process.
static SHARED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// So many threads of their own, or the shared ones of this process, one per processor.
pub fn pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, PyErr> {
    match threads {
        Some(_) => build(threads),
        None => shared(),
    }
}

/// Computes on threads while the interpreter is free for others.
pub fn compute<T: Send + Ungil>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send + Ungil,
) -> Result<T, PyErr> {
    let pool = pool(threads)?;
    Ok(py.detach(|| pool.install(work)))
}

fn shared() -> Result<Arc<ThreadPool>, PyErr> {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match &*shared {
        Some((owner, pool)) if *owner == process => return Ok(pool.clone()),
        _ => {}
    }
    // The pool of a parent process is not dropped: that would wake threads that are not there.
    std::mem::forget(shared.take());
    let pool = build(None)?;
    *shared = Some((process, pool.clone()));
    Ok(pool)
}

fn build(threads: Option<usize>) -> Result<Arc<ThreadPool>, PyErr> {
    let builder = ThreadPoolBuilder::new().stack_size(STACK).num_threads(threads.unwrap_or(0));
    let pool = builder.build().map_err(|error| {
        PyRuntimeError::new_err(format!("threads could not be started: {error}; take fewer, threads="))
    })?;
    Ok(Arc::new(pool))
}
