//! Smoothing by the diagonal and the weak modes of overlapping patches.
//!
//! The block of a matrix on a patch, scaled by its diagonal `D`, has few eigenvalues far below one, and only
//! these modes need more than the diagonal. With the eigenvectors `q` of `D^-1/2 A_c D^-1/2 q = lambda q` for
//! `lambda` below a bound, `w = D^-1/2 q`, the restriction `R_c` to a patch and the inverse number `W` of
//! patches a node belongs to,
//!
//! `z = omega D^-1 r + W sum R_c^T sum_w w (1/lambda - omega) w.R_c r`,
//!
//! restricted additive Schwarz (Cai and Sarkis 1999) with the blocks' inverses to low rank.

use std::ops::Range;

use rayon::prelude::*;

use crate::dense::{BlockError, DenseSymmetric};
use crate::jagged::Jagged;
use crate::krylov::lowest_modes;
use crate::smoother::schwarz::block_on;
use crate::sparse::SymmetricBlockMatrix;

/// What the diagonal counts.
const OMEGA: f64 = 0.4;
/// Modes with eigenvalues below this are kept.
const BOUND: f64 = 0.2;
/// Patches that a thread takes at a time, and nodes.
const PATCHES: usize = 32;
const NODES: usize = 1024;

/// The weak modes of patches of nodes with `B` components.
#[derive(Clone, Debug)]
pub struct WeakModes<const B: usize> {
    /// Nodes of each patch.
    patches: Jagged<u32>,
    /// `w (1/lambda - omega)^1/2`, mode by mode, patch by patch.
    modes: Vec<f32>,
    /// The inverse number of patches of each node of each patch.
    weights: Vec<f32>,
    /// `omega D^-1` on nodes of patches, zero elsewhere.
    diagonal: Vec<f32>,
    /// First number of each patch among the modes, then their number.
    firsts: Vec<usize>,
    /// Where each node is in the list of the nodes of all patches.
    places: Jagged<u32>,
    /// Corrections of all patches, and what they are made of.
    corrections: Vec<f32>,
    residuals: Vec<f32>,
}

/// Memory for [`weak_modes`].
#[derive(Clone, Debug, Default)]
pub struct ModesWorkspace {
    place: Vec<u32>,
    dense: DenseSymmetric,
}

