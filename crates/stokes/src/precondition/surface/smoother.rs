//! The smoothers of a mesh that surfaces cut.
//!
//! Where aggregates extrapolate and penalties act, motions of every stiffness meet in one cell: the
//! operator's block on the free nodes of every root tells them apart. A sweep of restricted additive Schwarz
//! over these (Cai and Sarkis 1999), `z = sum R_c^T W_c A_c^-1 R_c r` with `W` the inverse number of blocks a
//! node belongs to, needs no damping. In 3D, where an inverse has 3321 numbers, only the few modes of a block
//! that its diagonal does not tell apart are kept. Elsewhere Chebyshev's method with the diagonal is enough.

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Dim, Space};
use gluey_linalg::{
    Chebyshev, Guess, LinOp, PatchError, Preconditioner, SchwarzPatches, SpectralInterval, WeakModes,
    estimate_lambda_max, invert_spd, vector,
};

use crate::error::{DiagonalError, StokesError};
use crate::operator::{BlockDiagonal, Elements, ViscousOperator, add_at, gather, nodal_diagonal};
use crate::precondition::assembly::assemble_on_nodes;
use crate::precondition::numbered::NumberedNodes;
use crate::precondition::velocity::cell_lambda_max;
use crate::space::around_finest_cells;
use crate::surface::SurfaceCoupling;

use super::roots::{ModesError, modes_and_diagonal};

/// Steps of the sweep with the diagonal in 2D and in 3D, and what it damps eigenvalues down to: the largest
/// in the fluid over this.
const DEGREES: [usize; 2] = [3, 4];
const RATIOS: [f64; 2] = [5.0, 8.0];
/// Lanczos steps for the largest eigenvalue, which depends on the cuts, and the factor on what they find.
const LANCZOS_STEPS: usize = 8;
const SAFETY: f64 = 1.1;

/// The smoothers of the finest mesh.
pub struct SurfaceSmoother<const D: usize> {
    /// The viscous operator at the nodes that the sweep smooths, and of velocities at those of the blocks.
    operator: ViscousOperator<D>,
    diagonal: BlockDiagonal,
    /// The sweep with the diagonal.
    chebyshev: Chebyshev<f32>,
    blocks: Blocks<D>,
    /// Reduced velocities and their loads.
    velocity: Vec<f32>,
    load: Vec<f32>,
}

/// Restricted additive Schwarz on the free nodes of the roots.
struct Blocks<const D: usize> {
    inverses: Inverses<D>,
    /// The components of the nodes among the reduced velocities.
    positions: Vec<u32>,
    r: Vec<f32>,
    z: Vec<f32>,
}

/// What stands for the inverses of the blocks.
enum Inverses<const D: usize> {
    /// Themselves.
    Whole(SchwarzPatches<f32, D>),
    /// Their largest parts, a tenth of the memory.
    WeakModes(WeakModes<D>),
}

impl<const D: usize> SurfaceSmoother<D>
where
    Dim<D>: Space<D>,
{
    /// The smoothers of a system with cut cells.
    pub fn new(elements: &Elements<'_, D>, surfaces: &SurfaceCoupling<D>) -> Result<Self, StokesError> {
        let system = elements.system();
        let near = near_surfaces(elements, surfaces);
        let nodes = NumberedNodes::new(system.discretisation(), |n| near[n] && system.space.is_free(n));
        let mut smoothed = around_finest_cells(system.discretisation());
        let (blocks, near_surfaces) = Blocks::new(&nodes, elements, surfaces)?;
        let mut diagonal = diagonal(elements, surfaces, &smoothed, (&blocks.positions, &near_surfaces))?;
        smoothed.iter_mut().zip(&near).for_each(|(smoothed, near)| *smoothed |= near);
        let mut operator = ViscousOperator::new(system, &smoothed, &near);
        let interval =
            interval(&mut operator, &mut diagonal, &blocks.positions, &system.discretisation().reference())?;
        operator.take_applications();
        let dim = operator.dim();
        Ok(Self {
            operator,
            chebyshev: Chebyshev::new(dim, DEGREES[D - 2], interval),
            diagonal,
            blocks,
            velocity: vec![0.0; dim],
            load: vec![0.0; dim],
        })
    }

    /// `x += G r`, `r -= A G r` by the blocks `G`.
    pub fn add_blocks(&mut self, r: &mut [f32], x: &mut [f32]) {
        self.velocity.fill(0.0);
        self.blocks.add(r, &mut self.velocity);
        vector::axpy(1.0, &self.velocity, x);
        self.operator.apply_near(&self.velocity, &mut self.load);
        vector::axpy(-1.0, &self.load, r);
    }

    /// Chebyshev's sweep on `A x = b` from an `x` with the residual `r`.
    pub fn sweep(&mut self, r: &[f32], x: &mut [f32]) {
        let Self { operator, diagonal, chebyshev, velocity, .. } = self;
        chebyshev.smooth(operator, diagonal, r, velocity, Guess::Zero);
        vector::axpy(1.0, velocity, x);
    }

    /// `r -= A z` at the nodes that are smoothed.
    pub fn subtract(&mut self, z: &[f32], r: &mut [f32]) {
        self.operator.apply(z, &mut self.load);
        vector::axpy(-1.0, &self.load, r);
    }

    /// Applications of the operator since the last call.
    pub fn take_applications(&mut self) -> f64 {
        self.operator.take_applications()
    }
}

