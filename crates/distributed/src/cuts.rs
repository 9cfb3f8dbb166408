//! Where the order of cells is cut: as much work for each rank.

use std::ops::Range;

use gluey_fem::{Cell, Cuts, ImplicitTree};
use gluey_geom::Vector;
use gluey_levelset::BallTree;
use gluey_parallel::{Communicator, Ranks};

/// Blocks of keys a rank counts, at least: a cut is searched in one of them.
const BLOCKS_OF_A_RANK: usize = 16;

/// Work on a cell that flows, and on one that a surface cuts (measured: `docs/ranks.md`).
const OF_CELL: u64 = 10;
const OF_CUT_CELL: u64 = 82;
/// Work on a cell without fluid, of which nothing but a coarser level knows.
const OF_SOLID_CELL: u64 = 4;

/// Cuts the whole tree into runs that differ by one leaf at most. Each rank counts its share of the tree; all
/// know of the others are the numbers of leaves in some dozen blocks of each.
pub fn equal_cuts<const D: usize>(tree: &ImplicitTree<'_, D>, ranks: &Ranks) -> Cuts {
    weighted_cuts(tree, ranks, &|_| 1)
}

/// Cuts it into runs of equal weight, as near as leaves allow.
pub fn weighted_cuts<const D: usize>(
    tree: &ImplicitTree<'_, D>,
    ranks: &Ranks,
    weight: &dyn Fn(&Cell<D>) -> u64,
) -> Cuts {
    let (end, size) = (tree.end(), ranks.size());
    let share = blocks_of_a_rank::<D>(end, size);
    let block = |k: usize| blocks(end, share * size, k)..blocks(end, share * size, k + 1);
    // Answers of other parts of the tree are not needed again.
    let mut asked = tree.forgotten();
    let own = ranks.rank() * share..(ranks.rank() + 1) * share;
    let weights: Vec<u64> = own.map(|k| asked.weigh_leaves(&block(k), weight)).collect();
    let weights = ranks.all_gather(&weights);
    let total: u64 = weights.iter().sum();
    let first = (u128::from(total) * ranks.rank() as u128 / size as u128) as u64;
    let mut before = 0;
    let holder = weights.iter().position(|&weight| {
        before += weight;
        before > first
    });
    let key = holder.map(|k| {
        let within = first + weights[k] - before;
        let mut asked = tree.forgotten();
        // The last leaves of a block may weigh less than what is left: the next begins then.
        asked.key_after(&block(k), within, weight).unwrap_or_else(|| asked.end_of_leaf(block(k).end))
    });
    let key = if ranks.rank() == 0 { 0 } else { key.unwrap_or(end) };
    Cuts::new(ranks.all_gather(&[key]), end)
}

/// Cuts it into runs of equal work around bodies whose surfaces cut cells.
pub fn cuts_of_work<const D: usize>(
    tree: &ImplicitTree<'_, D>,
    bodies: &BallTree<'_, D>,
    ranks: &Ranks,
) -> Cuts {
    let frame = tree.frame();
    let weight = |cell: &Cell<D>| {
        let h = frame.size(cell.level);
        let center: Vector<D> = frame.lower_corner(cell).add_scalar(0.5 * h);
        // Half an edge on the way to a surface is what the middles of cut cells have on the mean.
        match bodies.nearest_within(&center, 0.5 * h) {
            None => OF_CELL,
            Some((_, level_set)) if level_set <= 0.5 * h => OF_CUT_CELL,
            Some(_) => OF_SOLID_CELL,
        }
    };
    weighted_cuts(tree, ranks, &weight)
}

/// Blocks of each rank: as many as there are keys, at most.
fn blocks_of_a_rank<const D: usize>(end: u64, size: usize) -> usize {
    BLOCKS_OF_A_RANK.min((end as usize).div_ceil(size)).max(1)
}

/// First key of block `k` of `count`.
fn blocks(end: u64, count: usize, k: usize) -> u64 {
    let range: Range<u128> = 0..u128::from(end);
    (range.end * k as u128 / count as u128) as u64
}
