//! Schur complements of the pressures in gaps narrower than a cell, as in the serial solver: for the
//! pressures `P` of the cells around a cluster of poorly supported ones and the unknown velocities `V` that
//! they act on, `S_P = B_PV A_VV^-1 B_PV^T`, small and dense.
//!
//! A cluster may lie on several ranks. It is called by the least key of its pressures, which spreads from
//! cell to cell and, by the owners of pressures, from rank to rank, and belongs to the rank that owns that
//! pressure. To this rank the others say which velocities their cells have in it, then, once these have
//! places, what their cells add to the matrices.

use std::collections::BTreeMap;

use gluey_fem::{ImplicitTree, ReferenceMatrices};
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, GhostPlan, Wanted, route};
use gluey_stokes::StokesError;
use nalgebra::DMatrix;
use rustc_hash::FxHashMap;

use super::cluster::{Cluster, Label, MASS, NOWHERE, PRESSURE, Place, UNLABELLED, VELOCITY, packed, spread};
use super::mass::{Columns, SharedMass};
use crate::bodies::{Shared, rigid};
use crate::coarse::{Term, forms};
use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

/// The inverses of `S_P` for the gaps of this rank.
pub struct Gaps {
    blocks: Vec<Block>,
    plan: GhostPlan,
    /// Whether any rank has gaps.
    has_any: bool,
    /// Owned pressures, then those of others in own gaps.
    x: Vec<f32>,
    y: Vec<f32>,
}

/// `S_P^-1` of one gap.
struct Block {
    pressures: Vec<u32>,
    inverse: DMatrix<f64>,
}

impl Gaps {
    /// All ranks call this.
    pub fn new<const D: usize>(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        space: &LevelSpace<D>,
        nodes: &GhostPlan,
        pressures: &SharedPressures,
        mass: &SharedMass<'_>,
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        let owned = mass.columns.owned();
        if pressures.poor_count == 0.0 {
            let [x, y] = [(); 2].map(|()| Vec::new());
            return Ok(Self { blocks: Vec::new(), plan: GhostPlan::default(), has_any: false, x, y });
        }
        let ranks = shared.ranks;
        let cells = Cells { space, pressures, columns: &mass.columns, viscosity: mass.viscosity };
        let labels = cells.labels(ranks);
        let members = cells.members(tree, shared, &labels);
        let clusters = Cluster::gathered(ranks, members);
        let places = Places::told(shared, nodes, &cells, &clusters);
        let entries = cells.entries(&places, mass);
        let entries = route(ranks, entries);
        let find = space.pressure.finder();
        let first = space.pressure.owned.start as u32;
        let find = |key: u64| find(key).map(|q| q - first);
        let mut wanted: Vec<Wanted> = Vec::new();
        let mut blocks = Vec::new();
        let mut failure = None;
        for (key, cluster) in &clusters {
            let place = |&[key, owner]: &[u64; 2]| {
                if owner as usize == ranks.rank() {
                    return find(key).expect("ranks agree on who owns what");
                }
                let place = (owned + wanted.len()) as u32;
                wanted.push(Wanted { owner: owner as usize, key, place });
                place
            };
            let pressures: Vec<u32> = cluster.pressures.iter().map(place).collect();
            match cluster.inverse(*key, &entries) {
                Ok(inverse) => blocks.push(Block { pressures, inverse }),
                Err(matrix) => {
                    failure = failure.or(Some(StokesError::GapPressures {
                        matrix,
                        place: cells.point(*key),
                        pressures: cluster.pressures.len(),
                        velocities: cluster.velocities.len(),
                    }));
                }
            }
        }
        let [x, y] = [0, 1].map(|_| vec![0.0; owned + wanted.len()]);
        let plan = GhostPlan::new(ranks, wanted, find);
        match failure {
            Some(error) => Err(error),
            None => Ok(Self { blocks, plan, has_any: true, x, y }),
        }
    }

    /// `z += S_P^-1 r` on the pressures of every gap.
    pub fn add(&mut self, ranks: &dyn Communicator, r: &[f32], z: &mut [f32]) {
        let Self { blocks, plan, has_any, x, y } = self;
        if !*has_any {
            return;
        }
        x[..r.len()].copy_from_slice(r);
        plan.update::<f32, 1>(ranks, x);
        y.fill(0.0);
        for Block { pressures, inverse } in blocks {
            for (&q, row) in pressures.iter().zip(inverse.row_iter()) {
                let terms = row.iter().zip(&*pressures).map(|(s, &p)| s * f64::from(x[p as usize]));
                y[q as usize] += terms.sum::<f64>() as f32;
            }
        }
        plan.accumulate::<f32, 1>(ranks, y);
        z.iter_mut().zip(y).for_each(|(z, y)| *z += *y);
    }
}

