//! How the iteration for the forces of contacts goes on from what pairs ask for.
//!
//! Anderson's acceleration of the steps takes 10 to 40 of them as a rule. Where a crowd jams, pairs stick and
//! slip in turn, and it may not end. Then steps that are short enough for neighbours that push back do end,
//! slowly: they are taken as they are, and accelerated now and then, as far as that helps.

use super::anderson::Anderson;
use super::params::FlowContactParams;

/// Steps that the acceleration remembers.
const WINDOW: usize = 10;
/// The acceleration begins anew where a residual is so many times the smallest so far.
const GROWTH: f64 = 10.0;
/// Short steps that are taken as they are.
const PLAIN: usize = 100;
/// Accelerated ones, after which the residual has to be half of what it was.
const FAST: usize = 25;

/// Length of the steps of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// Pairs yield as they would alone.
    Usual,
    /// Pairs are taken to yield 16 times more, and acceleration is checked.
    Careful,
}

impl Pace {
    /// How many times more than alone pairs are taken to yield.
    pub fn softness(self) -> f64 {
        if self == Self::Careful { 16.0 } else { 1.0 }
    }

    /// Steps at most.
    pub fn iteration_limit(self, params: &FlowContactParams) -> usize {
        params.iteration_limit * if self == Self::Careful { 20 } else { 1 }
    }
}

/// Course of an iteration.
pub(super) struct Course {
    pace: Pace,
    anderson: Anderson,
    /// The smallest residual so far, or of the last plain step.
    least: f64,
    /// Steps of this kind so far.
    count: usize,
    /// The forces that accelerated steps began with, while they go on.
    saved: Option<Vec<f64>>,
}

impl Course {
    /// The beginning.
    pub fn new(pace: Pace) -> Self {
        Self { pace, anderson: Anderson::new(WINDOW), least: f64::INFINITY, count: 0, saved: None }
    }

    /// Where to go on from `forces`, for which pairs ask for `asked`; `change` is the difference, weighted.
    pub fn next(&mut self, residual: f64, forces: &[f64], asked: Vec<f64>, change: Vec<f64>) -> Vec<f64> {
        if self.pace == Pace::Usual {
            if residual > GROWTH * self.least {
                self.anderson.restart();
                self.least = residual;
            }
            self.least = self.least.min(residual);
            return self.anderson.next(asked, change);
        }
        self.count += 1;
        let Some(saved) = &self.saved else {
            if self.count < PLAIN {
                return asked;
            }
            self.begin(residual, forces.to_vec());
            return self.anderson.next(asked, change);
        };
        if self.count < FAST {
            return self.anderson.next(asked, change);
        }
        if residual <= 0.5 * self.least {
            self.begin(residual, forces.to_vec());
            return self.anderson.next(asked, change);
        }
        let saved = saved.clone();
        (self.count, self.saved) = (0, None);
        saved
    }

    /// Begins accelerated steps.
    fn begin(&mut self, residual: f64, forces: Vec<f64>) {
        self.anderson.restart();
        (self.count, self.least, self.saved) = (0, residual, Some(forces));
    }
}
