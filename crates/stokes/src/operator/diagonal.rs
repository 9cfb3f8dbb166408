//! The inverse of the operator's diagonal, with a block for every body's twist.

use gluey_fem::ReferenceMatrices;
use gluey_geom::Dim;
use gluey_linalg::{Preconditioner, invert_spd, vector};

use super::cells::viscous_diagonal;
use crate::error::DiagonalError;
use crate::space::{ActiveCell, VelocitySpace};

/// Inverse diagonal on free nodes, inverse blocks on twists, zero elsewhere.
#[derive(Clone, Debug)]
pub struct BlockDiagonal {
    nodal: Vec<f32>,
    twists: Vec<f32>,
    rigid: usize,
}

impl BlockDiagonal {
    /// These inverses of nodal entries, and of blocks of `rigid` rows for the twists.
    pub fn new(nodal: Vec<f32>, twists: Vec<f32>, rigid: usize) -> Self {
        Self { nodal, twists, rigid }
    }

    /// Leaves the twists of these bodies alone.
    pub fn hold(&mut self, is_held: impl Fn(usize) -> bool) {
        let blocks = self.twists.chunks_exact_mut(self.rigid * self.rigid).enumerate();
        blocks.filter(|(body, _)| is_held(*body)).for_each(|(_, block)| block.fill(0.0));
    }

    /// Multiplies the inverses at some positions and those of all twists by a factor.
    pub fn scale(&mut self, positions: &[u32], factor: f32) {
        positions.iter().for_each(|&k| self.nodal[k as usize] *= factor);
        self.twists.iter_mut().for_each(|value| *value *= factor);
    }

    /// The nodal entries at some positions, and all twists.
    pub fn restricted(&self, positions: &[u32]) -> Self {
        let nodal = positions.iter().map(|&k| self.nodal[k as usize]).collect();
        Self { nodal, twists: self.twists.clone(), rigid: self.rigid }
    }
}

impl Preconditioner<f32> for BlockDiagonal {
    fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        let split = self.nodal.len();
        vector::multiply(&self.nodal, &r[..split], &mut z[..split]);
        self.apply_rest(&r[split..], &mut z[split..]);
    }

    fn diagonal(&self) -> &[f32] {
        &self.nodal
    }

    fn apply_rest(&mut self, r: &[f32], z: &mut [f32]) {
        let n = self.rigid;
        for (body, block) in self.twists.chunks_exact(n * n).enumerate() {
            for (i, row) in block.chunks_exact(n).enumerate() {
                z[body * n + i] = row.iter().zip(&r[body * n..]).map(|(m, r)| m * r).sum();
            }
        }
    }
}

/// The diagonal of the fluid's operator as cells add it up: at nodes, and `R^T A R` for the twists.
pub struct DiagonalSums {
    nodal: Vec<f64>,
    twists: Vec<f64>,
}

impl DiagonalSums {
    /// The sums over some cells.
    pub fn new<const D: usize>(space: &VelocitySpace<D>, cells: &[ActiveCell]) -> Self {
        let twists = twist_blocks(space, cells, &space.discretisation().reference());
        Self { nodal: nodal_sums(space, cells), twists }
    }

    /// The inverse diagonal on the nodes in `smoothed`, and those of the twists; zero for twists that are not
    /// active or that no cell acts on. All ranks call this.
    ///
    /// # Errors
    /// [`DiagonalError`] for a diagonal that has no inverse.
    pub fn inverted<const D: usize>(
        self,
        space: &VelocitySpace<D>,
        smoothed: &[bool],
    ) -> Result<BlockDiagonal, DiagonalError> {
        let Self { mut nodal, mut twists } = self;
        nodal.resize(space.dim(), 0.0);
        space.halo().clone().sum(&mut nodal);
        space.halo_of_twist_blocks().clone().sum(&mut twists);
        nodal.truncate(space.full_dim());
        let nodal = inverse_entries(space, nodal, smoothed)?;
        let rigid = Dim::<D>::RIGID;
        for (body, block) in twists.chunks_exact_mut(rigid * rigid).enumerate() {
            let is_touched = block.iter().any(|&entry| entry != 0.0);
            if is_touched && space.is_active(body) {
                invert_spd(rigid, block).map_err(|source| DiagonalError::Body { body, source })?;
            } else {
                block.fill(0.0);
            }
        }
        let twists = twists.into_iter().map(|entry| entry as f32).collect();
        Ok(BlockDiagonal { nodal, twists, rigid })
    }
}

