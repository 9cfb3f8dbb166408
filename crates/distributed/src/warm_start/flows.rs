//! The last flows as a rank keeps them.

use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{Cuts, NodeMap, TreeMesh};

use super::films::KeptFilm;

/// Flows at most that are kept: the last one and the one before.
pub const MOST: usize = 2;

/// Velocities and pressures at the nodes of one mesh.
pub type Values = [Vec<f64>; 2];

/// What a rank keeps of the last flows for the next one.
pub struct WarmStart<const D: usize> {
    /// The box, without cells.
    pub frame: TreeMesh<D>,
    /// Between the runs of the pieces.
    pub cuts: Cuts,
    pub pieces: Vec<Piece<D>>,
    pub small: GlobalState,
}

/// The flows in the cells of one run, the last one first.
pub struct Piece<const D: usize> {
    pub run: usize,
    pub mesh: Arc<TreeMesh<D>>,
    /// Those of the run, of the cells of the mesh.
    pub cells: Range<usize>,
    pub velocity_nodes: Arc<NodeMap<D>>,
    pub pressure_nodes: Arc<NodeMap<D>>,
    pub flows: Vec<Values>,
}

/// What belongs to no mesh: of the last flow first.
#[derive(Clone, Default)]
pub struct GlobalState {
    /// Motions of all bodies, of each flow.
    pub bodies: Vec<Vec<f64>>,
    pub films: Vec<KeptFilm>,
}
