//! Galerkin multigrid for the penalised operator on the nodes of the solid.
//!
//! The rigid levels never see the viscosity of the solid; this is where strain inside it is found. In 2D,
//! where factors are small, the operator on these nodes is factorised. In 3D a multigrid cycle on coarser
//! meshes approximates its inverse, with the Galerkin products `P^T A P` on those of their nodes that lie
//! among the solid's, so a cell that is cut stays cut as it is. [`SchwarzPatches`] on the cells smooth all
//! but the coarsest level, which is factorised; on the finest the smoother of the whole mesh does.

use gluey_fem::Evaluator;
use gluey_fem::element::{multi_index, values_1d};
use gluey_linalg::{
    Chebyshev, ChebyshevParams, DirectSpd, Guess, LinOp, Ordering, Preconditioner, Prolongation,
    SchwarzPatches, SparseMatrix, SymmetricBlockMatrix, vector,
};

use crate::error::StokesError;
use crate::operator::factorised;
use crate::precondition::numbered::NumberedNodes;
use crate::space::Discretisation;

/// A sweep with the patches as preconditioner.
const SWEEP: ChebyshevParams = ChebyshevParams { degree: 2, ratio: 4.0, safety: 1.1, lanczos_steps: 8 };

/// A V-cycle of Galerkin multigrid on the nodes of the solid, or a factorisation.
pub struct SolidMultigrid<const D: usize> {
    /// From fine to coarse, without the finest; none where that is factorised.
    coarser: Vec<Coarse<D>>,
    direct: DirectSpd,
}

/// A level below the finest.
struct Coarse<const D: usize> {
    prolongation: Prolongation,
    /// Matrix and smoother, but on the coarsest.
    smoothed: Option<(SymmetricBlockMatrix<D>, Smoother<D>)>,
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
}

struct Smoother<const D: usize> {
    patches: SchwarzPatches<f64, D>,
    chebyshev: Chebyshev<f64>,
}

impl<const D: usize> SolidMultigrid<D> {
    /// The factorisation of a matrix in place of a cycle.
    pub fn factorised(matrix: &SparseMatrix, order: &[usize]) -> Result<Self, StokesError> {
        Ok(Self { coarser: Vec::new(), direct: factorised(matrix, Ordering::Custom(order))? })
    }

    /// The cycle below the nodes of `solid`, on which the operator is `matrix`, on the `meshes` of the
    /// coarser levels, fine to coarse.
    pub fn below<'a>(
        solid: &NumberedNodes<'a, D>,
        matrix: &SymmetricBlockMatrix<D>,
        meshes: impl Iterator<Item = &'a Discretisation<D>>,
    ) -> Result<Self, StokesError> {
        let mut coarser: Vec<Coarse<D>> = Vec::new();
        let mut last: Option<(NumberedNodes<'a, D>, SymmetricBlockMatrix<D>)> = None;
        for mesh in meshes {
            let (nodes, matrix) = last.as_ref().map_or((solid, matrix), |(nodes, matrix)| (nodes, matrix));
            let (coarse, prolongation) = nodes.coarsened(mesh);
            let product = matrix.galerkin(&prolongation);
            if let (Some(level), Some((nodes, matrix))) = (coarser.last_mut(), last) {
                let smoother = Smoother::new(&matrix, &nodes)?;
                level.smoothed = Some((matrix, smoother));
            }
            coarser.push(Coarse::new(prolongation));
            last = Some((coarse, product));
        }
        let coarsest = last.as_ref().map_or(matrix, |last| &last.1);
        let (matrix, blocks) = coarsest.to_sparse()?;
        Ok(Self { coarser, direct: factorised(&matrix, Ordering::Custom(&blocks.minimum_degree()?))? })
    }
}

impl<const D: usize> Preconditioner<f64> for SolidMultigrid<D> {
    fn apply(&mut self, b: &[f64], x: &mut [f64]) {
        if self.coarser.is_empty() {
            return self.direct.apply(b, x);
        }
        x.fill(0.0);
        correct(&mut self.coarser, &mut self.direct, b, x);
    }
}

impl<'a, const D: usize> NumberedNodes<'a, D> {
    /// The numbered nodes of each cell whose centre has a number.
    pub fn cells(&self) -> impl Iterator<Item = Vec<u32>> {
        let nodes = &self.mesh.velocity;
        let centre = nodes.nodes_per_cell() / 2;
        let number = |node: &u32| self.nodes.number(*node as usize).map(|number| number as u32);
        (0..nodes.cell_count())
            .map(|cell| nodes.cell(cell))
            .filter(move |cell| self.nodes.contains(cell[centre] as usize))
            .map(move |cell| cell.iter().filter_map(number).collect())
    }

    /// The nodes of a coarser mesh that lie at numbered ones, and the interpolation from them.
    pub fn coarsened<'b>(&self, mesh: &'b Discretisation<D>) -> (NumberedNodes<'b, D>, Prolongation) {
        let mut found: Vec<(usize, [[f64; 3]; D])> = Vec::with_capacity(self.nodes.len());
        let mut is_in = vec![false; mesh.velocity.node_count()];
        let evaluator = Evaluator::new(&mesh.mesh);
        for &node in self.nodes.positions() {
            let Some((cell, x)) = evaluator.locate(&self.mesh.velocity.point(node as usize)) else {
                continue;
            };
            let place = (0..D).rev().try_fold(0, |place, d| {
                let along = 2.0 * x[d];
                (along == along.round()).then_some(3 * place + along as usize)
            });
            if let Some(place) = place {
                is_in[mesh.velocity.cell(cell)[place] as usize] = true;
            }
            found.push((cell, x.map(|x| values_1d(2, x))));
        }
        let coarse = NumberedNodes::new(mesh, |node| is_in[node]);
        let terms = |(cell, line): &(usize, [[f64; 3]; D])| {
            let weight = |i: usize| (0..D).map(|d| line[d][multi_index::<D>(i, 3)[d]]).product::<f64>();
            let numbers = mesh.velocity.cell(*cell).iter().map(|&n| coarse.nodes.number(n as usize));
            let terms = numbers.enumerate().filter_map(|(i, number)| Some((number? as u32, weight(i))));
            terms.filter(|term| term.1 != 0.0).collect::<Vec<_>>()
        };
        let prolongation = Prolongation::new(coarse.nodes.len(), found.iter().map(terms));
        (coarse, prolongation)
    }
}

impl<const D: usize> Coarse<D> {
    fn new(prolongation: Prolongation) -> Self {
        let zeros = || vec![0.0; prolongation.coarse_count() * D];
        Self { b: zeros(), x: zeros(), r: zeros(), smoothed: None, prolongation }
    }
}

impl<const D: usize> Smoother<D> {
    fn new(matrix: &SymmetricBlockMatrix<D>, nodes: &NumberedNodes<'_, D>) -> Result<Self, StokesError> {
        let diagonal = matrix.diagonal().iter().map(|d| 1.0 / d).collect();
        let patches = SchwarzPatches::new(matrix, nodes.cells(), diagonal);
        let mut patches = patches.map_err(StokesError::SolidPatch)?;
        let chebyshev = Chebyshev::for_operator(&mut &*matrix, &mut patches, &SWEEP)?;
        Ok(Self { patches, chebyshev })
    }

    fn smooth(&mut self, a: &mut impl LinOp<f64>, b: &[f64], x: &mut [f64], guess: Guess) {
        self.chebyshev.smooth(a, &mut self.patches, b, x, guess);
    }
}

/// Adds to `x` the correction of the coarser levels for the residual `r`.
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
