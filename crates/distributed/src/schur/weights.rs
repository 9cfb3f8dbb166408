//! How much of its mass a pressure keeps next to walls and bodies, as in the serial solver: with
//! `s_q = (B diag(A)^-1 B^T)_qq` and `m_q = M_qq / eta` the ratio `s_q / m_q` over the same ratio away from
//! all walls.
//!
//! The rank that owns a pressure adds up rows of `B` from its own cells, and from those of others that act on
//! it through hanging nodes and nodes in bodies.

use std::collections::BTreeMap;

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Dim, Space};
use gluey_parallel::{Ranks, route};
use gluey_stokes::part::{LEAST_WEIGHT, ratio_inside};

use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

/// Where something flows that nothing cuts, and which velocities are fixed there.
pub struct Flowing {
    /// Own cells in which something flows.
    pub own: Vec<usize>,
    /// All cells of the part in which something flows.
    pub all: Vec<usize>,
    /// Velocity nodes on walls and in bodies.
    pub is_fixed: Vec<bool>,
}

impl Flowing {
    fn is_fixed(&self, node: u32) -> bool {
        self.is_fixed[node as usize]
    }
}

/// Weights of the owned pressures, one for those that are not unknowns. All ranks call this.
pub fn weights<const D: usize>(
    ranks: &Ranks,
    space: &LevelSpace<D>,
    pressures: &SharedPressures,
    flowing: &Flowing,
    viscosity: f64,
) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let inside = ratio_inside::<D>();
    let ratios = ratios(ranks, space, pressures, flowing, viscosity);
    let weight = |ratio: Option<f64>| ratio.map_or(1.0, |ratio| (ratio / inside).clamp(LEAST_WEIGHT, 1.0));
    ratios.into_iter().map(weight).collect()
}

/// `s_q / m_q` of the owned unknowns next to fixed velocities.
fn ratios<const D: usize>(
    ranks: &Ranks,
    space: &LevelSpace<D>,
    pressures: &SharedPressures,
    flowing: &Flowing,
    viscosity: f64,
) -> Vec<Option<f64>> {
    let special = next_to_fixed(ranks, space, pressures, flowing);
    let rows = Rows::new(space, pressures, flowing, viscosity, |q| special[q]);
    let mut sent = Vec::new();
    for ghost in &pressures.ghosts {
        for (node, [b, a]) in rows.row(ghost.place as usize) {
            for d in 0..D {
                let numbers = [ghost.key, node, d as u64, b[d].to_bits(), a[d].to_bits()];
                sent.push((ghost.owner, numbers));
            }
        }
        let mass = rows.mass(ghost.place as usize);
        if mass > 0.0 {
            sent.push((ghost.owner, [ghost.key, u64::MAX, 0, mass.to_bits(), 0]));
        }
    }
    let mut received = route(ranks, sent);
    received.sort_by_key(|record| record[0]);
    let of = |q: usize| {
        let key = space.pressure.map.key(q);
        let first = received.partition_point(|record| record[0] < key);
        let count = received[first..].iter().take_while(|record| record[0] == key).count();
        &received[first..first + count]
    };
    let ratio = |(q, &is_free): (usize, &bool)| {
        (is_free && special[q]).then(|| {
            let [stiffness, mass] = rows.sums(q, of(q));
            stiffness / mass
        })
    };
    space.pressure.owned.clone().zip(&pressures.is_free).map(ratio).collect()
}

/// Which unknowns act on a cell with a velocity that is that of a wall or of a body.
fn next_to_fixed<const D: usize>(
    ranks: &Ranks,
    space: &LevelSpace<D>,
    pressures: &SharedPressures,
    flowing: &Flowing,
) -> Vec<bool> {
    let is_fixed = |&node: &u32| flowing.is_fixed(node);
    let mut special = vec![0.0; pressures.dim()];
    for &cell in flowing.own.iter().filter(|&&cell| space.velocity.map.cell(cell).iter().any(is_fixed)) {
        for &node in space.pressure.map.cell(cell) {
            pressures.for_each_term(&space.pressure, node, |q, _| special[q as usize] = 1.0);
        }
    }
    let mut plan = pressures.plan.clone();
    plan.accumulate::<f64, 1>(ranks, &mut special);
    plan.update::<f64, 1>(ranks, &mut special);
    special.into_iter().map(|special| special > 0.0).collect()
}

/// A row of `B` at the velocity nodes, by their keys, with the diagonal of `A` there.
type RowOf<const D: usize> = BTreeMap<u64, [[f64; D]; 2]>;

/// Rows of `B` as far as own cells add to them. Hanging nodes count as nodes of their own.
struct Rows<'a, const D: usize> {
    space: &'a LevelSpace<D>,
    flowing: &'a Flowing,
    reference: ReferenceMatrices<D>,
    viscosity: f64,
    /// Of `A`, at the velocity nodes of own cells.
    diagonal: Vec<[f64; D]>,
    /// Where the corners of cells of each pressure are in `corners`.
    firsts: Vec<u32>,
    /// Cell, corner and weight.
    corners: Vec<(u32, u8, f64)>,
}

