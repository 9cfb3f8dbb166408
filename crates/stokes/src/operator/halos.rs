//! The halos of the vectors of a system that ranks share.

use gluey_fem::Constraint;
use gluey_geom::Dim;
use gluey_parallel::{GhostPlan, Halo};

use crate::space::{PartNodes, Partition, PressureSpace, VelocitySpace};
use crate::term::Terms;

/// The halos of vectors: nothing on one rank.
#[derive(Clone, Debug, Default)]
pub struct SystemHalos {
    /// Of whole vectors.
    pub all: Halo,
    /// Of their velocities and twists.
    pub velocities: Halo,
    /// Of a square matrix for each twist, row by row.
    pub twist_blocks: Halo,
    /// Of nodal velocities in all cells around own ones that are cut.
    pub around: Halo,
}

impl SystemHalos {
    /// The halos for the unknowns and terms of the system of a part, and that of its pressures. All ranks
    /// call this.
    pub fn new<const D: usize>(
        space: &VelocitySpace<D>,
        pressure: &PressureSpace<D>,
        terms: &Terms<D>,
        partition: &Partition<D>,
    ) -> (Self, Halo) {
        let (ranks, n) = (&partition.ranks, Dim::<D>::RIGID);
        let masters = CellMasters::new(space, &partition.velocity);
        let plan_of =
            |needed: &[bool]| partition.velocity.ghosts(ranks, |node| needed[node] && space.is_free(node));
        let nodes = plan_of(&masters.needed(partition, terms));
        let around = plan_of(&masters.around(partition, terms));
        let twists = partition.twists(&bodies_here(space, terms, partition));
        let pressures = pressure_plan(partition, pressure);
        let (first_twist, first_pressure) = (space.full_dim(), space.dim());
        let first_film = first_pressure + pressure.dim();
        let films = first_film..first_film + terms.iter().map(|term| term.row_count()).sum::<usize>();
        let own_nodes = partition.velocity.owned.start * D..partition.velocity.owned.end * D;
        let own_pressures = partition.pressure.owned.clone();
        let own_twists = |first: usize, width: usize| {
            partition.own_bodies().map(move |body| first + body * width..first + (body + 1) * width)
        };
        let own_velocities: Vec<_> =
            std::iter::once(own_nodes.clone()).chain(own_twists(first_twist, n)).collect();
        let shifted = first_pressure + own_pressures.start..first_pressure + own_pressures.end;
        let own = own_velocities.iter().cloned().chain([shifted, films]).collect();
        let of_velocities = [(&nodes, D, 0), (&twists, n, first_twist)];
        let of_all = [of_velocities[0], of_velocities[1], (&pressures, 1, first_pressure)];
        let of_blocks = GhostPlan::joined(&[(&twists, n * n, 0)]);
        let halos = Self {
            all: Halo::new(ranks, GhostPlan::joined(&of_all), own),
            velocities: Halo::new(ranks, GhostPlan::joined(&of_velocities), own_velocities),
            twist_blocks: Halo::new(ranks, of_blocks, own_twists(0, n * n).collect()),
            around: Halo::new(ranks, GhostPlan::joined(&[(&around, D, 0)]), vec![own_nodes]),
        };
        (halos, Halo::new(ranks, pressures, vec![own_pressures]))
    }
}

/// The plan of the unknown pressures of other ranks on which own cells depend, by themselves or by those that
/// follow from them.
fn pressure_plan<const D: usize>(partition: &Partition<D>, pressure: &PressureSpace<D>) -> GhostPlan {
    let nodes = &partition.pressure;
    let mut needed = nodes.needed(partition.part.own());
    let rows = pressure.constraints().iter().filter(|row| !nodes.map.is_hanging(row.node as usize));
    let masters: Vec<u32> =
        rows.filter(|row| needed[row.node as usize]).flat_map(|row| &row.masters).map(|m| m.0).collect();
    masters.into_iter().for_each(|master| needed[master as usize] = true);
    nodes.ghosts(&partition.ranks, |node| needed[node] && pressure.is_free(node))
}

/// Nodes from which others take their values.
struct CellMasters<'p, const D: usize> {
    nodes: &'p PartNodes<D>,
    ghosts: &'p [Constraint],
    /// The constraint of each node among these, or none.
    ghost_of: Vec<u32>,
}

impl<'p, const D: usize> CellMasters<'p, D> {
    fn new(space: &'p VelocitySpace<D>, nodes: &'p PartNodes<D>) -> Self {
        let ghosts = space.ghosts();
        let mut ghost_of = vec![u32::MAX; nodes.map.node_count()];
        ghosts.iter().zip(0..).for_each(|(ghost, k)| ghost_of[ghost.node as usize] = k);
        Self { nodes, ghosts, ghost_of }
    }

    fn mark(&self, cell: usize, marked: &mut [bool]) {
        for &node in self.nodes.map.cell(cell) {
            for (node, _) in self.nodes.regular(node) {
                marked[node as usize] = true;
                let ghost = self.ghosts.get(self.ghost_of[node as usize] as usize);
                let masters = ghost.into_iter().flat_map(|ghost| &ghost.masters);
                masters.for_each(|master| marked[master.0 as usize] = true);
            }
        }
    }

    /// The nodes that own cells and own films depend on.
    fn needed(&self, partition: &Partition<D>, terms: &Terms<D>) -> Vec<bool> {
        let mut needed = vec![false; self.nodes.map.node_count()];
        partition.part.own().for_each(|cell| self.mark(cell, &mut needed));
        for (k, _) in rows(terms) {
            if let Some(needed) = needed.get_mut(*k as usize / D) {
                *needed = true;
            }
        }
        needed
    }

    /// The nodes that own cut cells and those around them depend on.
    fn around(&self, partition: &Partition<D>, terms: &Terms<D>) -> Vec<bool> {
        let mesh = &partition.part.mesh;
        let mut needed = vec![false; self.nodes.map.node_count()];
        let offset = |k: usize| std::array::from_fn(|d| (k / 3usize.pow(d as u32) % 3) as i32 - 1);
        let own = partition.part.own();
        let pieces = terms.iter().flat_map(|term| term.pieces()).map(|of| of.0);
        for own in pieces.filter(|cell| own.contains(cell)) {
            let near = (0..3usize.pow(D as u32)).filter_map(|k| {
                mesh.neighbour(&mesh.cells()[own], &offset(k)).and_then(|cell| mesh.find(&cell))
            });
            near.for_each(|cell| self.mark(cell, &mut needed));
        }
        needed
    }
}

/// The bodies near the part whose motions own cells or own films depend on, those around own nodes included.
fn bodies_here<const D: usize>(
    space: &VelocitySpace<D>,
    terms: &Terms<D>,
    partition: &Partition<D>,
) -> Vec<bool> {
    let mut here = vec![false; space.body_count()];
    for (cell, body) in terms.iter().flat_map(|term| term.pieces()) {
        here[body] |= partition.part.own().contains(&cell);
    }
    let nodal = space.full_dim();
    for (k, _) in rows(terms) {
        if let Some(twist) = (*k as usize).checked_sub(nodal) {
            here[twist / Dim::<D>::RIGID] = true;
        }
    }
    for &node in partition.velocity.map.cells(partition.part.own()) {
        if let Some(body) = space.body_of(node as usize) {
            here[body as usize] = true;
        }
    }
    here
}

/// Entries of the rows of terms.
fn rows<const D: usize>(terms: &Terms<D>) -> impl Iterator<Item = &(u32, f64)> {
    terms.iter().flat_map(|term| (0..term.row_count()).flat_map(|row| term.row(row)))
}
