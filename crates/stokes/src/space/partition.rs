//! A rank's share of a mesh that ranks have in parts: its cells, the nodes and twists that it owns, and where
//! those of others are.

use std::ops::Range;

use gluey_fem::Part;
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, GhostPlan, Halo, Ranks, Wanted};

/// A rank's share of a mesh.
#[derive(Clone, Debug)]
pub struct Partition<const D: usize> {
    /// The ranks.
    pub ranks: Ranks,
    /// The cells, of which this rank adds its own up.
    pub part: Part<D>,
    /// Velocity nodes that it owns.
    pub nodes: Range<usize>,
    /// Velocity nodes of the whole mesh, and of ranks before this one.
    pub node_counts: [usize; 2],
    /// Pressure nodes of ranks before this one.
    pub pressures_before: usize,
    /// Velocity nodes on which its cells depend, hanging ones by their masters.
    pub needed: Vec<bool>,
    /// Those of them that others own.
    pub ghosts: GhostPlan,
    /// Pressure nodes that it owns.
    pub pressure_nodes: Range<usize>,
    /// The halo of all pressures.
    pub pressures: Halo,
    /// Level of the smallest cell of the whole mesh at each velocity node of the part.
    pub finest: Vec<u8>,
    /// Numbers among all bodies of those near the part, in ascending order.
    pub bodies: Vec<u32>,
    /// The ranks that own their twists.
    pub owners: Vec<usize>,
    /// Whether the part is the whole mesh.
    pub is_whole: bool,
}

impl<const D: usize> Partition<D>
where
    Dim<D>: Space<D>,
{
    /// The halos of reduced velocities, and of a square matrix for each twist: of the bodies with needed
    /// nodes, and of all with nodes in the part, for nodes that are `solid`. All ranks call this.
    pub fn halos(&self, solid: &[Option<u32>]) -> [Halo; 2] {
        let (n, size, first) = (Dim::<D>::RIGID, Dim::<D>::RIGID * Dim::<D>::RIGID, solid.len() * D);
        let [mut here, mut needed] = [(); 2].map(|()| vec![false; self.bodies.len()]);
        for (body, &is_needed) in solid.iter().zip(&self.needed).filter_map(|of| Some(((*of.0)?, of.1))) {
            here[body as usize] = true;
            needed[body as usize] |= is_needed;
        }
        let velocities = [(&self.ghosts, D, 0), (&self.twists(&needed), n, first)];
        let velocities = GhostPlan::joined(&velocities);
        let matrices = GhostPlan::joined(&[(&self.twists(&here), size, 0)]);
        let own = |first: usize, width: usize| {
            self.own_bodies().map(move |body| first + body * width..first + (body + 1) * width)
        };
        let nodes = std::iter::once(self.nodes.start * D..self.nodes.end * D);
        [
            Halo::new(&self.ranks, velocities, nodes.chain(own(first, n)).collect()),
            Halo::new(&self.ranks, matrices, own(0, size).collect()),
        ]
    }

    /// The plan of the twists of other ranks' bodies, of those `here`, by their places among those near the
    /// part. All ranks call this.
    pub fn twists(&self, here: &[bool]) -> GhostPlan {
        let is_ghost = |&place: &usize| here[place] && self.owners[place] != self.ranks.rank();
        let wanted = (0..self.bodies.len()).filter(is_ghost).map(|place| Wanted {
            owner: self.owners[place],
            key: u64::from(self.bodies[place]),
            place: place as u32,
        });
        let find = |key: u64| self.bodies.binary_search(&(key as u32)).ok().map(|place| place as u32);
        GhostPlan::new(&self.ranks, wanted.collect(), find)
    }
}

impl<const D: usize> Partition<D> {
    /// The bodies whose twists this rank owns, by their places among those near the part.
    pub fn own_bodies(&self) -> impl Iterator<Item = usize> {
        let rank = self.ranks.rank();
        self.owners.iter().enumerate().filter(move |of| *of.1 == rank).map(|of| of.0)
    }
}
