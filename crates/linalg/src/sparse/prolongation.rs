//! Interpolation from some nodes to more of them.

use crate::jagged::Jagged;

/// Values at nodes as weighted sums of the values at fewer nodes, the same for every component.
#[derive(Clone, Debug)]
pub struct Prolongation {
    /// Coarse node and weight, one list per node.
    terms: Jagged<(u32, f64)>,
    coarse_count: usize,
}

impl Prolongation {
    /// One row per node, to numbers below `coarse_count`.
    pub fn new(
        coarse_count: usize,
        rows: impl Iterator<Item = impl IntoIterator<Item = (u32, f64)>>,
    ) -> Self {
        Self { terms: rows.collect(), coarse_count }
    }

    /// Number of nodes it goes from.
    pub fn coarse_count(&self) -> usize {
        self.coarse_count
    }

    /// Terms of a node.
    pub fn of(&self, node: usize) -> &[(u32, f64)] {
        &self.terms[node]
    }

    /// The nodes that each coarse node contributes to.
    pub fn transposed(&self) -> Self {
        let rows = self.terms.iter().zip(0u32..);
        let pairs = rows.flat_map(|(terms, node)| terms.iter().map(move |&(k, w)| (k as usize, (node, w))));
        Self { terms: Jagged::grouped(self.coarse_count, pairs), coarse_count: self.terms.len() }
    }

    /// `fine += P coarse` for `B` components. Nodes beyond its rows are left alone.
    pub fn prolong<const B: usize>(&self, coarse: &[f64], fine: &mut [f64]) {
        let fine = fine.as_chunks_mut::<B>().0;
        for (terms, fine) in self.terms.iter().zip(fine) {
            for &(from, weight) in terms {
                let from = &coarse[from as usize * B..][..B];
                fine.iter_mut().zip(from).for_each(|(fine, value)| *fine += weight * value);
            }
        }
    }

    /// `coarse = P^T fine`.
    pub fn restrict<const B: usize>(&self, fine: &[f64], coarse: &mut [f64]) {
        coarse.fill(0.0);
        let fine = fine.as_chunks::<B>().0;
        for (terms, fine) in self.terms.iter().zip(fine) {
            for &(to, weight) in terms {
                let to = &mut coarse[to as usize * B..][..B];
                to.iter_mut().zip(fine).for_each(|(to, value)| *to += weight * value);
            }
        }
    }
}
