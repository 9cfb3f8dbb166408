//! A mesh with its velocity and pressure nodes.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{Chunks, Interpolation, NodeMap, ReferenceMatrices, TreeMesh};
use gluey_geom::Vector;
use gluey_linalg::vector;
use gluey_parallel::{Communicator, RankFailure, Traffic};

use super::body_numbers::BodyNumbers;
use super::partition::Partition;
use crate::error::StokesError;

/// A mesh with the nodes of the Q2-Q1 pair. Cheap to clone: clones share all of it.
#[derive(Clone, Debug)]
pub struct Discretisation<const D: usize> {
    /// The mesh.
    pub mesh: Arc<TreeMesh<D>>,
    /// Nodes of the velocity, degree 2.
    pub velocity: Arc<NodeMap<D>>,
    /// Nodes of the pressure, degree 1.
    pub pressure: Arc<NodeMap<D>>,
    /// How operators cut the mesh.
    pub chunks: Arc<Chunks<D>>,
    /// This rank's share, where the mesh is a part of a larger one.
    partition: Option<Arc<Partition<D>>>,
}

impl<const D: usize> Discretisation<D> {
    /// Numbers the nodes of `mesh`.
    pub fn new(mesh: TreeMesh<D>) -> Self {
        let nodes = |degree| Arc::new(NodeMap::new(&mesh, degree));
        let (velocity, pressure) = rayon::join(|| nodes(2), || nodes(1));
        let chunks = Arc::new(Chunks::new(&velocity, &pressure));
        Self { mesh: Arc::new(mesh), velocity, pressure, chunks, partition: None }
    }

    /// A part of a larger mesh: operators are sums over the cells of `partition`, sums over all cells those
    /// of all parts.
    pub fn of_part(partition: Partition<D>) -> Self {
        let [velocity, pressure] = [&partition.velocity, &partition.pressure].map(|nodes| nodes.map.clone());
        let chunks = Arc::new(Chunks::new(&velocity, &pressure));
        Self {
            mesh: partition.part.mesh.clone(),
            velocity,
            pressure,
            chunks,
            partition: Some(partition.into()),
        }
    }

    /// The same mesh as one that no ranks share.
    #[must_use]
    pub fn alone(&self) -> Self {
        Self { partition: None, ..self.clone() }
    }

    /// This rank's share; `None` where the mesh is no part.
    pub fn partition(&self) -> Option<&Partition<D>> {
        self.partition.as_deref()
    }

    /// Whether the mesh is a part of a larger one.
    pub fn is_part(&self) -> bool {
        self.partition.is_some()
    }

    /// The cells that are added up here: all, but in a part.
    pub fn own_cells(&self) -> Range<usize> {
        self.partition().map_or(0..self.mesh.cell_count(), |part| part.part.own())
    }

    /// Whether a cell is added up here.
    pub fn is_own(&self, cell: usize) -> bool {
        self.own_cells().contains(&cell)
    }

    /// Of the values of all bodies, if there are any, those of the bodies near the part.
    pub fn near<T: Clone>(&self, all: &[T]) -> Vec<T> {
        match self.partition() {
            Some(part) => part.bodies.ids.iter().filter_map(|&id| all.get(id as usize).cloned()).collect(),
            None => all.to_vec(),
        }
    }

    /// The values of the bodies near the part that the rank owns, nothing of others.
    pub fn of_owned<T: Clone + Default>(&self, near: &[T]) -> Vec<T> {
        let Some(part) = self.partition() else { return near.to_vec() };
        let mut own = vec![T::default(); near.len()];
        part.own_bodies().for_each(|body| own[body] = near[body].clone());
        own
    }

    /// Sums over ranks of what each has of the bodies near its part; of all bodies. All ranks call this.
    pub fn sums_of_bodies<T: BodyNumbers>(&self, near: Vec<T>) -> Vec<T> {
        let Some(part) = self.partition() else { return near };
        let mut numbers = vec![0.0; near.len() * T::COUNT];
        let of_bodies = near.iter().zip(numbers.chunks_exact_mut(T::COUNT));
        of_bodies.for_each(|(value, numbers)| value.write(numbers));
        part.sums_of_bodies(&numbers, T::COUNT).chunks_exact(T::COUNT).map(T::read).collect()
    }

    /// Whether something holds on any rank. All ranks call this.
    pub fn any(&self, holds: bool) -> bool {
        self.partition().map_or(holds, |part| part.ranks.all_gather(&[u64::from(holds)]).contains(&1))
    }

    /// What the rank has sent so far.
    pub fn traffic(&self) -> Traffic {
        self.partition().map_or_else(Traffic::default, |part| part.ranks.traffic())
    }

    /// Adds up numbers over all ranks.
    pub fn sum_over_ranks(&self, numbers: &mut [f64]) {
        if let Some(part) = self.partition() {
            part.ranks.sum(numbers);
        }
    }

    /// A failure of one rank as one of all, with the number of a body among all. All ranks call this.
    pub fn agreed<T>(&self, outcome: Result<T, StokesError>) -> Result<T, StokesError> {
        let Some(part) = self.partition() else { return outcome };
        let outcome = outcome.map_err(|error| error.with_bodies(|place| part.bodies.ids[place] as usize));
        let elsewhere = |RankFailure { rank, message, .. }| StokesError::Elsewhere { rank, message };
        part.ranks.agreed(outcome).map_err(elsewhere)?
    }

