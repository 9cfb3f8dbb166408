//! Pressures that ranks share: which are unknowns, and those in bodies, which follow from others.
//!
//! As in the serial solver: a pressure that touches no cell in which something flows is no unknown; one
//! inside a body that does touch such a cell takes the mean of those outside that share one with it. The rank
//! that owns the node knows all cells around it, and tells the others the row; the nodes it names may lie in
//! cells that the others do not hold.

use gluey_fem::{Constraint, ImplicitTree};
use gluey_geom::{Dim, Space};
use gluey_linalg::Scalar;
use gluey_parallel::{Communicator, GhostPlan, Wanted};
use gluey_stokes::PressureSpace;
use rustc_hash::FxHashMap;

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
    /// Whether bodies share cells without a free node anywhere: divergences need not sum to zero then.
    pub has_bridges: bool,
    /// Owned unknowns inside bodies, which no outer one can speak for: they lie in gaps.
    pub is_poor: Vec<bool>,
    /// Number of these on all ranks.
    pub poor_count: f64,
    /// The ghosts of `plan`, by their places.
    pub ghosts: Vec<Wanted>,
    /// Free ones at all nodes of the part and elsewhere.
    keeps: Vec<bool>,
    /// By their nodes.
    rows: Vec<Constraint>,
}

impl SharedPressures {
    /// All ranks call this.
    pub fn new<const D: usize>(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        space: &LevelSpace<D>,
    ) -> Self {
        let ranks = shared.ranks;
        let nodes = &*space.pressure;
        let everywhere = wanted_nodes(tree, shared, &space.part, nodes, |node| !nodes.map.is_hanging(node));
        let owners: FxHashMap<u32, usize> = everywhere.iter().map(|w| (w.place, w.owner)).collect();
        let wide = GhostPlan::new(ranks, everywhere.clone(), nodes.finder());
        let (mut free, inside) = free_and_inside(ranks, &wide, space);
        let own_rows = rows_of_owned(space, &free, &inside);
        let mut follows = vec![0.0; free.len()];
        own_rows.iter().for_each(|row| follows[row.node as usize] = 1.0);
        wide.clone().update::<f64, 1>(ranks, &mut follows);
        free.iter_mut().zip(&follows).for_each(|(free, &follows)| *free &= follows == 0.0);

        let needed = nodes.needed(&space.part);
        let places = Places { rank: ranks.rank(), owners: &owners };
        let hot = wide.restricted(ranks, |node| needed[node as usize]);
        let (mut rows, elsewhere) = places.gathered_rows(ranks, space, &hot, own_rows, &follows);
        rows.sort_unstable_by_key(|row| row.node);
        let mut is_needed = needed;
        rows.iter().flat_map(|row| &row.masters).for_each(|&(master, _)| {
            if let Some(needed) = is_needed.get_mut(master as usize) {
                *needed = true;
            }
        });
        let in_part =
            everywhere.into_iter().filter(|w| is_needed[w.place as usize] && free[w.place as usize]);
        let mut ghosts: Vec<Wanted> = in_part.chain(elsewhere.iter().copied()).collect();
        ghosts.sort_unstable_by_key(|ghost| ghost.place);
        let plan = GhostPlan::new(ranks, ghosts.clone(), nodes.finder());
        let is_free = free[nodes.owned.clone()].to_vec();
        let is_poor: Vec<bool> = nodes.owned.clone().map(|node| free[node] && inside[node]).collect();
        let bridges = space.own_cells().filter(|&cell| !space.bodies.is_fluid(space.velocity.map.cell(cell)));
        let count = |of: &[bool]| of.iter().filter(|is| **is).count() as f64;
        let mut sums = [count(&is_free), bridges.count() as f64, count(&is_poor)];
        ranks.sum(&mut sums);
        free.resize(free.len() + elsewhere.len(), true);
        let [free_count, bridge_count, poor_count] = sums;
        let has_bridges = bridge_count > 0.0;
        Self { plan, is_free, free_count, has_bridges, is_poor, poor_count, ghosts, keeps: free, rows }
    }

