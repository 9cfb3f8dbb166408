//! Orders of elimination for matrices whose unknowns come in blocks.

use faer::sparse::linalg::amd;

use super::{DirectError, Scratch, faer_pattern};
use crate::sparse::{BlockPattern, Pattern};

impl BlockPattern {
    /// An order of elimination of the unknowns by approximate minimum degree (Amestoy, Davis and Duff 1996)
    /// of whole blocks, for [`crate::Ordering::Custom`].
    pub fn minimum_degree(&self) -> Result<Vec<usize>, DirectError> {
        let order = minimum_degree(self.blocks())?;
        Ok(order.into_iter().flat_map(|block| self.range(block)).collect())
    }
}

/// The row eliminated in each place by approximate minimum degree (Amestoy, Davis and Duff 1996).
fn minimum_degree(pattern: &Pattern) -> Result<Vec<usize>, DirectError> {
    let dim = pattern.row_count();
    let too_large = |_| DirectError::OutOfMemory { dim };
    let (mut forward, mut inverse) = (vec![0u32; dim], vec![0u32; dim]);
    let mut scratch = Scratch::new(dim, amd::order_scratch::<u32>(dim, pattern.entry_count()))?;
    let control = amd::Control::default();
    amd::order(&mut forward, &mut inverse, faer_pattern(pattern), control, scratch.stack())
        .map_err(too_large)?;
    Ok(forward.into_iter().map(|row| row as usize).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BlockGroups, DirectIndefinite, IndefiniteParams, Ordering, Symbolic};
    use std::sync::Arc;

    /// A symmetric dense matrix with a heavy diagonal, row by row.
    fn fill(count: usize, target: &mut [f64]) {
        for (k, value) in target.iter_mut().enumerate() {
            let (i, j) = (k / count, k % count);
            *value = if i == j { 10.0 } else { ((i + j) as f64).sin() };
        }
    }

    #[test]
    fn blocks_are_eliminated_whole() {
        let mut groups = BlockGroups::default();
        let cells: [&[usize]; 3] = [&[0, 2], &[3, 1, 2], &[0, 3]];
        cells.iter().for_each(|group| groups.push(group.iter().copied()));
        let blocks = BlockPattern::new(vec![0, 2, 3, 6, 8], groups).expect("valid");
        let order = blocks.minimum_degree().expect("fits");
        let place = |unknown: usize| order.iter().position(|&u| u == unknown).expect("a permutation");
        for range in (0..4).map(|block| blocks.range(block)) {
            assert!(range.clone().all(|u| place(u) == place(range.start) + u - range.start));
        }
        let matrix = blocks.sum(|group, target| fill(blocks.unknowns_of(group).count(), target));
        let symbolic = Symbolic::new(matrix.pattern().clone(), Ordering::Custom(&order)).expect("symmetric");
        let mut factor =
            DirectIndefinite::new(Arc::new(symbolic), IndefiniteParams::default()).expect("fits");
        factor.factorise(matrix.values()).expect("regular");
        let (mut b, mut x) = ([0.0; 8], [0.0; 8]);
        matrix.multiply(&[1.0; 8], &mut b);
        factor.solve(&b, &mut x).expect("converges");
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12));
    }
}
