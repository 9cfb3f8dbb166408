//! One failure of ranks that failed together.

use super::PartFailure;
use crate::ContactError;

impl PartFailure {
    /// The error that this rank has for the others.
    pub fn here(&self) -> Option<&ContactError> {
        match self {
            Self::Here(error) => Some(error),
            Self::Elsewhere { .. } => None,
        }
    }

    /// The error of ranks that failed together, from what each [has](PartFailure::here) for the others:
    /// contacts that are infeasible are those of all, another error is that of the first.
    pub fn of_all(self, told: impl IntoIterator<Item = Option<ContactError>>) -> ContactError {
        let mut errors = told.into_iter().flatten();
        let mut first = errors.next().unwrap_or(match self {
            Self::Here(error) => error,
            Self::Elsewhere { message } => ContactError::Elsewhere { message },
        });
        if let ContactError::Infeasible { pairs } = &mut first {
            for error in errors {
                if let ContactError::Infeasible { pairs: more } = error {
                    pairs.extend(more);
                }
            }
            pairs.sort_unstable();
            pairs.dedup();
        }
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PairKey;

    #[test]
    fn ranks_that_failed_together_have_one_error() {
        let pairs = [PairKey::across(7, 3, [1, -2, 0]), PairKey::new(0, 1), PairKey::wall(4, 1)];
        let infeasible = |pairs: &[PairKey]| ContactError::Infeasible { pairs: pairs.to_vec() };
        let given = ContactError::Given { pair: pairs[2], gap: -0.25 };
        let elsewhere = || PartFailure::Elsewhere { message: "no memory".to_owned() };
        let told = [None, Some(infeasible(&pairs[..2])), Some(given.clone()), Some(infeasible(&pairs[1..]))];
        let mut sorted = pairs;
        sorted.sort_unstable();
        assert_eq!(elsewhere().of_all(told), infeasible(&sorted), "all pairs, each once");
        assert_eq!(elsewhere().of_all([None, Some(given.clone())]), given, "the first that is known");
        assert_eq!(
            PartFailure::Here(given.clone()).of_all([None, None]),
            given,
            "its own where none is told"
        );
        let message = "no memory".to_owned();
        assert_eq!(elsewhere().of_all([None, None]), ContactError::Elsewhere { message });
    }
}
