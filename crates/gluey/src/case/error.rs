//! Errors in a case, with the numbers needed to fix them.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use thiserror::Error;

use super::VERSION;
pub use super::key::{Key, KeyPart};
use super::mesh::FINEST_LEVEL;
use super::names::UnknownName;
use super::particle_problem::ParticleProblem;
use super::suggest::former;
use crate::number_text::{shown, shown_to};
use crate::text::{named, visible};

/// A case could not be used.
#[derive(Debug, Error)]
pub enum CaseError {
    /// The file could not be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Something in the case is wrong.
    #[error(transparent)]
    Invalid(Box<InvalidCase>),
}

/// A case with all that is wrong in it. Displays as one line for each issue.
#[derive(Clone, Debug, PartialEq)]
pub struct InvalidCase {
    /// The file; the name of a case that was not read from one.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// What is wrong, in the order of the text.
    pub issues: Vec<CaseIssue>,
    /// Number of issues beyond these.
    pub more: usize,
}

/// An error in a case, and where it is.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseIssue {
    /// Where it was written.
    pub place: IssuePlace,
    /// The key, e.g. `particles[1].radius`.
    pub key: Key,
    /// The value as written, when there is one.
    pub value: Option<String>,
    /// The error.
    pub problem: CaseProblem,
}

/// The place where something of a case was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IssuePlace {
    /// In the text of its file.
    Text {
        /// Line, from 1.
        line: usize,
        /// Column, from 1, in characters.
        column: usize,
        /// Bytes of the text to point at.
        span: Range<usize>,
    },
    /// In a file that lists particles.
    List {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
    },
    /// In an argument of the command line.
    Argument(String),
    /// Nowhere: a program made it.
    Value,
}

impl fmt::Display for InvalidCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, issue) in self.issues.iter().enumerate() {
            let file = self.file.display();
            if index > 0 {
                writeln!(f)?;
            }
            match &issue.place {
                IssuePlace::Text { line, column, .. } => write!(f, "{file}:{line}:{column}: {issue}")?,
                IssuePlace::List { file, line } => write!(f, "{}:{line}: {issue}", file.display())?,
                IssuePlace::Argument(argument) => write!(f, "{argument}: {issue}")?,
                IssuePlace::Value => write!(f, "{file}: {issue}")?,
            }
        }
        match self.more {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

impl std::error::Error for InvalidCase {}

impl fmt::Display for CaseIssue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.key.is_root() || self.is_of_list(), &self.value) {
            (true, Some(value)) => write!(f, "{value}: ")?,
            (true, None) => {}
            (false, Some(value)) => write!(f, "{} = {value}: ", self.key)?,
            (false, None) => write!(f, "{}: ", self.key)?,
        }
        write!(f, "{}", self.problem)
    }
}

impl CaseIssue {
    /// Whether the value is a row of a list, which says more than a key of the case.
    fn is_of_list(&self) -> bool {
        matches!(self.place, IssuePlace::List { .. })
    }
}