    /// Whether the rank is the one whose run holds a point.
    pub fn is_own_point(&self, point: &Vector<D>) -> bool {
        self.partition().is_none_or(|part| part.owner_of_point(point) == part.ranks.rank())
    }

    /// The index in the whole mesh of an own cell.
    pub fn cell_number(&self, cell: usize) -> usize {
        self.partition().map_or(cell, |part| part.before[0] + cell - part.part.own().start)
    }

    /// The number among all bodies of one of those near the part.
    pub fn body_number(&self, body: u32) -> u32 {
        self.partition().map_or(body, |part| part.bodies.ids[body as usize])
    }

    /// The velocity nodes that this rank owns.
    pub fn own_nodes(&self) -> Range<usize> {
        self.partition().map_or(0..self.velocity.node_count(), |part| part.velocity.owned.clone())
    }

    /// The pressure nodes that this rank owns.
    pub fn own_pressure_nodes(&self) -> Range<usize> {
        self.partition().map_or(0..self.pressure.node_count(), |part| part.pressure.owned.clone())
    }

    /// The velocity nodes that belong to this part.
    pub fn own_velocity_nodes(&self) -> Range<usize> {
        self.partition().map_or(0..self.velocity.node_count(), |part| part.velocity.owned.clone())
    }

    /// Pseudo-random numbers at the own pressures, for any number of ranks those of one; zero at others.
    pub fn pseudo_random_pressures(&self) -> Vec<f32> {
        let mut numbers = vec![0.0; self.pressure.node_count()];
        let before = self.partition().map_or(0, |part| part.before[2]);
        vector::fill_pseudo_random_from(1, before, &mut numbers[self.own_pressure_nodes()]);
        numbers
    }

    /// The same at own velocities and the twists of own bodies of so many, with `width` numbers each.
    pub fn pseudo_random_velocities(&self, bodies: usize, width: usize) -> Vec<f32> {
        let nodal = self.velocity.node_count() * D;
        let mut numbers = vec![0.0; nodal + bodies * width];
        let Some(part) = self.partition() else {
            vector::fill_pseudo_random(1, &mut numbers);
            return numbers;
        };
        let [all, before] = [part.counts[1], part.before[1]];
        let own = part.velocity.owned.start * D..part.velocity.owned.end * D;
        vector::fill_pseudo_random_from(1, before * D, &mut numbers[own]);
        for body in part.own_bodies() {
            let first = all * D + part.bodies.ids[body] as usize * width;
            vector::fill_pseudo_random_from(1, first, &mut numbers[nodal + body * width..][..width]);
        }
        numbers
    }

    /// The interpolation between nodes of this mesh and of one that is finer by one level: on parts to those
    /// that the rank owns.
    pub fn interpolation(&self, fine: &Self, nodes: fn(&Self) -> &Arc<NodeMap<D>>) -> Interpolation<D> {
        match (self.partition(), fine.partition()) {
            (Some(from), Some(to)) => {
                Interpolation::of_parts(&from.part, nodes(self).clone(), &to.part, nodes(fine))
            }
            _ => Interpolation::new(&self.mesh, nodes(self).clone(), &fine.mesh, nodes(fine)),
        }
    }

    /// Level of the smallest cell at each velocity node.
    pub fn finest_levels(&self) -> Cow<'_, [u8]> {
        if let Some(part) = self.partition() {
            return Cow::Borrowed(&part.finest);
        }
        Cow::Owned(finest_levels(&self.mesh, &self.velocity))
    }

    /// Cells of the whole mesh.
    pub fn cell_count(&self) -> usize {
        self.partition().map_or(self.mesh.cell_count(), |part| part.counts[0])
    }

    /// Velocity and pressure unknowns of the whole mesh, as if there were no bodies and no hanging nodes.
    pub fn dof_count(&self) -> usize {
        let here = || [0, self.velocity.node_count(), self.pressure.node_count()];
        let [_, velocities, pressures] = self.partition().map_or_else(here, |part| part.counts);
        velocities * D + pressures
    }

    /// The element matrices of its cells, which are sheared like the box.
    pub fn reference(&self) -> ReferenceMatrices<D> {
        ReferenceMatrices::sheared(self.mesh.shear())
    }

    /// Edge length of the smallest cells.
    pub fn finest_cell_size(&self) -> f64 {
        self.mesh.size(self.mesh.max_level())
    }

    /// Edge length of a cell.
    pub fn cell_size(&self, cell: usize) -> f64 {
        self.mesh.size(self.mesh.cells()[cell].level)
    }
}

/// Level of the smallest cell of a mesh at each node.
pub fn finest_levels<const D: usize>(mesh: &TreeMesh<D>, nodes: &NodeMap<D>) -> Vec<u8> {
    let mut finest = vec![0; nodes.node_count()];
    for (index, cell) in mesh.cells().iter().enumerate() {
        for &node in nodes.cell(index) {
            finest[node as usize] = cell.level.max(finest[node as usize]);
        }
    }
    finest
}
