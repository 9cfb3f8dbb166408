//! Progress of the runs: a bar each on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use gluey::progress::duration;
use gluey::{ProgressState, RunReport};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::chain;

/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(20);

/// Lines of which one is printed now and then.
pub struct NowAndThen(Mutex<Instant>);

impl Default for NowAndThen {
    fn default() -> Self {
        Self(Mutex::new(Instant::now()))
    }
}

impl NowAndThen {
    /// Prints this line if the last one is long ago.
    pub fn print(&self, line: impl FnOnce() -> String) {
        let mut last = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if last.elapsed() >= LINE_EVERY {
            *last = Instant::now();
            eprintln!("{}", line());
        }
    }
}

/// Shows all runs.
pub struct Board {
    bars: Option<MultiProgress>,
}

/// Shows one run; hand it to [`gluey::run`].
pub struct RunLine {
    name: String,
    bar: Option<ProgressBar>,
    lines: NowAndThen,
}

impl Board {
    /// Bars if standard error is a terminal, lines otherwise.
    pub fn new() -> Self {
        Self { bars: std::io::stderr().is_terminal().then(MultiProgress::new) }
    }

    /// A run begins.
    pub fn start(&self, name: &str) -> RunLine {
        let bar = self.bars.as_ref().map(|bars| bars.add(ProgressBar::new(0).with_style(style())));
        let line = RunLine { name: name.to_owned(), bar, lines: NowAndThen::default() };
        match &line.bar {
            Some(bar) => bar.set_prefix(line.name.clone()),
            None => eprintln!("{}: started", line.name),
        }
        line
    }
}

impl RunLine {
    /// The run is over, with this result.
    pub fn finish(&self, result: &anyhow::Result<RunReport>) {
        let outcome = match result {
            Ok(report) => format!("done in {}", duration(report.wall_s)),
            Err(error) => format!("failed: {}", chain(&**error)),
        };
        match &self.bar {
            Some(bar) => bar.abandon_with_message(outcome),
            None => eprintln!("{}: {outcome}", self.name),
        }
    }
}

impl gluey::Progress for RunLine {
    fn report(&self, state: &ProgressState) {
        match &self.bar {
            Some(bar) => {
                bar.set_length(state.steps as u64);
                bar.set_position(state.step as u64);
                bar.set_message(describe(state));
            }
            None => self
                .lines
                .print(|| format!("{}: step {}/{}, {}", self.name, state.step, state.steps, describe(state))),
        }
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{prefix:<26} {bar:24} {pos:>5}/{len:<5} {msg}")
        .expect("the template is a constant and well formed")
}

/// Phase, rate and time left.
fn describe(state: &ProgressState) -> String {
    let rate = state.step as f64 / state.wall_s.max(f64::MIN_POSITIVE);
    match state.left_s {
        Some(left) if state.step > 0 => {
            format!("{}, {rate:.1} steps/s, {} left", state.phase, duration(left))
        }
        _ => state.phase.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_shows_phase_rate_and_time_left() {
        let state = ProgressState {
            step: 50,
            steps: 200,
            time: 1.0,
            phase: "flow",
            wall_s: 10.0,
            left_s: Some(30.0),
        };
        assert_eq!(describe(&state), "flow, 5.0 steps/s, 30 s left");
        assert_eq!(describe(&ProgressState { step: 0, left_s: None, ..state }), "flow");
    }
}
