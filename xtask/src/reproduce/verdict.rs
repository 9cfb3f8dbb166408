//! Rows under the figures: what is claimed, the number that decides it, and whether it is so.

use gluey_verify::{Outcome, Wanted};
use serde::Serialize;

use super::known::{self, Missed, Mode};
use super::plan::FigureName;

/// Why a row is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A statement of the paper: reproduced or not.
    Paper,
    /// A comparison with an exact solution.
    Exact,
    /// Holds by construction of the contact model, for any flow: no evidence, but a defect if it does not
    /// hold.
    Guarantee,
}

/// A statement with the number that decides it, before it is judged.
#[derive(Clone, Debug)]
pub struct Claim {
    /// Names the row for good, such as `fig9-third-joins`.
    pub id: &'static str,
    /// Why it is there.
    pub kind: Kind,
    /// The statement.
    pub statement: &'static str,
    /// The run or runs it is about.
    pub run: &'static str,
    /// The measure.
    pub measure: &'static str,
    /// The number; `None` if it could not be measured.
    pub value: Option<f64>,
    /// Its wanted interval.
    pub wanted: Wanted,
    /// It needs the full computation: runs of `--quick` end earlier and take larger steps.
    pub full_only: bool,
}

impl Claim {
    /// The same, but left out of `--quick`.
    pub fn full_only(self) -> Self {
        Self { full_only: true, ..self }
    }

    /// The row that stands under `figure`.
    pub fn judge(self, figure: FigureName, mode: Mode) -> Row {
        let value = self.value.filter(|value| value.is_finite());
        let outcome = self.wanted.outcome(value);
        Row {
            id: self.id,
            figure,
            kind: self.kind,
            statement: self.statement,
            run: self.run,
            measure: self.measure,
            value,
            wanted: self.wanted.to_string(),
            outcome,
            known: known::missed(self.id, mode),
        }
    }
}

/// One judged row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Names the row for good.
    pub id: &'static str,
    /// The figure under which it is shown.
    pub figure: FigureName,
    /// Why it is there.
    pub kind: Kind,
    /// The statement.
    pub statement: &'static str,
    /// The run or runs it is about.
    pub run: &'static str,
    /// The measure.
    pub measure: &'static str,
    /// The number; `None` if it could not be measured.
    pub value: Option<f64>,
    /// Its wanted interval.
    pub wanted: String,
    /// Whether it is.
    pub outcome: Outcome,
    /// What is known of it, if it is a known disagreement.
    pub known: Option<Missed>,
}

impl Row {
    /// Why the reproduction fails because of this row; `None` if it does not.
    pub fn failure(&self) -> Option<String> {
        match (self.outcome, self.known) {
            (Outcome::NotMeasured, _) => Some("was not measured".to_owned()),
            (Outcome::No, None) => Some("does not hold and is no known disagreement".to_owned()),
            (Outcome::No, Some(known)) if !known.has(self.value) => {
                let (least, most) = known.between;
                let value = self.value.unwrap_or(f64::NAN);
                Some(format!("is {value:.4e}, known to disagree by {least:e} to {most:e}"))
            }
            (Outcome::Yes, Some(_)) => Some("holds, and is listed as a known disagreement".to_owned()),
            (Outcome::Yes, None) | (Outcome::No, Some(_)) => None,
        }
    }

    /// Whether the reproduction fails because of this row.
    pub fn is_failure(&self) -> bool {
        self.failure().is_some()
    }

    /// For a known disagreement, the reason.
    pub fn reason(&self) -> Option<&'static str> {
        self.known.filter(|_| self.outcome == Outcome::No && !self.is_failure()).map(|known| known.why)
    }
}

/// How many rows of a kind hold, and how many there are.
pub fn count(rows: &[Row], kind: Kind) -> (usize, usize) {
    let own = rows.iter().filter(|row| row.kind == kind);
    let held = own.clone().filter(|row| row.outcome == Outcome::Yes).count();
    (held, own.count())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(value: Option<f64>, wanted: Wanted) -> Claim {
        Claim {
            id: "fig5-test",
            kind: Kind::Paper,
            statement: "It is so.",
            run: "pair-2d-none",
            measure: "a number",
            value,
            wanted,
            full_only: false,
        }
    }

    fn outcome(value: Option<f64>, wanted: Wanted) -> Outcome {
        claim(value, wanted).judge(FigureName::Fig5, Mode::Full).outcome
    }

    #[test]
    fn limits_are_inclusive_and_what_is_not_a_number_is_not_measured() {
        assert_eq!(outcome(Some(1.0), Wanted::AtMost(1.0)), Outcome::Yes);
        assert_eq!(outcome(Some(1.1), Wanted::AtMost(1.0)), Outcome::No);
        assert_eq!(outcome(Some(0.9), Wanted::AtLeast(1.0)), Outcome::No);
        assert_eq!(outcome(Some(0.5), Wanted::Between(0.0, 0.4)), Outcome::No);
        for value in [None, Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(outcome(value, Wanted::AtMost(1.0)), Outcome::NotMeasured);
        }
    }

    #[test]
    fn what_is_not_measured_or_unexpectedly_wrong_is_a_failure() {
        let judged = |value| claim(value, Wanted::AtMost(1.0)).judge(FigureName::Fig5, Mode::Full);
        assert!(judged(None).is_failure());
        assert!(judged(Some(2.0)).is_failure());
        assert!(!judged(Some(0.0)).is_failure());
    }

    #[test]
    fn known_disagreements_are_no_failures_but_stay_counted_as_no() {
        let listed = known::KNOWN.iter().find(|known| known.full.is_some()).expect("there are some");
        let (least, most) = listed.full.expect("this one is").between;
        let of = |value| Claim { id: listed.id, ..claim(value, Wanted::AtMost(0.5 * least)) };
        let judged = |value| of(value).judge(FigureName::Fig5, Mode::Full);
        let row = judged(Some(0.5 * (least + most)));
        assert!(row.reason().is_some() && !row.is_failure());
        assert_eq!(count(&[row], Kind::Paper), (0, 1));
        assert!(judged(None).is_failure());
        // Another number than the known one, and one that is as the paper says.
        for value in [1.01 * most, 0.99 * least, 0.0] {
            let row = judged(Some(value));
            assert!(row.is_failure() && row.reason().is_none(), "{value}: {row:?}");
        }
        assert!(judged(Some(0.0)).failure().is_some_and(|text| text.starts_with("holds")));
    }
}
