//! Pressures that are continuous across hanging nodes.
//!
//! A pressure node that touches no cell in which something flows acts on nothing and is dropped.

use gluey_fem::{Constraint, NodeMap};
use gluey_linalg::Scalar;
use gluey_parallel::Halo;

use super::cells::ActiveCell;
use super::velocity::VelocitySpace;

/// The reduced pressure space of one mesh. Vectors have one entry per node, zero at nodes that are not
/// free.
#[derive(Clone, Debug)]
pub struct PressureSpace<const D: usize> {
    free: Vec<bool>,
    /// Number of free nodes, on all ranks.
    free_count: usize,
    constraints: Vec<Constraint>,
    halo: Halo,
    /// Free nodes that this rank owns, where others have some.
    own: Option<Vec<bool>>,
}

impl<const D: usize> PressureSpace<D> {
    /// The pressures seen by the free velocities of `space` on the active `cells`.
    pub fn new(space: &VelocitySpace<D>, cells: &[ActiveCell]) -> Self {
        let discretisation = space.discretisation();
        let mut flows = vec![false; discretisation.mesh.cell_count()];
        for cell in cells.iter().map(|cell| cell.cell as usize) {
            flows[cell] =
                discretisation.velocity.cell(cell).iter().any(|&n| space.body_of(n as usize).is_none());
        }
        Self::around_surfaces(&discretisation.pressure, |cell| flows[cell], &[])
    }

    /// The pressures of the cells in which `seen` holds; `ghosts` take their values from others.
    pub fn around_surfaces(nodes: &NodeMap<D>, seen: impl Fn(usize) -> bool, ghosts: &[Constraint]) -> Self {
        let cells: Vec<usize> = (0..nodes.cell_count()).filter(|&cell| seen(cell)).collect();
        let free = self::seen(nodes, &cells);
        let constraints = nodes.constraints().iter().chain(ghosts).cloned().collect();
        let free_count = free.iter().filter(|&&f| f).count();
        Self { free, free_count, constraints, halo: Halo::default(), own: None }
    }

    /// Makes the pressures of the part of a mesh those of all ranks, by the halo of the free ones. All ranks
    /// call this.
    pub(crate) fn share(&mut self, halo: Halo) {
        let mut own = self.free.clone();
        halo.clear(&mut own);
        let mut count = [own.iter().filter(|is_own| **is_own).count() as f64];
        halo.sum_over_ranks(&mut count);
        (self.free_count, self.own, self.halo) = (count[0] as usize, Some(own), halo);
    }

    /// The halo of the pressures: nothing on one rank.
    pub fn halo(&self) -> &Halo {
        &self.halo
    }

    /// Length of a vector.
    pub fn dim(&self) -> usize {
        self.free.len()
    }

    /// Whether the pressure of a node is an unknown.
    pub fn is_free(&self, node: usize) -> bool {
        self.free[node]
    }

    /// The nodes whose pressure follows from others, in an order in which each can be resolved from those
    /// before.
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }

    /// Sets the constrained pressures from the free ones.
    pub fn expand<T: Scalar>(&self, p: &mut [T]) {
        for constraint in &self.constraints {
            let term = |&(master, weight): &(u32, f64)| weight * p[master as usize].to_f64();
            p[constraint.node as usize] = T::from_f64(constraint.masters.iter().map(term).sum());
        }
    }

    /// The transpose of [`PressureSpace::expand`]; entries of nodes that are not free become zero.
    pub fn reduce<T: Scalar>(&self, q: &mut [T]) {
        for constraint in self.constraints.iter().rev() {
            let value = std::mem::replace(&mut q[constraint.node as usize], T::ZERO);
            for &(master, weight) in &constraint.masters {
                q[master as usize] += T::from_f64(weight) * value;
            }
        }
        self.clear_fixed(q);
    }

    /// Clears the entries of nodes that are not free.
    pub fn clear_fixed<T: Scalar>(&self, q: &mut [T]) {
        for (value, &free) in q.iter_mut().zip(&self.free) {
            if !free {
                *value = T::ZERO;
            }
        }
    }

    /// Makes the sum over free nodes vanish: a pressure is defined up to a constant, and the rest of the
    /// divergence is spread evenly. Ghosts are left as they are.
    pub fn remove_mean<T: Scalar>(&self, q: &mut [T]) {
        let own = self.own.as_ref().unwrap_or(&self.free);
        let mut sum = [q.iter().zip(own).filter(|e| *e.1).map(|e| e.0.to_f64()).sum()];
        self.halo.sum_over_ranks(&mut sum);
        let mean = T::from_f64(sum[0] / self.free_count.max(1) as f64);
        for (value, &free) in q.iter_mut().zip(own) {
            if free {
                *value -= mean;
            }
        }
    }
}

/// Regular nodes that touch a fluid cell, directly or through a hanging node.
fn seen<const D: usize>(nodes: &NodeMap<D>, fluid: &[usize]) -> Vec<bool> {
    let mut free = vec![false; nodes.node_count()];
    for &cell in fluid {
        nodes.cell(cell).iter().for_each(|&q| free[q as usize] = true);
    }
    for constraint in nodes.constraints() {
        if std::mem::take(&mut free[constraint.node as usize]) {
            constraint.masters.iter().for_each(|m| free[m.0 as usize] = true);
        }
    }
    free
}
