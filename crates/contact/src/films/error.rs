//! Why films cannot be kept open.

use std::fmt;

/// The gaps after a step could not be found. A smaller step may have some.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// There is no room for a film.
    #[error(transparent)]
    Closed(#[from] FilmClosed),
    /// The impulses in films do not come to a balance.
    #[error(
        "the films do not come to a balance in {corrections} corrections: that between {ends} is farthest from it, its \
         gap of {gap:.3e} radii becomes {left:.3e} and should be {wanted:.3e}"
    )]
    NotBalanced {
        /// The film that is farthest off, relative to its gap.
        ends: FilmEnds,
        /// Gap before the step, in radii of the first particle.
        gap: f64,
        /// Gap after it, in these.
        left: f64,
        /// The gap that its impulse asks for, in these.
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
        matches!(self, Self::Closed(closed) if closed.is_given)
    }
}

/// A gap that could not be kept open; gaps in radii of the first particle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the film between {ends} would close: its gap of {gap:.3e} radii becomes {left:.3e} in a step{}", cure(*is_given))]
pub struct FilmClosed {
    /// What it is between.
    pub ends: FilmEnds,
    /// Gap before the step.
    pub gap: f64,
    /// Gap after it.
    pub left: f64,
    /// Whether both move as they are told.
    pub is_given: bool,
}

/// What a film is between, as messages say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmEnds {
    /// Index of the particle, from 0; messages count from 1.
    pub first: usize,
    /// Index of its partner; `None` for a wall.
    pub second: Option<usize>,
    /// Whether the partner is an image across a border of the box.
    pub is_image: bool,
}

impl fmt::Display for FilmEnds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = self.first + 1;
        match self.second.map(|second| second + 1) {
            None => write!(f, "particle {first} and a wall"),
            Some(second) if second == first => write!(f, "particle {first} and its own image"),
            Some(second) if self.is_image => write!(f, "particle {first} and an image of particle {second}"),
            Some(second) => write!(f, "particles {first} and {second}"),
        }
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
    use super::{FilmClosed, FilmEnds};

    #[test]
    fn messages_name_both_sides_as_users_count() {
        let told = |second, is_image| {
            let ends = FilmEnds { first: 0, second, is_image };
            FilmClosed { ends, gap: 1e-3, left: -0.1, is_given: false }.to_string()
        };
        assert_eq!(
            told(Some(2), false),
            "the film between particles 1 and 3 would close: its gap of 1.000e-3 radii becomes -1.000e-1 in a step"
        );
        assert!(told(Some(2), true).contains("between particle 1 and an image of particle 3 would"));
        assert!(told(Some(0), true).contains("between particle 1 and its own image would"));
        assert!(told(None, false).contains("between particle 1 and a wall would"));
    }
}
