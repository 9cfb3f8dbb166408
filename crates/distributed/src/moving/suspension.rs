//! The flow around particles that move, on ranks.

use gluey_fem::{ImplicitTree, MeshError};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::BallTree;
use gluey_motion::{Configuration, Fields, Prediction};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::{NotDriven, StokesError, Suspension};

use super::step_input::StepInput;
use crate::contact::ContactFollower;
use crate::cuts::cuts_of_work;
use crate::flow::{BoxFlow, LocalFlow};
use crate::memory::Memory;
use crate::orders::{FrameName, Order};
use crate::surface::{SharedTree, SurfaceBodies};
use crate::warm_start::SavedPiece;

/// A suspension whose flow ranks share.
#[derive(Clone, Debug)]
pub struct SharedSuspension<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Fluid and tolerance.
    pub flow: BoxFlow,
    /// The particles, and what drives them.
    pub suspension: Suspension<D>,
}

/// Why there is no flow around the particles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SuspensionError {
    /// The box has no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The flow failed, on all ranks.
    #[error(transparent)]
    Flow(#[from] StokesError),
    /// The forces between particles drive them faster than the stress that is given.
    #[error(transparent)]
    NotDriven(#[from] NotDriven),
}

impl<const D: usize> SharedSuspension<D>
where
    Dim<D>: Space<D>,
{
    /// The flow of a configuration, in a box without walls relative to the undisturbed one. All ranks call
    /// this with the same numbers.
    ///
    /// # Errors
    /// [`SuspensionError`], on all ranks.
    pub fn solve(
        &self,
        ranks: &Ranks,
        configuration: &Configuration<'_, D>,
    ) -> Result<LocalFlow<D>, SuspensionError> {
        Ok(self.solve_from(ranks, configuration, &Memory::default())?.0)
    }

    /// The flow of a configuration, and what it predicts but for statistics. The first solve starts from the
    /// flows in memory, and its flow is kept there for the next.
    pub(super) fn solve_from(
        &self,
        ranks: &Ranks,
        configuration: &Configuration<'_, D>,
        memory: &Memory<D>,
    ) -> Result<(LocalFlow<D>, Prediction<D>), SuspensionError> {
        let Self { flow: BoxFlow { viscosity, .. }, suspension } = self;
        let balls = suspension.balls(configuration);
        let shear = balls.first().map_or(0.0, |ball| ball.lattice().shear());
        let (refinement, tree_of_balls) = (&suspension.refinement, BallTree::new(&balls));
        let wants = |lower: &Vector<D>, h: f64, level: u8| refinement.wants(lower, h, level, &tree_of_balls);
        let tree = |depth: u8| {
            let Suspension { domain, roots, .. } = *suspension;
            let tree = ImplicitTree::new(domain, roots, suspension.periodic(), depth, &wants)?;
            Ok::<_, MeshError>(tree.sheared(shear))
        };
        let deepest = refinement.surface;
        let mut whole = tree(deepest)?;
        let mut cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        let used = finest_level(&mut whole, &cuts.of(ranks.rank()), ranks);
        if used < deepest {
            whole = tree(used)?;
            cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        }
        let bodies = SurfaceBodies { balls: &balls, lubrication: suspension.lubrication };
        let mut kept = memory.last.take();
        let mut leaves = SharedTree { tree: &mut whole, cuts: &cuts, ranks };
        let (flow, rate) = suspension.driven(configuration, *viscosity, |drive| {
            self.flow.solve_from(&bodies, &mut leaves, &mut kept, |solver, mesh| {
                solver.solve_driven::<SuspensionError>(mesh, &balls, drive)
            })
        })?;
        memory.last.replace(kept);
        let prediction = suspension.prediction(configuration, *viscosity, &flow.flow, rate);
        Ok((flow, prediction))
    }

    /// The fields of a flow in the cells of a rank, in space.
    pub(super) fn fields(&self, flow: &LocalFlow<D>, input: &StepInput<D>) -> Fields<D> {
        let (balls, flow) = (self.suspension.balls(&input.configuration()), &flow.flow);
        let fields = flow.fields(&balls, &self.flow.params(self.suspension.lubrication));
        self.suspension.in_space(fields, flow.discretisation.mesh.shear(), input.shear_factor)
    }

    /// Does what rank zero asks for with its [`crate::SharedHydrodynamics::leading`], until that ends. All
    /// other ranks call this.
    pub fn follow(&self, ranks: &Ranks) {
        self.follow_and_show(ranks, &mut |_, _| {});
    }

    /// The same, and hands `show` the fields in the cells of this rank when rank zero
    /// [asks](crate::ask_for_fields) for them: none if there is no flow.
    pub fn follow_and_show(&self, ranks: &Ranks, show: &mut dyn FnMut(FrameName, Option<Fields<D>>)) {
        self.follow_for(ranks, &Memory::default(), &mut ShowOnly(show));
    }

    /// The same with flows in `memory`, for a follower who keeps them too.
    pub fn follow_for(&self, ranks: &Ranks, memory: &Memory<D>, follower: &mut dyn Follower<D>) {
        let (mut input, mut last) = (StepInput::new(&self.suspension), None::<LocalFlow<D>>);
        let mut contact = ContactFollower::default();
        loop {
            match Order::End.share(ranks) {
                Order::End => return,
                Order::Predict => {
                    input.share(ranks);
                    // Its memory is free for the next.
                    drop(last.take());
                    // An error is one on all ranks: rank zero says what it is.
                    last = self.solve_from(ranks, &input.configuration(), memory).ok().map(|found| found.0);
                }
                Order::Show(frame) => {
                    follower.show(frame, last.as_ref().map(|flow| self.fields(flow, &input)));
                }
                Order::Contact => {
                    // An error is one on all ranks here too.
                    let _ = contact.step(ranks);
                }
                Order::Remember => memory.remember(),
                Order::Keep(name) => follower.keep(name, memory.saved()),
            }
        }
    }
}

/// What other ranks do with flows when rank zero asks for it.
pub trait Follower<const D: usize> {
    /// Shows the fields in the cells of this rank; none if there is no flow.
    fn show(&mut self, frame: FrameName, fields: Option<Fields<D>>);

    /// Keeps for a checkpoint what the flow after it starts from.
    fn keep(&mut self, name: u64, pieces: Vec<SavedPiece>);
}

/// Shows fields and keeps nothing.
struct ShowOnly<'s, const D: usize>(&'s mut dyn FnMut(FrameName, Option<Fields<D>>));

impl<const D: usize> Follower<D> for ShowOnly<'_, D> {
    fn show(&mut self, frame: FrameName, fields: Option<Fields<D>>) {
        (self.0)(frame, fields);
    }

    fn keep(&mut self, _: u64, _: Vec<SavedPiece>) {}
}

/// Level of the smallest leaves of all ranks.
fn finest_level<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    own: &std::ops::Range<u64>,
    ranks: &Ranks,
) -> u8 {
    let mut finest = 0;
    let depth = tree.max_level();
    tree.for_each_leaf(depth, own, |leaf| finest = finest.max(leaf.level));
    ranks.all_gather(&[u64::from(finest)]).into_iter().max().map_or(0, |level| level as u8)
}