/// The inverse diagonal of the fluid's operator on the nodes in `smoothed`, zero elsewhere.
pub fn nodal_diagonal<const D: usize>(
    space: &VelocitySpace<D>,
    cells: &[ActiveCell],
    smoothed: &[bool],
) -> Result<Vec<f32>, DiagonalError> {
    inverse_entries(space, nodal_sums(space, cells), smoothed)
}

/// The diagonal at nodes.
fn nodal_sums<const D: usize>(space: &VelocitySpace<D>, cells: &[ActiveCell]) -> Vec<f64> {
    let cells = cells.iter().map(|c| (c, c.viscous, None));
    let mut nodal = viscous_diagonal(space.discretisation(), cells);
    // The squares keep the sum positive: weights of hanging nodes may be negative.
    space.nodes().condense(D, |w| w * w, &mut nodal);
    nodal
}

/// Inverses of the entries at free nodes in `smoothed`, zero elsewhere.
fn inverse_entries<const D: usize>(
    space: &VelocitySpace<D>,
    nodal: Vec<f64>,
    smoothed: &[bool],
) -> Result<Vec<f32>, DiagonalError> {
    let mut nodal: Vec<f32> = nodal.into_iter().map(|d| d as f32).collect();
    for (k, value) in nodal.iter_mut().enumerate() {
        *value = match space.is_free(k / D) && smoothed[k / D] {
            true if *value > 0.0 => 1.0 / *value,
            true => return Err(DiagonalError::Node { node: k / D, value: f64::from(*value) }),
            false => 0.0,
        };
    }
    Ok(nodal)
}

/// `R^T A R` for every body, row by row.
fn twist_blocks<const D: usize>(
    space: &VelocitySpace<D>,
    cells: &[ActiveCell],
    reference: &ReferenceMatrices<D>,
) -> Vec<f64> {
    let discretisation = space.discretisation();
    let (n, rigid) = (ReferenceMatrices::<D>::VELOCITY, Dim::<D>::RIGID);
    let mut rows = vec![None; space.nodes().node_count()];
    for (node, body, matrix) in space.rigid_rows() {
        rows[node as usize] = Some((body as usize, matrix));
    }
    let viscous = nalgebra::DMatrix::from_row_slice(n, n, &reference.viscous);
    let mut blocks = vec![0.0; space.body_count() * rigid * rigid];
    for cell in cells {
        let nodes = discretisation.velocity.cell(cell.cell as usize);
        let mut bodies: Vec<usize> =
            nodes.iter().filter_map(|&v| rows[v as usize].as_ref().map(|r| r.0)).collect();
        bodies.sort_unstable();
        bodies.dedup();
        for body in bodies {
            let mut motion = vec![0.0; n * rigid];
            for (i, &node) in nodes.iter().enumerate() {
                if let Some((owner, matrix)) = &rows[node as usize]
                    && *owner == body
                {
                    motion[i * D * rigid..(i + 1) * D * rigid].copy_from_slice(matrix);
                }
            }
            let motion = nalgebra::DMatrix::from_row_slice(n, rigid, &motion);
            let product = motion.transpose() * (&viscous * &motion) * cell.viscous;
            let block = &mut blocks[body * rigid * rigid..][..rigid * rigid];
            block.iter_mut().zip(product.iter()).for_each(|(b, p)| *b += p);
        }
    }
    blocks
}