/// Where the unknowns of a rank stand in clusters.
struct Places {
    /// By the position of a velocity or twist in a vector of the part.
    velocities: FxHashMap<u32, Vec<Place>>,
    /// By number; a pressure is in one cluster at most.
    pressures: Vec<Place>,
}

impl Places {
    /// Owners of clusters tell those of unknowns, and these their neighbours.
    fn told<const D: usize>(
        shared: &Shared<'_, '_, D>,
        nodes: &GhostPlan,
        cells: &Cells<'_, D>,
        clusters: &BTreeMap<u64, Cluster>,
    ) -> Self
    where
        Dim<D>: Space<D>,
    {
        let (space, columns, ranks) = (cells.space, cells.columns, shared.ranks);
        let me = ranks.rank() as u64;
        let mut told = Vec::new();
        for (&key, cluster) in clusters {
            for (place, &[name, component, owner]) in cluster.velocities.iter().enumerate() {
                told.push((owner as usize, [VELOCITY, name, component, key, me, place as u64]));
            }
            for (place, &[name, owner]) in cluster.pressures.iter().enumerate() {
                told.push((owner as usize, [PRESSURE, name, 0, key, me, place as u64]));
            }
        }
        let (node, pressure) = (space.velocity.finder(), space.pressure.finder());
        let mut velocities: FxHashMap<u32, Vec<Place>> = FxHashMap::default();
        let mut pressures = vec![NOWHERE; columns.len()];
        for [kind, name, component, key, owner, place] in route(ranks, told) {
            let place = (Label { key, owner }, place as u32);
            if kind == PRESSURE {
                let at = pressure(name).expect("ranks agree on who owns what");
                pressures[columns.number(at)] = place;
                continue;
            }
            let first = match u64::MAX - name {
                body if body < space_of_names(shared) => {
                    let own = &space.bodies.ids[..space.bodies.owned];
                    let at = own.binary_search(&(body as u32)).expect("ranks agree on who owns what");
                    space.nodal_dim() + at * rigid::<D>()
                }
                _ => node(name).expect("ranks agree on who owns what") as usize * D,
            };
            velocities.entry((first + component as usize) as u32).or_default().push(place);
        }
        velocities.values_mut().for_each(|places| places.sort_unstable());
        let mut told = Self { velocities, pressures };
        told.share_velocities(ranks, nodes, space);
        let mut pressures: Vec<u64> =
            told.pressures.iter().flat_map(|at| [at.0.key, at.0.owner, u64::from(at.1)]).collect();
        columns.plan.clone().update::<u64, 3>(ranks, &mut pressures);
        let place = |&[key, owner, place]: &[u64; 3]| (Label { key, owner }, place as u32);
        told.pressures = pressures.as_chunks::<3>().0.iter().map(place).collect();
        told
    }

    /// From owners of nodes and bodies to the ranks that have ghosts of them.
    fn share_velocities<const D: usize>(
        &mut self,
        ranks: &dyn Communicator,
        nodes: &GhostPlan,
        space: &LevelSpace<D>,
    ) {
        let plans = [(nodes, D, 0), (&space.bodies.plan, rigid::<D>(), space.nodal_dim())];
        for (plan, width, first) in plans {
            let write = |place: u32, list: &mut Vec<u64>| {
                for component in 0..width {
                    let at = (first + place as usize * width + component) as u32;
                    for &(Label { key, owner }, place) in self.velocities.get(&at).into_iter().flatten() {
                        list.extend([component as u64, key, owner, u64::from(place)]);
                    }
                }
            };
            let lists = plan.lists(ranks, write);
            for (place, list) in lists {
                for &[component, key, owner, at] in list.as_chunks::<4>().0 {
                    let position = first + place as usize * width + component as usize;
                    let places = self.velocities.entry(position as u32).or_default();
                    places.push((Label { key, owner }, at as u32));
                }
            }
        }
    }
}

