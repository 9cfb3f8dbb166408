//! Why films cannot be kept open.

use crate::PairKey;

/// The gaps after a step could not be found. A smaller step may have some. Gaps are in radii of the first
/// particle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// There is no room for a film.
    #[error("the film between {pair} would close: its gap of {gap:.3e} radii becomes {left:.3e} in a step{}", cure(*is_given))]
    Closed {
        /// What it is between.
        pair: PairKey,
        /// Gap before the step.
        gap: f64,
        /// Gap after it.
        left: f64,
        /// Whether both move as they are told.
        is_given: bool,
    },
    /// The impulses in films do not come to a balance.
    #[error(
        "the films do not come to a balance in {corrections} corrections: that between {pair} is farthest from it, its \
         gap of {gap:.3e} radii becomes {left:.3e} and should be {wanted:.3e}"
    )]
    NotBalanced {
        /// What the film is between that is farthest off, relative to its gap.
        pair: PairKey,
        /// Gap before the step.
        gap: f64,
        /// Gap after it.
        left: f64,
        /// The gap that its impulse asks for.
        wanted: f64,
        /// Corrections made.
        corrections: usize,
    },
    /// Films push a particle so far that it may meet others, of which nothing is known.
    #[error("to keep films open, particle {} would be pushed by {pushed:.3} radii in a step", .particle + 1)]
    Pushed {
        /// Index of the particle, from 0; messages count from 1.
        particle: usize,
        /// By how much, in its radii.
        pushed: f64,
    },
}

impl FilmError {
    /// Whether a smaller step is no help: particles meet because they move as they are told.
    pub fn is_given(&self) -> bool {
        matches!(self, Self::Closed { is_given: true, .. })
    }
}

fn cure(is_given: bool) -> &'static str {
    match is_given {
        true => "; both move as the case tells them to: let them pass each other, or end before",
        false => "",
    }
}

#[cfg(test)]
mod tests {
    use super::FilmError;
    use crate::PairKey;

    #[test]
    fn messages_name_both_sides_as_users_count() {
        let told = |pair| FilmError::Closed { pair, gap: 1e-3, left: -0.1, is_given: false }.to_string();
        assert_eq!(
            told(PairKey::new(0, 2)),
            "the film between particles 1 and 3 would close: its gap of 1.000e-3 radii becomes -1.000e-1 in a step"
        );
        assert!(told(PairKey::across(0, 2, [0, 1, 0])).contains("1 and 3 (its image [0, 1, 0]) would"));
        assert!(told(PairKey::across(0, 0, [1, 0, 0])).contains("1 and 1 (its image [1, 0, 0]) would"));
        assert!(told(PairKey::wall(0, 1)).contains("between particle 1 and wall 2 would"));
    }
}
