//! What is counted over a run, so that nothing that was helped over goes unseen.

use std::fmt;

use gluey_contact::FilmReport;
use gluey_motion::FlowStatistics;
use serde::{Deserialize, Serialize};

/// Films that move no particle by more than this, in its radii, are nothing to be told of at the end of a
/// run.
const SMALL_PUSH: f64 = 0.01;

/// The motion of the particles in a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepMotion {
    /// Parts in which the step was done; 0 before it was.
    pub parts: usize,
    /// The shortest of them, as a share of the step.
    pub shortest: f64,
    /// Why the step was halved, where it was: what was found at the shortest length that could not be done.
    pub refused: Option<String>,
    /// The largest error of the time scheme in the parts that led to the velocities of this step, as
    /// estimated: in radii, in root mean square over the particles. 0 in the first step and after a reversal.
    pub error: f64,
    /// Whether that is more than the tolerance, where there is one.
    pub is_inaccurate: bool,
}

/// Steps that were halved, films that closed, penalties that were changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Tally {
    /// Steps that were done in parts, because films could not be kept open in the whole, or no forces of
    /// contacts were found.
    pub halved_steps: usize,
    /// The shortest part, as a share of a step; 1 where none was halved, 0 before any.
    pub shortest_part: f64,
    /// Largest error of the time scheme in a part of a step, as estimated, in radii.
    pub step_error: f64,
    /// Steps in which that was more than the tolerance, where there is one.
    pub inaccurate_steps: usize,
    /// Most films that were closed at once: their gaps of 0.5e-9 to 1e-9 radii are a floor and no
    /// measurement.
    pub closed_films: usize,
    /// Rows with closed films.
    pub rows_with_closed_films: usize,
    /// How far films moved a particle in a step from where the flow alone would have taken it, at most, in
    /// its radii.
    pub film_push: f64,
    /// How often the penalties of all cells at surfaces were doubled.
    pub penalties_doubled: usize,
    /// Cells at surfaces whose penalties were raised, step by step.
    pub cells_raised: usize,
    /// Flows that were solved again for that.
    pub flows_solved_again: usize,
}

impl Tally {
    /// Adds a step.
    pub(crate) fn add(&mut self, motion: &StepMotion, films: &FilmReport, flow: &FlowStatistics) {
        self.halved_steps += usize::from(motion.refused.is_some() && motion.parts > 1);
        self.step_error = self.step_error.max(motion.error);
        self.inaccurate_steps += usize::from(motion.is_inaccurate);
        if motion.parts > 0 {
            let before = if self.shortest_part > 0.0 { self.shortest_part } else { 1.0 };
            self.shortest_part = before.min(motion.shortest);
        }
        self.closed_films = self.closed_films.max(films.closed_count);
        self.rows_with_closed_films += usize::from(films.closed_count > 0);
        self.film_push = self.film_push.max(films.largest_push);
        self.penalties_doubled += flow.penalties_doubled;
        self.cells_raised += flow.cells_raised;
        self.flows_solved_again += flow.solved_again;
    }

    /// Whether any penalty was changed.
    pub(crate) fn has_changed_penalties(&self) -> bool {
        self.penalties_doubled + self.cells_raised > 0
    }
}

/// A line for each that there was.
impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { halved_steps, closed_films, rows_with_closed_films, film_push, .. } = self;
        let Self { inaccurate_steps, step_error, .. } = self;
        if *halved_steps > 0 {
            writeln!(
                f,
                "  steps done in parts: {halved_steps}, the shortest part 1/{} of a step",
                self.shortest_part.recip()
            )?;
        }
        if *inaccurate_steps > 0 {
            writeln!(
                f,
                "  steps less accurate than time.tolerance: {inaccurate_steps}, their error {step_error:.1e} radii at most"
            )?;
        }
        if *closed_films > 0 {
            writeln!(
                f,
                "  closed films: {closed_films} at most, in {rows_with_closed_films} rows; their gaps are a floor"
            )?;
        }
        if *film_push > SMALL_PUSH {
            writeln!(f, "  farthest that films moved a particle in a step: {film_push:.2e} radii")?;
        }
        if self.has_changed_penalties() {
            let Self { penalties_doubled, cells_raised, flows_solved_again, .. } = self;
            writeln!(
                f,
                "  penalties: doubled {penalties_doubled} times, raised in {cells_raised} cells; \
                 {flows_solved_again} flows solved again"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happened_is_told_and_no_more() {
        let mut tally = Tally::default();
        let whole = StepMotion { parts: 1, shortest: 1.0, ..StepMotion::default() };
        tally.add(&whole, &FilmReport::default(), &FlowStatistics::default());
        assert_eq!((tally.shortest_part, tally.to_string().as_str()), (1.0, ""));
        let halved = StepMotion {
            parts: 3,
            shortest: 0.25,
            refused: Some("films".to_owned()),
            error: 2e-3,
            is_inaccurate: true,
        };
        let films = FilmReport { closed_count: 2, largest_push: 0.5 };
        let flow = FlowStatistics { cells_raised: 4, solved_again: 1, ..FlowStatistics::default() };
        tally.add(&halved, &films, &flow);
        let told = tally.to_string();
        assert!(told.contains("in parts: 1, the shortest part 1/4") && told.contains("2 at most, in 1 rows"));
        assert!(told.contains("time.tolerance: 1, their error 2.0e-3"), "{told}");
        assert!(told.contains("5.00e-1 radii") && told.contains("in 4 cells; 1 flows"), "{told}");
    }
}
