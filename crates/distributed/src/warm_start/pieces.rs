//! What a rank keeps of the last flows as numbers, for checkpoints.

use std::sync::Arc;

use gluey_fem::{Cell, Cuts, ImplicitTree, MeshError, NodeMap, TreeMesh};
use gluey_geom::Dim;
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::Suspension;
use serde::{Deserialize, Serialize};

use super::films::KeptFilm;
use super::flows::{FlowPiece, GlobalState, KeptFlows, MOST};

/// The flows in the cells of one run in the order of cells, of how many runs, and what belongs to no mesh.
///
/// It says nothing of ranks: any number of them can go on from the pieces of others, each from those that
/// [`SavedPiece::holder`] gives it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedPiece {
    /// Level of the finest lattice.
    level: u8,
    /// First keys of all runs, and the end of the last.
    firsts: Vec<u64>,
    run: usize,
    /// Levels of the cells, and their coordinates one after the other.
    levels: Vec<u8>,
    coords: Vec<u32>,
    /// Velocities and pressures, of the last flow first, at the nodes in the order in which cells touch them.
    flows: Vec<[Vec<f64>; 2]>,
    bodies: Vec<Vec<f64>>,
    films: Vec<KeptFilm>,
}

/// Pieces from which no flow can go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PieceError {
    /// There is no mesh of this depth in the box.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Its parts do not belong together, or not to this box and these particles.
    #[error("the flow of run {run} has {what}")]
    Unfit {
        /// Which run, from 0.
        run: usize,
        /// What is wrong.
        what: &'static str,
    },
}

impl SavedPiece {
    /// Which run it is, from 0.
    pub fn run(&self) -> usize {
        self.run
    }

    /// Number of runs.
    pub fn run_count(&self) -> usize {
        self.firsts.len().saturating_sub(1)
    }

    /// The rank among `ranks` that goes on from run `run` of `runs`.
    pub fn holder(run: usize, runs: usize, ranks: usize) -> usize {
        run * ranks / runs
    }
}

impl<const D: usize> KeptFlows<D> {
    /// The pieces of this rank.
    pub fn saved(&self) -> Vec<SavedPiece> {
        self.pieces.iter().map(|piece| self.saved_piece(piece)).collect()
    }

    fn saved_piece(&self, piece: &FlowPiece<D>) -> SavedPiece {
        let cells = piece.mesh.cells()[piece.cells.clone()].to_vec();
        let level = self.frame.max_level();
        let levels = cells.iter().map(|cell| cell.level).collect();
        let coords = cells.iter().flat_map(|cell| cell.coords).collect();
        let mesh = self.frame.clone().with_cells(cells);
        let [velocities, pressures] =
            [&piece.velocity_nodes, &piece.pressure_nodes].map(|nodes| numbered(&mesh, nodes, piece));
        let of_flow =
            |flow: &[Vec<f64>; 2]| [picked(&velocities, D, &flow[0]), picked(&pressures, 1, &flow[1])];
        SavedPiece {
            level,
            firsts: self.cuts.firsts().to_vec(),
            run: piece.run,
            levels,
            coords,
            flows: piece.flows.iter().map(of_flow).collect(),
            bodies: self.small.bodies.clone(),
            films: if piece.run == self.pieces[0].run { self.small.films.clone() } else { Vec::new() },
        }
    }

