//! Progress and results in words: a bar on a terminal, plain lines in a log.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use gluey::analyse::Summary;
use gluey::view::Viewed;
use gluey::{Notice, Progress, ProgressState, RunReport};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// Time between lines of a log.
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// Shows where a run is.
pub enum Reporter {
    /// On a terminal.
    Bar(ProgressBar),
    /// Into a file or pipe.
    Log {
        /// Name of the run.
        name: String,
        /// Time of the last line.
        last: Mutex<Instant>,
        /// Whether only what should be known is told, not where the run is.
        quiet: bool,
    },
}

impl Reporter {
    /// A bar if there is a terminal to draw it on and `quiet` does not forbid it.
    pub fn new(name: &str, quiet: bool) -> Self {
        if quiet || !stderr().is_terminal() {
            return Self::log(name, quiet);
        }
        let bar = ProgressBar::no_length().with_prefix(name.to_owned());
        let template = "{prefix} [{bar:30}] step {pos}/{len} {msg}";
        // The template is valid; a plain bar would do as well.
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        Self::Bar(bar)
    }

    /// Lines, whatever there is to draw on.
    pub fn log(name: &str, quiet: bool) -> Self {
        Self::Log { name: name.to_owned(), last: Mutex::new(Instant::now()), quiet }
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Reporter {
    fn report(&self, state: &ProgressState<'_>) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(state.steps as u64);
                bar.set_position(state.step as u64);
                bar.set_message(summary(state));
            }
            Self::Log { quiet: true, .. } => {}
            Self::Log { name, last, .. } => {
                let Ok(mut last) = last.lock() else { return };
                if last.elapsed() >= LOG_INTERVAL {
                    *last = Instant::now();
                    say(&format!("{name}: step {}/{} {}", state.step, state.steps, summary(state)));
                }
            }
        }
    }

    fn notice(&self, notice: &Notice) {
        match self {
            Self::Bar(bar) => bar.suspend(|| say(&notice.to_string())),
            Self::Log { name, .. } => say(&format!("{name}: {notice}")),
        }
    }
}

/// Writes a line for people. That nobody listens any more, as when a terminal was closed, must not end a run.
pub fn say(line: &str) {
    let _ = writeln!(stderr(), "{line}");
}

fn summary(state: &ProgressState<'_>) -> String {
    let left = state.left_s.map_or("?".into(), duration);
    let rate = match state.left_s {
        Some(left) if left > 0.0 => format!("{:.3}", (state.steps - state.step) as f64 / left),
        _ => "?".into(),
    };
    format!("t = {:.3}, {rate} steps/s, {left} left, {}", state.time, state.phase)
}

/// A time one waits, in words.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Prints what came out, and where the time went.
pub fn print_report(report: &RunReport) {
    let total: f64 = report.phases.iter().map(|(_, seconds)| seconds).sum();
    let mut text = format!("{report}  phase                seconds   share\n");
    for (name, seconds) in &report.phases {
        let share = 100.0 * seconds / total.max(f64::MIN_POSITIVE);
        text.push_str(&format!("  {name:<18} {seconds:>9.3} {share:>6.1} %\n"));
    }
    // All results are on disk: that nobody reads this is no failure.
    let _ = stdout().write_all(text.as_bytes());
}

/// Prints `value` as JSON.
pub fn print_json(value: &impl Serialize) {
    let text = serde_json::to_string_pretty(value).expect("keys are texts, and numbers have a form");
    let _ = writeln!(stdout(), "{text}");
}

/// Prints lines of a name and what it stands for.
pub fn print_lines(lines: &[(&str, String)]) {
    let text: String = lines.iter().map(|(name, value)| format!("{name:<12} {value}\n")).collect();
    let _ = stdout().write_all(text.as_bytes());
}

/// Prints a table whose first row is its head; columns without any entry are left out.
pub fn print_table(rows: &[Vec<String>]) {
    let (head, body) = rows.split_first().map_or((&[][..], rows), |(head, body)| (&head[..], body));
    let used: Vec<usize> = (0..head.len()).filter(|&k| body.iter().any(|row| !row[k].is_empty())).collect();
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let line = |row: &Vec<String>| {
        let cells = used.iter().map(|&k| format!("{:<width$}", row[k], width = width(k)));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    let text: String = rows.iter().map(line).collect();
    let _ = stdout().write_all(text.as_bytes());
}

/// Prints what an analysis found.
pub fn print_summary(summary: &Summary) {
    let _ = stdout().write_all(summary.to_string().as_bytes());
}

/// Prints which page was written.
pub fn print_viewed(viewed: &Viewed) {
    let Viewed { page, frame_count, particle_count, size } = viewed;
    let megabytes = *size as f64 / 1e6;
    let text = format!(
        "{}: {frame_count} frames of {particle_count} particles, {megabytes:.1} MB; open it in a browser\n",
        page.display()
    );
    let _ = stdout().write_all(text.as_bytes());
}

/// Prints which pictures were written.
pub fn print_pictures(pictures: &[PathBuf]) {
    let lines: String = pictures.iter().map(|picture| format!("{}\n", picture.display())).collect();
    let _ = stdout().write_all(lines.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_given_in_units_one_can_wait_in() {
        assert_eq!(duration(3.4), "3 s");
        assert_eq!(duration(125.0), "2 min 05 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
    }
}
