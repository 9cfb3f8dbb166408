//! What is wrong with a case, gathered while it is checked.

use super::error::{CaseProblem, Key, KeyPart};

/// So many findings are kept; beyond, they are counted.
const KEPT: usize = 100;

/// A value that makes no sense, and its key.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Violation {
    pub key: Key,
    pub problem: CaseProblem,
}

/// Errors found in a case.
#[derive(Debug, Default)]
pub(super) struct CaseFindings {
    list: Vec<Violation>,
    /// Findings beyond those that are kept.
    more: usize,
}

impl CaseFindings {
    /// Notes that the value of `key` is wrong.
    pub fn add(&mut self, key: Key, problem: CaseProblem) {
        match self.list.len() < KEPT {
            true => self.list.push(Violation { key, problem }),
            false => self.more += 1,
        }
    }

    /// Notes that `found`, the value of `key`, is not in a range.
    pub fn out_of_range(&mut self, key: Key, found: f64, range: &str) {
        self.add(key, CaseProblem::OutOfRange { found, range: range.to_owned() });
    }

    /// Notes that `choice` needs something else than what the case has.
    pub fn unfit(
        &mut self,
        key: Key,
        choice: impl Into<String>,
        needs: impl Into<String>,
        found: impl Into<String>,
    ) {
        let (choice, needs, found) = (choice.into(), needs.into(), found.into());
        self.add(key, CaseProblem::Unfit { choice, needs, found });
    }

    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether nothing was found in the parts of the case with these names, nor in the case as a whole.
    /// Checks that need several parts ask this first: what follows from an error is not worth telling.
    pub fn are_good(&self, parts: &[&str]) -> bool {
        self.parts().all(|found| found.is_some_and(|found| !parts.contains(&found)))
    }

    /// The parts of the case that something was found in; `None` for the case as a whole.
    pub fn parts(&self) -> impl Iterator<Item = Option<&str>> {
        self.list.iter().map(|violation| match violation.key.0.first() {
            Some(KeyPart::Name(name)) => Some(name.as_str()),
            _ => None,
        })
    }

    /// Whether there is a key that nothing reads beside the parts of the case: it may be meant for any of
    /// them.
    pub fn have_unknown_part(&self) -> bool {
        let is_one = |violation: &Violation| {
            violation.key.0.len() == 1 && matches!(violation.problem, CaseProblem::UnknownKey { .. })
        };
        self.list.iter().any(is_one)
    }

    /// All that was found and kept, and how many more there are.
    pub fn into_parts(self) -> (Vec<Violation>, usize) {
        (self.list, self.more)
    }
}
