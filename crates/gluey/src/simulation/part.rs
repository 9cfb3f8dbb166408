//! Steps that are halved, and their halves again, until particles can be moved.

/// A step is halved so often at most, whatever is asked for.
const MOST_HALVINGS: u32 = 20;

/// A part of a step, in units of the shortest one. Parts are halves of halves, so that no step ends elsewhere
/// than it would have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    start: u32,
    length: u32,
}

impl Part {
    /// All of a step.
    pub const WHOLE: Self = Self { start: 0, length: 1 << MOST_HALVINGS };

    /// Whether it begins where the step does.
    pub fn is_first(self) -> bool {
        self.start == 0
    }

    /// Where it begins, as a share of the step.
    pub fn start(self) -> f64 {
        f64::from(self.start) / f64::from(Self::WHOLE.length)
    }

    /// Its length, as a share of the step.
    pub fn share(self) -> f64 {
        f64::from(self.length) / f64::from(Self::WHOLE.length)
    }

    /// Its first half, unless that has been halved more often than `most`.
    pub fn halved(self, most: u32) -> Option<Self> {
        let shortest = Self::WHOLE.length >> most.min(MOST_HALVINGS);
        (self.length > shortest).then_some(Self { length: self.length / 2, ..self })
    }

    /// The longest one that may come after it; `None` at the end of the step.
    pub fn next(self) -> Option<Self> {
        let start = self.start + self.length;
        (start < Self::WHOLE.length).then(|| Self { start, length: 1 << start.trailing_zeros() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_halves_of_halves_and_fill_the_step() {
        let quarter = Part::WHOLE.halved(2).and_then(|half| half.halved(2)).expect("two halvings");
        assert_eq!(quarter.halved(2), None);
        let mut parts = vec![(quarter.start(), quarter.share())];
        let mut last = quarter;
        while let Some(part) = last.next() {
            parts.push((part.start(), part.share()));
            last = part;
        }
        assert_eq!(parts, [(0.0, 0.25), (0.25, 0.25), (0.5, 0.5)]);
        assert_eq!((Part::WHOLE.next(), Part::WHOLE.halved(0)), (None, None));
    }
}
