//! A multigrid cycle for the penalised operator on the nodes around the solid.
//!
//! The rigid levels never see the viscosity of the solid. Here every level keeps it: the finest applies the operator itself,
//! the others the Galerkin products `P^T A P` on those of their nodes that lie among the solid's, so a cell that is cut stays
//! cut as it is. [`Patches`] smooth on all but the coarsest level, which is factorised. In 2D, where factors are small, that
//! is the finest.
//!
//! The cycle runs before and after the rigid levels: whole, or where the contrast is low, cut in two halves, of which the first
//! smooths and then corrects ([`SolidCycle::descend`]) and the second is its transpose ([`SolidCycle::ascend`]).

use gluey_fem::element::{split, values_1d};
use gluey_geom::{Dim, Space};
use gluey_linalg::{
    Chebyshev, DirectSpd, Guess, LinOp, Ordering, Preconditioner, SparseMatrix, SpectralInterval,
    estimate_lambda_max, vector,
};

use crate::assembly::factorised;
use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::node_matrix::{NodeMatrix, Prolongation};
use crate::patches::Patches;
use crate::restricted::Restricted;
use crate::transfer::Evaluator;

/// Applications of the patches in a sweep.
const DEGREE: usize = 2;
/// Largest over smallest eigenvalue that a sweep damps.
const RATIO: f64 = 4.0;
/// Lanczos steps for the largest eigenvalue.
const LANCZOS_STEPS: usize = 8;
/// Factor by which that estimate is raised.
const SAFETY: f64 = 1.1;
/// Ratio of the viscosities of solid and fluid from which on cycles are whole. Two spheres (a/h = 3.2) take 26 in place of 29
/// iterations at 1e2, each a quarter dearer, and 35 in place of 48 at 1e6.
const WHOLE_FROM: f64 = 300.0;
/// No node.
const NONE: u32 = u32::MAX;

/// Nodes of a mesh with numbers of their own.
pub struct Numbered<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Discretisation<D>,
    /// Number of each node, or `u32::MAX`.
    pub number: Vec<u32>,
    /// Nodes with a number.
    pub count: usize,
}

impl<'a, const D: usize> Numbered<'a, D> {
    /// Numbers the nodes for which `is_in` holds.
    pub fn new(mesh: &'a Discretisation<D>, is_in: impl Fn(usize) -> bool) -> Self {
        let mut new = Self { mesh, number: vec![NONE; mesh.velocity.node_count()], count: 0 };
        for node in (0..new.number.len()).filter(|&node| is_in(node)) {
            new.number[node] = new.count as u32;
            new.count += 1;
        }
        new
    }

    /// The numbered nodes of each cell whose centre has a number.
    fn cells(&self) -> impl Iterator<Item = Vec<u32>> {
        let nodes = &self.mesh.velocity;
        let centre = nodes.nodes_per_cell() / 2;
        let number = |node: &u32| Some(self.number[*node as usize]).filter(|&n| n != NONE);
        (0..nodes.cell_count())
            .map(|cell| nodes.cell(cell))
            .filter(move |cell| number(&cell[centre]).is_some())
            .map(move |cell| cell.iter().filter_map(number).collect())
    }

    /// The nodes of a coarser mesh that lie at numbered ones, and the interpolation from them.
    fn coarsened<'b>(&self, mesh: &'b Discretisation<D>) -> (Numbered<'b, D>, Prolongation) {
        let mut found: Vec<(usize, [[f64; 3]; D])> = Vec::with_capacity(self.count);
        let mut is_in = vec![false; mesh.velocity.node_count()];
        let evaluator = Evaluator::new(&mesh.mesh);
        for node in (0..self.number.len()).filter(|&node| self.number[node] != NONE) {
            let Some((cell, x)) = evaluator.locate(&self.mesh.velocity, node) else { continue };
            let place = (0..D).rev().try_fold(0, |place, d| {
                let along = 2.0 * x[d];
                (along == along.round()).then_some(3 * place + along as usize)
            });
            if let Some(place) = place {
                is_in[mesh.velocity.cell(cell)[place] as usize] = true;
            }
            found.push((cell, x.map(|x| values_1d(2, x))));
        }
        let coarse = Numbered::new(mesh, |node| is_in[node]);
        let terms = |(cell, line): &(usize, [[f64; 3]; D])| {
            let weight = |i: usize| (0..D).map(|d| line[d][split::<D>(i, 3)[d]]).product::<f64>();
            let nodes = mesh.velocity.cell(*cell).iter().map(|&n| coarse.number[n as usize]).enumerate();
            let terms = nodes.filter(|term| term.1 != NONE).map(|(i, node)| (node, weight(i)));
            terms.filter(|term| term.1 != 0.0).collect::<Vec<_>>()
        };
        let prolongation = Prolongation::new(coarse.count, found.iter().map(terms));
        (coarse, prolongation)
    }
}

/// The levels.
pub struct SolidCycle<const D: usize> {
    /// Operator and smoother of the finest level, unless that is factorised.
    finest: Option<(Restricted<f64, D>, Smoother<D>)>,
    /// From fine to coarse.
    coarser: Vec<Coarse<D>>,
    direct: DirectSpd,
    /// Residual of the finest level.
    r: Vec<f64>,
    /// Whether it is its own transpose.
    is_whole: bool,
}

/// A level below the finest.
struct Coarse<const D: usize> {
    prolongation: Prolongation,
    /// Matrix and smoother, but on the coarsest.
    smoothed: Option<(NodeMatrix<D>, Smoother<D>)>,
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
}

struct Smoother<const D: usize> {
    patches: Patches<D>,
    chebyshev: Chebyshev<f64>,
}

