//! `cargo xtask verify`: computes the cases of `gluey-verify`, holds them against their limits, writes the
//! book.

mod drawing;
mod page;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use gluey_verify::{
    CASES, Case, Extent, Judged, Limit, LimitError, Outcome, Row, Table, Tables, Task, VerifyError,
};

use crate::book::files::{self, WriteError};
use crate::book::schedule::{self, JobError};
use crate::book::{Failure, write_drawing};
use gluey_pictures::Canvas;

/// Time between two lines of progress.
const LINE_EVERY: Duration = Duration::from_secs(20);

/// What to verify, and where to put the book.
#[derive(Clone, Debug)]
pub struct Options {
    /// Fewer positions and coarser meshes.
    pub quick: bool,
    /// Names of the cases; all if empty.
    pub only: Vec<String>,
    /// Folder of the workspace.
    pub root: PathBuf,
    /// Output folder.
    pub out: PathBuf,
}

/// Why there is no book.
#[derive(Debug, thiserror::Error)]
pub enum BookError {
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The limits could not be read.
    #[error(transparent)]
    Limits(#[from] LimitError),
    /// There is no case of this name.
    #[error("there is no case {0}; the cases are {names}", names = names())]
    NoCase(String),
}

fn names() -> String {
    CASES.iter().map(|case| case.name).collect::<Vec<_>>().join(", ")
}

/// A case with its results.
pub struct Chapter {
    /// The case.
    pub case: &'static Case,
    /// Its numbers with what is said of them.
    pub judged: Vec<Judged>,
    /// Lines for `limits.csv`, for the numbers that it does not have.
    pub proposals: Vec<String>,
    /// Its picture.
    pub drawing: Canvas,
}

/// The whole book.
pub struct Book {
    /// Computed with `--quick`.
    pub quick: bool,
    /// The state of the sources, where git knows it.
    pub commit: Option<String>,
    /// Wall time of the computations, seconds.
    pub wall_s: f64,
    /// The cases.
    pub chapters: Vec<Chapter>,
    /// Computations and pictures that failed.
    pub failures: Vec<Failure>,
}

impl Book {
    /// Whether everything was computed and every number is within its limit.
    pub fn holds(&self) -> bool {
        self.failures.is_empty() && !self.judged().any(|(_, judged)| judged.is_failure())
    }

    /// All numbers, each with its case.
    pub fn judged(&self) -> impl Iterator<Item = (&'static Case, &Judged)> {
        self.chapters.iter().flat_map(|chapter| chapter.judged.iter().map(|judged| (chapter.case, judged)))
    }

    /// How many numbers have a limit, how many of them are within it, and how many have none.
    pub fn counts(&self) -> (usize, usize, usize) {
        let outcomes: Vec<_> =
            self.judged().map(|(_, judged)| judged.verdict.map(|(_, outcome)| outcome)).collect();
        let count = |wanted: &dyn Fn(&Option<Outcome>) -> bool| outcomes.iter().filter(|o| wanted(o)).count();
        (count(&|o| o.is_some()), count(&|o| *o == Some(Outcome::Yes)), count(&|o| o.is_none()))
    }

    /// What the terminal is told: all that fails, then the counts.
    pub fn account(&self) -> String {
        let failures =
            self.failures.iter().map(|failure| format!("error: {}: {}", failure.what, failure.error));
        let missed = self.judged().filter(|(_, judged)| judged.is_failure());
        let missed = missed.map(|(case, judged)| format!("error: {}, {}", case.name, page::sentence(judged)));
        let (limits, held, free) = self.counts();
        let counts = format!("of {limits} numbers with a limit {held} are within it; {free} have none");
        failures.chain(missed).chain([counts]).collect::<Vec<_>>().join("\n")
    }
}

/// Computes and writes the book. Failures of single computations are part of it.
pub fn verify(options: &Options) -> Result<Book, BookError> {
    let start = Instant::now();
    files::prepare_folder(&options.out)?;
    let limits = gluey_verify::limits()?;
    let cases = chosen(&options.only)?;
    let extent = if options.quick { Extent::Quick } else { Extent::Full };
    let mut failures = Vec::new();
    let tables = compute(&cases, extent, &mut failures);
    let chapters: Vec<Chapter> =
        cases.into_iter().map(|case| chapter(case, &tables, &limits, extent)).collect();
    for Chapter { case, drawing, .. } in &chapters {
        files::write(&options.out.join(format!("{}.csv", case.name)), tables.of(case.name).csv().as_bytes())?;
        write_drawing(&options.out, case.name, drawing, &mut failures)?;
    }
    let wall_s = start.elapsed().as_secs_f64();
    let book = Book { quick: options.quick, commit: commit(&options.root), wall_s, chapters, failures };
    files::write(&options.out.join("numbers.csv"), page::csv(&book).as_bytes())?;
    let proposals = book.chapters.iter().flat_map(|chapter| &chapter.proposals);
    let proposals: String = proposals.map(|line| format!("{line}\n")).collect();
    files::write(&options.out.join("proposed-limits.csv"), proposals.as_bytes())?;
    files::write(&options.out.join("index.html"), page::html(&book).as_bytes())?;
    Ok(book)
}

fn chapter(case: &'static Case, tables: &Tables, limits: &[Limit], extent: Extent) -> Chapter {
    let numbers = (case.numbers)(tables);
    let judged = gluey_verify::judge(case.name, &numbers, limits, extent);
    let free = numbers.iter().zip(&judged).filter(|(_, judged)| judged.verdict.is_none());
    let proposals =
        free.filter_map(|(number, _)| gluey_verify::proposal(case.name, number, extent)).collect();
    Chapter { case, judged, proposals, drawing: drawing::draw(&(case.plot)(tables)) }
}

fn chosen(only: &[String]) -> Result<Vec<&'static Case>, BookError> {
    let is_case = |name: &&String| CASES.iter().any(|case| case.name == **name);
    match only.iter().find(|name| !is_case(name)) {
        Some(name) => Err(BookError::NoCase(name.clone())),
        None => {
            Ok(CASES.iter().filter(|case| only.is_empty() || only.iter().any(|n| n == case.name)).collect())
        }
    }
}

