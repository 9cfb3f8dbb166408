//! A rank's share of a mesh that ranks have in parts: its cells, the nodes and twists that it owns, and where
//! those of others are.

use gluey_fem::{Cell, Cuts, Part};
use gluey_geom::{Dim, Vector};
use gluey_parallel::{Communicator, GhostPlan, Halo, Ranks, Wanted};

use super::part_nodes::PartNodes;

/// A rank's share of a mesh.
#[derive(Clone, Debug)]
pub struct Partition<const D: usize> {
    /// The ranks.
    pub ranks: Ranks,
    /// Where the order of cells is cut, on the finest lattice.
    pub cuts: Cuts,
    /// The cells, of which this rank adds its own up.
    pub part: Part<D>,
    /// Velocity nodes.
    pub velocity: PartNodes<D>,
    /// Pressure nodes.
    pub pressure: PartNodes<D>,
    /// Cells, velocity nodes and pressure nodes of the whole mesh.
    pub counts: [usize; 3],
    /// Those of ranks before this one.
    pub before: [usize; 3],
    /// Velocity nodes on which its cells depend, hanging ones by their masters.
    pub needed: Vec<bool>,
    /// Those of them that others own.
    pub ghosts: GhostPlan,
    /// The halo of all pressures.
    pub pressures: Halo,
    /// Level of the smallest cell of the whole mesh at each velocity node of the part.
    pub finest: Vec<u8>,
    /// The bodies near the part.
    pub bodies: PartBodies,
    /// Whether the part is the whole mesh.
    pub is_whole: bool,
}

/// The bodies near a part of a mesh.
#[derive(Clone, Debug, Default)]
pub struct PartBodies {
    /// Their numbers among all bodies, in ascending order.
    pub ids: Vec<u32>,
    /// The ranks that own their twists.
    pub owners: Vec<usize>,
    /// Number of all bodies.
    pub all: usize,
}

impl<const D: usize> Partition<D> {
    /// The halos of reduced velocities, and of a square matrix for each twist: of the bodies with needed
    /// nodes, and of all with nodes in the part, for nodes that are `solid`. All ranks call this.
    pub fn halos(&self, solid: &[Option<u32>]) -> [Halo; 2] {
        let (n, size, first) = (Dim::<D>::RIGID, Dim::<D>::RIGID * Dim::<D>::RIGID, solid.len() * D);
        let [mut here, mut needed] = [(); 2].map(|()| vec![false; self.bodies.ids.len()]);
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
        let nodes = std::iter::once(self.velocity.owned.start * D..self.velocity.owned.end * D);
        [
            Halo::new(&self.ranks, velocities, nodes.chain(own(first, n)).collect()),
            Halo::new(&self.ranks, matrices, own(0, size).collect()),
        ]
    }

    /// The plan of the twists of other ranks' bodies, of those `here`, by their places among those near the
    /// part. All ranks call this.
    pub fn twists(&self, here: &[bool]) -> GhostPlan {
        let PartBodies { ids, owners, .. } = &self.bodies;
        let is_ghost = |&place: &usize| here[place] && owners[place] != self.ranks.rank();
        let wanted = (0..ids.len()).filter(is_ghost).map(|place| Wanted {
            owner: owners[place],
            key: u64::from(ids[place]),
            place: place as u32,
        });
        let find = |key: u64| ids.binary_search(&(key as u32)).ok().map(|place| place as u32);
        GhostPlan::new(&self.ranks, wanted.collect(), find)
    }
}

impl<const D: usize> Partition<D> {
    /// The share of the rank in a mesh of which it has this part, with the level of the smallest cell at each
    /// velocity node. All ranks call this.
    pub fn new(
        ranks: &Ranks,
        cuts: &Cuts,
        part: Part<D>,
        [velocity, pressure]: [PartNodes<D>; 2],
        finest: Vec<u8>,
        bodies: PartBodies,
    ) -> Self {
        let own = [part.own().len(), velocity.owned.len(), pressure.owned.len()];
        let of_ranks = ranks.all_gather(&own.map(|count| count as u64));
        let of_ranks = of_ranks.as_chunks::<3>().0;
        let sums = |ranks: &[[u64; 3]]| [0, 1, 2].map(|k| ranks.iter().map(|of| of[k] as usize).sum());
        let (needed, needed_pressures) = (velocity.needed(part.inner()), pressure.needed(part.inner()));
        let pressures = pressure.ghosts(ranks, |node| needed_pressures[node]);
        Self {
            counts: sums(of_ranks),
            before: sums(&of_ranks[..ranks.rank()]),
            ghosts: velocity.ghosts(ranks, |node| needed[node]),
            pressures: Halo::new(ranks, pressures, vec![pressure.owned.clone()]),
            is_whole: ranks.rank() == 0 && part.inner().len() == part.mesh.cell_count(),
            ranks: ranks.clone(),
            cuts: cuts.clone(),
            part,
            velocity,
            pressure,
            needed,
            finest,
            bodies,
        }
    }

    /// Sums over ranks of `count` numbers of each body, from what each has of those near its part; of all
    /// bodies. All ranks call this.
    pub fn sums_of_bodies(&self, near: &[f64], count: usize) -> Vec<f64> {
        let mut all = vec![0.0; self.bodies.all * count];
        for (numbers, &id) in near.chunks_exact(count).zip(&self.bodies.ids) {
            all[id as usize * count..][..count].copy_from_slice(numbers);
        }
        if !all.is_empty() {
            self.ranks.sum(&mut all);
        }
        all
    }

    /// The bodies whose twists this rank owns, by their places among those near the part.
    pub fn own_bodies(&self) -> impl Iterator<Item = usize> {
        let rank = self.ranks.rank();
        self.bodies.owners.iter().enumerate().filter(move |of| *of.1 == rank).map(|of| of.0)
    }

    /// The rank whose run holds a point, or what is nearest to it in the box.
    pub fn owner_of_point(&self, point: &Vector<D>) -> usize {
        owner_of_point(&self.part.mesh, &self.cuts, point)
    }
}

/// The rank whose run holds a point, or what is nearest to it in the box, where the order of the cells of a
/// mesh is cut at some keys of its finest lattice.
pub fn owner_of_point<const D: usize>(
    mesh: &gluey_fem::TreeMesh<D>,
    cuts: &Cuts,
    point: &Vector<D>,
) -> usize {
    let (arm, level) = (point - mesh.domain().lower, mesh.max_level());
    let h = mesh.size(level);
    let coords = std::array::from_fn(|d| {
        let count = i64::from(mesh.roots()[d]) << level;
        let cell = (arm[d] / h).floor() as i64;
        let wrapped = if mesh.periodic()[d] { cell.rem_euclid(count) } else { cell };
        wrapped.clamp(0, count - 1) as u32
    });
    cuts.owner(mesh.key(&Cell { level, coords }))
}