impl<const D: usize> SolidCycle<D>
where
    Dim<D>: Space<D>,
{
    /// The cycle that is a factorisation.
    pub fn factorised(matrix: &SparseMatrix, order: &[usize]) -> Result<Self, StokesError> {
        Ok(Self {
            finest: None,
            coarser: Vec::new(),
            direct: factorised(matrix, Ordering::Custom(order))?,
            r: Vec::new(),
            is_whole: true,
        })
    }

    /// The cycle for an operator whose first unknowns are those at the nodes of `solid`, where it is `matrix`, and which has
    /// this diagonal on the others. `meshes` are those of the coarser levels, fine to coarse.
    pub fn new<'a>(
        (mut operator, diagonal): (Restricted<f64, D>, &[f64]),
        (solid, mut matrix): (Numbered<'a, D>, NodeMatrix<D>),
        meshes: impl Iterator<Item = &'a Discretisation<D>>,
        contrast: f64,
    ) -> Result<Self, StokesError> {
        let finest = Smoother::new(&mut operator, &matrix, solid.cells(), diagonal)?;
        let mut coarser: Vec<Coarse<D>> = Vec::new();
        let mut nodes = solid;
        for mesh in meshes {
            let (coarse, prolongation) = nodes.coarsened(mesh);
            let product = matrix.galerkin(&prolongation);
            if let Some(level) = coarser.last_mut() {
                let smoother = Smoother::new(&mut &matrix, &matrix, nodes.cells(), &matrix.diagonal())?;
                level.smoothed = Some((matrix, smoother));
            }
            coarser.push(Coarse::new(prolongation));
            (matrix, nodes) = (product, coarse);
        }
        let (matrix, order) = matrix.to_sparse()?;
        let r = vec![0.0; operator.dim()];
        Ok(Self {
            finest: Some((operator, finest)),
            coarser,
            direct: factorised(&matrix, Ordering::Custom(&order))?,
            r,
            is_whole: contrast >= WHOLE_FROM,
        })
    }

    /// From a zero guess: smooths `A x = b`, then corrects by the coarser levels; a whole cycle smooths again.
    pub fn descend(&mut self, b: &[f64], x: &mut [f64]) {
        let Some((a, smoother)) = &mut self.finest else { return self.direct.apply(b, x) };
        smoother.smooth(a, b, x, Guess::Zero);
        residual(a, b, x, &mut self.r);
        correct(&mut self.coarser, &mut self.direct, &self.r, x);
        if self.is_whole {
            smoother.smooth(a, b, x, Guess::Given);
        }
    }

    /// The transpose of [`SolidCycle::descend`].
    pub fn ascend(&mut self, b: &[f64], x: &mut [f64]) {
        let (Some((a, smoother)), false) = (&mut self.finest, self.is_whole) else {
            return self.descend(b, x);
        };
        x.fill(0.0);
        correct(&mut self.coarser, &mut self.direct, b, x);
        smoother.smooth(a, b, x, Guess::Given);
    }

    /// What [`SolidCycle::descend`] left: `r = b - A x`, or zero where it solves.
    pub fn residual(&mut self, b: &[f64], x: &[f64], r: &mut [f64]) {
        match &mut self.finest {
            Some((a, _)) => residual(a, b, x, r),
            None => r.fill(0.0),
        }
    }

    /// Applications on the finest mesh since the last call, each as its share of it.
    pub fn take_applications(&mut self) -> f64 {
        self.finest.as_mut().map_or(0.0, |(a, _)| a.take_applications())
    }
}

impl<const D: usize> Coarse<D> {
    fn new(prolongation: Prolongation) -> Self {
        let zeros = || vec![0.0; prolongation.coarse_count() * D];
        Self { b: zeros(), x: zeros(), r: zeros(), smoothed: None, prolongation }
    }
}

impl<const D: usize> Smoother<D> {
    fn new(
        a: &mut impl LinOp<f64>,
        matrix: &NodeMatrix<D>,
        cells: impl Iterator<Item = Vec<u32>>,
        diagonal: &[f64],
    ) -> Result<Self, StokesError> {
        let failed = |reason| StokesError::Smoother { level: 0, reason: format!("solid: {reason}") };
        let mut patches = Patches::new(matrix, cells, diagonal).map_err(|e| failed(e.to_string()))?;
        let largest = estimate_lambda_max(a, &mut patches, LANCZOS_STEPS)?;
        let interval = SpectralInterval::upper_part(largest, RATIO, SAFETY);
        Ok(Self { patches, chebyshev: Chebyshev::new(a.dim(), DEGREE, interval) })
    }

    fn smooth(&mut self, a: &mut impl LinOp<f64>, b: &[f64], x: &mut [f64], guess: Guess) {
        self.chebyshev.smooth(a, &mut self.patches, b, x, guess);
    }
}

/// Adds to `x` what the coarser levels make of the residual `r`.
fn correct<const D: usize>(levels: &mut [Coarse<D>], direct: &mut DirectSpd, r: &[f64], x: &mut [f64]) {
    let Some((level, coarser)) = levels.split_first_mut() else { return };
    level.prolongation.restrict::<D>(r, &mut level.b);
    match &mut level.smoothed {
        None => direct.apply(&level.b, &mut level.x),
        Some((matrix, smoother)) => {
            smoother.smooth(matrix, &level.b, &mut level.x, Guess::Zero);
            residual(matrix, &level.b, &level.x, &mut level.r);
            correct(coarser, direct, &level.r, &mut level.x);
            smoother.smooth(matrix, &level.b, &mut level.x, Guess::Given);
        }
    }
    level.prolongation.prolong::<D>(&level.x, x);
}

fn residual(a: &mut impl LinOp<f64>, b: &[f64], x: &[f64], r: &mut [f64]) {
    a.apply(x, r);
    vector::residual_from_product(b, r);
}