/// An error in a value of a case.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CaseProblem {
    /// Not TOML.
    #[error("not valid TOML: {message}")]
    Syntax {
        /// Message of the parser.
        message: String,
    },
    /// A character that one does not see, where none may be.
    #[error(
        "line {line} {} a character that is not seen, {}",
        if *.is_first { "begins with" } else { "has" },
        named(*character)
    )]
    Unseen {
        /// The line, from 1.
        line: usize,
        /// Whether the line begins with it.
        is_first: bool,
        /// The character.
        character: char,
    },
    /// A key that has no default is absent.
    #[error("missing key `{name}`")]
    MissingKey {
        /// The key.
        name: String,
        /// An example of a line that would be right.
        example: &'static str,
    },
    /// A key that nothing reads.
    #[error("unknown key `{}`", visible(name))]
    UnknownKey {
        /// The key as written.
        name: String,
        /// The nearest known key.
        suggestion: Option<String>,
        /// Tables that have this key, as a case file writes them: `[flow.mesh]`.
        elsewhere: Vec<String>,
        /// All keys known here.
        known: Vec<String>,
    },
    /// An entry of a list that is not there.
    #[error("there is no entry {index}")]
    NoEntry {
        /// Its index, from 0.
        index: usize,
        /// Entries there are.
        count: usize,
    },
    /// A value of another type.
    #[error("wrong type: found {found}")]
    WrongType {
        /// Type of the value.
        found: String,
        /// Type that would be right.
        expected: String,
    },
    /// A name that is none of the known ones.
    #[error("{0}")]
    UnknownName(UnknownName),
    /// A case file of another layout.
    #[error("layout {found} of case files is not known to this program, gluey {}", env!("CARGO_PKG_VERSION"))]
    Version {
        /// Its layout.
        found: i64,
    },
    /// Something the parser has no better word for.
    #[error("{message}")]
    Malformed {
        /// Message of the parser.
        message: String,
    },
    /// A whole number beyond 64 bits.
    #[error("too many digits for a whole number")]
    TooManyDigits,
    /// NaN or infinite.
    #[error("{} is not a finite number", shown(*found))]
    NotFinite {
        /// The value.
        found: f64,
    },
    /// A number outside its range.
    #[error("{} is out of range", shown(*found))]
    OutOfRange {
        /// The value.
        found: f64,
        /// The range, in words: `greater than 0`.
        range: String,
    },
    /// A vector with another number of coordinates than the dimension.
    #[error("{found} coordinates in {dimension}D")]
    CoordinateCount {
        /// Coordinates given.
        found: usize,
        /// Coordinates needed.
        dimension: usize,
    },
    /// A torque or a spin with another number of components than the dimension has rotations.
    #[error("{what} of {found} numbers in {dimension}D")]
    RotationCount {
        /// What it is.
        what: &'static str,
        /// Numbers given.
        found: usize,
        /// Numbers needed.
        needed: usize,
        /// Dimension of space.
        dimension: usize,
    },
    /// The upper corner is not above the lower one.
    #[error("the box is empty along {axis}: lower {}, upper {}", shown(*lower), shown(*upper))]
    EmptyBox {
        /// Name of the axis.
        axis: char,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// Edges whose ratios are not simple cannot be filled with cubes of one size.
    #[error("a box of edges {edges:?} is not a small number of cubes")]
    UnevenBox {
        /// Edge lengths.
        edges: Vec<f64>,
    },
    /// A particle wider than the box.
    #[error(
        "particle {particle} of diameter {} does not fit in a box of edge {} along {axis}",
        shown(*diameter),
        shown(*edge)
    )]
    TooBig {
        /// Its number, from 1.
        particle: usize,
        /// Its diameter.
        diameter: f64,
        /// The edge of the box it exceeds.
        edge: f64,
        /// Name of the axis.
        axis: char,
    },
    /// A particle that another one could touch on both sides of a periodic box at once.
    #[error(
        "particle {particle} of diameter {} is wider than half the period {} along {axis}",
        shown(*diameter),
        shown(*period)
    )]
    PeriodTooShort {
        /// Its number, from 1.
        particle: usize,
        /// Its diameter.
        diameter: f64,
        /// The period.
        period: f64,
        /// Name of the axis.
        axis: char,
    },
    /// A particle that sticks out of the box.
    #[error("particle {particle} sticks out of the box by {} along {axis}", shown(*excess))]
    OutsideBox {
        /// Its number, from 1.
        particle: usize,
        /// How far.
        excess: f64,
        /// Name of the axis.
        axis: char,
        /// The interval its centre may lie in along that axis.
        range: (f64, f64),
    },
    /// Two particles that overlap at the start.
    #[error("particles {first} and {second} overlap at the start: gap {}{}", shown(*gap), more(others))]
    Overlap {
        /// Number of the first particle, from 1.
        first: usize,
        /// Number of the second particle.
        second: usize,
        /// Their gap, negative.
        gap: f64,
        /// Distance of the centres.
        distance: f64,
        /// Sum of the radii.
        contact_distance: f64,
        /// Numbers of the other pairs that overlap.
        others: Vec<(usize, usize)>,
    },
    /// Particles could not be generated or read.
    #[error(transparent)]
    Particles(ParticleProblem),
    /// No particles at all.
    #[error("no particles")]
    NoParticles,
    /// A particle in which there is no room for a cell of the finest mesh.
    #[error("particle {particle}: radius {} is too small for the box", shown(*radius))]
    TooSmall {
        /// Its number, from 1.
        particle: usize,
        /// Its radius.
        radius: f64,
        /// The smallest radius that the mesh of this box can have.
        least: f64,
    },
    /// A mesh finer than the tree can number.
    #[error(
        "{} cells per radius of {} need level {level} of the tree",
        shown(*cells_per_radius),
        shown(*radius)
    )]
    MeshTooFine {
        /// Cells asked for.
        cells_per_radius: f64,
        /// The smallest radius.
        radius: f64,
        /// Level needed.
        level: f64,
        /// Finest level possible.
        finest: u32,
        /// The largest number of cells per radius at that level.
        largest: f64,
    },
    /// The coarsest cells would be finer than the finest.
    #[error("level {found} is finer than the finest cells, level {finest}")]
    CoarseTooFine {
        /// Level asked for.
        found: u32,
        /// Level of the finest cells.
        finest: u32,
    },
    /// More steps than can be counted or waited for.
    #[error("{} / {} are {steps:.3e} steps", shown(*end), shown(*step))]
    TooManySteps {
        /// End of the run.
        end: f64,
        /// Time step.
        step: f64,
        /// Number of steps.
        steps: f64,
    },
    /// A choice that does not go with the rest of the case.
    #[error("{choice} needs {needs}, but the case has {found}")]
    Unfit {
        /// The choice.
        choice: String,
        /// Its requirement.
        needs: String,
        /// The case's value in its place.
        found: String,
    },
    /// A name with characters that do not belong in a file name.
    #[error("not a name")]
    BadName,
}

