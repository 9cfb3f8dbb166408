//! The weighted mass of the pressures over twice the viscosity, in rows of the owned unknowns.
//!
//! Cells of other ranks act on unknowns of this one: what they add to its rows comes in one exchange before
//! the first product, so that a product needs the ghosts' values and nothing more.

use std::sync::Arc;

use gluey_linalg::{LinOp, Pattern, SellMatrix, SparseError, SparseMatrix};
use gluey_parallel::{Communicator, GhostPlan, Ranks, Wanted, route};
use rustc_hash::FxHashMap;

use crate::agreement::agreed;
use crate::flow::FlowError;
use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

/// Calls what it is given with each own cell in which something flows and `int p_q p_r / eta` over its fluid,
/// row by row.
pub type Masses<'a> = dyn Fn(&mut dyn FnMut(usize, &[f64])) + 'a;

/// `T` on the owned pressures.
pub struct SharedMass<'a> {
    pub ranks: &'a Ranks,
    pub columns: Columns,
    /// Its diagonal at the owned pressures.
    pub diagonal: Vec<f32>,
    /// Rows of ghosts are empty.
    rows: SellMatrix<f32>,
    x: Vec<f32>,
    y: Vec<f32>,
}

/// Pressures by number: owned ones in their order, then ghosts.
pub struct Columns {
    /// What others own of them, by number.
    pub ghosts: Vec<Wanted>,
    pub plan: GhostPlan,
    owned: usize,
    first: usize,
    /// Number of each ghost by its place in the part.
    of_place: FxHashMap<u32, u32>,
}

impl Columns {
    fn new<const D: usize>(space: &LevelSpace<D>, pressures: &SharedPressures) -> Self {
        let owned = space.pressure.owned.len();
        let number = |(k, ghost): (usize, &Wanted)| Wanted { place: (owned + k) as u32, ..*ghost };
        let ghosts: Vec<Wanted> = pressures.ghosts.iter().enumerate().map(number).collect();
        let of_place = pressures.ghosts.iter().zip(&ghosts).map(|(at, ghost)| (at.place, ghost.place));
        let (of_place, first) = (of_place.collect(), space.pressure.owned.start);
        Self { ghosts, plan: GhostPlan::default(), owned, first, of_place }
    }

    /// Number of pressures here.
    pub fn len(&self) -> usize {
        self.owned + self.ghosts.len()
    }

    /// Number of a pressure by its place in the part.
    pub fn number(&self, place: u32) -> usize {
        match (place as usize).checked_sub(self.first).filter(|&own| own < self.owned) {
            Some(own) => own,
            None => self.of_place[&place] as usize,
        }
    }

    /// Who owns a pressure, and its key.
    pub fn name<const D: usize>(&self, rank: usize, space: &LevelSpace<D>, number: usize) -> (usize, u64) {
        match number.checked_sub(self.owned) {
            Some(ghost) => (self.ghosts[ghost].owner, self.ghosts[ghost].key),
            None => (rank, space.pressure.map.key(self.first + number)),
        }
    }
}

impl<'a> SharedMass<'a> {
    /// With the weights of the owned pressures. All ranks call this.
    pub fn new<const D: usize>(
        ranks: &'a Ranks,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        masses: &Masses<'_>,
        weights: &[f64],
    ) -> Result<Self, FlowError> {
        let mut columns = Columns::new(space, pressures);
        let cells = Cells { space, pressures, masses };
        let received = cells.rows_of_others(ranks, &columns);
        let received = columns.placed(ranks, space, &received);
        let find = space.pressure.finder();
        let first = space.pressure.owned.start as u32;
        columns.plan = GhostPlan::new(ranks, columns.ghosts.clone(), |key| find(key).map(|q| q - first));

        let mut matrix = agreed(ranks, cells.matrix(&columns, &received))?;
        let owned = columns.owned;
        let mut roots: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
        roots.resize(columns.len(), 1.0);
        columns.plan.update::<f64, 1>(ranks, &mut roots);
        let pattern = matrix.pattern().clone();
        for row in 0..owned {
            let entries = &mut matrix.values_mut()[pattern.range(row)];
            for (value, &column) in entries.iter_mut().zip(pattern.columns_of(row)) {
                *value *= 0.5 * roots[row] * roots[column as usize];
            }
        }
        let [x, y] = [0, 1].map(|_| vec![0.0; columns.len()]);
        let diagonal = (0..owned).map(|q| matrix.get(q, q) as f32).collect();
        Ok(Self { ranks, diagonal, rows: SellMatrix::new(&matrix), columns, x, y })
    }
}

