//! The smoothers of a mesh that surfaces cut.
//!
//! Where aggregates extrapolate and penalties act, motions of every stiffness meet in one cell: the
//! operator's block on the free nodes of every root tells them apart. A sweep of restricted additive Schwarz
//! over these (Cai and Sarkis 1999), `z = sum R_c^T W_c A_c^-1 R_c r` with `W` the inverse number of blocks a
//! node belongs to, needs no damping. In 3D, where an inverse has 3321 numbers, only the few modes of a block
//! that its diagonal does not tell apart are kept. Elsewhere Chebyshev's method with the diagonal is enough.

use gluey_fem::ReferenceMatrices;
use gluey_geom::Dim;
use gluey_linalg::{
    Chebyshev, Guess, Jagged, LinOp, PatchError, Preconditioner, SchwarzPatches, SpectralInterval, WeakModes,
    estimate_lambda_max_from, invert_spd, vector,
};
use gluey_parallel::Halo;

use crate::error::{DiagonalError, StokesError};
use crate::operator::{
    BlockDiagonal, Elements, OnOwned, Summed, SystemHalos, ViscousOperator, add_at, gather, nodal_diagonal,
};
use crate::precondition::assembly::assemble_on_nodes;
use crate::precondition::numbered::NumberedNodes;
use crate::precondition::velocity::cell_lambda_max;
use crate::space::{Discretisation, VelocitySpace, around_finest_cells};
use crate::surface::SurfaceCoupling;

use super::roots::{ModesError, modes_and_diagonal};

/// Steps of the sweep with the diagonal in 2D and in 3D, and what it damps eigenvalues down to: the largest
/// in the fluid over this.
const DEGREES: [usize; 2] = [3, 4];
const RATIOS: [f64; 2] = [5.0, 8.0];
/// Spheres with a smaller radius, in cells, have a block for what is inside: some 120 nodes at most. Discs
/// have none.
const RADIUS_OF_BLOCKS: f64 = 1.5;
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
    blocks: RootBlocks<D>,
    /// Reduced velocities and their loads.
    velocity: Vec<f32>,
    load: Vec<f32>,
    /// Of reduced velocities.
    halo: Halo,
}

/// Restricted additive Schwarz on the free nodes of the own roots.
struct RootBlocks<const D: usize> {
    inverses: Inverses<D>,
    /// Blocks inside small bodies, where there are any.
    inside: Option<WeakModes<D>>,
    /// The components of the nodes among the reduced velocities.
    positions: Vec<u32>,
    /// In a part, which share of its blocks a component has here.
    shares: Option<Vec<f32>>,
    r: Vec<f32>,
    z: Vec<f32>,
}

/// Matrices that stand for the inverses of the blocks.
enum Inverses<const D: usize> {
    /// Themselves.
    Whole(SchwarzPatches<f32, D>),
    /// Their largest parts, a tenth of the memory.
    WeakModes(WeakModes<D>),
}

impl<const D: usize> SurfaceSmoother<D> {
    /// The smoothers of a system with cut cells, on levels of which the finest has the velocities `rigid`.
    /// Vectors that they are applied to hold the same at ghosts as at their owners. All ranks call this.
    ///
    /// # Errors
    /// If a block or an entry of the diagonal is not positive, on all ranks.
    pub fn new(
        elements: &Elements<'_, D>,
        surfaces: &SurfaceCoupling<D>,
        rigid: &VelocitySpace<D>,
    ) -> Result<Self, StokesError> {
        let discretisation = elements.system().discretisation();
        let assembled = discretisation.agreed(Self::assembled(elements, surfaces, rigid))?;
        discretisation.agreed(assembled.completed(elements))
    }

    /// What of it needs no other part.
    ///
    /// # Errors
    /// If a block or an entry of the diagonal is not positive.
    fn assembled(
        elements: &Elements<'_, D>,
        surfaces: &SurfaceCoupling<D>,
        rigid: &VelocitySpace<D>,
    ) -> Result<AssembledSmoother<D>, StokesError> {
        let system = elements.system();
        let near = near_surfaces(elements, surfaces);
        let here = nodes_of_own_cells(system.discretisation());
        let is_in = |n: usize| near[n] && system.space.is_free(n) && here.as_ref().is_none_or(|here| here[n]);
        let nodes = NumberedNodes::new(system.discretisation(), is_in);
        let mut smoothed = around_finest_cells(system.discretisation());
        if let Some(here) = &here {
            smoothed.iter_mut().zip(here).for_each(|(smoothed, here)| *smoothed &= here);
        }
        let (blocks, near_surfaces) = RootBlocks::new(&nodes, elements, surfaces, rigid)?;
        let nodal = nodal(elements, &smoothed, &blocks.positions, &near_surfaces)?;
        smoothed.iter_mut().zip(&near).for_each(|(smoothed, near)| *smoothed |= near);
        let operator = ViscousOperator::new(system, &smoothed, &near);
        Ok(AssembledSmoother { operator, blocks, nodal, near })
    }
}