impl<const B: usize> WeakModes<B> {
    /// Those of `matrix` on these patches.
    ///
    /// # Errors
    /// If a block is not positive definite.
    pub fn new(
        matrix: &SymmetricBlockMatrix<B>,
        patches: impl Iterator<Item = Vec<u32>>,
    ) -> Result<Self, BlockError> {
        let ascending = patches.map(|mut nodes| {
            nodes.sort_unstable();
            nodes
        });
        let patches: Jagged<u32> = ascending.collect();
        let full = matrix.diagonal();
        let modes = (0..patches.len())
            .into_par_iter()
            .with_min_len(32)
            .map_init(ModesWorkspace::default, |work, k| weak_modes(matrix, &full, &patches[k], work))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self::from_modes(patches, modes.iter(), &full))
    }

    /// From the nodes of the patches, ascending in each, what [`weak_modes`] gave for each, and the diagonal
    /// of the matrix.
    pub fn from_modes<'a>(
        patches: Jagged<u32>,
        found: impl Iterator<Item = &'a Vec<f32>> + Clone,
        full: &[f64],
    ) -> Self {
        let mut shares = vec![0u32; full.len() / B];
        patches.items().iter().for_each(|&node| shares[node as usize] += 1);
        let weights = patches.items().iter().map(|&node| 1.0 / shares[node as usize] as f32).collect();
        let mut modes = Vec::new();
        modes.reserve_exact(found.clone().map(Vec::len).sum());
        found.clone().for_each(|own| modes.extend_from_slice(own));
        let in_patch = |k: usize| shares[k / B] > 0;
        let diagonal = full.iter().enumerate();
        let diagonal = diagonal.map(|(k, d)| if in_patch(k) { (OMEGA / d) as f32 } else { 0.0 }).collect();
        let mut firsts = vec![0];
        firsts.extend(found.scan(0, |end, own| {
            *end += own.len();
            Some(*end)
        }));
        let places = patches.items().iter().zip(0u32..).map(|(&node, place)| (node as usize, place));
        let places = Jagged::grouped(full.len() / B, places);
        let (corrections, residuals) = (Vec::new(), Vec::new());
        Self { modes, weights, diagonal, patches, firsts, places, corrections, residuals }
    }

    /// `z = G r`.
    pub fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        let [mut corrections, mut residuals] =
            [&mut self.corrections, &mut self.residuals].map(std::mem::take);
        let dim = self.patches.items().len() * B;
        [&mut corrections, &mut residuals].into_iter().for_each(|v| v.resize(dim, 0.0));
        self.correct(0..self.patches.len(), r, &mut corrections, &mut residuals);
        let of_places = corrections.as_chunks::<B>().0;
        // Corrections of a node are added in the order of its patches.
        z.par_chunks_mut(NODES * B).enumerate().for_each(|(k, z)| {
            for (node, z) in (k * NODES..).zip(z.as_chunks_mut::<B>().0) {
                let (d, r) = (&self.diagonal[node * B..][..B], &r[node * B..][..B]);
                *z = std::array::from_fn(|c| d[c] * r[c]);
                for &place in &self.places[node] {
                    let (weight, correction) = (self.weights[place as usize], &of_places[place as usize]);
                    z.iter_mut().zip(correction).for_each(|(z, own)| *z += weight * own);
                }
            }
        });
        (self.corrections, self.residuals) = (corrections, residuals);
    }

    /// The corrections of a range of patches, without weights, and the residuals on them.
    fn correct(&self, patches: Range<usize>, r: &[f32], corrections: &mut [f32], residuals: &mut [f32]) {
        let start = |patch: usize| self.patches.starts()[patch] as usize * B;
        let first = start(patches.start);
        if patches.len() > PATCHES {
            let middle = patches.start + patches.len() / 2;
            let [of_corrections, of_residuals] =
                [corrections, residuals].map(|v| v.split_at_mut(start(middle) - first));
            rayon::join(
                || self.correct(patches.start..middle, r, of_corrections.0, of_residuals.0),
                || self.correct(middle..patches.end, r, of_corrections.1, of_residuals.1),
            );
            return;
        }
        for patch in patches {
            let at = start(patch) - first..start(patch + 1) - first;
            let (z, local) = (&mut corrections[at.clone()], &mut residuals[at]);
            z.fill(0.0);
            let modes = &self.modes[self.firsts[patch]..self.firsts[patch + 1]];
            if modes.is_empty() {
                continue;
            }
            for (own, &node) in local.chunks_exact_mut(B).zip(&self.patches[patch]) {
                own.copy_from_slice(&r[node as usize * B..][..B]);
            }
            for mode in modes.chunks_exact(local.len()) {
                let share = inner(mode, local);
                z.iter_mut().zip(mode).for_each(|(z, w)| *z += share * w);
            }
        }
    }
}

/// The modes of a patch, ascending nodes of a matrix with this diagonal, as [`WeakModes::from_modes`] takes
/// them.
///
/// # Errors
/// If the block is not positive definite.
pub fn weak_modes<const B: usize>(
    matrix: &SymmetricBlockMatrix<B>,
    diagonal: &[f64],
    nodes: &[u32],
    ModesWorkspace { place, dense }: &mut ModesWorkspace,
) -> Result<Vec<f32>, BlockError> {
    // What is left in it is all `u32::MAX`.
    place.resize(place.len().max(matrix.node_count()), u32::MAX);
    block_on(matrix, nodes, place, dense);
    let components = nodes.iter().flat_map(|&node| (0..B).map(move |c| node as usize * B + c));
    let roots: Vec<f64> = components.map(|k| 1.0 / diagonal[k].sqrt()).collect();
    for (i, own) in roots.iter().enumerate() {
        dense.row_mut(i)[..=i].iter_mut().zip(&roots).for_each(|(a, root)| *a *= own * root);
    }
    let mut scaled = Vec::new();
    for (value, vector) in lowest_modes(dense, BOUND)? {
        let factor = (1.0 / value - OMEGA).sqrt();
        scaled.extend(vector.iter().zip(&roots).map(|(q, root)| (factor * root * q) as f32));
    }
    Ok(scaled)
}