impl Columns {
    /// Entries that came by name, by number; ghosts that were not known are added.
    fn placed<const D: usize>(
        &mut self,
        ranks: &Ranks,
        space: &LevelSpace<D>,
        entries: &[[u64; 4]],
    ) -> Vec<(usize, usize, f64)> {
        let find = space.pressure.finder();
        let mut numbers: FxHashMap<u64, usize> =
            self.ghosts.iter().map(|ghost| (ghost.key, ghost.place as usize)).collect();
        let mut placed = Vec::with_capacity(entries.len());
        for &[row, column, owner, value] in entries {
            let row = find(row).map(|q| q as usize - self.first).expect("ranks agree on who owns what");
            let column = if owner as usize == ranks.rank() {
                find(column).map(|q| q as usize - self.first).expect("ranks agree on who owns what")
            } else {
                *numbers.entry(column).or_insert_with(|| {
                    let place = (self.owned + self.ghosts.len()) as u32;
                    self.ghosts.push(Wanted { owner: owner as usize, key: column, place });
                    place as usize
                })
            };
            placed.push((row, column, f64::from_bits(value)));
        }
        placed
    }
}

/// The mass matrices of the own cells.
struct Cells<'a, const D: usize> {
    space: &'a LevelSpace<D>,
    pressures: &'a SharedPressures,
    masses: &'a Masses<'a>,
}

impl<const D: usize> Cells<'_, D> {
    /// The pressures at the corners of a cell as unknowns, by number.
    fn terms(&self, cell: usize, columns: &Columns) -> Vec<Vec<(usize, f64)>> {
        let nodes = &self.space.pressure;
        let terms = |&node: &u32| {
            let mut terms = Vec::new();
            self.pressures.for_each_term(nodes, node, |q, w| terms.push((columns.number(q), w)));
            terms
        };
        nodes.map.cell(cell).iter().map(terms).collect()
    }

    fn group(&self, cell: usize, columns: &Columns) -> Vec<usize> {
        let mut group: Vec<usize> = self.terms(cell, columns).iter().flatten().map(|term| term.0).collect();
        group.sort_unstable();
        group.dedup();
        group
    }

    fn for_each_entry(&self, columns: &Columns, mut visit: impl FnMut(usize, usize, f64)) {
        (self.masses)(&mut |cell, matrix| {
            let terms = self.terms(cell, columns);
            for (i, rows) in terms.iter().enumerate() {
                for (j, others) in terms.iter().enumerate() {
                    let value = matrix[i * terms.len() + j];
                    for &(row, wr) in rows {
                        others.iter().for_each(|&(column, wc)| visit(row, column, wr * wc * value));
                    }
                }
            }
        });
    }

    /// The rows of the owned pressures, with twos on the diagonal where nothing is unknown: what own cells
    /// and those of others add to them.
    fn matrix(
        &self,
        columns: &Columns,
        received: &[(usize, usize, f64)],
    ) -> Result<SparseMatrix, SparseError> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        (self.masses)(&mut |cell, _| groups.push(self.group(cell, columns)));
        groups.extend(received.iter().map(|entry| vec![entry.0, entry.1]));
        let mut matrix = SparseMatrix::zeros(Arc::new(Pattern::from_groups(columns.len(), &groups)?));
        drop(groups);
        let (owned, mut failed) = (columns.owned, Ok(()));
        self.for_each_entry(columns, |row, column, value| {
            if row < owned {
                failed = failed.and(matrix.add(row, column, value));
            }
        });
        failed?;
        received.iter().try_for_each(|&(row, column, value)| matrix.add(row, column, value))?;
        for q in (0..owned).filter(|&q| !self.pressures.is_free[q]) {
            matrix.add(q, q, 2.0)?;
        }
        Ok(matrix)
    }

    /// Sends what own cells add to rows of others, and returns what others add to own ones: keys of row and
    /// column, who owns the column, and the value.
    fn rows_of_others(&self, ranks: &Ranks, columns: &Columns) -> Vec<[u64; 4]> {
        let mut entries = Vec::new();
        self.for_each_entry(columns, |row, column, value| {
            if row >= columns.owned {
                entries.push((row, column, value));
            }
        });
        entries.sort_by_key(|entry| (entry.0, entry.1));
        let named = entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).map(|same| {
            let (owner, row) = columns.name(ranks.rank(), self.space, same[0].0);
            let (other, column) = columns.name(ranks.rank(), self.space, same[0].1);
            let value: f64 = same.iter().map(|entry| entry.2).sum();
            (owner, [row, column, other as u64, value.to_bits()])
        });
        route(ranks, named.collect())
    }
}

impl LinOp<f32> for SharedMass<'_> {
    fn dim(&self) -> usize {
        self.columns.owned
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.x[..x.len()].copy_from_slice(x);
        self.columns.plan.update::<f32, 1>(self.ranks, &mut self.x);
        self.rows.apply(&self.x, &mut self.y);
        y.copy_from_slice(&self.y[..y.len()]);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.ranks.sum(sums);
    }
}
