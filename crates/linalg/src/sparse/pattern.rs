//! Where the entries of a sparse matrix in compressed rows lie.

use rayon::prelude::*;

use crate::jagged::Jagged;

/// Rows that are found by one thread at a time.
const ROWS: usize = 4096;

/// Positions of the entries of a sparse matrix, row by row, columns ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    column_count: usize,
    /// Columns of each row.
    rows: Jagged<u32>,
}

/// Reason why a pattern or a matrix was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SparseError {
    /// A row or column lies outside the matrix.
    #[error("entry ({row}, {column}) lies outside a matrix of {row_count} x {column_count}")]
    OutOfRange {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Rows of the matrix.
        row_count: usize,
        /// Columns of the matrix.
        column_count: usize,
    },
    /// The matrix has an entry outside the pattern.
    #[error("entry ({row}, {column}) is not in the pattern")]
    NotInPattern {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
    },
    /// More entries than 32-bit indices can count.
    #[error("{entry_count} entries are more than 32-bit indices can count")]
    TooLarge {
        /// Number of entries.
        entry_count: usize,
    },
    /// The number of values is not the number of entries.
    #[error("{found} values for a pattern of {expected} entries")]
    WrongLength {
        /// Entries of the pattern.
        expected: usize,
        /// Values given.
        found: usize,
    },
}

impl Pattern {
    /// Pattern of a square matrix of dimension `dim` that couples all unknowns of a group with each other; a
    /// group is typically the unknowns of a cell. The diagonal is always in it, and the pattern is symmetric.
    pub fn from_groups<G: AsRef<[usize]> + Sync>(dim: usize, groups: &[G]) -> Result<Self, SparseError> {
        let touching = touching(dim, groups)?;
        let parts = (0..dim.div_ceil(ROWS)).into_par_iter().map_init(
            || RowBuilder::new(ROWS, dim),
            |builder, part| {
                builder.clear();
                for row in part * ROWS..((part + 1) * ROWS).min(dim) {
                    builder.insert(row);
                    for &group in &touching[row] {
                        groups[group as usize].as_ref().iter().for_each(|&column| builder.insert(column));
                    }
                    builder.end_ascending_row()?;
                }
                Ok((builder.row_start.clone(), builder.columns.clone()))
            },
        );
        Self::of_parts(dim, parts.collect::<Result<Vec<_>, SparseError>>()?)
    }

    /// The rows of the parts, each with starts and columns, one after another.
    fn of_parts(column_count: usize, parts: Vec<(Vec<u32>, Vec<u32>)>) -> Result<Self, SparseError> {
        let entry_count = parts.iter().map(|(_, columns)| columns.len()).sum();
        if u32::try_from(entry_count).is_err() {
            return Err(SparseError::TooLarge { entry_count });
        }
        let row_count: usize = parts.iter().map(|(starts, _)| starts.len() - 1).sum();
        let mut row_start = Vec::with_capacity(row_count + 1);
        row_start.push(0);
        let mut all = Vec::with_capacity(entry_count);
        for (starts, columns) in parts {
            let before = all.len() as u32;
            row_start.extend(starts[1..].iter().map(|start| before + start));
            all.extend_from_slice(&columns);
        }
        Ok(Self { column_count, rows: Jagged::from_starts(row_start, all) })
    }

    /// The pattern in which row and column `b` of this square one stand for `first[b] .. first[b + 1]`.
    pub(crate) fn expanded(&self, first: &[u32]) -> Result<Self, SparseError> {
        let dim = first.last().map_or(0, |&dim| dim as usize);
        let size = |b: usize| (first[b + 1] - first[b]) as usize;
        let width = |row: usize| -> usize { self.columns_of(row).iter().map(|&c| size(c as usize)).sum() };
        let entry_count = (0..self.row_count()).map(|row| size(row) * width(row)).sum();
        if u32::try_from(entry_count).is_err() {
            return Err(SparseError::TooLarge { entry_count });
        }
        let mut rows = Jagged::with_capacity(dim, entry_count);
        for row in 0..self.row_count() {
            for _ in 0..size(row) {
                let spans = self.columns_of(row).iter().map(|&c| first[c as usize]..first[c as usize + 1]);
                rows.push(spans.flatten());
            }
        }
        Ok(Self { column_count: dim, rows })
    }

    /// Pattern of the entries `(row, column)`, in any order, repetitions allowed.
    pub fn from_entries(
        row_count: usize,
        column_count: usize,
        entries: &[(usize, usize)],
    ) -> Result<Self, SparseError> {
        let mut sorted = entries.to_vec();
        sorted.sort_unstable();
        let mut builder = RowBuilder::new(row_count, column_count);
        let mut next = sorted.iter().peekable();
        for row in 0..row_count {
            while let Some(&(_, column)) = next.next_if(|entry| entry.0 == row) {
                if column >= column_count {
                    return Err(SparseError::OutOfRange { row, column, row_count, column_count });
                }
                builder.insert(column);
            }
            builder.end_row()?;
        }
        match next.next() {
            Some(&(row, column)) => Err(SparseError::OutOfRange { row, column, row_count, column_count }),
            None => Ok(builder.finish()),
        }
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// Number of entries.
    pub fn entry_count(&self) -> usize {
        self.rows.items().len()
    }

    /// Columns of a row, ascending.
    pub fn columns_of(&self, row: usize) -> &[u32] {
        &self.rows[row]
    }

    /// Positions of the entries of a row in the array of values.
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.rows.range(row)
    }