/// What the sweep damps. The cuts decide the largest eigenvalue near surfaces, at `near` and of the twists,
/// which may be several times that in the fluid: half of the excess, in powers, goes into the diagonal there,
/// half into the interval.
fn interval<const D: usize>(
    operator: &mut ViscousOperator<D>,
    diagonal: &mut BlockDiagonal,
    near: &[u32],
    reference: &ReferenceMatrices<D>,
) -> Result<SpectralInterval, StokesError>
where
    Dim<D>: Space<D>,
{
    let in_fluid = cell_lambda_max(reference);
    let largest = SAFETY * estimate_lambda_max(operator, diagonal, LANCZOS_STEPS)?;
    let excess = (largest / in_fluid).max(1.0).sqrt();
    diagonal.scale(near, (1.0 / excess) as f32);
    Ok(SpectralInterval { lower: in_fluid / RATIOS[D - 2], upper: in_fluid * excess })
}

/// The nodes of cut cells and of roots.
fn near_surfaces<const D: usize>(elements: &Elements<'_, D>, surfaces: &SurfaceCoupling<D>) -> Vec<bool>
where
    Dim<D>: Space<D>,
{
    let nodes = &elements.system().discretisation().velocity;
    let mut near = vec![false; nodes.node_count()];
    let cut = surfaces.cut.cells.iter().map(|cell| cell.cell);
    for cell in cut.chain(surfaces.roots().iter().copied()) {
        nodes.cell(cell as usize).iter().for_each(|&node| near[node as usize] = true);
    }
    near
}

impl<const D: usize> Blocks<D>
where
    Dim<D>: Space<D>,
{
    /// `z += G r`.
    fn add(&mut self, r: &[f32], z: &mut [f32]) {
        let Self { inverses, positions, r: local, z: correction } = self;
        gather(positions, r, local);
        match inverses {
            Inverses::Whole(patches) => patches.apply(local, correction),
            Inverses::WeakModes(modes) => modes.apply(local, correction),
        }
        add_at(positions, correction, z);
    }

    /// The blocks, and the diagonal at their nodes.
    fn new(
        nodes: &NumberedNodes<'_, D>,
        elements: &Elements<'_, D>,
        surfaces: &SurfaceCoupling<D>,
    ) -> Result<(Self, Vec<f64>), StokesError> {
        let number = |&node: &u32| nodes.nodes.number(node as usize).map(|number| number as u32);
        let block = |&root: &u32| -> Vec<u32> {
            let mut block: Vec<u32> =
                nodes.mesh.velocity.cell(root as usize).iter().filter_map(number).collect();
            block.sort_unstable();
            block
        };
        let blocks = surfaces.roots().iter().map(block);
        let zeros = vec![0.0; nodes.nodes.len() * D];
        let (inverses, diagonal) = if D == 2 {
            let matrix = assemble_on_nodes(nodes, elements)?;
            let patches = SchwarzPatches::restricted(&matrix, blocks, zeros.clone());
            (Inverses::Whole(patches.map_err(|error| at_root(surfaces, error))?), matrix.diagonal())
        } else {
            let found = modes_and_diagonal(nodes, elements, blocks.collect());
            let (modes, diagonal) = found.map_err(|error| match error {
                ModesError::Patch(error) => at_root(surfaces, error),
                ModesError::Matrix(error) => error,
            })?;
            (Inverses::WeakModes(modes), diagonal)
        };
        Ok((Self { inverses, positions: nodes.positions(), r: zeros.clone(), z: zeros }, diagonal))
    }
}

/// The error of the block of a root.
fn at_root<const D: usize>(surfaces: &SurfaceCoupling<D>, error: PatchError) -> StokesError
where
    Dim<D>: Space<D>,
{
    let PatchError { patch, source } = error;
    let (discretisation, root) = (surfaces.discretisation(), surfaces.roots()[patch] as usize);
    let (mesh, half) = (&discretisation.mesh, 0.5 * discretisation.cell_size(root));
    let center = mesh.lower_corner(&mesh.cells()[root]).iter().map(|x| x + half).collect();
    StokesError::SurfaceBlock { center, body: surfaces.body_at_root(patch), source }
}

/// The inverse diagonal, with blocks for the twists.
fn diagonal<const D: usize>(
    elements: &Elements<'_, D>,
    surfaces: &SurfaceCoupling<D>,
    smoothed: &[bool],
    (positions, near_surfaces): (&[u32], &[f64]),
) -> Result<BlockDiagonal, StokesError>
where
    Dim<D>: Space<D>,
{
    let system = elements.system();
    let mut smoothed_in_fluid = smoothed.to_vec();
    positions.iter().for_each(|&k| smoothed_in_fluid[k as usize / D] = false);
    let fluid = nodal_diagonal(&system.space, &system.cells, &smoothed_in_fluid);
    let mut nodal = fluid.map_err(StokesError::AtSurface)?;
    for (&k, &value) in positions.iter().zip(near_surfaces) {
        if value <= 0.0 || value.is_nan() {
            let source = DiagonalError::Node { node: k as usize / D, value };
            return Err(StokesError::AtSurface(source));
        }
        nodal[k as usize] = (1.0 / value) as f32;
    }
    let rigid = Dim::<D>::RIGID;
    let mut blocks = vec![0.0; system.space.body_count() * rigid * rigid];
    for (piece, (_, body)) in surfaces.pieces().enumerate() {
        surfaces.add_twist_block(piece, &mut blocks[body * rigid * rigid..][..rigid * rigid]);
    }
    for (body, block) in blocks.chunks_exact_mut(rigid * rigid).enumerate() {
        let inverted = invert_spd(rigid, block);
        inverted.map_err(|source| StokesError::AtSurface(DiagonalError::Body { body, source }))?;
    }
    Ok(BlockDiagonal::new(nodal, blocks.into_iter().map(|value| value as f32).collect(), rigid))
}
