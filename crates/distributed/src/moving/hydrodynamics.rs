//! The flow that ranks share as [`Hydrodynamics`].

use std::rc::Rc;

use gluey_contact::TwistMobility;
use gluey_levelset::Ball;
use gluey_motion::{
    Configuration, Fields, Film, FlowStatistics, Hydrodynamics, NextLoads, Prediction, ResumeError,
};
use gluey_parallel::Ranks;

use super::suspension::{SharedSuspension, SuspensionError};
use crate::flow::LocalFlow;
use crate::memory::FlowMemory;

/// The flow of a suspension as a model of how its particles move. All ranks make the same predictions.
pub struct SharedHydrodynamics<'a, const D: usize> {
    suspension: &'a SharedSuspension<D>,
    ranks: &'a Ranks,
    /// Of the last prediction, if it succeeded.
    last: Option<PredictedFlow<D>>,
    /// What the next flow starts from.
    memory: Rc<FlowMemory<D>>,
}

/// A flow in the cells of a rank, around these bodies, and the factor of the shear that drives it.
struct PredictedFlow<const D: usize> {
    flow: LocalFlow<D>,
    balls: Vec<Ball<D>>,
    shear_factor: f64,
}

impl<'a, const D: usize> SharedHydrodynamics<'a, D> {
    /// By the flow of `suspension`.
    pub fn new(suspension: &'a SharedSuspension<D>, ranks: &'a Ranks) -> Self {
        Self { suspension, ranks, last: None, memory: Rc::default() }
    }

    /// With flows in this memory.
    #[must_use]
    pub fn remembering(self, memory: Rc<FlowMemory<D>>) -> Self {
        Self { memory, ..self }
    }
}

impl<const D: usize> Hydrodynamics<D> for SharedHydrodynamics<'_, D> {
    type Error = SuspensionError;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, SuspensionError> {
        self.predict_with_contacts(configuration, &mut |_| None)
    }

    fn predict_with_contacts(
        &mut self,
        configuration: &Configuration<'_, D>,
        next: &mut NextLoads<'_, D>,
    ) -> Result<Prediction<D>, SuspensionError> {
        // Its memory is free for the next.
        self.last = None;
        let start = std::time::Instant::now();
        let (flow, prediction) = self.suspension.solve_from(self.ranks, configuration, &self.memory, next)?;
        let phases = vec![("shared flow", start.elapsed().as_secs_f64())];
        let statistics = FlowStatistics { phases, ..flow.flow.statistics(flow.raised_penalties) };
        let (balls, shear_factor) =
            (self.suspension.suspension.balls(configuration), configuration.shear_factor);
        self.last = Some(PredictedFlow { flow, balls, shear_factor });
        Ok(Prediction { statistics, ..prediction })
    }

    fn near_mobility(
        &self,
        configuration: &Configuration<'_, D>,
    ) -> Result<Option<Box<dyn TwistMobility<D>>>, SuspensionError> {
        let SharedSuspension { flow, suspension } = self.suspension;
        Ok(Some(Box::new(suspension.near_mobility(configuration, flow.viscosity)?)))
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn films(&self, configuration: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        self.suspension.suspension.films(configuration, reach)
    }

    /// Nothing: what the next flow starts from is in pieces, which the [`FlowMemory`] of each rank has until
    /// this is called again.
    fn checkpoint(&self) -> Result<Vec<u8>, SuspensionError> {
        self.memory.remember();
        Ok(Vec::new())
    }

    /// What one process starts from is no start for a flow in pieces, which begins at zero then.
    fn resume(&mut self, _: &[u8]) -> Result<(), ResumeError<SuspensionError>> {
        Ok(())
    }

    /// Those in the cells of this rank.
    fn fields(&self) -> Option<Fields<D>> {
        let PredictedFlow { flow: LocalFlow { flow, .. }, balls, shear_factor } = self.last.as_ref()?;
        let SharedSuspension { flow: params, suspension } = self.suspension;
        let fields = flow.fields(balls, &params.params(suspension.lubrication));
        Some(suspension.in_space(fields, flow.discretisation.mesh.shear(), *shear_factor))
    }
}
