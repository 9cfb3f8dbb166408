//! Progress and results in words: a bar on a terminal, plain lines in a log.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use gluey::output::folder_of;
use gluey::output::solver_log::SolverRow;
use gluey::progress::Ticker;
use gluey::{Notice, Progress, ProgressState, ResultPaths, RunReport};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// Time between lines of a log.
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// Shows where a run is.
pub struct Reporter {
    name: String,
    surface: Surface,
    /// Time of the last step, if each is told.
    steps: Option<Mutex<Instant>>,
}

/// The surface that progress is shown on.
enum Surface {
    /// A terminal.
    Bar(ProgressBar),
    /// A file or pipe, with what writes a line every so often.
    Log(Ticker),
    /// Nothing: only what should be known is told, not where the run is.
    Nothing,
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
        Self { name: name.to_owned(), surface: Surface::Bar(bar), steps: None }
    }

    /// Lines, whatever there is to draw on.
    pub fn log(name: &str, quiet: bool) -> Self {
        let of_lines = name.to_owned();
        let ticker = || {
            Ticker::new(LOG_INTERVAL, move |state| {
                say(&format!("{of_lines}: step {}/{}, {state}", state.step, state.steps));
            })
        };
        let surface = if quiet { Surface::Nothing } else { Surface::Log(ticker()) };
        Self { name: name.to_owned(), surface, steps: None }
    }

    /// The same with a line for each step, if asked for.
    pub fn verbose(self, is_verbose: bool) -> Self {
        Self { steps: is_verbose.then(|| Mutex::new(Instant::now())), ..self }
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Surface::Bar(bar) = &self.surface {
            bar.finish_and_clear();
        }
    }

    /// Writes a line, above the bar where there is one.
    fn line(&self, line: &str) {
        match &self.surface {
            Surface::Bar(bar) => bar.suspend(|| say(line)),
            Surface::Log(_) | Surface::Nothing => say(&format!("{}: {line}", self.name)),
        }
    }
}

impl Progress for Reporter {
    fn report(&self, state: &ProgressState) {
        match &self.surface {
            Surface::Bar(bar) => {
                bar.set_length(state.steps as u64);
                bar.set_position(state.step as u64);
                bar.set_message(state.to_string());
            }
            Surface::Nothing => {}
            Surface::Log(ticker) => ticker.report(state),
        }
    }

    fn step(&self, row: &SolverRow<'_>) {
        let Some(Ok(mut last)) = self.steps.as_ref().map(Mutex::lock) else { return };
        let seconds = last.elapsed().as_secs_f64();
        *last = Instant::now();
        self.line(&format!("{row}, {seconds:.3} s"));
    }

    fn notice(&self, notice: &Notice) {
        self.line(&notice.to_string());
    }
}

/// Writes a line for people. That nobody listens any more, as when a terminal was closed, must not end a run.
pub fn say(line: &str) {
    let _ = writeln!(stderr(), "{line}");
}

/// Prints what came out, where the time went, and where the results are that begin with the table `csv`.
pub fn print_report(report: &RunReport, csv: &Path) {
    let total: f64 = report.phases.iter().map(|(_, seconds)| seconds).sum();
    let mut text = format!("{report}  phase                seconds   share\n");
    for (name, seconds) in &report.phases {
        let share = 100.0 * seconds / total.max(f64::MIN_POSITIVE);
        text.push_str(&format!("  {name:<18} {seconds:>9.3} {share:>6.1} %\n"));
    }
    let (table, folder) = (csv.display(), folder_of(csv).display());
    text.push_str(&format!("  results: {table} and beside it; pictures: gluey plot {folder}"));
    let has_frames = ResultPaths::of_csv(csv).xyz().is_dir();
    text.push_str(&if has_frames { format!("; a page: gluey view {folder}\n") } else { "\n".to_owned() });
    print(&text);
}

/// Prints a text that came out. Results are on disk: that nobody reads this is no failure.
pub fn print(text: &str) {
    let _ = stdout().write_all(text.as_bytes());
}

/// Prints `value` as JSON.
pub fn print_json(value: &impl Serialize) {
    let text = serde_json::to_string_pretty(value).expect("keys are texts, and numbers have a form");
    print(&(text + "\n"));
}

/// Prints lines of a name and what it stands for.
pub fn print_lines(lines: &[(&str, String)]) {
    print(&lines.iter().map(|(name, value)| format!("{name:<12} {value}\n")).collect::<String>());
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
    print(&rows.iter().map(line).collect::<String>());
}