/// Names from here up to `u64::MAX`, counted from there, are those of bodies.
fn space_of_names<const D: usize>(shared: &Shared<'_, '_, D>) -> u64 {
    shared.bodies.balls().len() as u64
}

/// The own cells in terms of the unknowns.
struct Cells<'a, const D: usize> {
    space: &'a LevelSpace<D>,
    pressures: &'a SharedPressures,
    columns: &'a Columns,
    viscosity: f64,
}

impl<const D: usize> Cells<'_, D>
where
    Dim<D>: Space<D>,
{
    /// The unknowns at each corner of a cell, by number.
    fn pressures_of(&self, cell: usize) -> Vec<Vec<(usize, f64)>> {
        let nodes = &self.space.pressure;
        let terms = |&node: &u32| {
            let mut terms = Vec::new();
            self.pressures.for_each_term(nodes, node, |q, w| terms.push((self.columns.number(q), w)));
            terms
        };
        nodes.map.cell(cell).iter().map(terms).collect()
    }

    /// The nodal velocities of a cell in the unknowns.
    fn velocities_of(&self, cell: usize) -> Vec<Vec<Term>> {
        let nodes = self.space.velocity.map.cell(cell).iter();
        nodes.flat_map(|&node| forms(self.space, node)).collect()
    }

    /// The cluster of each pressure: those of the cells with a poorly supported one; cells that share any are
    /// in one cluster.
    fn labels(&self, ranks: &dyn Communicator) -> Vec<Label> {
        let (space, count) = (self.space, self.columns.len());
        let mut plan = self.columns.plan.clone();
        let mut poor: Vec<f64> = self.pressures.is_poor.iter().map(|&is| f64::from(u8::from(is))).collect();
        poor.resize(count, 0.0);
        plan.update::<f64, 1>(ranks, &mut poor);
        let is_fluid = |&cell: &usize| space.bodies.is_fluid(space.velocity.map.cell(cell));
        let groups: Vec<Vec<usize>> = (space.own_cells().filter(is_fluid))
            .map(|cell| self.pressures_of(cell).into_iter().flatten().map(|term| term.0).collect())
            .filter(|group: &Vec<usize>| group.iter().any(|&q| poor[q] > 0.0))
            .collect();
        let mut labels = vec![UNLABELLED; count];
        for &q in groups.iter().flatten() {
            let (owner, key) = self.columns.name(ranks.rank(), space, q);
            labels[q] = Label { key, owner: owner as u64 };
        }
        loop {
            spread(&groups, &mut labels);
            let before = labels.clone();
            plan.accumulate::<Label, 1>(ranks, &mut labels);
            plan.update::<Label, 1>(ranks, &mut labels);
            let mut changes = [labels.iter().zip(&before).filter(|(a, b)| a != b).count() as f64];
            ranks.sum(&mut changes);
            if changes[0] == 0.0 {
                return labels;
            }
        }
    }

    /// What the owners of clusters are told: velocities on which their pressures act in own cells, and the
    /// own pressures.
    fn members(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        labels: &[Label],
    ) -> Vec<(usize, [u64; 5])> {
        let mut acted_on: Vec<(Label, u32)> = Vec::new();
        for cell in self.space.own_cells() {
            let mut here: Vec<Label> =
                self.pressures_of(cell).iter().flatten().map(|term| labels[term.0]).collect();
            here.sort_unstable();
            here.dedup();
            for label in here.into_iter().filter(|&label| label != UNLABELLED) {
                acted_on.extend(self.velocities_of(cell).iter().flatten().map(|term| (label, term.0)));
            }
        }
        acted_on.sort_unstable();
        acted_on.dedup();
        let mut told = Vec::new();
        for (label, position) in acted_on {
            let (owner, name, component) = self.name(tree, shared, position as usize);
            let record = [label.key, VELOCITY, name, component as u64, owner as u64];
            told.push((label.owner as usize, record));
        }
        for (q, label) in labels[..self.columns.owned()].iter().enumerate() {
            if *label != UNLABELLED {
                let (owner, key) = self.columns.name(shared.ranks.rank(), self.space, q);
                told.push((label.owner as usize, [label.key, PRESSURE, key, 0, owner as u64]));
            }
        }
        told
    }

    /// Who owns the unknown at a position in a vector of the part, what it is called, and its component.
    fn name(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        position: usize,
    ) -> (usize, u64, usize) {
        let space = self.space;
        if let Some(twist) = position.checked_sub(space.nodal_dim()) {
            let body = space.bodies.ids[twist / rigid::<D>()];
            let owner = shared.owner(tree, &shared.bodies.balls()[body as usize]);
            return (owner, u64::MAX - u64::from(body), twist % rigid::<D>());
        }
        let node = position / D;
        let owner = match space.velocity.owned.contains(&node) {
            true => shared.ranks.rank(),
            false => {
                let point = space.velocity.map.lattice_point(node);
                shared.cuts.owner(tree.first_touching(space.part.mesh.max_level(), 2, point))
            }
        };
        (owner, space.velocity.map.key(node), position % D)
    }

    /// What own cells add to the matrices of clusters, and the entries of the mass, for their owners.
    fn entries(&self, places: &Places, mass: &SharedMass<'_>) -> Vec<(usize, [u64; 3])> {
        let mut sums: BTreeMap<Label, FxHashMap<u64, f64>> = BTreeMap::new();
        for cell in self.space.own_cells() {
            let velocities = self.velocities_of(cell);
            let mut here: Vec<Label> = (velocities.iter().flatten())
                .flat_map(|term| places.velocities.get(&term.0).into_iter().flatten().map(|place| place.0))
                .collect();
            here.sort_unstable();
            here.dedup();
            for label in here {
                self.add_cell(cell, label, &velocities, places, sums.entry(label).or_default());
            }
        }
        for (q, &(label, row)) in places.pressures[..self.columns.owned()].iter().enumerate() {
            if label == UNLABELLED {
                continue;
            }
            for &column in mass.columns_of(q) {
                let (other, place) = places.pressures[column as usize];
                if other == label {
                    let sums = sums.entry(label).or_default();
                    *sums.entry(packed(MASS, row, place)).or_default() += mass.entry(q, column as usize);
                }
            }
        }
        let mut entries = Vec::new();
        for (label, sums) in sums {
            let mut sums: Vec<(u64, f64)> = sums.into_iter().collect();
            sums.sort_unstable_by_key(|sum| sum.0);
            let record = |(at, value): (u64, f64)| (label.owner as usize, [label.key, at, value.to_bits()]);
            entries.extend(sums.into_iter().map(record));
        }
        entries
    }

    fn add_cell(
        &self,
        cell: usize,
        label: Label,
        velocities: &[Vec<Term>],
        places: &Places,
        sums: &mut FxHashMap<u64, f64>,
    ) {
        let (n, reference) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::new());
        let mesh = &self.space.part.mesh;
        let h = mesh.size(mesh.cells()[cell].level);
        let (viscous, divergence) = (self.viscosity * h.powi(D as i32 - 2), h.powi(D as i32 - 1));
        let place = |position: u32| {
            let at = places.velocities.get(&position)?;
            at.iter().find(|place| place.0 == label).map(|place| place.1)
        };
        let placed = |terms: &Vec<Term>| -> Vec<(u32, f64)> {
            terms.iter().filter_map(|&(k, w)| Some((place(k)?, w))).collect()
        };
        let rows: Vec<Vec<(u32, f64)>> = velocities.iter().map(placed).collect();
        let mut add = |kind: u64, rows: &[(u32, f64)], columns: &[(u32, f64)], value: f64| {
            for &(i, v) in rows {
                columns
                    .iter()
                    .for_each(|&(j, w)| *sums.entry(packed(kind, i, j)).or_default() += v * w * value);
            }
        };
        for (i, row) in rows.iter().enumerate().filter(|row| !row.1.is_empty()) {
            for (j, column) in rows.iter().enumerate() {
                add(VELOCITY, row, column, viscous * reference.viscous[i * n + j]);
            }
        }
        for (corner, terms) in self.pressures_of(cell).iter().enumerate() {
            let of_label = |&(q, w): &(usize, f64)| {
                let (other, place) = places.pressures[q];
                (other == label).then_some((place, w))
            };
            let column: Vec<(u32, f64)> = terms.iter().filter_map(of_label).collect();
            for (j, row) in rows.iter().enumerate() {
                add(PRESSURE, row, &column, divergence * reference.divergence[corner * n + j]);
            }
        }
    }

    /// Where an owned pressure is.
    fn point(&self, key: u64) -> Vec<f64> {
        let find = self.space.pressure.finder();
        find(key)
            .map_or_else(Vec::new, |q| self.space.pressure.map.point(q as usize).iter().copied().collect())
    }
}
