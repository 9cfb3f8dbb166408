//! Progress of the runs: a bar each on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use gluey::ProgressState;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use gluey::progress::duration;

/// Time between two lines of a run where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(20);

/// Shows all runs.
pub struct Board {
    bars: Option<MultiProgress>,
}

/// Shows one run; hand it to [`gluey::run`].
pub struct RunLine {
    name: String,
    bar: Option<ProgressBar>,
    last_line: Mutex<Instant>,
}

impl Board {
    /// Bars if standard error is a terminal, lines otherwise.
    pub fn new() -> Self {
        Self { bars: std::io::stderr().is_terminal().then(MultiProgress::new) }
    }

    /// A run begins.
    pub fn start(&self, name: &str) -> RunLine {
        let bar = self.bars.as_ref().map(|bars| bars.add(ProgressBar::new(0).with_style(style())));
        let line = RunLine { name: name.to_owned(), bar, last_line: Mutex::new(Instant::now()) };
        match &line.bar {
            Some(bar) => bar.set_prefix(line.name.clone()),
            None => eprintln!("{}: started", line.name),
        }
        line
    }
}

impl RunLine {
    /// The run is over; `outcome` says how.
    pub fn finish(&self, outcome: &str) {
        match &self.bar {
            Some(bar) => bar.abandon_with_message(outcome.to_owned()),
            None => eprintln!("{}: {outcome}", self.name),
        }
    }

    fn print_now_and_then(&self, state: &ProgressState<'_>) {
        let mut last = self.last_line.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if last.elapsed() >= LINE_EVERY {
            *last = Instant::now();
            eprintln!("{}: step {}/{}, {}", self.name, state.step, state.steps, describe(state));
        }
    }
}

impl gluey::Progress for RunLine {
    fn report(&self, state: &ProgressState<'_>) {
        match &self.bar {
            Some(bar) => {
                bar.set_length(state.steps as u64);
                bar.set_position(state.step as u64);
                bar.set_message(describe(state));
            }
            None => self.print_now_and_then(state),
        }
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{prefix:<26} {bar:24} {pos:>5}/{len:<5} {msg}")
        .expect("the template is a constant and well formed")
}

/// Phase, rate and time left.
fn describe(state: &ProgressState<'_>) -> String {
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
