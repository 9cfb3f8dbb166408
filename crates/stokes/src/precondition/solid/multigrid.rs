//! Galerkin multigrid for the penalised operator on the nodes of the solid.
//!
//! The rigid levels never see the viscosity of the solid; this is where strain inside it is found. In 2D,
//! where factors are small, the operator on these nodes is factorised. In 3D a multigrid cycle on coarser
//! meshes approximates its inverse, with the Galerkin products `P^T A P` on those of their nodes that lie
//! among the solid's, so a cell that is cut stays cut as it is. [`SchwarzPatches`] on the cells smooth all
//! but the coarsest level, which is factorised; on the finest the smoother of the whole mesh does.

use gluey_geom::{Dim, Space};
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

/// One V-cycle of Galerkin multigrid on the nodes of the solid, or a factorisation.
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

impl<const D: usize> SolidMultigrid<D>
where
    Dim<D>: Space<D>,
{
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

impl<const D: usize> Preconditioner<f64> for SolidMultigrid<D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, b: &[f64], x: &mut [f64]) {
        if self.coarser.is_empty() {
            return self.direct.apply(b, x);
        }
        x.fill(0.0);
        correct(&mut self.coarser, &mut self.direct, b, x);
    }
}

impl<const D: usize> Coarse<D> {
    fn new(prolongation: Prolongation) -> Self {
        let zeros = || vec![0.0; prolongation.coarse_count() * D];
        Self { b: zeros(), x: zeros(), r: zeros(), smoothed: None, prolongation }
    }
}

impl<const D: usize> Smoother<D>
where
    Dim<D>: Space<D>,
{
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
fn correct<const D: usize>(levels: &mut [Coarse<D>], direct: &mut DirectSpd, r: &[f64], x: &mut [f64])
where
    Dim<D>: Space<D>,
{
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
