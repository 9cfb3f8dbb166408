//! The limits of the book, `limits.csv`, and the numbers held against them.
//!
//! A line is `case; number; formulation; wanted; limit; from; reason`: wanted is `at least`, `at most` or
//! `within` (of zero), from is `quick` or `full`, the first extent that measures it. A line whose number is
//! not measured fails; a number without a line is shown and decides
//! nothing.

use crate::case::Extent;
use crate::number::{Number, NumberKind};
use crate::verdict::{Judgement, Wanted};

/// The limit of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Name of the case.
    pub case: String,
    /// The number, as in [`Number::what`].
    pub what: String,
    /// Name of the formulation.
    pub method: String,
    /// Its wanted interval.
    pub wanted: Wanted,
    /// The first extent that measures it.
    pub from: Extent,
    /// Why it is no better; empty where that needs no reason.
    pub reason: String,
}

/// A line of `limits.csv` cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("limits.csv, line {line}: {problem}")]
pub struct LimitError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong.
    pub problem: &'static str,
}

/// A number with what is said of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The number in words.
    pub what: String,
    /// Name of the formulation.
    pub method: String,
    /// The number; `None` if it is missing or not finite.
    pub value: Option<f64>,
    /// Its wanted interval and whether it lies there; `None` where there is no limit yet.
    pub verdict: Option<(Wanted, Judgement)>,
    /// Why the limit is no better.
    pub reason: String,
}

impl Judged {
    /// Whether the book fails because of it: it does not hold, or could not be measured.
    pub fn is_failure(&self) -> bool {
        match self.verdict {
            Some((_, outcome)) => outcome != Judgement::Yes,
            None => self.value.is_none(),
        }
    }
}

/// The limits of the repository.
///
/// # Errors
/// [`LimitError`] for the first line that cannot be read.
pub fn limits() -> Result<Vec<Limit>, LimitError> {
    parse(include_str!("../limits.csv"))
}

fn parse(text: &str) -> Result<Vec<Limit>, LimitError> {
    let says_something = |line: &(usize, &str)| !line.1.trim().is_empty() && !line.1.starts_with('#');
    let lines = text.lines().enumerate().filter(says_something);
    lines
        .map(|(index, line)| limit(line).map_err(|problem| LimitError { line: index + 1, problem }))
        .collect()
}

fn limit(line: &str) -> Result<Limit, &'static str> {
    let fields: Vec<&str> = line.splitn(7, ';').map(str::trim).collect();
    let [case, what, method, wanted, limit, from, reason] = fields[..] else {
        return Err("there are not seven fields");
    };
    let limit: f64 = limit.parse().map_err(|_| "the limit is not a number")?;
    let wanted = match wanted {
        "at least" => Wanted::AtLeast(limit),
        "at most" => Wanted::AtMost(limit),
        "within" => Wanted::Between(-limit, limit),
        _ => return Err("what is wanted is none of `at least`, `at most`, `within`"),
    };
    let from = match from {
        "quick" => Extent::Quick,
        "full" => Extent::Full,
        _ => return Err("the extent is neither `quick` nor `full`"),
    };
    let [case, what, method, reason] = [case, what, method, reason].map(str::to_owned);
    Ok(Limit { case, what, method, wanted, from, reason })
}

/// The line that would limit a number to twice what it is, or to 0.9 of an order; `None` where nothing is
/// wanted of it. What is nothing but rounding may be as large as a hundred-billionth.
pub fn proposal(case: &str, number: &Number, from: Extent) -> Option<String> {
    let twice = round_up(2.0 * number.value.abs().max(0.5 * ROUNDING));
    let (wanted, limit) = match number.kind {
        NumberKind::Order => ("at least", (9.0 * number.value).floor() / 10.0),
        NumberKind::Error => ("within", twice),
        NumberKind::Size => ("at most", twice),
        NumberKind::Remark => return None,
    };
    let from = if from == Extent::Quick { "quick" } else { "full" };
    let Number { what, method, .. } = number;
    Some(format!("{case}; {what}; {method}; {wanted}; {limit:?}; {from};"))
}

/// Smallest limit of an error.
const ROUNDING: f64 = 1e-11;

/// The next number with two digits.
fn round_up(value: f64) -> f64 {
    let exponent = value.log10().floor() - 1.0;
    let digits = (value / 10f64.powf(exponent) - 1e-9).ceil();
    format!("{digits}e{exponent}").parse().unwrap_or(value)
}

