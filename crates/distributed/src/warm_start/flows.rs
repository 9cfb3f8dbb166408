//! The last flows as a rank keeps them.

use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{Cuts, NodeMap, TreeMesh};

use super::films::KeptFilm;

/// Flows at most that are kept: the last one and the one before.
pub const MOST: usize = 2;

/// Velocities and pressures at the nodes of one mesh.
pub type Values = [Vec<f64>; 2];

/// The last flows as a rank keeps them for the next one.
pub struct KeptFlows<const D: usize> {
    /// The box, without cells.
    pub frame: TreeMesh<D>,
    /// Between the runs of the pieces.
    pub cuts: Cuts,
    pub pieces: Vec<FlowPiece<D>>,
    pub small: GlobalState,
}

/// The flows in the cells of one run, the last one first.
pub struct FlowPiece<const D: usize> {
    pub run: usize,
    pub mesh: Arc<TreeMesh<D>>,
    /// Those of the run, of the cells of the mesh.
    pub cells: Range<usize>,
    pub velocity_nodes: Arc<NodeMap<D>>,
    pub pressure_nodes: Arc<NodeMap<D>>,
    pub flows: Vec<Values>,
}

/// State that belongs to no mesh: of the last flow first.
#[derive(Clone, Default)]
pub struct GlobalState {
    /// Motions of all bodies, of each flow.
    pub bodies: Vec<Vec<f64>>,
    pub films: Vec<KeptFilm>,
}