    /// Around surfaces that cut cells: those of the space of the part, which knows the aggregates of its own
    /// cells. Constants are in the kernel but for rounding of the moments, so means are removed. All ranks
    /// call this.
    pub fn around_surfaces<const D: usize>(
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
        let is_poor = vec![false; is_free.len()];
        let (free_count, poor_count) = (free_count[0], 0.0);
        Self { plan, is_free, free_count, has_bridges: true, is_poor, poor_count, ghosts, keeps, rows }
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

    /// Sets the pressures that follow from others, all of which are known, but for hanging nodes.
    pub fn expand<T: Scalar>(&self, p: &mut [T]) {
        for row in &self.rows {
            let term = |&(master, weight): &(u32, f64)| weight * p[master as usize].to_f64();
            p[row.node as usize] = T::from_f64(row.masters.iter().map(term).sum());
        }
    }

    /// The transpose, after which only unknowns have entries.
    pub fn reduce<T: Scalar>(&self, q: &mut [T]) {
        for row in &self.rows {
            let value = std::mem::replace(&mut q[row.node as usize], T::ZERO);
            row.masters.iter().for_each(|&(m, weight)| q[m as usize] += T::from_f64(weight) * value);
        }
        q.iter_mut().zip(&self.keeps).filter(|(_, keeps)| !**keeps).for_each(|(q, _)| *q = T::ZERO);
    }

    /// Makes the entries at owned nodes sum to zero over all ranks.
    pub fn remove_mean<T: Scalar>(&self, ranks: &dyn Communicator, q: &mut [T]) {
        let mut sum = [q.iter().zip(&self.is_free).filter(|e| *e.1).map(|e| e.0.to_f64()).sum()];
        ranks.sum(&mut sum);
        let mean = T::from_f64(sum[0] / self.free_count.max(1.0));
        q.iter_mut().zip(&self.is_free).filter(|e| *e.1).for_each(|(q, _)| *q -= mean);
    }
}

/// Of each node of the part: whether it touches a cell in which something flows, directly or through a
/// hanging node, and whether it lies in a body then.
fn free_and_inside<const D: usize>(
    ranks: &dyn Communicator,
    plan: &GhostPlan,
    space: &LevelSpace<D>,
) -> (Vec<bool>, Vec<bool>) {
    let map = &space.pressure.map;
    let [mut seen, mut inside] = [0, 1].map(|_| vec![0.0; map.node_count()]);
    for cell in space.own_cells().filter(|&cell| space.bodies.is_fluid(space.velocity.map.cell(cell))) {
        let velocity = space.velocity.map.cell(cell);
        for (corner, &node) in map.cell(cell).iter().enumerate() {
            seen[node as usize] = 1.0;
            let is_in_a_body =
                space.bodies.body_of(velocity[velocity_node_at::<D>(corner)] as usize).is_some();
            inside[node as usize] = f64::from(u8::from(is_in_a_body));
        }
    }
    for constraint in map.constraints() {
        inside[constraint.node as usize] = 0.0;
        if std::mem::take(&mut seen[constraint.node as usize]) > 0.0 {
            constraint.masters.iter().for_each(|m| seen[m.0 as usize] = 1.0);
        }
    }
    let both = |x: &mut [f64]| {
        plan.clone().accumulate::<f64, 1>(ranks, x);
        plan.clone().update::<f64, 1>(ranks, x);
        x.iter().map(|&x| x > 0.0).collect()
    };
    (both(&mut seen), both(&mut inside))
}

/// The rows of the owned nodes inside bodies that have outer nodes in a common cell.
fn rows_of_owned<const D: usize>(space: &LevelSpace<D>, free: &[bool], inside: &[bool]) -> Vec<Constraint> {
    let (map, owned) = (&space.pressure.map, &space.pressure.owned);
    let mut outer: Vec<Vec<u32>> = vec![Vec::new(); owned.len()];
    let is_fluid = |cell: &usize| space.bodies.is_fluid(space.velocity.map.cell(*cell));
    for cell in (0..map.cell_count()).filter(is_fluid) {
        let nodes = map.cell(cell);
        for &node in nodes.iter().filter(|&&q| inside[q as usize] && owned.contains(&(q as usize))) {
            let supported = nodes.iter().filter(|&&q| free[q as usize] && !inside[q as usize]);
            outer[node as usize - owned.start].extend(supported);
        }
    }
    let row = |(k, mut masters): (usize, Vec<u32>)| {
        masters.sort_unstable();
        let share = 1.0 / masters.len() as f64;
        let weighted = masters.chunk_by(|a, b| a == b).map(|same| (same[0], share * same.len() as f64));
        Constraint { node: (owned.start + k) as u32, masters: weighted.collect() }
    };
    outer.into_iter().enumerate().filter(|outer| !outer.1.is_empty()).map(row).collect()
}

/// Who owns the nodes of a part.
struct Places<'a> {
    rank: usize,
    owners: &'a FxHashMap<u32, usize>,
}

impl Places<'_> {
    /// The rows of owned nodes and of the ghosts of a plan, and the nodes elsewhere that they name.
    fn gathered_rows<const D: usize>(
        &self,
        ranks: &dyn Communicator,
        space: &LevelSpace<D>,
        plan: &GhostPlan,
        mut rows: Vec<Constraint>,
        follows: &[f64],
    ) -> (Vec<Constraint>, Vec<Wanted>) {
        let map = &space.pressure.map;
        let write = |node: u32, list: &mut Vec<u64>| {
            let Ok(place) = rows.binary_search_by_key(&node, |row| row.node) else { return };
            for &(master, weight) in &rows[place].masters {
                let owner = self.owners.get(&master).copied().unwrap_or(self.rank);
                list.extend([map.key(master as usize), owner as u64, weight.to_bits()]);
            }
        };
        let lists = plan.lists(ranks, write);
        let local: FxHashMap<u64, u32> = (0..map.node_count()).map(|n| (map.key(n), n as u32)).collect();
        let mut elsewhere: Vec<Wanted> = Vec::new();
        let mut found: FxHashMap<u64, u32> = FxHashMap::default();
        for (node, list) in lists.into_iter().filter(|(node, _)| follows[*node as usize] > 0.0) {
            let mut masters = Vec::new();
            for &[key, owner, weight] in list.as_chunks::<3>().0 {
                let place = local.get(&key).copied().unwrap_or_else(|| {
                    *found.entry(key).or_insert_with(|| {
                        let place = (map.node_count() + elsewhere.len()) as u32;
                        elsewhere.push(Wanted { owner: owner as usize, key, place });
                        place
                    })
                });
                masters.push((place, f64::from_bits(weight)));
            }
            rows.push(Constraint { node, masters });
        }
        (rows, elsewhere)
    }
}

/// The local velocity node at a corner of a cell.
fn velocity_node_at<const D: usize>(corner: usize) -> usize {
    (0..D).map(|d| 2 * (corner >> d & 1) * 3usize.pow(d as u32)).sum()
}
