//! Rows under the figures: what is claimed, the number that decides it, and whether it is so.

use gluey_verify::{Judgement, Wanted};
use serde::{Deserialize, Serialize};

use super::plan::{FigureName, RunKey};

/// The kind of a row: why it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimKind {
    /// A statement of the paper: reproduced or not.
    Paper,
    /// A comparison with an exact solution.
    Exact,
    /// Holds by construction of the contact model, for any flow: no evidence, but a defect if it does not
    /// hold.
    Guarantee,
}

/// A statement and the interval of its number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Claim {
    /// Names the row for good, such as `fig9-third-joins`.
    pub id: String,
    /// The figure under which it is shown.
    pub figure: FigureName,
    /// Why it is there.
    pub kind: ClaimKind,
    /// The statement.
    pub statement: String,
    /// The run or runs it is about.
    pub run: String,
    /// The measure.
    pub measure: String,
    /// The run that is measured, where `run` does not begin with its name.
    #[serde(skip_serializing)]
    own: Option<String>,
    /// Its wanted interval.
    #[serde(flatten, skip_serializing)]
    wanted: Wanted,
    /// The wanted interval with `--quick`, where that is another one.
    #[serde(skip_serializing)]
    quick: Option<Wanted>,
    /// It needs the full computation: runs of `--quick` end earlier and take larger steps.
    #[serde(default, skip_serializing)]
    pub full_only: bool,
    /// That it does not hold, if this is known.
    #[serde(skip_serializing)]
    known: Option<Missed>,
    /// The same with `--quick`.
    #[serde(skip_serializing)]
    known_quick: Option<Missed>,
}

/// A reason for which a row does not hold, and where its number lies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missed {
    /// The reason.
    pub why: String,
    /// Smallest and largest number that is known: another one is something new.
    pub between: (f64, f64),
}

impl Claim {
    /// The run that is measured.
    pub fn own_run(&self) -> Option<RunKey> {
        let name = self.own.as_deref().or_else(|| self.run.split(' ').next())?;
        RunKey::all().find(|key| key.name() == name)
    }

    /// The row that it becomes with its number.
    pub fn judge(&'static self, value: Option<f64>, quick: bool) -> JudgedClaim {
        let value = value.filter(|value| value.is_finite());
        let wanted = self.quick.filter(|_| quick).unwrap_or(self.wanted);
        let known = if quick { &self.known_quick } else { &self.known };
        JudgedClaim {
            claim: self,
            value,
            wanted: wanted.to_string(),
            outcome: wanted.outcome(value),
            known: known.as_ref(),
        }
    }
}

/// A judged row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedClaim {
    /// What is claimed.
    #[serde(flatten)]
    pub claim: &'static Claim,
    /// The number; `None` if it could not be measured.
    pub value: Option<f64>,
    /// Its wanted interval.
    pub wanted: String,
    /// Whether it is.
    pub outcome: Judgement,
    /// What is known of it, if it is a known disagreement.
    pub known: Option<&'static Missed>,
}

impl JudgedClaim {
    /// Why the reproduction fails because of this row; `None` if it does not.
    pub fn failure(&self) -> Option<String> {
        match (self.outcome, self.known) {
            (Judgement::NotMeasured, _) => Some("was not measured".to_owned()),
            (Judgement::No, None) => Some("does not hold and is no known disagreement".to_owned()),
            (Judgement::No, Some(Missed { between: (least, most), .. })) => {
                let value = self.value.filter(|value| !(*least..=*most).contains(value))?;
                Some(format!("is {value:.4e}, known to disagree by {least:e} to {most:e}"))
            }
            (Judgement::Yes, Some(_)) => Some("holds, and is listed as a known disagreement".to_owned()),
            (Judgement::Yes, None) => None,
        }
    }

    /// Whether the reproduction fails because of this row.
    pub fn is_failure(&self) -> bool {
        self.failure().is_some()
    }

    /// For a known disagreement, the reason.
    pub fn reason(&self) -> Option<&'static str> {
        let known = self.known.filter(|_| self.outcome == Judgement::No && !self.is_failure());
        known.map(|known| known.why.as_str())
    }
}

/// How many rows of a kind hold, and how many there are.
pub fn count(rows: &[JudgedClaim], kind: ClaimKind) -> (usize, usize) {
    let own = rows.iter().filter(|row| row.claim.kind == kind);
    let held = own.clone().filter(|row| row.outcome == Judgement::Yes).count();
    (held, own.count())
}

#[cfg(test)]
mod tests {
    use super::super::rows::claims;
    use super::*;

    fn claim(wanted: Wanted, known: Option<Missed>) -> &'static Claim {
        let text = |text: &str| text.to_owned();
        Box::leak(Box::new(Claim {
            id: text("fig5-test"),
            figure: FigureName::Fig5,
            kind: ClaimKind::Paper,
            statement: text("It is so."),
            run: text("pair-2d-none"),
            measure: text("a number"),
            own: None,
            wanted,
            quick: None,
            full_only: false,
            known,
            known_quick: None,
        }))
    }

    fn outcome(value: Option<f64>, wanted: Wanted) -> Judgement {
        claim(wanted, None).judge(value, false).outcome
    }

    #[test]
    fn limits_are_inclusive_and_what_is_not_a_number_is_not_measured() {
        assert_eq!(outcome(Some(1.0), Wanted::AtMost(1.0)), Judgement::Yes);
        assert_eq!(outcome(Some(1.1), Wanted::AtMost(1.0)), Judgement::No);
        assert_eq!(outcome(Some(0.9), Wanted::AtLeast(1.0)), Judgement::No);
        assert_eq!(outcome(Some(0.5), Wanted::Between(0.0, 0.4)), Judgement::No);
        for value in [None, Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(outcome(value, Wanted::AtMost(1.0)), Judgement::NotMeasured);
        }
    }

    #[test]
    fn what_is_not_measured_or_unexpectedly_wrong_is_a_failure() {
        let judged = |value| claim(Wanted::AtMost(1.0), None).judge(value, false);
        assert!(judged(None).is_failure());
        assert!(judged(Some(2.0)).is_failure());
        assert!(!judged(Some(0.0)).is_failure());
    }

    #[test]
    fn known_disagreements_are_no_failures_but_stay_counted_as_no() {
        let listed = claims().iter().find_map(|claim| claim.known.clone()).expect("there are some");
        let (least, most) = listed.between;
        let claim = claim(Wanted::AtMost(0.5 * least), Some(listed));
        let judged = |value| claim.judge(value, false);
        let row = judged(Some(0.5 * (least + most)));
        assert!(row.reason().is_some() && !row.is_failure());
        assert_eq!(count(&[row], ClaimKind::Paper), (0, 1));
        assert!(judged(None).is_failure());
        // Another number than the known one, and one that is as the paper says.
        for value in [1.01 * most, 0.99 * least, 0.0] {
            let row = judged(Some(value));
            assert!(row.is_failure() && row.reason().is_none(), "{value}: {row:?}");
        }
        assert!(judged(Some(0.0)).failure().is_some_and(|text| text.starts_with("holds")));
    }
}
