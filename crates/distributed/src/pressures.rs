//! Pressures that ranks share: which are unknowns, and those of aggregates, which follow from others.

use gluey_fem::{Constraint, ImplicitTree};
use gluey_geom::{Dim, Space};
use gluey_linalg::Scalar;
use gluey_parallel::{Communicator, GhostPlan, Ranks, Wanted};
use gluey_stokes::PressureSpace;

use crate::bodies::Shared;
use crate::space::{LevelSpace, Nodes, wanted_nodes};

/// The pressures of a part: at its nodes, and after these at nodes elsewhere that rows name.
#[derive(Clone)]
pub struct SharedPressures {
    /// Of those that the cells of the rank depend on.
    pub plan: GhostPlan,
    /// At the owned nodes.
    pub is_free: Vec<bool>,
    /// Number of unknowns of all ranks.
    pub free_count: f64,
    /// The ghosts of `plan`, by their places.
    pub ghosts: Vec<Wanted>,
    /// Free ones at all nodes of the part and elsewhere.
    keeps: Vec<bool>,
    /// By their nodes.
    rows: Vec<Constraint>,
}

impl SharedPressures {
    /// Those of the space of the part, which knows the aggregates of its own
    /// cells. Constants are in the kernel but for rounding of the moments, so means are removed. All ranks
    /// call this.
    pub fn new<const D: usize>(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        space: &LevelSpace<D>,
        pressure: &PressureSpace<D>,
    ) -> Self
    where
        Dim<D>: Space<D>,
    {
        let (ranks, nodes) = (shared.ranks, &*space.pressure);
        let count = nodes.map.node_count();
        let is_ghost = |row: &&Constraint| !nodes.map.is_hanging(row.node as usize);
        let mut rows: Vec<Constraint> = pressure.constraints().iter().filter(is_ghost).cloned().collect();
        rows.sort_unstable_by_key(|row| row.node);
        let mut needed = vec![false; count];
        for &node in nodes.map.cells(space.part.own()) {
            nodes.regular(node).for_each(|(node, _)| needed[node as usize] = true);
        }
        rows.retain(|row| needed[row.node as usize]);
        let masters = rows.iter().flat_map(|row| &row.masters);
        masters.for_each(|&(master, _)| needed[master as usize] = true);
        let keeps: Vec<bool> = (0..count).map(|node| pressure.is_free(node)).collect();
        let mut ghosts = wanted_nodes(tree, shared, &space.part, nodes, |node| needed[node] && keeps[node]);
        ghosts.sort_unstable_by_key(|ghost| ghost.place);
        let plan = GhostPlan::new(ranks, ghosts.clone(), nodes.finder());
        let is_free = keeps[nodes.owned.clone()].to_vec();
        let mut free_count = [is_free.iter().filter(|is_free| **is_free).count() as f64];
        ranks.sum(&mut free_count);
        Self { plan, is_free, free_count: free_count[0], ghosts, keeps, rows }
    }

    /// Length of a vector at the nodes of the part and elsewhere.
    pub fn dim(&self) -> usize {
        self.keeps.len()
    }

    /// Passes on the unknowns that the pressure at a node of an own cell stands for, with their weights.
    pub fn for_each_term<const D: usize>(
        &self,
        nodes: &Nodes<D>,
        node: u32,
        mut visit: impl FnMut(u32, f64),
    ) {
        for (node, weight) in nodes.regular(node) {
            if self.keeps[node as usize] {
                visit(node, weight);
            } else if let Ok(row) = self.rows.binary_search_by_key(&node, |row| row.node) {
                self.rows[row].masters.iter().for_each(|&(master, w)| visit(master, weight * w));
            }
        }
    }

    /// Makes the entries at owned nodes sum to zero over all ranks.
    pub fn remove_mean<T: Scalar>(&self, ranks: &Ranks, q: &mut [T]) {
        let mut sum = [q.iter().zip(&self.is_free).filter(|e| *e.1).map(|e| e.0.to_f64()).sum()];
        ranks.sum(&mut sum);
        let mean = T::from_f64(sum[0] / self.free_count.max(1.0));
        q.iter_mut().zip(&self.is_free).filter(|e| *e.1).for_each(|(q, _)| *q -= mean);
    }
}