impl CaseProblem {
    /// Hint at values that would be right.
    pub fn hint(&self) -> String {
        match self {
            Self::Syntax { message } => syntax_hint(message).into(),
            Self::Unseen { character, .. } if character.is_whitespace() => {
                "put a plain blank in its place".into()
            }
            Self::Unseen { .. } => "take it out".into(),
            Self::Malformed { .. } => "see docs/case-keys.md for what is right".into(),
            Self::TooManyDigits => {
                "a whole number has at most 18 digits; with a point or an exponent, 1e20, it may be larger"
                    .into()
            }
            Self::MissingKey { name, .. } if name == "particles" => {
                "list them under lines `[[particles]]`, or generate them by `[suspension]`, or name a \
                 `particles_file`"
                    .into()
            }
            Self::MissingKey { example, .. } => format!("add a line like `{example}`"),
            Self::UnknownKey { name, suggestion, elsewhere, known } => former(name)
                .map_or_else(|| unknown_key_hint(suggestion.as_deref(), elsewhere, known), str::to_owned),
            Self::Version { found } if *found > i64::from(VERSION) => {
                format!("it reads layout {VERSION}: take a newer gluey, or write the case in that layout")
            }
            Self::Version { .. } => format!("it reads layout {VERSION}: write `version = {VERSION}`"),
            Self::NoEntry { count: 0, .. } => {
                "the case has no such list; particles can be set one by one where the \
                                               case lists them"
                    .into()
            }
            Self::NoEntry { count, .. } => {
                format!("entries are counted from 0: there are 0 to {}", count - 1)
            }
            Self::WrongType { expected, .. } => format!("expected {expected}"),
            Self::UnknownName(name) => name.hint(),
            Self::NotFinite { .. } => "expected a finite number".into(),
            Self::OutOfRange { range, .. } => format!("expected a number {range}"),
            Self::Particles(problem) => problem.hint(),
            Self::NoParticles => {
                "list them under lines `[[particles]]`, each with `position` and `radius`".into()
            }
            Self::MeshTooFine { finest, largest, .. } => {
                format!("the tree has {finest} levels: at most {} cells per radius", shown(*largest))
            }
            Self::CoarseTooFine { finest, .. } => format!("expected a level between 0 and {finest}"),
            Self::TooManySteps { .. } => "at most 1e9 steps: take a longer step or an earlier end".into(),
            Self::Unfit { choice, needs, .. } => format!("take {needs}, or do without {choice}"),
            Self::BadName => "use letters, digits, `-` and `_`, at most 64 of them".into(),
            _ => self.hint_at_places(),
        }
    }

    /// Hint at right places of particles and sizes of boxes.
    fn hint_at_places(&self) -> String {
        match self {
            Self::CoordinateCount { dimension, .. } => format!("expected {dimension} coordinates"),
            Self::RotationCount { needed, .. } => format!("expected a list of length {needed}"),
            Self::EmptyBox { .. } => "every coordinate of `upper` must exceed that of `lower`".into(),
            Self::UnevenBox { .. } => format!(
                "the mesh is made of cubes: make the ratios of the edges simple, such as 3:2, and less than \
                 2^{FINEST_LEVEL}"
            ),
            Self::TooSmall { least, .. } => format!(
                "the mesh of this box is for radii of {} or more: take a smaller box or larger particles",
                shown_to(*least, 4)
            ),
            Self::TooBig { edge, .. } => format!("the radius must be less than {}", shown(0.5 * edge)),
            Self::PeriodTooShort { period, axis, .. } => {
                format!("the radius must be at most {}, or the box longer along {axis}", shown(0.25 * period))
            }
            Self::OutsideBox { axis, range, .. } => {
                format!("{axis} of the centre must lie between {} and {}", shown(range.0), shown(range.1))
            }
            Self::Overlap { distance, contact_distance, .. } => {
                let (distance, needed) = (shown(*distance), shown(*contact_distance));
                format!("the centres are {distance} apart, at least {needed} is needed")
            }
            _ => String::new(),
        }
    }
}

/// The first few of further pairs that overlap.
fn more(others: &[(usize, usize)]) -> String {
    const SHOWN: usize = 9;
    let shown = others.iter().take(SHOWN).map(|(first, second)| format!("{first} and {second}"));
    let list = shown.collect::<Vec<_>>().join(", ");
    match others.len() {
        0 => String::new(),
        count if count <= SHOWN => format!("; so do {list}"),
        count => format!("; so do {list} and {} more pairs", count - SHOWN),
    }
}

fn syntax_hint(message: &str) -> &'static str {
    match message.contains("duplicate key") {
        true => "every key and every line `[table]` stands once; only `[[particles]]` are repeated",
        false => "a case has lines like `key = 0.5` and `key = \"text\"` below lines like `[table]`",
    }
}

fn unknown_key_hint(suggestion: Option<&str>, elsewhere: &[String], known: &[String]) -> String {
    let known = known.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
    match (suggestion, elsewhere) {
        (Some(near), _) => format!("did you mean `{near}`? Keys known here: {known}"),
        (None, []) => format!("keys known here: {known}"),
        (None, tables) => format!("it is a key of {}; keys known here: {known}", tables.join(" and ")),
    }
}