    /// What a rank goes on from: its pieces of a checkpoint of flows of a suspension, or any other piece
    /// where it has none.
    ///
    /// # Errors
    /// [`PieceError`] for pieces that do not fit.
    pub fn restored(
        suspension: &Suspension<D>,
        ranks: &Ranks,
        mut saved: Vec<SavedPiece>,
    ) -> Result<Self, PieceError> {
        let any = saved.first().cloned().ok_or(PieceError::Unfit { run: 0, what: "no piece" })?;
        let unfit = |what| PieceError::Unfit { run: any.run, what };
        let Suspension { domain, roots, .. } = *suspension;
        let tree = ImplicitTree::new(domain, roots, suspension.periodic(), any.level, &|_, _, _| false)?;
        let frame = tree.frame().clone();
        let (end, firsts) = any.firsts.split_last().ok_or(unfit("no runs"))?;
        if firsts.first() != Some(&0) || !any.firsts.is_sorted() {
            return Err(unfit("runs out of order"));
        }
        let cuts = Cuts::new(firsts.to_vec(), *end);
        let motions = suspension.radii.len() * Dim::<D>::RIGID;
        if !(1..=MOST).contains(&any.bodies.len()) || any.bodies.iter().any(|all| all.len() != motions) {
            return Err(unfit("motions of another number of particles"));
        }
        let (flow_count, runs) = (any.bodies.len(), cuts.count());
        saved.retain(|piece| SavedPiece::holder(piece.run, runs, ranks.size()) == ranks.rank());
        let films = saved.iter().flat_map(|piece| piece.films.iter().copied()).collect();
        let pieces: Result<Vec<_>, _> =
            saved.into_iter().map(|piece| restored_piece(&frame, &cuts, flow_count, piece)).collect();
        Ok(Self { pieces: pieces?, small: GlobalState { bodies: any.bodies, films }, frame, cuts })
    }
}

fn restored_piece<const D: usize>(
    frame: &TreeMesh<D>,
    cuts: &Cuts,
    flow_count: usize,
    saved: SavedPiece,
) -> Result<FlowPiece<D>, PieceError> {
    let unfit = |what| PieceError::Unfit { run: saved.run, what };
    let own = if saved.run < cuts.count() { cuts.of(saved.run) } else { 0..0 };
    let coords = saved.coords.as_chunks::<D>().0;
    let cells: Vec<Cell<D>> =
        saved.levels.iter().zip(coords).map(|(&level, &coords)| Cell { level, coords }).collect();
    let is_here = |cell: &Cell<D>| {
        let is_inside = |d: usize| cell.coords[d] < frame.roots()[d] << cell.level;
        cell.level <= frame.max_level() && (0..D).all(is_inside) && own.contains(&frame.key(cell))
    };
    if saved.coords.len() != D * saved.levels.len() || !cells.iter().all(is_here) {
        return Err(unfit("cells that are not in it"));
    }
    let count = cells.len();
    let mesh = frame.clone().with_cells(cells);
    let (velocity_nodes, pressure_nodes) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
    let fits = |flow: &[Vec<f64>; 2]| {
        flow[0].len() == D * velocity_nodes.node_count() && flow[1].len() == pressure_nodes.node_count()
    };
    if saved.flows.len() != flow_count || !saved.flows.iter().all(fits) {
        return Err(unfit("values for other nodes"));
    }
    Ok(FlowPiece {
        run: saved.run,
        mesh: Arc::new(mesh),
        cells: 0..count,
        velocity_nodes: Arc::new(velocity_nodes),
        pressure_nodes: Arc::new(pressure_nodes),
        flows: saved.flows,
    })
}

/// For the nodes of a mesh that has the cells of a piece only, in their order, those of the piece.
fn numbered<const D: usize>(mesh: &TreeMesh<D>, nodes: &NodeMap<D>, piece: &FlowPiece<D>) -> Vec<u32> {
    let alone = NodeMap::new(mesh, nodes.degree());
    let mut places = vec![0; alone.node_count()];
    for (node, place) in alone.cells(0..mesh.cell_count()).iter().zip(nodes.cells(piece.cells.clone())) {
        places[*node as usize] = *place;
    }
    places
}

/// The values with this many components at some nodes.
fn picked(nodes: &[u32], components: usize, values: &[f64]) -> Vec<f64> {
    nodes.iter().flat_map(|&node| &values[node as usize * components..][..components]).copied().collect()
}
