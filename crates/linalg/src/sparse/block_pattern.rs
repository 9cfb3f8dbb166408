//! Patterns of matrices whose unknowns come in blocks of consecutive numbers, such as the velocity components
//! of a node.
//!
//! The unknowns of a block share their couplings. What depends on couplings alone (the pattern, the places
//! where a cell's matrix goes, the elimination order) is found for blocks and expanded to unknowns, at a
//! fraction of the cost.

use std::sync::Arc;

use super::{Pattern, SparseError, SparseMatrix};
use crate::jagged::Jagged;
use crate::scalar::Scalar;

/// Groups of blocks that are coupled with each other; a group is typically the blocks of a cell.
#[derive(Clone, Debug, Default)]
pub struct BlockGroups {
    groups: Jagged<usize>,
}

impl BlockGroups {
    /// Adds a group with the given blocks in the order of their first appearance.
    pub fn push(&mut self, blocks: impl IntoIterator<Item = usize>) {
        self.groups.push_distinct(blocks);
    }

    /// The groups, in the order they came.
    pub fn iter(&self) -> impl Iterator<Item = &[usize]> {
        self.groups.iter()
    }
}

/// Pattern of a square matrix in blocks, and where in it the matrices of groups go.
#[derive(Clone, Debug)]
pub struct BlockPattern {
    /// Couplings of the blocks.
    blocks: Pattern,
    /// First unknown of each block; one more for the number of unknowns.
    first: Vec<u32>,
    groups: BlockGroups,
    /// For each group and each pair of its blocks, where the second starts in the rows of the first.
    offsets: Vec<u32>,
    pattern: Arc<Pattern>,
}

impl BlockPattern {
    /// Pattern that couples all unknowns of all blocks of a group with each other. Block `b` holds the
    /// unknowns `first[b] .. first[b + 1]`, so `first` ascends from zero and has one entry more than there
    /// are blocks.
    pub fn new(first: Vec<u32>, groups: BlockGroups) -> Result<Self, SparseError> {
        let slices: Vec<&[usize]> = groups.iter().collect();
        let blocks = Pattern::from_groups(first.len().saturating_sub(1), &slices)?;
        let offsets = offsets(&blocks, &first, &groups);
        let pattern = Arc::new(blocks.expanded(&first)?);
        Ok(Self { blocks, first, groups, offsets, pattern })
    }

    /// The pattern of the unknowns.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Couplings of the blocks.
    pub(crate) fn blocks(&self) -> &Pattern {
        &self.blocks
    }

    /// The unknowns of a group of blocks, block after block.
    pub fn unknowns_of(&self, group: &[usize]) -> impl Iterator<Item = usize> {
        group.iter().flat_map(|&block| self.range(block))
    }

    /// The unknowns of a block.
    pub(crate) fn range(&self, block: usize) -> std::ops::Range<usize> {
        self.first[block] as usize..self.first[block + 1] as usize
    }

    /// The sum of dense matrices, one per group. `fill` is called for group after group with its blocks and a
    /// zero matrix to write to, row by row in the order of [`BlockPattern::unknowns_of`].
    pub fn sum<T: Scalar>(&self, mut fill: impl FnMut(&[usize], &mut [T])) -> SparseMatrix<T> {
        let mut matrix = SparseMatrix::zeros(self.pattern.clone());
        let (mut dense, mut offsets) = (Vec::new(), self.offsets.as_slice());
        for group in self.groups.iter() {
            dense.clear();
            dense.resize(self.unknowns_of(group).count().pow(2), T::ZERO);
            fill(group, &mut dense);
            let (own, rest) = offsets.split_at(group.len().pow(2));
            self.add(matrix.values_mut(), group, own, &dense);
            offsets = rest;
        }
        matrix
    }

