//! The sparse factor `R` of `A = R R^T`.

/// Rows of a sparse matrix.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    coordinate_count: usize,
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Factor {
    /// No rows, for so many degrees of freedom.
    pub fn new(coordinate_count: usize) -> Self {
        Self { coordinate_count, starts: vec![0], entries: Vec::new() }
    }

    /// Adds a row: degrees of freedom, each once, and values.
    pub fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        self.entries.extend(row);
        self.starts.push(self.entries.len());
    }

    pub(super) fn coordinate_count(&self) -> usize {
        self.coordinate_count
    }

    pub(super) fn row_count(&self) -> usize {
        self.starts.len() - 1
    }

    pub(super) fn row(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        self.entries[self.starts[k]..self.starts[k + 1]].iter().copied()
    }

    /// `R_k x`.
    pub(super) fn product(&self, k: usize, x: &[f64]) -> f64 {
        self.row(k).map(|(coordinate, value)| value * x[coordinate]).sum()
    }

    /// `x <- x + force R_k^T`.
    pub(super) fn add_row(&self, k: usize, force: f64, x: &mut [f64]) {
        self.row(k).for_each(|(coordinate, value)| x[coordinate] += force * value);
    }
}
