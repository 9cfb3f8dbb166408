//! The verification book: chapters with their numbers, and what they come to.

use gluey_pictures::Canvas;
use gluey_verify::{Judged, Judgement, VerificationCase};

use crate::book::BookFailure;

/// A case with its results.
pub struct Chapter {
    /// The case.
    pub case: &'static VerificationCase,
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
    pub failures: Vec<BookFailure>,
}

impl Book {
    /// Whether everything was computed and every number is within its limit.
    pub fn holds(&self) -> bool {
        self.failures.is_empty() && !self.judged().any(|(_, judged)| judged.is_failure())
    }

    /// All numbers, each with its case.
    pub fn judged(&self) -> impl Iterator<Item = (&'static VerificationCase, &Judged)> {
        self.chapters.iter().flat_map(|chapter| chapter.judged.iter().map(|judged| (chapter.case, judged)))
    }

    /// How many numbers have a limit, how many of them are within it, and how many have none.
    pub fn counts(&self) -> (usize, usize, usize) {
        let outcomes: Vec<_> =
            self.judged().map(|(_, judged)| judged.verdict.map(|(_, outcome)| outcome)).collect();
        let count =
            |wanted: &dyn Fn(&Option<Judgement>) -> bool| outcomes.iter().filter(|o| wanted(o)).count();
        (count(&|o| o.is_some()), count(&|o| *o == Some(Judgement::Yes)), count(&|o| o.is_none()))
    }

    /// What the terminal is told: all that fails, then the counts.
    pub fn account(&self) -> String {
        let failures =
            self.failures.iter().map(|failure| format!("error: {}: {}", failure.what, failure.error));
        let missed = self.judged().filter(|(_, judged)| judged.is_failure());
        let missed = missed.map(|(case, judged)| format!("error: {}, {}", case.name, sentence(judged)));
        let (limits, held, free) = self.counts();
        let counts = format!("of {limits} numbers with a limit {held} are within it; {free} have none");
        failures.chain(missed).chain([counts]).collect::<Vec<_>>().join("\n")
    }
}

/// A number with its limit, in words.
pub fn sentence(judged: &Judged) -> String {
    let value = judged.value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.4e}"));
    let wanted = judged.verdict.map_or_else(String::new, |(wanted, _)| format!(" ({wanted})"));
    format!("{}, {}: {value}{wanted}", judged.what, judged.method)
}
