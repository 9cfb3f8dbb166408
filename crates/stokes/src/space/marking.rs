//! Which nodes and cells lie in bodies, near them, or between them.

use gluey_fem::NodeMap;
use gluey_levelset::{Ball, BallTree};
use rayon::prelude::*;

use super::discretisation::Discretisation;
use super::velocity::SolidNodes;

/// Least number of nodes that are looked up by one thread.
const LEAST_SHARE: usize = 1024;

/// The nodes with `alpha >= offset h`, each with the body whose level set is largest there; `h` is the size
/// of the smallest cell at the node. A negative offset takes nodes slightly outside the surface.
pub fn solid_nodes<const D: usize>(
    discretisation: &Discretisation<D>,
    bodies: &[Ball<D>],
    offset: f64,
) -> SolidNodes {
    let (mesh, nodes) = (&discretisation.mesh, &discretisation.velocity);
    let finest = discretisation.finest_levels();
    let bodies = BallTree::new(bodies);
    let at = |node: usize| {
        let threshold = offset * mesh.size(finest[node]);
        bodies.nearest_within(&nodes.point(node), -threshold).map(|b| b.0 as u32)
    };
    (0..nodes.node_count()).into_par_iter().with_min_len(LEAST_SHARE).map(at).collect()
}

/// Whether all nodes of a cell, with these bodies, belong to one body: no strain, no flow.
pub fn moves_as_one(mut bodies: impl Iterator<Item = Option<u32>>) -> bool {
    let first = bodies.next().flatten();
    first.is_some() && bodies.all(|body| body == first)
}

/// The nodes a level smooths: those of its finest cells and of the cells next to them. The others are those
/// of the next coarser level, which smooths them.
pub fn around_finest_cells<const D: usize>(discretisation: &Discretisation<D>) -> Vec<bool> {
    let level = discretisation.mesh.max_level();
    let finest: Vec<bool> = discretisation.finest_levels().iter().map(|&finest| finest == level).collect();
    nodes_of_cells_with(&discretisation.velocity, &finest)
}

/// The nodes of all cells that have a marked node.
pub fn nodes_of_cells_with<const D: usize>(nodes: &NodeMap<D>, marked: &[bool]) -> Vec<bool> {
    let mut around = vec![false; nodes.node_count()];
    for cell in 0..nodes.cell_count() {
        if nodes.cell(cell).iter().any(|&n| marked[n as usize]) {
            nodes.cell(cell).iter().for_each(|&n| around[n as usize] = true);
        }
    }
    around
}

/// The cells with a marked node, or with a hanging node that hangs on one: those whose stress acts on marked
/// nodes.
pub fn cells_touching<const D: usize>(nodes: &NodeMap<D>, marked: &[bool]) -> Vec<bool> {
    let mut acting = marked.to_vec();
    for constraint in nodes.constraints() {
        acting[constraint.node as usize] |= constraint.masters.iter().any(|m| marked[m.0 as usize]);
    }
    (0..nodes.cell_count()).map(|c| nodes.cell(c).iter().any(|&n| acting[n as usize])).collect()
}
