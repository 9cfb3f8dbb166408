//! The flow that ranks share as [`Hydrodynamics`].

use std::rc::Rc;

use gluey_geom::{Dim, Space};
use gluey_motion::{Configuration, Fields, Film, FlowStatistics, Hydrodynamics, Prediction, ResumeError};
use gluey_parallel::Ranks;

use super::step_input::StepInput;
use super::suspension::{SharedSuspension, SuspensionError};
use crate::flow::LocalFlow;
use crate::memory::Memory;
use crate::orders::Order;

/// The flow of a suspension as a model of how its particles move.
pub struct SharedHydrodynamics<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    suspension: &'a SharedSuspension<D>,
    ranks: &'a Ranks,
    input: StepInput<D>,
    /// Whether others follow and are to be input of the end.
    leads: bool,
    /// Of the last prediction, if it succeeded.
    last: Option<LocalFlow<D>>,
    /// What the next flow starts from.
    memory: Rc<Memory<D>>,
}

impl<'a, const D: usize> SharedHydrodynamics<'a, D>
where
    Dim<D>: Space<D>,
{
    /// For ranks that all make the same predictions.
    pub fn beside(suspension: &'a SharedSuspension<D>, ranks: &'a Ranks) -> Self {
        let input = StepInput::new(&suspension.suspension);
        Self { suspension, ranks, input, leads: false, last: None, memory: Rc::default() }
    }

    /// For rank zero, while the others [`SharedSuspension::follow`].
    pub fn leading(suspension: &'a SharedSuspension<D>, ranks: &'a Ranks) -> Self {
        let mut new = Self::beside(suspension, ranks);
        new.leads = true;
        new
    }

    /// With flows in this memory.
    #[must_use]
    pub fn remembering(mut self, memory: Rc<Memory<D>>) -> Self {
        self.memory = memory;
        self
    }
}

impl<const D: usize> Drop for SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    fn drop(&mut self) {
        // A rank that panics ends the others anyhow.
        if std::thread::panicking() {
            return;
        }
        assert!(!self.memory.is_broken(), "what other ranks share was broken off");
        if self.leads {
            Order::End.share(self.ranks);
        }
    }
}

impl<const D: usize> Hydrodynamics<D> for SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    type Error = SuspensionError;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, SuspensionError> {
        let Self { suspension, ranks, input, memory, .. } = self;
        *input = StepInput::of(&suspension.suspension, configuration);
        memory.is_sharing.set(true);
        Order::Predict.share(ranks);
        input.share(ranks);
        self.last = None;
        let start = std::time::Instant::now();
        let found = suspension.solve_from(ranks, &input.configuration(), memory);
        memory.is_sharing.set(false);
        let (flow, prediction) = found?;
        let phases = vec![("shared flow", start.elapsed().as_secs_f64())];
        let statistics = FlowStatistics { phases, ..flow.flow.statistics(flow.raised_penalties) };
        self.last = Some(flow);
        Ok(Prediction { statistics, ..prediction })
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn films(&self, configuration: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        self.suspension.suspension.films(configuration, reach)
    }

    /// Nothing: what the next flow starts from is in pieces, which the [`Memory`] of each rank has until this
    /// is called again.
    fn checkpoint(&self) -> Result<Vec<u8>, SuspensionError> {
        if self.leads {
            Order::Remember.share(self.ranks);
        }
        self.memory.remember();
        Ok(Vec::new())
    }

    /// What one process starts from is no start for a flow in pieces, which begins at zero then.
    fn resume(&mut self, _: &[u8]) -> Result<(), ResumeError<SuspensionError>> {
        Ok(())
    }

    /// Those in the cells of this rank.
    fn fields(&self) -> Option<Fields<D>> {
        self.last.as_ref().map(|flow| self.suspension.fields(flow, &self.input))
    }
}