/// Judges the numbers of a case: those measured, then those that should have been.
pub fn judge(case: &str, numbers: &[Number], limits: &[Limit], extent: Extent) -> Vec<Judged> {
    let limits: Vec<&Limit> = limits.iter().filter(|limit| limit.case == case).collect();
    let is_of = |limit: &Limit, number: &Number| limit.what == number.what && limit.method == number.method;
    let measured = numbers.iter().map(|number| {
        let limit = limits.iter().find(|limit| is_of(limit, number));
        let value = Some(number.value).filter(|value| value.is_finite());
        Judged {
            what: number.what.clone(),
            method: number.method.to_owned(),
            value,
            verdict: limit.map(|limit| (limit.wanted, limit.wanted.outcome(value))),
            reason: limit.map_or_else(String::new, |limit| limit.reason.clone()),
        }
    });
    let due = limits.iter().filter(|limit| limit.from <= extent);
    let missing =
        due.filter(|limit| !numbers.iter().any(|number| is_of(limit, number))).map(|limit| Judged {
            what: limit.what.clone(),
            method: limit.method.clone(),
            value: None,
            verdict: Some((limit.wanted, Judgement::NotMeasured)),
            reason: limit.reason.clone(),
        });
    measured.chain(missing).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINES: &str = "# a comment\ndisc; spin; soft; within; 0.1; quick; it is soft; and proud\n\
                         disc; speed; soft; at most; 2; full;\n";

    fn number(what: &str, value: f64) -> Number {
        Number::new(NumberKind::Error, what.to_owned(), "soft", value)
    }

    #[test]
    fn lines_are_read_and_wrong_ones_named() {
        let limits = parse(LINES).unwrap();
        assert_eq!(limits[0].wanted, Wanted::Between(-0.1, 0.1));
        assert_eq!((limits[0].reason.as_str(), limits[1].from), ("it is soft; and proud", Extent::Full));
        for line in [
            "a; b; c; at most; 1; quick",
            "a;b;c;at most;x;quick;",
            "a;b;c;above;1;quick;",
            "a;b;c;at most;1;;",
        ] {
            assert_eq!(parse(&format!("\n{line}")).unwrap_err().line, 2, "{line}");
        }
    }

    #[test]
    fn the_limits_of_the_repository_are_well_formed_and_each_is_there_once() {
        let limits = limits().unwrap();
        for (index, limit) in limits.iter().enumerate() {
            let name = |limit: &Limit| (limit.case.clone(), limit.what.clone(), limit.method.clone());
            assert!(limits[..index].iter().all(|other| name(other) != name(limit)), "{limit:?}");
            assert!(crate::CASES.iter().any(|case| case.name == limit.case), "{limit:?}");
        }
    }

    /// A number of the wrong sign, one beyond its limit and none at all are failures.
    #[test]
    fn what_is_wrong_or_missing_fails() {
        let limits = parse(LINES).unwrap();
        let fails = |numbers: &[Number], extent| {
            judge("disc", numbers, &limits, extent).iter().filter(|judged| judged.is_failure()).count()
        };
        assert_eq!(fails(&[number("spin", 0.09)], Extent::Quick), 0);
        assert_eq!(fails(&[number("spin", -0.11)], Extent::Quick), 1);
        assert_eq!(fails(&[number("spin", f64::NAN)], Extent::Quick), 1);
        assert_eq!(fails(&[], Extent::Quick), 1);
        assert_eq!(fails(&[number("spin", 0.0)], Extent::Full), 1, "the speed is due");
        assert_eq!(fails(&[number("spin", 0.0), number("speed", 2.5)], Extent::Full), 1);
    }

    #[test]
    fn a_proposal_is_a_line_that_lets_its_number_pass() {
        let kinds = [
            (NumberKind::Error, -0.0123, "within; 0.025"),
            (NumberKind::Size, 0.5, "at most; 1.0"),
            (NumberKind::Order, 2.97, "at least; 2.6"),
        ];
        for (kind, value, expected) in kinds {
            let number = Number::new(kind, "spin".to_owned(), "soft", value);
            let line = proposal("disc", &number, Extent::Quick).unwrap();
            assert_eq!(line, format!("disc; spin; soft; {expected}; quick;"));
            let limits = parse(&line).unwrap();
            assert!(!judge("disc", &[number], &limits, Extent::Quick)[0].is_failure());
        }
        let seconds = Number::new(NumberKind::Remark, "seconds".to_owned(), "soft", 1.0);
        assert_eq!(proposal("cost", &seconds, Extent::Full), None);
        let nothing = Number::new(NumberKind::Size, "turn".to_owned(), "soft", 0.0);
        assert_eq!(
            proposal("symmetry", &nothing, Extent::Full).unwrap(),
            "symmetry; turn; soft; at most; 1e-11; full;"
        );
    }

    #[test]
    fn a_number_without_a_limit_is_shown_but_must_be_one() {
        let judged = judge("disc", &[number("drift", 1.0)], &[], Extent::Quick);
        assert!(judged[0].verdict.is_none() && !judged[0].is_failure());
        assert!(judge("disc", &[number("drift", f64::NAN)], &[], Extent::Quick)[0].is_failure());
    }
}
