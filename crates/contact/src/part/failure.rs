//! Why a step failed on some rank, in numbers that travel to the one that says it.

use super::PartFailure;
use crate::solver::ResidualHistory;
use crate::{ContactError, PairKey, Partner};

/// Words of a pair.
pub const PAIR_WORDS: usize = 5;

/// A pair as numbers: its first particle, its partner, which image.
pub fn pair_words(pair: PairKey) -> [u64; PAIR_WORDS] {
    let (second, image) = match pair.second {
        Partner::Particle { index, image } => (u64::from(index), image),
        Partner::Wall(wall) => (WALL | u64::from(wall), [0; 3]),
    };
    let [i, j, k] = image.map(|count| u64::from(count.cast_unsigned()));
    [u64::from(pair.first), second, i, j, k]
}

/// The pair of such numbers.
pub fn pair_of(words: [u64; PAIR_WORDS]) -> PairKey {
    let [first, second, image @ ..] = words;
    let second = match second & WALL {
        0 => {
            Partner::Particle { index: second as u32, image: image.map(|count| (count as u32).cast_signed()) }
        }
        _ => Partner::Wall(second as u32),
    };
    PairKey { first: first as u32, second }
}

/// Marks walls among partners.
const WALL: u64 = 1 << 32;

const COINCIDENT: u64 = 0;
const INFEASIBLE: u64 = 1;
const GIVEN: u64 = 2;
const NOT_CONVERGED: u64 = 3;
const GAP_NOT_CLOSED: u64 = 4;

impl PartFailure {
    /// The failure as numbers; none if others know it.
    pub fn words(&self) -> Vec<u64> {
        let Self::Here(error) = self else { return Vec::new() };
        let named =
            |kind: u64, pair: &PairKey, rest: &[u64]| [&[kind], &pair_words(*pair)[..], rest].concat();
        match error {
            ContactError::Coincident { pair } => named(COINCIDENT, pair, &[]),
            ContactError::Given { pair, gap } => named(GIVEN, pair, &[gap.to_bits()]),
            ContactError::GapNotClosed { pair, gap, passes } => {
                named(GAP_NOT_CLOSED, pair, &[gap.to_bits(), *passes as u64])
            }
            ContactError::Infeasible { pairs } => {
                let pairs = pairs.iter().flat_map(|pair| pair_words(*pair));
                std::iter::once(INFEASIBLE).chain(pairs).collect()
            }
            ContactError::NotConverged { residual, tolerance, iterations, history, worst } => {
                let mut words = named(NOT_CONVERGED, worst, &[residual.to_bits(), tolerance.to_bits()]);
                words.push(*iterations as u64);
                words
                    .extend(history.entries.iter().flat_map(|(k, residual)| [*k as u64, residual.to_bits()]));
                words
            }
            // All others show where particles are sent, before there is anything to solve.
            _ => Vec::new(),
        }
    }

    /// The error of ranks that failed together, from the words of each: contacts that are infeasible are
    /// those of all, another error is that of the first. Where nobody has words for it, what is known of it
    /// here.
    pub fn of_all(self, failures: &[Vec<u64>]) -> ContactError {
        let mut errors = failures.iter().filter_map(|words| error_of(words));
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

/// The error of a rank.
fn error_of(words: &[u64]) -> Option<ContactError> {
    let (&kind, rest) = words.split_first()?;
    if kind == INFEASIBLE {
        let pairs = rest.as_chunks::<PAIR_WORDS>().0.iter().map(|words| pair_of(*words)).collect();
        return Some(ContactError::Infeasible { pairs });
    }
    let (pair, rest) = rest.split_first_chunk::<PAIR_WORDS>()?;
    let pair = pair_of(*pair);
    Some(match (kind, rest) {
        (COINCIDENT, []) => ContactError::Coincident { pair },
        (GIVEN, &[gap]) => ContactError::Given { pair, gap: f64::from_bits(gap) },
        (GAP_NOT_CLOSED, &[gap, passes]) => {
            ContactError::GapNotClosed { pair, gap: f64::from_bits(gap), passes: passes as usize }
        }
        (NOT_CONVERGED, [residual, tolerance, iterations, history @ ..]) => {
            let entry = |&[k, residual]: &[u64; 2]| (k as usize, f64::from_bits(residual));
            let entries = history.as_chunks().0.iter().map(entry).collect();
            ContactError::NotConverged {
                residual: f64::from_bits(*residual),
                tolerance: f64::from_bits(*tolerance),
                iterations: *iterations as usize,
                history: ResidualHistory { entries },
                worst: pair,
            }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_arrive_as_they_were_sent() {
        let pairs = [PairKey::across(7, 3, [1, -2, 0]), PairKey::new(0, 1), PairKey::wall(4, 1)];
        let [pair, worst, _] = pairs;
        let history = ResidualHistory { entries: vec![(1, 0.5), (2, 1e-3)] };
        let errors = [
            ContactError::Coincident { pair },
            ContactError::Given { pair: pairs[2], gap: -0.25 },
            ContactError::GapNotClosed { pair, gap: 1e-9, passes: 7 },
            ContactError::Infeasible { pairs: pairs.to_vec() },
            ContactError::NotConverged { residual: 1e-3, tolerance: 1e-13, iterations: 9, history, worst },
        ];
        for error in errors {
            let words = PartFailure::Here(error.clone()).words();
            let mut expected = error.clone();
            if let ContactError::Infeasible { pairs } = &mut expected {
                pairs.sort_unstable();
            }
            let others = [Vec::new(), words.clone(), Vec::new(), words];
            let here = PartFailure::Elsewhere { message: error.to_string() };
            assert_eq!(here.of_all(&others), expected);
        }
        let message = "no memory".to_owned();
        let elsewhere = PartFailure::Elsewhere { message: message.clone() };
        let unnamed = PartFailure::Here(ContactError::BadStep { velocity_weight: 0.0, dt: 0.0 });
        let all = [&elsewhere, &unnamed].map(PartFailure::words);
        assert_eq!(elsewhere.of_all(&all), ContactError::Elsewhere { message });
        assert!(matches!(unnamed.of_all(&all), ContactError::BadStep { .. }));
    }
}
