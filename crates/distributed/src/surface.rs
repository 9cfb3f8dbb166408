//! Flows around the true surfaces of bodies, the formulation `unfitted`, on cells that
//! ranks share.
//!
//! A rank sets the problem of one process up on its part of the finest mesh, which reaches far enough around
//! surfaces for all that follows from places alone: cut cells, aggregates, penalties, films, blocks of the
//! smoother. Only sums over cells go between ranks. Coarser levels are those of bodies whose nodes move with
//! them.

use std::sync::Arc;

use gluey_fem::{Cell, Cuts, ImplicitTree, TreeMesh};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Body};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::part::{GhostLayer, levels, owner_of_point, rings_around_surfaces, sizes};
use gluey_stokes::{Conditions, Discretisation, Film, Flow, FlowSolver, Lubrication, StokesError};

use crate::flow::{BoxFlow, LocalFlow};
use crate::warm_start::KeptFlows;

/// Cells between the middle of a cell and a surface, at most, if the part is to hold what is around it.
const CELLS_AT_SURFACE: f64 = 3.5;

/// Bodies whose surfaces cut the mesh where they are, all of which every rank knows.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceBodies<'a, const D: usize> {
    /// The bodies.
    pub balls: &'a [Ball<D>],
    /// Treatment of films that are too thin for the mesh.
    pub lubrication: Lubrication,
}

/// A tree and the ranks that share its leaves.
pub struct SharedTree<'s, 't, const D: usize> {
    pub tree: &'s mut ImplicitTree<'t, D>,
    pub cuts: &'s Cuts,
    pub ranks: &'s Ranks,
}

impl BoxFlow {
    /// The flow with the velocity `walls` on the walls of the box. All ranks call this with the same tree and
    /// cuts. The function is also taken for the undisturbed flow inside.
    ///
    /// # Errors
    /// [`StokesError`], on all ranks; [`StokesError::NoWall`] in a box that is periodic in all directions.
    pub fn solve<const D: usize>(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &Ranks,
        walls: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<LocalFlow<D>, StokesError> {
        if tree.frame().periodic().into_iter().all(|is_periodic| is_periodic) {
            return Err(StokesError::NoWall);
        }
        let none = SurfaceBodies { balls: &[], lubrication: Lubrication::None };
        self.solve_around_surfaces(&none, tree, cuts, ranks, &Conditions::boundary(walls))
    }

    /// The flow around bodies whose surfaces cut the mesh, under conditions on all of them. All ranks call
    /// this with the same arguments. A box without walls is sheared like the tree, and the flow has no mean
    /// where all bodies are free.
    ///
    /// # Errors
    /// [`StokesError`], on all ranks.
    pub fn solve_around_surfaces<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &Ranks,
        conditions: &Conditions<'_, D>,
    ) -> Result<LocalFlow<D>, StokesError> {
        conditions.check_count(around.balls.len())?;
        let leaves = &mut SharedTree { tree, cuts, ranks };
        let solve = |solver: &mut FlowSolver<D>, mesh: &Discretisation<D>| {
            Ok::<_, StokesError>((solver.solve_on(mesh, around.balls, conditions)?, ()))
        };
        Ok(self.solve_from(around, leaves, &mut None, solve)?.0)
    }

    /// The flow that `solve` finds on the part of the rank, with what else that says, from the last flows,
    /// which this one becomes one of.
    ///
    /// # Errors
    /// Those of `solve`, on all ranks; nothing is kept then.
    pub(crate) fn solve_from<T, E: From<StokesError>, const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        leaves: &mut SharedTree<'_, '_, D>,
        kept: &mut Option<Arc<KeptFlows<D>>>,
        solve: impl FnOnce(&mut FlowSolver<D>, &Discretisation<D>) -> Result<(Flow<D>, T), E>,
    ) -> Result<(LocalFlow<D>, T), E> {
        let (last, start) = (kept.take(), leaves.ranks.traffic());
        let meshes = levels_around(around, leaves)?;
        let (finest, coarser) = meshes.split_last().expect("a tree has a finest level");
        let partition = finest.partition().expect("the mesh is a part");
        let mut solver =
            FlowSolver::new(self.params(around.lubrication))?.on_parts(coarser, self.max_iterations)?;
        let mut before = last.map(|last| last.moved(finest));
        if let Some([Some(last), older]) = before.as_mut().map(|flows| flows.near(partition, around.balls)) {
            solver.start_from(finest.clone(), last, older).expect("flows were moved to these nodes");
        }
        let (flow, found) = solve(&mut solver, finest)?;
        let frame = leaves.tree.frame();
        *kept = solver
            .warm_start()
            .map(|(last, _)| Arc::new(KeptFlows::new(frame, partition, last.clone(), before)));
        let sent = leaves.ranks.traffic().since(start);
        let flow = LocalFlow {
            raised_penalties: solver.take_raised_penalties(),
            levels: meshes.iter().map(|mesh| sizes(mesh, around.balls)).collect(),
            setup_traffic: sent.since(flow.solve_traffic),
            flow,
        };
        Ok((flow, found))
    }
}

/// The parts of the levels around bodies, coarsest first.
fn levels_around<const D: usize>(
    around: &SurfaceBodies<'_, D>,
    leaves: &mut SharedTree<'_, '_, D>,
) -> Result<Vec<Discretisation<D>>, StokesError> {
    let SharedTree { tree, cuts, ranks } = leaves;
    let frame = tree.frame().clone();
    let cell_size = frame.size(frame.max_level());
    let is_small = |ball: &Ball<D>| ball.bounding_radius() < cell_size;
    if let Some(body) = around.balls.iter().position(is_small) {
        let radius = around.balls[body].bounding_radius();
        return Err(StokesError::Unresolved { body, radius, cell_size });
    }
    let bodies = BallTree::new(around.balls);
    let spreads = |cell: &Cell<D>| is_near_surface(&frame, &bodies, cell);
    let is_own = |film: &Film<D>| owner_of_point(&frame, cuts, &film.middle(frame.shear())) == ranks.rank();
    let SurfaceBodies { balls, lubrication } = *around;
    let rings = rings_around_surfaces(lubrication, balls, frame.domain(), cell_size, &is_own);
    Ok(levels(tree, ranks, cuts, &bodies, &GhostLayer { rings, spreads: &spreads }))
}

/// Whether the part is to hold what is around a cell: whether a surface is near it.
fn is_near_surface<const D: usize>(frame: &TreeMesh<D>, bodies: &BallTree<'_, D>, cell: &Cell<D>) -> bool {
    let h = frame.size(cell.level);
    let center: Vector<D> = frame.lower_corner(cell) + Vector::repeat(0.5 * h);
    let reach = CELLS_AT_SURFACE * h;
    bodies.nearest_within(&center, reach).is_some_and(|nearest| nearest.1 <= reach)
}
