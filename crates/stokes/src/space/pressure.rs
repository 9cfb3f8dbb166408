//! Pressures that are continuous across hanging nodes and well supported near bodies.
//!
//! A pressure node that touches no cell with a free velocity node acts on nothing and is dropped. One that
//! lies inside a body but touches such a cell is *poorly supported*: it acts on few free velocities, and left
//! alone it makes the Schur complement nearly singular. With [`CutCellPressures::Aggregate`] it takes the
//! mean of the pressures at the nodes outside the bodies that share a cell with it, in the manner of the
//! aggregated finite element method (AgFEM: Badia, Verdugo and Martin 2018, Comput. Methods Appl. Mech. Eng.
//! 336, 533); the divergence it would have tested is then tested by those, so nothing leaks. In a gap
//! narrower than a cell, where no such node exists, poorly supported nodes stay unknowns of their own: the
//! lubrication pressure is there.

use std::sync::Arc;

use gluey_fem::{Constraint, NodeMap};
use gluey_geom::{Dim, Space};
use gluey_linalg::Scalar;

use super::cells::ActiveCell;
use super::discretisation::Discretisation;
use super::velocity::VelocitySpace;

/// Treatment of the poorly supported pressures: those of nodes inside bodies that touch the fluid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutCellPressures {
    /// Poorly supported pressures stay unknowns.
    Keep,
    /// Poorly supported pressures take the mean of their outer neighbours, an aggregation as in AgFEM.
    Aggregate,
}

/// The reduced pressure space of one mesh. Vectors have one entry per node, zero at nodes that are not
/// free.
#[derive(Clone, Debug)]
pub struct PressureSpace<const D: usize> {
    nodes: Arc<NodeMap<D>>,
    free: Vec<bool>,
    free_count: usize,
    constraints: Vec<Constraint>,
    poorly_supported: Vec<u32>,
}

impl<const D: usize> PressureSpace<D>
where
    Dim<D>: Space<D>,
{
    /// The pressures seen by the free velocities of `space` on the active `cells`.
    pub fn new(space: &VelocitySpace<D>, cells: &[ActiveCell], cut: CutCellPressures) -> Self {
        let discretisation = space.discretisation();
        let nodes = discretisation.pressure.clone();
        let fluid: Vec<usize> = cells
            .iter()
            .map(|c| c.cell as usize)
            .filter(|&c| discretisation.velocity.cell(c).iter().any(|&n| space.body_of(n as usize).is_none()))
            .collect();
        let mut free = seen(&nodes, &fluid);
        // Aggregates first: hanging nodes may hang on them.
        let inside = inside(space, &fluid, &free);
        let mut constraints = match cut {
            CutCellPressures::Keep => Vec::new(),
            CutCellPressures::Aggregate => aggregates(discretisation, &fluid, &free, &inside),
        };
        constraints.iter().for_each(|c| free[c.node as usize] = false);
        constraints.extend_from_slice(nodes.constraints());
        let free_count = free.iter().filter(|&&f| f).count();
        let left = |&q: &u32| free[q as usize] && inside[q as usize];
        let poorly_supported = (0..free.len() as u32).filter(left).collect();
        Self { nodes, free, free_count, constraints, poorly_supported }
    }

    /// The pressures of the cells in which `seen` holds; `ghosts` take their values from others.
    pub fn around_surfaces(
        nodes: &Arc<NodeMap<D>>,
        seen: impl Fn(usize) -> bool,
        ghosts: &[Constraint],
    ) -> Self {
        let cells: Vec<usize> = (0..nodes.cell_count()).filter(|&cell| seen(cell)).collect();
        let free = self::seen(nodes, &cells);
        let constraints = nodes.constraints().iter().chain(ghosts).cloned().collect();
        let free_count = free.iter().filter(|&&f| f).count();
        Self { nodes: nodes.clone(), free, free_count, constraints, poorly_supported: Vec::new() }
    }

    /// The nodes.
    pub fn nodes(&self) -> &NodeMap<D> {
        &self.nodes
    }

    /// Length of a vector.
    pub fn dim(&self) -> usize {
        self.free.len()
    }

    /// Whether the pressure of a node is an unknown.
    pub fn is_free(&self, node: usize) -> bool {
        self.free[node]
    }

    /// The poorly supported pressures that are unknowns.
    pub fn poorly_supported(&self) -> &[u32] {
        &self.poorly_supported
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
    /// divergence is spread evenly.
    pub fn remove_mean<T: Scalar>(&self, q: &mut [T]) {
        let sum: f64 = q.iter().zip(&self.free).filter(|e| *e.1).map(|e| e.0.to_f64()).sum();
        let mean = T::from_f64(sum / self.free_count.max(1) as f64);
        for (value, &free) in q.iter_mut().zip(&self.free) {
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

/// The free nodes inside bodies.
fn inside<const D: usize>(space: &VelocitySpace<D>, fluid: &[usize], free: &[bool]) -> Vec<bool>
where
    Dim<D>: Space<D>,
{
    let discretisation = space.discretisation();
    let mut inside = vec![false; free.len()];
    for &cell in fluid {
        let velocity = discretisation.velocity.cell(cell);
        for (corner, &q) in discretisation.pressure.cell(cell).iter().enumerate() {
            let at_corner = velocity[velocity_node_at::<D>(corner)];
            inside[q as usize] = free[q as usize] && space.body_of(at_corner as usize).is_some();
        }
    }
    inside
}

/// Constraints of the poorly supported nodes that have outer nodes in a common fluid cell.
fn aggregates<const D: usize>(
    discretisation: &Discretisation<D>,
    fluid: &[usize],
    free: &[bool],
    inside: &[bool],
) -> Vec<Constraint> {
    let corners = discretisation.pressure.nodes_per_cell();
    let mut outer: Vec<Vec<u32>> = vec![Vec::new(); free.len()];
    for &cell in fluid {
        let nodes = discretisation.pressure.cell(cell);
        for &node in nodes.iter().take(corners).filter(|&&q| inside[q as usize]) {
            let supported = nodes.iter().filter(|&&q| free[q as usize] && !inside[q as usize]);
            outer[node as usize].extend(supported);
        }
    }
    let constraint = |(node, mut masters): (usize, Vec<u32>)| {
        masters.sort_unstable();
        let share = 1.0 / masters.len() as f64;
        let mut weighted: Vec<(u32, f64)> = Vec::new();
        for master in masters {
            match weighted.last_mut() {
                Some(last) if last.0 == master => last.1 += share,
                _ => weighted.push((master, share)),
            }
        }
        Constraint { node: node as u32, masters: weighted }
    };
    outer.into_iter().enumerate().filter(|o| !o.1.is_empty()).map(constraint).collect()
}

/// The local velocity node at a corner of a cell.
fn velocity_node_at<const D: usize>(corner: usize) -> usize {
    (0..D).map(|d| 2 * (corner >> d & 1) * 3usize.pow(d as u32)).sum()
}
