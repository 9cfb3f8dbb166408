//! The flow around particles that move, on ranks.

use gluey_fem::{ImplicitTree, MeshError};
use gluey_geom::Vector;
use gluey_levelset::BallTree;
use gluey_motion::{Configuration, NextLoads, Prediction};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::{NotDriven, StokesError, Suspension};

use crate::cuts::cuts_of_work;
use crate::flow::{BoxFlow, LocalFlow};
use crate::memory::FlowMemory;
use crate::surface::{SharedTree, SurfaceBodies};

/// A suspension whose flow ranks share.
#[derive(Clone, Debug)]
pub struct SharedSuspension<const D: usize> {
    /// Fluid and tolerance.
    pub flow: BoxFlow,
    /// The particles, and what drives them.
    pub suspension: Suspension<D>,
}

/// Reason why there is no flow around the particles.
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

impl<const D: usize> SharedSuspension<D> {
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
        Ok(self.solve_from(ranks, configuration, &FlowMemory::default(), &mut |_| None)?.0)
    }

    /// The flow of a configuration, and what it predicts but for statistics. The first solve starts from the
    /// flows in memory, and its flow is kept there for the next.
    pub(super) fn solve_from(
        &self,
        ranks: &Ranks,
        configuration: &Configuration<'_, D>,
        memory: &FlowMemory<D>,
        next: &mut NextLoads<'_, D>,
    ) -> Result<(LocalFlow<D>, Prediction<D>), SuspensionError> {
        let suspension = &self.suspension;
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
        let found = self.flow.solve_from(&bodies, &mut leaves, &mut kept, |solver, mesh| {
            solver.predict::<SuspensionError>(mesh, suspension, configuration, next)
        })?;
        memory.last.replace(kept);
        Ok(found)
    }
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
