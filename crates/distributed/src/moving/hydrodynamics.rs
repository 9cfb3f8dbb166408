//! The flow that ranks share as [`Hydrodynamics`].

use std::rc::Rc;

use gluey_geom::{Dim, Matrix, Space, Vector};
use gluey_motion::{
    Configuration, Fields, Film, FlowStatistics, Holding, Hydrodynamics, MeanStress, Prediction, ResumeError,
};
use gluey_parallel::Ranks;
use gluey_stokes::Lubrication;

use super::told::{Order, Told};
use super::{Memory, Suspension, SuspensionError};
use crate::flow::MyFlow;

/// The flow of a suspension as a model of how its particles move.
pub struct SharedHydrodynamics<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    suspension: &'a Suspension<D>,
    ranks: &'a Ranks,
    told: Told<D>,
    /// Whether others follow and are to be told of the end.
    leads: bool,
    /// Of the last prediction, if it succeeded.
    last: Option<MyFlow<D>>,
    /// What the next flow starts from.
    memory: Rc<Memory<D>>,
}

impl<'a, const D: usize> SharedHydrodynamics<'a, D>
where
    Dim<D>: Space<D>,
{
    /// For ranks that all make the same predictions.
    pub fn beside(suspension: &'a Suspension<D>, ranks: &'a Ranks) -> Self {
        let told = Told::new(suspension);
        Self { suspension, ranks, told, leads: false, last: None, memory: Rc::default() }
    }

    /// For rank zero, while the others [`Suspension::follow`].
    pub fn leading(suspension: &'a Suspension<D>, ranks: &'a Ranks) -> Self {
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

impl<const D: usize> SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    /// Power of the forces and torques of the case in the last flow, beside the shear.
    fn work_of_forces(&self, flow: &MyFlow<D>) -> f64 {
        let undisturbed = self.suspension.undisturbed_twist(self.told.shear_factor);
        let twists = flow.twists.iter().zip(&self.told.positions);
        let beside = twists.map(|(twist, place)| *twist - undisturbed(place));
        self.suspension.wrenches.iter().zip(beside).map(|(wrench, twist)| wrench.power(&twist)).sum()
    }

    /// The mean stress of a flow, if it is wanted.
    fn stress(&self, flow: &MyFlow<D>, of_repulsion: Matrix<D>) -> Option<MeanStress<D>> {
        let stress = flow.stress.as_ref().filter(|_| self.told.with_stress)?;
        let volume = self.suspension.domain.extent().product();
        Some(MeanStress {
            rate: self.suspension.shear_rate * self.told.shear_factor,
            viscosity: self.suspension.flow.viscosity,
            of_bodies: stress.of_bodies(volume),
            of_films: stress.of_films.iter().sum::<Matrix<D>>() / volume,
            of_contacts: None,
            of_repulsion,
            dissipation: stress.dissipation / volume,
            work_of_forces: self.work_of_forces(flow) / volume,
        })
    }

    /// What holds particles in a flow, if any are held.
    fn holding(&self, flow: &MyFlow<D>) -> Option<Holding<D>> {
        let held = self.suspension.given.iter().enumerate().filter(|(_, given)| given.is_some());
        let density = self.suspension.force_density.unwrap_or_else(Vector::zeros);
        Some(Holding {
            mean_velocity: flow.mean_velocity?,
            force_density: flow.mean_force + density,
            wrenches: held.map(|(k, _)| (k, flow.wrenches[k] - self.told.wrenches[k])).collect(),
        })
    }

    /// Velocity of the image at a film beyond that of its particle.
    fn slide(&self, film: &gluey_stokes::Film<D>) -> Vector<D> {
        let mut slide = Vector::zeros();
        if let (true, Some(second)) = (self.suspension.is_sheared(), film.side(1)) {
            let places = &self.told.positions;
            let direct = places[second][1] - places[film.body as usize][1];
            slide[0] = self.suspension.shear_rate * self.told.shear_factor * (film.branch()[1] - direct);
        }
        slide
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
        let Self { suspension, ranks, told, memory, .. } = self;
        told.take(suspension, configuration);
        memory.is_sharing.set(true);
        Order::Predict.share(ranks);
        told.share(ranks);
        self.last = None;
        let start = std::time::Instant::now();
        let flow = suspension.solve_as_told(ranks, told, memory);
        memory.is_sharing.set(false);
        let (flow, rate) = flow?;
        // Those that are given without the rounding of what the flow is relative to.
        let given = |index: usize| suspension.given_twist(index, told.shear_factor);
        let twists = flow.twists.iter().enumerate();
        let twists = twists.map(|(index, found)| given(index).unwrap_or(*found)).collect();
        let statistics = FlowStatistics {
            cell_count: flow.cell_count,
            dof_count: flow.dof_count,
            solve_count: flow.solve_count,
            iteration_count: flow.iterations,
            residual: flow.relative_residual,
            penalties_doubled: flow.raised_penalties.doubled,
            cells_raised: flow.raised_penalties.cells,
            solved_again: flow.raised_penalties.solved_again,
            phases: vec![("shared flow", start.elapsed().as_secs_f64())],
        };
        let stress = self.stress(&flow, configuration.pair_stress / rate);
        let holding = self.holding(&flow);
        self.last = Some(flow);
        Ok(Prediction { twists, rate, stress, holding, statistics })
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn films(&self, _: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        if self.last.is_none() || self.suspension.lubrication != Lubrication::Deficit {
            return Vec::new();
        }
        let (balls, domain) = (self.suspension.balls(&self.told), &self.suspension.domain);
        let mut films = gluey_stokes::films(&balls, domain, reach);
        films.retain(|film| !film.is_across_flow());
        let is_held = |body: usize| self.suspension.given.get(body).is_some_and(Option::is_some);
        let film = |film: gluey_stokes::Film<D>| Film {
            first: film.body as usize,
            second: film.side(1),
            branch: film.branch(),
            slide: self.slide(&film),
            is_held: [0, 1].map(|side| film.side(side).is_some_and(is_held)),
            gap: film.gap,
            curvature_radius: film.curvature_radius(),
        };
        films.into_iter().map(film).collect()
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
        self.last.as_ref().map(|flow| self.suspension.fields(flow, &self.told))
    }
}