    fn add<T: Scalar>(&self, values: &mut [T], group: &[usize], offsets: &[u32], mut dense: &[T]) {
        for (&block, offsets) in group.iter().zip(offsets.chunks_exact(group.len())) {
            for row in self.range(block) {
                let target = &mut values[self.pattern.range(row)];
                for (&column, &offset) in group.iter().zip(offsets) {
                    let (piece, rest) = dense.split_at(self.range(column).len());
                    let place = &mut target[offset as usize..][..piece.len()];
                    place.iter_mut().zip(piece).for_each(|(value, &added)| *value += added);
                    dense = rest;
                }
            }
        }
    }
}

/// See [`BlockPattern`]. Goes row by row, where the place of each column can be looked up.
fn offsets(blocks: &Pattern, first: &[u32], groups: &BlockGroups) -> Vec<u32> {
    let (visits, count) = visits(blocks.row_count(), groups);
    let mut offsets = vec![0; count];
    let mut place = vec![0; blocks.row_count()];
    for (row, visits) in visits.iter().enumerate() {
        let mut next = 0;
        for &column in blocks.columns_of(row) {
            place[column as usize] = next;
            next += first[column as usize + 1] - first[column as usize];
        }
        for visit in visits {
            let group = &groups.groups[visit.group as usize];
            let target = &mut offsets[visit.begin..][..group.len()];
            target.iter_mut().zip(group).for_each(|(offset, &column)| *offset = place[column]);
        }
    }
    offsets
}

/// A block of a group, with the begin of its offsets.
#[derive(Clone, Copy)]
struct Visit {
    group: u32,
    begin: usize,
}

/// The groups that each block is in, and the number of offsets.
fn visits(row_count: usize, groups: &BlockGroups) -> (Jagged<Visit>, usize) {
    let mut visits = Vec::with_capacity(groups.groups.items().len());
    let mut begin = 0;
    for (blocks, group) in groups.iter().zip(0..) {
        for &row in blocks {
            visits.push((row, Visit { group, begin }));
            begin += blocks.len();
        }
    }
    (Jagged::grouped(row_count, visits.into_iter()), begin)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: [u32; 5] = [0, 2, 3, 6, 8];
    const GROUPS: [&[usize]; 3] = [&[0, 2], &[3, 1, 2], &[0, 3]];

    fn unknowns(group: &[usize]) -> Vec<usize> {
        group.iter().flat_map(|&b| FIRST[b] as usize..FIRST[b + 1] as usize).collect()
    }

    /// A symmetric dense matrix with a heavy diagonal.
    fn dense(count: usize) -> Vec<f64> {
        let entry = |k: usize| {
            let (i, j) = (k / count, k % count);
            if i == j { 10.0 } else { ((i + j) as f64).sin() }
        };
        (0..count * count).map(entry).collect()
    }

    fn blocked() -> BlockPattern {
        let mut groups = BlockGroups::default();
        GROUPS.iter().for_each(|group| groups.push(group.iter().flat_map(|&block| [block; 2])));
        BlockPattern::new(FIRST.to_vec(), groups).expect("valid")
    }

    fn filled(pattern: &BlockPattern) -> SparseMatrix {
        pattern.sum(|group, target| target.copy_from_slice(&dense(unknowns(group).len())))
    }

    #[test]
    fn blocks_give_the_matrix_that_unknowns_give() {
        let got = filled(&blocked());
        let groups = GROUPS.map(unknowns);
        let plain = Arc::new(Pattern::from_groups(8, &groups).expect("valid"));
        assert_eq!(got.pattern(), &plain);
        let mut want = SparseMatrix::zeros(plain);
        for unknowns in &groups {
            want.add_block(unknowns, &dense(unknowns.len())).expect("in pattern");
        }
        assert_eq!(got.values(), want.values());
    }

    #[test]
    fn unknown_blocks_are_refused() {
        let mut groups = BlockGroups::default();
        groups.push([0, 2]);
        let refused = BlockPattern::new(vec![0, 1, 3], groups);
        assert!(matches!(refused, Err(SparseError::OutOfRange { row: 2, .. })));
    }
}