/// A smoother whose parts do not know of each other yet.
struct AssembledSmoother<const D: usize> {
    operator: ViscousOperator<D>,
    blocks: RootBlocks<D>,
    /// The inverse diagonal at the nodes of own cells.
    nodal: Vec<f32>,
    /// Nodes of cut cells and roots.
    near: Vec<bool>,
}

impl<const D: usize> AssembledSmoother<D> {
    /// The smoother. All ranks call this.
    ///
    /// # Errors
    /// If the block of a twist is not positive.
    fn completed(self, elements: &Elements<'_, D>) -> Result<SurfaceSmoother<D>, StokesError> {
        let Self { mut operator, blocks, nodal, near } = self;
        let system = elements.system();
        let SystemHalos { velocities: mut halo, twist_blocks: mut of_blocks, .. } = system.halos().clone();
        // Parts that fail send all messages first, which others wait for.
        let (mut diagonal, failure) = diagonal(elements, nodal, [&mut halo, &mut of_blocks]);
        let near: Vec<u32> = if system.discretisation().is_part() {
            let near = (0..near.len()).filter(|&node| near[node] && system.space.is_free(node));
            near.flat_map(|node| (node * D) as u32..((node + 1) * D) as u32).collect()
        } else {
            blocks.positions.clone()
        };
        let reference = system.discretisation().reference();
        let (bodies, rigid) = (system.space.body_count(), Dim::<D>::RIGID);
        let start = system.discretisation().pseudo_random_velocities(bodies, rigid);
        let interval = interval(&mut operator, start, &mut diagonal, &near, &reference, &mut halo)?;
        operator.take_applications();
        failure.map_or(Ok(()), Err)?;
        let dim = operator.dim();
        Ok(SurfaceSmoother {
            operator,
            chebyshev: Chebyshev::new(dim, DEGREES[D - 2], interval),
            diagonal,
            blocks,
            velocity: vec![0.0; dim],
            load: vec![0.0; dim],
            halo,
        })
    }
}

impl<const D: usize> SurfaceSmoother<D> {
    /// `x += G r`, `r -= A G r` by the blocks `G`.
    pub fn add_blocks(&mut self, r: &mut [f32], x: &mut [f32]) {
        self.velocity.fill(0.0);
        self.blocks.add(r, &mut self.velocity);
        self.halo.sum(&mut self.velocity);
        vector::axpy(1.0, &self.velocity, x);
        self.operator.apply_near(&self.velocity, &mut self.load);
        self.halo.sum(&mut self.load);
        vector::axpy(-1.0, &self.load, r);
    }

    /// `z += G r` by the blocks inside bodies.
    pub fn add_inside(&mut self, r: &[f32], z: &mut [f32]) {
        self.blocks.add_inside(r, z);
    }

    /// Chebyshev's sweep on `A x = b` from an `x` with the residual `r`.
    pub fn sweep(&mut self, r: &[f32], x: &mut [f32]) {
        let Self { operator, diagonal, chebyshev, velocity, halo, .. } = self;
        let mut operator = Summed { operator, halo };
        chebyshev.smooth(&mut operator, diagonal, r, velocity, Guess::Zero);
        vector::axpy(1.0, velocity, x);
    }

    /// `r -= A z` at the nodes that are smoothed.
    pub fn subtract(&mut self, z: &[f32], r: &mut [f32]) {
        Summed { operator: &mut self.operator, halo: &mut self.halo }.apply(z, &mut self.load);
        vector::axpy(-1.0, &self.load, r);
    }

    /// Sets the ghosts of reduced velocities to what their owners have.
    pub fn update(&mut self, x: &mut [f32]) {
        self.halo.update(x);
    }