/// All computations of the cases, as many at a time as there are cores; the last cases, which have the
/// longest computations, go first.
fn compute(cases: &[&'static Case], extent: Extent, failures: &mut Vec<Failure>) -> Tables {
    let of_case =
        |case: &&'static Case| (case.tasks)(extent).into_iter().map(|task| (*case, task)).collect::<Vec<_>>();
    let jobs: Vec<(&'static Case, Task)> = cases.iter().rev().flat_map(of_case).collect();
    let progress = Progress::new(jobs.len());
    let results = schedule::in_parallel(&jobs, rayon::current_num_threads(), |(_, task)| {
        let row = task.run();
        progress.step();
        row
    });
    let mut keep = |case: &Case, task: &Task, result: Result<Row, JobError<VerifyError>>| {
        let what = || format!("{}, {} at {:?}", case.name, task.method, task.at);
        result.map_err(|error| failures.push(Failure::new(what(), &error))).ok()
    };
    let rows: Vec<_> = jobs
        .iter()
        .zip(results)
        .map(|((case, task), result)| (*case, task, keep(case, task, result)))
        .collect();
    let mut tables = Tables::default();
    for case in cases {
        let own = rows.iter().filter(|(of, _, _)| of.name == case.name);
        tables.insert(case.name, Table::new(case, own.map(|(_, task, row)| (*task, row.clone()))));
    }
    tables
}

/// Tells now and then how many computations are done.
struct Progress {
    count: usize,
    done: AtomicUsize,
    last_line: Mutex<Instant>,
}

impl Progress {
    fn new(count: usize) -> Self {
        Self { count, done: AtomicUsize::new(0), last_line: Mutex::new(Instant::now()) }
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let mut last = self.last_line.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if last.elapsed() >= LINE_EVERY {
            *last = Instant::now();
            eprintln!("{done} of {} computations", self.count);
        }
    }
}

/// The commit of the sources, and whether they have changed since; `None` where git does not know.
fn commit(root: &Path) -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(root).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"])?;
    Some(if changed.is_empty() { commit } else { commit + " with changes" })
}

#[cfg(test)]
mod tests {
    use gluey_verify::Number;

    use super::*;

    fn judged(value: Option<f64>, outcome: Outcome) -> Judged {
        let verdict = Some((gluey_verify::Wanted::AtMost(1.0), outcome));
        Judged { what: "speed".into(), method: "soft".into(), value, verdict, reason: String::new() }
    }

    fn book(judged: Vec<Judged>, failures: Vec<Failure>) -> Book {
        let chapters =
            vec![Chapter { case: &CASES[0], judged, proposals: vec![], drawing: Canvas::new(1.0, 1.0) }];
        Book { quick: true, commit: Some("0123456789ab".into()), wall_s: 1.0, chapters, failures }
    }

    #[test]
    fn a_miss_a_missing_number_and_a_failed_computation_each_fail_the_book() {
        let good = || judged(Some(0.5), Outcome::Yes);
        assert!(book(vec![good()], vec![]).holds());
        assert!(!book(vec![good(), judged(Some(2.0), Outcome::No)], vec![]).holds());
        assert!(!book(vec![judged(None, Outcome::NotMeasured)], vec![]).holds());
        let failure = Failure { what: "disc".into(), error: "broke".into() };
        assert!(!book(vec![good()], vec![failure]).holds());
    }

    #[test]
    fn page_and_table_show_number_limit_verdict_and_commit() {
        let book = book(vec![judged(Some(2.0), Outcome::No)], vec![]);
        let page = page::html(&book);
        for part in ["0123456789ab", "speed", "2.000", "at most 1", "not within"] {
            assert!(page.contains(part), "{part}");
        }
        assert!(page::csv(&book).ends_with("manufactured;speed;soft;2;at most 1;no;\n"));
        assert!(book.account().contains("error: manufactured, speed"));
    }

    #[test]
    fn unknown_cases_are_refused() {
        assert!(matches!(chosen(&["disk".to_owned()]), Err(BookError::NoCase(_))));
        assert_eq!(chosen(&[]).unwrap().len(), CASES.len());
    }

    /// One case from its computations to its page, and the same with a sign reversed.
    #[test]
    fn a_case_holds_and_its_mirror_image_does_not() {
        let case = CASES.iter().find(|case| case.name == "integrator").unwrap();
        let mut failures = Vec::new();
        let tables = compute(&[case], Extent::Quick, &mut failures);
        let numbers = (case.numbers)(&tables);
        let limits = gluey_verify::limits().unwrap();
        let fails = |numbers: &[Number]| {
            let judged = gluey_verify::judge(case.name, numbers, &limits, Extent::Quick);
            judged.iter().any(Judged::is_failure)
        };
        assert!(failures.is_empty() && !numbers.is_empty() && !fails(&numbers));
        let mirrored =
            |number: &gluey_verify::Number| gluey_verify::Number { value: -number.value, ..number.clone() };
        assert!(fails(&numbers.iter().map(mirrored).collect::<Vec<_>>()));
    }
}
