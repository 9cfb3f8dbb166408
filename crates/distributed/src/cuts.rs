//! Where the order of cells is cut: as many leaves for each rank.

use std::ops::Range;

use gluey_fem::{Cuts, ImplicitTree};
use gluey_parallel::Communicator;

/// Blocks of keys a rank counts, at least: a cut is searched in one of them.
const BLOCKS_OF_A_RANK: usize = 16;

/// Cuts the whole tree into runs that differ by one leaf at most. Each rank counts its share of the tree; all
/// know of the others are the numbers of leaves in some dozen blocks of each.
pub fn equal_cuts<const D: usize>(tree: &ImplicitTree<'_, D>, ranks: &dyn Communicator) -> Cuts {
    let (end, size) = (tree.end(), ranks.size());
    let share = blocks_of_a_rank::<D>(end, size);
    let block = |k: usize| blocks(end, share * size, k)..blocks(end, share * size, k + 1);
    // Answers of other parts of the tree are not needed again.
    let mut asked = tree.forgotten();
    let own = ranks.rank() * share..(ranks.rank() + 1) * share;
    let counts: Vec<u64> = own.map(|k| asked.count_leaves(&block(k)) as u64).collect();
    let counts = ranks.all_gather(&counts);
    let total: u64 = counts.iter().sum();
    let first = ranks.rank() as u64 * total / size as u64;
    let mut before = 0;
    let holder = counts.iter().position(|&count| {
        before += count;
        before > first
    });
    let key = holder.and_then(|k| {
        let within = first + counts[k] - before;
        tree.forgotten().nth_key(&block(k), within as usize)
    });
    let key = if ranks.rank() == 0 { 0 } else { key.unwrap_or(end) };
    Cuts::new(ranks.all_gather(&[key]), end)
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