impl<'a, const D: usize> Rows<'a, D> {
    fn new(
        space: &'a LevelSpace<D>,
        pressures: &SharedPressures,
        flowing: &'a Flowing,
        viscosity: f64,
        special: impl Fn(usize) -> bool,
    ) -> Self {
        let mut of_pressure: Vec<(u32, (u32, u8, f64))> = Vec::new();
        for &cell in &flowing.own {
            for (corner, &node) in space.pressure.map.cell(cell).iter().enumerate() {
                pressures.for_each_term(&space.pressure, node, |q, weight| {
                    if special(q as usize) {
                        of_pressure.push((q, (cell as u32, corner as u8, weight)));
                    }
                });
            }
        }
        of_pressure.sort_by_key(|of| of.0);
        let first = |q: usize| of_pressure.partition_point(|of| (of.0 as usize) < q) as u32;
        let firsts = (0..=pressures.dim()).map(first).collect();
        let corners = of_pressure.into_iter().map(|of| of.1).collect();
        let reference = space.reference();
        let diagonal = diagonal(space, flowing, &reference, viscosity);
        Self { space, flowing, reference, viscosity, diagonal, firsts, corners }
    }

    fn corners_of(&self, q: usize) -> &[(u32, u8, f64)] {
        &self.corners[self.firsts[q] as usize..self.firsts[q + 1] as usize]
    }

    fn size(&self, cell: u32) -> f64 {
        let mesh = &self.space.part.mesh;
        mesh.size(mesh.cells()[cell as usize].level)
    }

    fn mass(&self, q: usize) -> f64 {
        let m = ReferenceMatrices::<D>::PRESSURE;
        let of_corner = |&(cell, corner, weight): &(u32, u8, f64)| {
            let unit = self.reference.pressure_mass[usize::from(corner) * (m + 1)];
            weight * weight * self.size(cell).powi(D as i32) / self.viscosity * unit
        };
        self.corners_of(q).iter().map(of_corner).sum()
    }

    fn row(&self, q: usize) -> RowOf<D> {
        let (n, map) = (ReferenceMatrices::<D>::VELOCITY, &self.space.velocity.map);
        let mut row = RowOf::<D>::new();
        for &(cell, corner, weight) in self.corners_of(q) {
            let divergence = self.reference.divergence[usize::from(corner) * n..][..n].as_chunks::<D>().0;
            let scale = weight * self.size(cell).powi(D as i32 - 1);
            let nodes = map.cell(cell as usize).iter().zip(divergence);
            for (&node, divergence) in nodes.filter(|term| !self.flowing.is_fixed(*term.0)) {
                let new = || [[0.0; D], self.diagonal[node as usize]];
                let entry = row.entry(map.key(node as usize)).or_insert_with(new);
                entry[0].iter_mut().zip(divergence).for_each(|(b, d)| *b += scale * d);
            }
        }
        row
    }

    /// `s_q` and `m_q` with what other ranks sent.
    fn sums(&self, q: usize, received: &[[u64; 5]]) -> [f64; 2] {
        let (mut row, mut mass) = (self.row(q), self.mass(q));
        for &[_, node, d, b, a] in received {
            if node == u64::MAX {
                mass += f64::from_bits(b);
            } else {
                let entry = row.entry(node).or_insert([[0.0; D]; 2]);
                entry[0][d as usize] += f64::from_bits(b);
                entry[1][d as usize] = f64::from_bits(a);
            }
        }
        let of_node = |[b, a]: &[[f64; D]; 2]| b.iter().zip(a).map(|(b, a)| b * b / a).sum::<f64>();
        [row.values().map(of_node).sum(), mass]
    }
}

/// The diagonal of `A` at the velocity nodes of the part; it is whole at those of own cells, since all cells
/// around them are there.
fn diagonal<const D: usize>(
    space: &LevelSpace<D>,
    flowing: &Flowing,
    reference: &ReferenceMatrices<D>,
    viscosity: f64,
) -> Vec<[f64; D]> {
    let (n, mesh, map) = (ReferenceMatrices::<D>::VELOCITY, &space.part.mesh, &space.velocity.map);
    let mut diagonal = vec![[0.0; D]; map.node_count()];
    for &cell in &flowing.all {
        let scale = viscosity * mesh.size(mesh.cells()[cell].level).powi(D as i32 - 2);
        for (i, &node) in map.cell(cell).iter().enumerate() {
            let entries = diagonal[node as usize].iter_mut().enumerate();
            entries.for_each(|(d, entry)| *entry += scale * reference.viscous[(i * D + d) * (n + 1)]);
        }
    }
    diagonal
}
