//! Tables of numbers in columns with names, as in CSV files, and values between their rows.

use thiserror::Error;

pub use crate::interpolate::linear;

/// Numbers in columns with names.
///
/// ```
/// use gluey::table::{NumberTable, linear};
///
/// let table = NumberTable::parse("# a comment\nt, x1\n0, 0.3\n2, 0.5\n")?;
/// let (t, x) = (table.column("t")?, table.column("x1")?);
/// assert_eq!(linear(t, |row| x[row], 1.0), Some(0.4));
/// # Ok::<(), gluey::table::TableError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NumberTable {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

/// A text is no table, or a table has no such column.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TableError {
    /// A column that must be there is not.
    #[error("column `{column}` is missing")]
    Column {
        /// Its name.
        column: String,
    },
    /// A row does not hold the numbers its header promises.
    #[error("line {line}: expected {expected} numbers")]
    Row {
        /// Line of the text, from 1.
        line: usize,
        /// Numbers that the header promises.
        expected: usize,
    },
}

impl NumberTable {
    /// Reads comma-separated numbers under a header of names; empty lines and those that start with `#` do
    /// not count, and an empty cell is no number (NaN). A text without a header is a table without columns.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let lines = text.lines().enumerate();
        let mut lines = lines.filter(|(_, line)| !line.starts_with('#') && !line.trim().is_empty());
        let header = lines.next().map(|(_, header)| header.split(',').map(|name| name.trim().to_owned()));
        let names: Vec<String> = header.into_iter().flatten().collect();
        let mut columns = vec![Vec::new(); names.len()];
        for (index, line) in lines {
            let row: Option<Vec<f64>> = line.split(',').map(|cell| number(cell.trim())).collect();
            let Some(row) = row.filter(|row| row.len() == names.len()) else {
                return Err(TableError::Row { line: index + 1, expected: names.len() });
            };
            columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        Ok(Self { names, columns })
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// The column of this name, if there is one.
    pub fn find(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|known| known == name).map(|index| &self.columns[index][..])
    }

    /// The column of this name.
    ///
    /// # Errors
    /// [`TableError::Column`] if there is none.
    pub fn column(&self, name: &str) -> Result<&[f64], TableError> {
        self.find(name).ok_or_else(|| TableError::Column { column: name.to_owned() })
    }
}

/// The number in a cell; an empty one has none.
fn number(cell: &str) -> Option<f64> {
    if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_cells_are_no_numbers() {
        let table = NumberTable::parse("t,x,y\n0,,2\n1,3,\n").expect("a table");
        let [x, y] = ["x", "y"].map(|name| table.column(name).expect("a column"));
        assert!(x[0].is_nan() && x[1] == 3.0 && y[0] == 2.0 && y[1].is_nan());
    }

    #[test]
    fn columns_are_found_by_name_and_comments_skipped() {
        let table = NumberTable::parse("# remark\nt, x\n\n0, 1.5\n# another\n1,2\n").expect("a table");
        assert_eq!(table.column("x"), Ok(&[1.5, 2.0][..]));
        assert_eq!(table.find("y"), None);
        assert_eq!(table.column("y"), Err(TableError::Column { column: "y".into() }));
    }

    #[test]
    fn rows_of_another_length_or_without_numbers_are_refused() {
        for bad in ["t,x\n0,1\n2\n", "t,x\n0,1\n2,3,4\n", "t,x\n0,1\n2,three\n"] {
            assert_eq!(NumberTable::parse(bad), Err(TableError::Row { line: 3, expected: 2 }), "{bad}");
        }
        assert_eq!(NumberTable::parse("").map(|table| table.find("t").is_none()), Ok(true));
    }
}