    /// The halo of reduced velocities.
    pub fn halo(&self) -> &Halo {
        &self.halo
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
    start: Vec<f32>,
    diagonal: &mut BlockDiagonal,
    near: &[u32],
    reference: &ReferenceMatrices<D>,
    halo: &mut Halo,
) -> Result<SpectralInterval, StokesError> {
    let in_fluid = cell_lambda_max(reference);
    let mut on_owned = OnOwned::new(operator, halo);
    let largest = SAFETY * estimate_lambda_max_from(start, &mut on_owned, diagonal, LANCZOS_STEPS)?;
    let excess = (largest / in_fluid).max(1.0).sqrt();
    diagonal.scale(near, (1.0 / excess) as f32);
    Ok(SpectralInterval { lower: in_fluid / RATIOS[D - 2], upper: in_fluid * excess })
}

/// The nodes of the own cells of a part.
fn nodes_of_own_cells<const D: usize>(discretisation: &Discretisation<D>) -> Option<Vec<bool>> {
    let nodes = &discretisation.velocity;
    discretisation.is_part().then(|| {
        let mut here = vec![false; nodes.node_count()];
        let own = (0..nodes.cell_count()).filter(|&cell| discretisation.is_own(cell));
        own.flat_map(|cell| nodes.cell(cell)).for_each(|&node| here[node as usize] = true);
        here
    })
}

/// The nodes of cut cells and of roots.
fn near_surfaces<const D: usize>(elements: &Elements<'_, D>, surfaces: &SurfaceCoupling<D>) -> Vec<bool> {
    let nodes = &elements.system().discretisation().velocity;
    let mut near = vec![false; nodes.node_count()];
    let cut = surfaces.cut.cells.iter().map(|cell| cell.cell);
    for cell in cut.chain(surfaces.roots().iter().copied()) {
        nodes.cell(cell as usize).iter().for_each(|&node| near[node as usize] = true);
    }
    near
}

impl<const D: usize> RootBlocks<D> {
    /// `z += G r`.
    fn add(&mut self, r: &[f32], z: &mut [f32]) {
        let Self { inverses, positions, shares, r: local, z: correction, .. } = self;
        gather(positions, r, local);
        match inverses {
            Inverses::Whole(patches) => patches.apply(local, correction),
            Inverses::WeakModes(modes) => modes.apply(local, correction),
        }
        if let Some(shares) = shares {
            correction.iter_mut().zip(shares).for_each(|(z, share)| *z *= *share);
        }
        add_at(positions, correction, z);
    }

    /// `z += G r` for the blocks inside bodies.
    fn add_inside(&mut self, r: &[f32], z: &mut [f32]) {
        let Self { inside: Some(inside), positions, r: local, z: correction, .. } = self else { return };
        gather(positions, r, local);
        inside.apply(local, correction);
        add_at(positions, correction, z);
    }

