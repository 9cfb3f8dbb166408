//! Nitsche's penalty from local eigenvalues.
//!
//! The form is positive if `beta` exceeds the largest ratio `lambda` of `int_G |2 eta eps(u) n|^2 / eta` to
//! `int_F 2 eta eps(u):eps(u)` over the polynomials of a root, on the root and the bad cells that it carries
//! (Annavarapu, Hautefeuille and Dolbow 2012 for the local eigenproblem). Bad cells next to each other whose
//! ghosts have other roots may need more: hence a factor, 2 and doubled where a block of the smoother is not
//! positive, and raised in single cells where a computed flow shows that it is too small (`weak.rs`). Since
//! `|eps n|^2 <= eps:eps`, the largest ratio `mu` of `int_G 4 eps(u):eps(u)` to `int_F 2 eps(u):eps(u)` is no
//! less than `lambda`, and takes the same products of gradients in the volume and on the surface:
//!
//! `beta = factor mu eta`.
//!
//! In coordinates of the unit cube `mu h` is a number of the cut alone.

use std::collections::BTreeMap;

use gluey_fem::cut::{POINTS, PairLines, Products};
use gluey_fem::element::{gauss_cube, node_count};
use gluey_geom::Vector;
use gluey_levelset::nearest_image;
use gluey_linalg::{BlockError, DenseSymmetric, largest_ratio};
use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::cut_cells::CutCells;
use crate::error::StokesError;
use crate::space::Discretisation;

/// Share of the mean diagonal that is added to the strain energy: rigid motions have none.
const SHIFT: f64 = 1e-9;

/// Multiple of the largest local ratios in the penalty.
#[derive(Clone, Debug)]
pub struct PenaltyFactor {
    everywhere: f64,
    /// What it is multiplied by in some cells of the mesh.
    raised: BTreeMap<u32, f64>,
}

impl PenaltyFactor {
    /// The same everywhere.
    pub fn new(everywhere: f64) -> Self {
        Self { everywhere, raised: BTreeMap::new() }
    }

    /// Twice as large everywhere, if that is no more than `largest`.
    pub fn doubled(&self, largest: f64) -> Option<Self> {
        let everywhere = 2.0 * self.everywhere;
        (everywhere <= largest).then(|| Self { everywhere, raised: self.raised.clone() })
    }

    /// Multiplied by a factor in each of these cells.
    #[must_use]
    pub fn raised(mut self, cells: impl Iterator<Item = (u32, f64)>) -> Self {
        cells.for_each(|(cell, factor)| *self.raised.entry(cell).or_insert(1.0) *= factor);
        self
    }

    fn of_cell(&self, cell: u32) -> f64 {
        self.everywhere * self.raised.get(&cell).unwrap_or(&1.0)
    }
}

/// `beta h / eta` of every cut cell: `factor mu h`.
///
/// # Errors
/// [`StokesError::NoPenalty`] where the volume left by bodies is not that of a fluid.
pub fn penalties<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    aggregates: &Aggregates,
    factor: &PenaltyFactor,
) -> Result<Vec<f64>, StokesError> {
    let mut members: Vec<(u32, u32)> = aggregates.roots.iter().copied().zip(0..).collect();
    members.sort_unstable();
    let clusters: Vec<&[(u32, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    let at_home = PairLines::<D>::new([0.0; D]);
    let of_cluster = |cluster: &&[(u32, u32)]| {
        let root = cluster[0].0 as usize;
        let [mut volume, mut surface] = [Products::<D>::zeros(), Products::zeros()];
        if cut.cut(root).is_none() {
            let weights: Vec<f64> = gauss_cube::<D>(POINTS).into_iter().map(|point| point.1).collect();
            volume.add(&at_home, &weights);
        }
        for &(_, k) in *cluster {
            let cell = &cut.cells[k as usize];
            let moments = &cell.moments;
            let elsewhere = (cell.cell as usize != root)
                .then(|| PairLines::new(offset(discretisation, root, cell.cell as usize)));
            let lines = elsewhere.as_ref().unwrap_or(&at_home);
            volume.add(lines, &moments.volume);
            surface.add(lines, &moments.area());
        }
        let shear = discretisation.mesh.shear();
        [&mut volume, &mut surface].into_iter().for_each(|products| products.shear(shear));
        // int 4 eps:eps on the surface to int 2 eps:eps in the volume.
        eigenvalue(&surface, &volume).map(|ratio| 2.0 * ratio)
    };
    let values: Vec<Result<f64, BlockError>> = clusters.par_iter().map(of_cluster).collect();
    let mut penalties = vec![0.0; cut.cells.len()];
    for (cluster, value) in clusters.iter().zip(values) {
        let is_own = |&(_, k): &(u32, u32)| discretisation.is_own(cut.cells[k as usize].cell as usize);
        // At the rim of a part aggregates are not whole; nobody asks for their penalties.
        let value = value.or_else(|error| if cluster.iter().any(is_own) { Err(error) } else { Ok(1.0) });
        let value = value.map_err(|_| {
            let first = &cut.cells[cluster[0].1 as usize];
            StokesError::NoPenalty { body: first.bodies[0] as usize, cell: first.cell as usize }
        })?;
        cluster
            .iter()
            .for_each(|&(_, k)| penalties[k as usize] = factor.of_cell(cut.cells[k as usize].cell) * value);
    }
    Ok(penalties)
}

/// Place of a cell relative to the root, in cells.
fn offset<const D: usize>(discretisation: &Discretisation<D>, root: usize, cell: usize) -> [f64; D] {
    let mesh = &discretisation.mesh;
    let lower = |cell: usize| mesh.lower_corner(&mesh.cells()[cell]);
    let arm: Vector<D> = lower(cell) - lower(root);
    std::array::from_fn(|d| {
        let period = mesh.periodic()[d].then_some(mesh.domain().extent()[d]);
        (nearest_image(arm[d], period) / discretisation.cell_size(root)).round()
    })
}

/// Rows and columns of `int 2 eps(u):eps(v)`, component by component.
fn strain_energy<const D: usize>(products: &Products<D>) -> DenseSymmetric {
    let n = node_count::<D>(2);
    let mut matrix = DenseSymmetric::zeros(D * n);
    // 2 eps:eps = grad u : (grad v + grad v^T).
    for a in 0..D {
        for i in 0..n {
            let row = matrix.row_mut(a * n + i);
            for b in 0..=a {
                (0..n).for_each(|j| row[b * n + j] = products.of([a, b], [j, i]));
            }
            for d in 0..D {
                (0..n).for_each(|j| row[a * n + j] += products.of([d, d], [i, j]));
            }
        }
    }
    matrix
}

/// The largest ratio of two forms, if the one in the volume is positive but for rigid motions.
fn eigenvalue<const D: usize>(surface: &Products<D>, volume: &Products<D>) -> Result<f64, BlockError> {
    let [above, mut below] = [surface, volume].map(strain_energy);
    let n = below.dim();
    let shift = SHIFT * (0..n).map(|k| below.row(k)[k]).sum::<f64>() / n as f64;
    (0..n).for_each(|k| below.row_mut(k)[k] += shift);
    largest_ratio(&above, &mut below)
}
