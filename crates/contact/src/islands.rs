//! Islands: contacts that are joined by movable particles, solved independently of each other and in
//! parallel.

use std::ops::Range;

use gluey_geom::Vector;

use crate::grid::sort_by_key;
use crate::rows::{GROUND, Row};

/// A connected component of the contact network.
#[derive(Clone, Debug)]
pub(crate) struct Island {
    pub rows: Range<usize>,
    pub slots: Range<usize>,
    /// Whether it has contacts that were never solved for.
    pub is_fresh: bool,
}

/// Particles of an island are numbered by slots; its first slot is the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot<const D: usize> {
    /// Place of the particle, or [`GROUND`].
    pub place: u32,
    pub position: Vector<D>,
    /// Displacement without contact.
    pub free: Vector<D>,
}

/// The partition of a step's contacts. Rows of an island are in the order they were given in.
#[derive(Debug, Default)]
pub(crate) struct Islands<const D: usize> {
    pub islands: Vec<Island>,
    pub rows: Vec<Row<D>>,
    /// Slots of tail and head of each row, within its island.
    pub ends: Vec<[u32; 2]>,
    pub slots: Vec<Slot<D>>,
    /// `c` times the mobility of each slot.
    pub weights: Vec<f64>,
    parents: Vec<u32>,
    island_of: Vec<u32>,
    starts: Vec<u32>,
    /// A root of each row, the rows by island.
    labels: Vec<u32>,
    order: Vec<u32>,
    slot_of: Vec<u32>,
}

/// A way to part contacts.
#[derive(Clone, Copy)]
pub(crate) enum Grouping<'a> {
    /// Into connected components.
    Components,
    /// All into one island, to which these places belong whether contacts join them or not.
    Whole(&'a [u32]),
}

/// Particles in the order of their places.
pub(crate) struct SortedParticles<'a, const D: usize> {
    pub positions: &'a [Vector<D>],
    pub free: &'a [Vector<D>],
    /// `c` times the mobility: 0 for fixed particles, which join no islands.
    pub weights: &'a [f64],
}

impl<const D: usize> Islands<D> {
    /// Parts `rows`.
    pub(crate) fn part(
        &mut self,
        rows: &[Row<D>],
        places: &SortedParticles<'_, D>,
        grouping: Grouping<'_>,
        is_fresh: impl Fn(&Row<D>) -> bool,
    ) {
        let count = match grouping {
            Grouping::Components => self.label(rows, places),
            Grouping::Whole(_) => self.label_as_one(rows),
        };
        let members = if let Grouping::Whole(members) = grouping { members } else { &[] };
        let (labels, islands) = (&self.labels, &self.island_of);
        let island = |k: usize| islands[labels[k] as usize] as usize;
        sort_by_key(rows.len(), count, island, &mut self.starts, &mut self.order);
        self.rows.clear();
        self.rows.extend(self.order.iter().map(|&k| rows[k as usize]));
        self.islands.clear();
        self.ends.clear();
        self.slots.clear();
        self.weights.clear();
        self.slot_of.clear();
        self.slot_of.resize(places.positions.len(), u32::MAX);
        for island in 0..count {
            let range = self.starts[island] as usize..self.starts[island + 1] as usize;
            self.fill(range, places, members, &is_fresh);
        }
    }

    /// Finds the components; afterwards `labels` holds a root for each row, `island_of` the island of each
    /// root. Returns how many islands there are.
    fn label(&mut self, rows: &[Row<D>], places: &SortedParticles<'_, D>) -> usize {
        let count = places.positions.len();
        self.parents.clear();
        self.parents.extend(0..count as u32);
        let movable = |place: u32| place != GROUND && places.weights[place as usize] > 0.0;
        for row in rows.iter().filter(|row| movable(row.tail) && movable(row.head)) {
            join(&mut self.parents, row.tail, row.head);
        }
        self.island_of.clear();
        self.island_of.resize(count, u32::MAX);
        self.labels.clear();
        let mut island_count = 0;
        for row in rows {
            let root = root(&mut self.parents, if movable(row.head) { row.head } else { row.tail });
            if self.island_of[root as usize] == u32::MAX {
                self.island_of[root as usize] = island_count;
                island_count += 1;
            }
            self.labels.push(root);
        }
        island_count as usize
    }

    /// The same with all rows in one island, which is there even without rows.
    fn label_as_one(&mut self, rows: &[Row<D>]) -> usize {
        self.labels.clear();
        self.labels.resize(rows.len(), 0);
        self.island_of.clear();
        self.island_of.push(0);
        1
    }

    /// Numbers the particles of one island.
    fn fill(
        &mut self,
        range: Range<usize>,
        places: &SortedParticles<'_, D>,
        members: &[u32],
        is_fresh: &impl Fn(&Row<D>) -> bool,
    ) {
        let first = self.slots.len();
        self.slots.push(Slot { place: GROUND, position: Vector::zeros(), free: Vector::zeros() });
        self.weights.push(0.0);
        members.iter().for_each(|&place| _ = self.slot(place, first, places));
        for k in range.clone() {
            let Row { tail, head, .. } = self.rows[k];
            let ends = [tail, head].map(|place| self.slot(place, first, places));
            self.ends.push(ends);
        }
        let is_fresh = self.rows[range.clone()].iter().any(is_fresh);
        self.islands.push(Island { rows: range, slots: first..self.slots.len(), is_fresh });
    }

    /// Slot of a place in the island whose slots begin at `first`; a fixed particle has one in each of its
    /// islands.
    fn slot(&mut self, place: u32, first: usize, places: &SortedParticles<'_, D>) -> u32 {
        if place == GROUND {
            return 0;
        }
        let at = place as usize;
        let known = self.slot_of[at] as usize;
        if self.slot_of[at] != u32::MAX && known >= first {
            return (known - first) as u32;
        }
        self.slot_of[at] = self.slots.len() as u32;
        self.slots.push(Slot { place, position: places.positions[at], free: places.free[at] });
        self.weights.push(places.weights[at]);
        (self.slots.len() - 1 - first) as u32
    }
}

/// Root of a place, with the path halved on the way.
fn root(parents: &mut [u32], mut place: u32) -> u32 {
    while parents[place as usize] != place {
        let above = parents[parents[place as usize] as usize];
        parents[place as usize] = above;
        place = above;
    }
    place
}

/// The smaller root becomes that of both.
fn join(parents: &mut [u32], i: u32, j: u32) {
    let (i, j) = (root(parents, i), root(parents, j));
    parents[i.max(j) as usize] = i.min(j);
}
