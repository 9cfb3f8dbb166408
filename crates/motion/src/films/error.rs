//! Why films cannot be kept open.

/// The gaps after a step could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// There is no room for a film.
    #[error(transparent)]
    Closed(#[from] FilmClosed),
    /// The impulses in films do not come to a balance.
    #[error(
        "the impulses in films do not balance: gaps are off by {}, relative to themselves; take smaller steps",
        listed(.history)
    )]
    NotBalanced {
        /// How far the gap was off that was farthest, over itself, before each correction.
        history: Vec<f64>,
    },
}

/// The last of a history, with what was before.
fn listed(history: &[f64]) -> String {
    const MOST: usize = 20;
    let last = &history[history.len().saturating_sub(MOST)..];
    let numbers: Vec<String> = last.iter().map(|x| format!("{x:.1e}")).collect();
    let before = if history.len() > MOST { "..., " } else { "" };
    format!("{before}{}", numbers.join(", "))
}

/// A gap that could not be kept open.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the film between {} would close: its gap of {gap} becomes {left} in a step; {}", names(*first, *second), cure(*is_given))]
pub struct FilmClosed {
    /// Index of the particle, from 0; messages count from 1.
    pub first: usize,
    /// Index of its partner; `None` for a wall.
    pub second: Option<usize>,
    /// Gap before the step.
    pub gap: f64,
    /// Gap after it.
    pub left: f64,
    /// Whether both move as they are told.
    pub is_given: bool,
}

fn names(first: usize, second: Option<usize>) -> String {
    match second {
        Some(second) => format!("particles {} and {}", first + 1, second + 1),
        None => format!("particle {} and a wall", first + 1),
    }
}

fn cure(is_given: bool) -> &'static str {
    match is_given {
        true => "both move as the case tells them to: let them pass each other, or end before",
        false => "take smaller steps",
    }
}

#[cfg(test)]
mod tests {
    use super::FilmError;

    #[test]
    fn of_a_long_history_the_end_is_told() {
        let history: Vec<f64> = (1..=25).map(f64::from).collect();
        let told = FilmError::NotBalanced { history }.to_string();
        assert!(told.contains("off by ..., 6.0e0, 7.0e0") && told.contains("2.5e1, relative"), "{told}");
    }
}
