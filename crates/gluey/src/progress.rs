//! How a run tells where it is.

/// Where a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressState<'a> {
    /// Steps done.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Time reached in the simulation.
    pub time: f64,
    /// What is being done: `flow`, `contact`, `motion` or `output`.
    pub phase: &'a str,
    /// Wall time since the run started, in seconds.
    pub wall_s: f64,
    /// Estimate of the wall time left, in seconds; `None` before the first step is done.
    pub left_s: Option<f64>,
}

/// Receives reports while a run goes on, a few times a step.
pub trait Progress: Sync {
    /// Takes note of where the run is; called from the thread of the run, and expected to return at once.
    fn report(&self, state: &ProgressState<'_>);
}

/// Takes no note of anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: &ProgressState<'_>) {}
}