    /// The blocks, and the diagonal at their nodes.
    fn new(
        nodes: &NumberedNodes<'_, D>,
        elements: &Elements<'_, D>,
        surfaces: &SurfaceCoupling<D>,
        rigid: &VelocitySpace<D>,
    ) -> Result<(Self, Vec<f64>), StokesError> {
        let number = |&node: &u32| nodes.nodes.number(node as usize).map(|number| number as u32);
        let block = |&root: &u32| -> Vec<u32> {
            let mut block: Vec<u32> =
                nodes.mesh.velocity.cell(root as usize).iter().filter_map(number).collect();
            block.sort_unstable();
            block
        };
        let is_own = |root: &&u32| nodes.mesh.is_own(**root as usize);
        let blocks: Jagged<u32> = surfaces.roots().iter().filter(is_own).map(block).collect();
        let shares = nodes.mesh.is_part().then(|| shares::<D>(nodes, surfaces.roots(), block));
        let zeros = vec![0.0; nodes.nodes.len() * D];
        let (inverses, inside, diagonal) = if D == 2 {
            let matrix = assemble_on_nodes(nodes, elements)?;
            let lists = blocks.iter().map(<[u32]>::to_vec);
            let patches = SchwarzPatches::restricted(&matrix, lists, zeros.clone());
            let patches = patches.map_err(|error| at_root(surfaces, &blocks, error))?;
            (Inverses::Whole(patches), None, matrix.diagonal())
        } else {
            let inside = inside_bodies(nodes, rigid, &blocks);
            let all: Jagged<u32> = blocks.iter().chain(inside.iter()).map(<[u32]>::to_vec).collect();
            let found = modes_and_diagonal(nodes, elements, &all);
            let (modes, diagonal) = found.map_err(|error| match error {
                ModesError::Patch(error) => at_root(surfaces, &all, error),
                ModesError::Matrix(error) => error,
            })?;
            let (of_roots, of_inside) = modes.split_at(blocks.len());
            let weak = |patches, modes: &[Vec<f32>]| WeakModes::from_modes(patches, modes.iter(), &diagonal);
            let inside = (!inside.is_empty()).then(|| weak(inside, of_inside));
            (Inverses::WeakModes(weak(blocks, of_roots)), inside, diagonal)
        };
        let positions = nodes.positions();
        Ok((Self { inverses, inside, positions, shares, r: zeros.clone(), z: zeros }, diagonal))
    }
}

/// Which share of the blocks of each component belongs to own roots, of the blocks of all.
fn shares<const D: usize>(
    nodes: &NumberedNodes<'_, D>,
    roots: &[u32],
    block: impl Fn(&u32) -> Vec<u32>,
) -> Vec<f32> {
    let [mut own, mut all] = [0, 1].map(|_| vec![0u32; nodes.nodes.len()]);
    for root in roots {
        let is_own = u32::from(nodes.mesh.is_own(*root as usize));
        for node in block(root) {
            own[node as usize] += is_own;
            all[node as usize] += 1;
        }
    }
    let share = |(&own, &all): (&u32, &u32)| own as f32 / all.max(1) as f32;
    own.iter().zip(&all).map(share).flat_map(|share| [share; D]).collect()
}

/// The own nodes of own roots that the levels take for parts of a body, body by body, of small bodies.
///
/// The levels move such nodes with the body. Cells much smaller than the body have no fluid there, and their
/// nodes are no unknowns; cells as large as it all have some, however little, and a velocity in the middle of
/// the body alone has hardly any energy: less than any block of a single cell tells.
fn inside_bodies<const D: usize>(
    nodes: &NumberedNodes<'_, D>,
    rigid: &VelocitySpace<D>,
    of_roots: &Jagged<u32>,
) -> Jagged<u32> {
    let mut is_in_root = vec![false; nodes.nodes.len()];
    of_roots.items().iter().for_each(|&node| is_in_root[node as usize] = true);
    let own = nodes.mesh.own_velocity_nodes();
    let numbered = nodes.nodes.positions().iter().zip(0u32..);
    let in_roots =
        numbered.filter(|&(&n, number)| own.contains(&(n as usize)) && is_in_root[number as usize]);
    let largest = RADIUS_OF_BLOCKS * nodes.mesh.finest_cell_size();
    let is_small = |body: &u32| rigid.radius(*body as usize) < largest;
    let pairs = in_roots.filter_map(|(&node, number)| {
        rigid.body_of(node as usize).filter(is_small).map(|body| (body as usize, number))
    });
    let of_bodies = Jagged::grouped(rigid.body_count(), pairs);
    of_bodies.iter().filter(|nodes| !nodes.is_empty()).map(<[u32]>::to_vec).collect()
}

/// The error of a block: of a root, or of what is inside a body, at the first root that has a node of it.
fn at_root<const D: usize>(
    surfaces: &SurfaceCoupling<D>,
    blocks: &Jagged<u32>,
    error: PatchError,
) -> StokesError {
    let PatchError { patch, source } = error;
    let (discretisation, roots) = (surfaces.discretisation(), surfaces.roots());
    let own = (0..roots.len()).filter(|&place| discretisation.is_own(roots[place] as usize));
    let own: Vec<usize> = own.collect();
    let has_it = |block: &[u32]| block.contains(&blocks[patch][0]);
    let first = || blocks.iter().position(has_it).unwrap_or_default();
    let place = own.get(patch).copied().unwrap_or_else(|| own[first()]);
    let root = roots[place] as usize;
    let (mesh, half) = (&discretisation.mesh, 0.5 * discretisation.cell_size(root));
    let center = mesh.lower_corner(&mesh.cells()[root]).iter().map(|x| x + half).collect();
    StokesError::SurfaceBlock { center, body: surfaces.body_at_root(place), source }
}

/// The inverse diagonal at nodes: in the fluid, and at the given ones near surfaces.
fn nodal<const D: usize>(
    elements: &Elements<'_, D>,
    smoothed: &[bool],
    positions: &[u32],
    near_surfaces: &[f64],
) -> Result<Vec<f32>, StokesError> {
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
    Ok(nodal)
}

/// The inverse diagonal, with blocks for the twists, and the first of these that is not positive.
fn diagonal<const D: usize>(
    elements: &Elements<'_, D>,
    mut nodal: Vec<f32>,
    [halo, of_blocks]: [&mut Halo; 2],
) -> (BlockDiagonal, Option<StokesError>) {
    let system = elements.system();
    let rigid = Dim::<D>::RIGID;
    let mut blocks = system.twist_blocks();
    let nodal_dim = nodal.len();
    nodal.resize(system.space.dim(), 0.0);
    halo.update(&mut nodal);
    nodal.truncate(nodal_dim);
    of_blocks.sum(&mut blocks);
    // A body that is near a part and nowhere in it has none there.
    let is_here = |block: &[f64]| !system.discretisation().is_part() || block.iter().any(|&b| b != 0.0);
    let mut failure = None;
    for (body, block) in blocks.chunks_exact_mut(rigid * rigid).enumerate().filter(|b| is_here(b.1)) {
        if let Err(source) = invert_spd(rigid, block) {
            failure = failure.or(Some(StokesError::AtSurface(DiagonalError::Body { body, source })));
        }
    }
    let blocks = blocks.into_iter().map(|value| value as f32).collect();
    (BlockDiagonal::new(nodal, blocks, rigid), failure)
}
