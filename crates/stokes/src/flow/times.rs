//! Where the time of a prediction went.

use std::time::Instant;

/// Seconds of wall time in the phases of a prediction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhaseTimes {
    /// Nodes, level sets and operator.
    pub assembly: f64,
    /// Preparation of the linear solver.
    pub preparation: f64,
    /// Solves, with their right-hand sides and the twists.
    pub solve: f64,
}

impl std::ops::Add for PhaseTimes {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            assembly: self.assembly + other.assembly,
            preparation: self.preparation + other.preparation,
            solve: self.solve + other.solve,
        }
    }
}

/// Moments at which phases of a prediction ended.
#[derive(Clone, Copy)]
pub struct Watch {
    pub start: Instant,
    pub assembled: Instant,
    pub prepared: Instant,
}

impl Watch {
    /// The phases until now.
    pub fn times(self) -> PhaseTimes {
        PhaseTimes {
            assembly: (self.assembled - self.start).as_secs_f64(),
            preparation: (self.prepared - self.assembled).as_secs_f64(),
            solve: self.prepared.elapsed().as_secs_f64(),
        }
    }
}