    /// Position of an entry in the array of values.
    pub fn position(&self, row: usize, column: usize) -> Option<usize> {
        let column = u32::try_from(column).ok()?;
        self.rows[row].binary_search(&column).ok().map(|offset| self.range(row).start + offset)
    }

    /// Whether the matrix is square and has entry `(j, i)` wherever it has `(i, j)`.
    pub fn is_symmetric(&self) -> bool {
        if self.row_count() != self.column_count {
            return false;
        }
        // Rows are visited in ascending order, so the next unseen entry of row j must be the row at hand.
        let mut seen = self.row_start()[..self.row_count()].to_vec();
        for row in 0..self.row_count() {
            for &column in self.columns_of(row) {
                let column = column as usize;
                let cursor = seen[column];
                if cursor == self.row_start()[column + 1] || self.columns()[cursor as usize] as usize != row {
                    return false;
                }
                seen[column] += 1;
            }
        }
        true
    }

    pub(crate) fn row_start(&self) -> &[u32] {
        self.rows.starts()
    }

    pub(crate) fn columns(&self) -> &[u32] {
        self.rows.items()
    }
}

/// The groups that touch each unknown.
fn touching<G: AsRef<[usize]>>(dim: usize, groups: &[G]) -> Result<Jagged<u32>, SparseError> {
    let pairs = groups
        .iter()
        .zip(0u32..)
        .flat_map(|(dofs, group)| dofs.as_ref().iter().map(move |&dof| (dof, group)));
    let entry_count = groups.iter().map(|group| group.as_ref().len()).sum();
    if u32::try_from(entry_count).is_err() {
        return Err(SparseError::TooLarge { entry_count });
    }
    match pairs.clone().find(|&(dof, _)| dof >= dim) {
        Some((row, _)) => {
            Err(SparseError::OutOfRange { row, column: row, row_count: dim, column_count: dim })
        }
        None => Ok(Jagged::grouped(dim, pairs)),
    }
}

/// Collects the columns of one row after the other.
struct RowBuilder {
    column_count: usize,
    row_start: Vec<u32>,
    columns: Vec<u32>,
    /// One more than the last row that has this column.
    mark: Vec<u32>,
}

impl RowBuilder {
    fn new(row_count: usize, column_count: usize) -> Self {
        let mut row_start = Vec::with_capacity(row_count + 1);
        row_start.push(0);
        Self { column_count, row_start, columns: Vec::new(), mark: vec![0; column_count] }
    }

    fn insert(&mut self, column: usize) {
        let stamp = self.row_start.len() as u32;
        if self.mark[column] != stamp {
            self.mark[column] = stamp;
            self.columns.push(column as u32);
        }
    }

    /// Drops all rows.
    fn clear(&mut self) {
        self.row_start.truncate(1);
        self.columns.clear();
    }

    /// Ends a row and sorts its columns, whose marks go.
    fn end_ascending_row(&mut self) -> Result<(), SparseError> {
        let first = self.row_start.last().map_or(0, |&start| start as usize);
        self.columns[first..].sort_unstable();
        self.columns[first..].iter().for_each(|&column| self.mark[column as usize] = 0);
        self.end_row()
    }

    /// Ends a row and leaves its columns in the order they came.
    fn end_row(&mut self) -> Result<(), SparseError> {
        let entry_count = self.columns.len();
        let end = u32::try_from(entry_count).map_err(|_| SparseError::TooLarge { entry_count })?;
        self.row_start.push(end);
        Ok(())
    }

    fn finish(self) -> Pattern {
        Pattern { column_count: self.column_count, rows: Jagged::from_starts(self.row_start, self.columns) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_couple_their_members() {
        let pattern = Pattern::from_groups(5, &[vec![0, 2], vec![2, 3, 0]]).expect("valid");
        let rows: Vec<&[u32]> = (0..5).map(|row| pattern.columns_of(row)).collect();
        assert_eq!(rows, [&[0u32, 2, 3][..], &[1], &[0, 2, 3], &[0, 2, 3], &[4]]);
        assert!(pattern.is_symmetric());
        assert_eq!(pattern.position(3, 2), Some(8));
        assert_eq!(pattern.position(3, 1), None);
        assert!(matches!(Pattern::from_groups(2, &[[2usize]]), Err(SparseError::OutOfRange { row: 2, .. })));
    }

    #[test]
    fn a_one_sided_entry_is_not_symmetric() {
        let entries = [(0, 0), (0, 1), (1, 1), (2, 1), (2, 2), (1, 2)];
        assert!(!Pattern::from_entries(3, 3, &entries).expect("valid").is_symmetric());
    }
}