fn inner(x: &[f32], y: &[f32]) -> f32 {
    const LANES: usize = 8;
    let ((x, x_rest), (y, y_rest)) = (x.as_chunks::<LANES>(), y.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (x, y) in x.iter().zip(y) {
        (0..LANES).for_each(|l| sums[l] += x[l] * y[l]);
    }
    sums.iter().sum::<f32>() + x_rest.iter().zip(y_rest).map(|(x, y)| x * y).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::LinOp;
    use crate::sparse::{LocalTerm, Pattern};

    /// Springs in a row between two walls: the modes are sines, the eigenvalues over the diagonal
    /// `1 - cos(k pi / (count + 1))`.
    #[test]
    fn weak_modes_are_inverted_and_others_damped() {
        let count = 12;
        let mut matrix = springs(count);
        let mut smoother = WeakModes::new(&matrix, std::iter::once((0..count as u32).collect())).unwrap();
        for k in 1..=count {
            let angle = k as f64 * std::f64::consts::PI / (count + 1) as f64;
            let mode: Vec<f64> = (1..=count).map(|i| (angle * i as f64).sin()).collect();
            let mut image = vec![0.0; count];
            matrix.apply(&mode, &mut image);
            let image: Vec<f32> = image.into_iter().map(|x| x as f32).collect();
            let mut z = vec![0.0; count];
            smoother.apply(&image, &mut z);
            let eigenvalue = 1.0 - angle.cos();
            let kept = if eigenvalue < BOUND { 1.0 } else { OMEGA * eigenvalue };
            let error =
                z.iter().zip(&mode).map(|(z, x)| (f64::from(*z) - kept * x).abs()).fold(0.0, f64::max);
            assert!(error < 1e-2, "{k}: {error}");
        }
    }

    /// `count` nodes between springs, the first and the last at walls.
    fn springs(count: usize) -> SymmetricBlockMatrix<1> {
        let groups: Vec<[usize; 2]> = (1..count).map(|k| [k - 1, k]).collect();
        let mut matrix = SymmetricBlockMatrix::<1>::zeros(&Pattern::from_groups(count, &groups).unwrap());
        for group in &groups {
            let term =
                |local: usize| LocalTerm { row: group[local] as u32, local: local as u32, weight: 1.0 };
            matrix.add_local(&[0, 1].map(term), &[1.0, -1.0, -1.0, 1.0]);
        }
        for end in [0, count as u32 - 1] {
            matrix.add_local(&[LocalTerm { row: end, local: 0, weight: 1.0 }], &[1.0]);
        }
        matrix
    }

    /// Patches that overlap, each by itself: `G r = omega D^-1 r + W sum (G_patch r - omega D^-1 r)`.
    #[test]
    fn threads_add_what_each_patch_corrects() {
        let (count, width) = (5 * NODES / 2, 12);
        let matrix = springs(count);
        let patches: Vec<Vec<u32>> =
            (0..count).step_by(5).map(|k| (k as u32..(k + width).min(count) as u32).collect()).collect();
        assert!(patches.len() > 3 * PATCHES);
        let r: Vec<f32> = (0..count).map(|i| (0.37 * i as f32).sin()).collect();
        let mut shares = vec![0.0f32; count];
        patches.iter().flatten().for_each(|&node| shares[node as usize] += 1.0);
        let mut want: Vec<f32> = r.iter().map(|r| OMEGA as f32 * r / 2.0).collect();
        for patch in &patches {
            let mut alone = vec![0.0; count];
            WeakModes::new(&matrix, std::iter::once(patch.clone())).unwrap().apply(&r, &mut alone);
            for &node in patch {
                let node = node as usize;
                want[node] += (alone[node] - OMEGA as f32 * r[node] / 2.0) / shares[node];
            }
        }
        let mut smoother = WeakModes::new(&matrix, patches.iter().cloned()).unwrap();
        let mut applied = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut z = vec![f32::NAN; count];
            pool.install(|| smoother.apply(&r, &mut z));
            z
        };
        let one = applied(1);
        assert!(one.iter().zip(&want).all(|(z, want)| (z - want).abs() < 1e-5));
        assert_eq!(applied(3), one);
    }

    #[test]
    fn nodes_of_no_patch_are_left_alone() {
        let mut matrix = SymmetricBlockMatrix::<1>::zeros(&Pattern::from_groups(2, &[[0], [1]]).unwrap());
        for row in 0..2 {
            matrix.add_local(&[LocalTerm { row, local: 0, weight: 1.0 }], &[2.0]);
        }
        let mut smoother = WeakModes::new(&matrix, std::iter::once(vec![1])).unwrap();
        let mut z = [1.0; 2];
        smoother.apply(&[3.0, 3.0], &mut z);
        assert_eq!(z, [0.0, (OMEGA * 1.5) as f32]);
    }
}
