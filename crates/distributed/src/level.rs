//! One level of the multigrid on the velocities, in `f32`: the viscous operator on shared vectors, and the
//! smoother.

use gluey_fem::ReferenceMatrices;
use gluey_fem::cells::{CellOperator, Workspace};
use gluey_linalg::{
    Chebyshev, ChebyshevParams, FnOp, Guess, Identity, Jacobi, KrylovError, LinOp, estimate_lambda_max,
};
use gluey_parallel::{Communicator, GhostPlan};

use crate::flow::FlowError;
use crate::space::LevelSpace;

/// Applications in a sweep, and the part of the spectrum that it damps, as in the serial solver.
const SWEEP: ChebyshevParams = ChebyshevParams { degree: 4, ratio: 5.0, safety: 1.01, lanczos_steps: 60 };

/// The viscous operator on the owned nodes.
pub struct LevelOperator<'a, const D: usize> {
    pub ranks: &'a dyn Communicator,
    pub space: LevelSpace<D>,
    pub plan: GhostPlan,
    pub cells: CellOperator<f32, D>,
    pub work: Workspace<f32>,
    /// At all nodes of the part.
    pub x: Vec<f32>,
    pub y: Vec<f32>,
}

impl<const D: usize> LevelOperator<'_, D> {
    /// The owned entries of a field at all nodes of the part.
    fn owned(&self) -> std::ops::Range<usize> {
        let owned = &self.space.velocity.owned;
        owned.start * D..owned.end * D
    }

    /// Sends what own cells gave to other ranks' nodes in `y`, and copies the rest.
    pub fn gather(&mut self, y: &mut [f32]) {
        self.plan.accumulate::<f32, D>(self.ranks, &mut self.y);
        y.copy_from_slice(&self.y[self.owned()]);
    }

    /// Fills `x` from the owned entries and those of other ranks.
    pub fn scatter(&mut self, x: &[f32]) {
        let owned = self.owned();
        self.x[owned].copy_from_slice(x);
        self.plan.update::<f32, D>(self.ranks, &mut self.x);
    }
}

impl<const D: usize> LinOp<f32> for LevelOperator<'_, D> {
    fn dim(&self) -> usize {
        self.owned().len()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.scatter(x);
        self.cells.viscous(&self.x, &mut self.y, &mut self.work);
        self.gather(y);
    }
}

/// One level.
pub struct Level<'a, const D: usize> {
    pub operator: LevelOperator<'a, D>,
    diagonal: Jacobi<f32>,
    chebyshev: Chebyshev<f32>,
    /// Right-hand side and solution at the owned nodes.
    pub b: Vec<f32>,
    pub z: Vec<f32>,
}

impl<'a, const D: usize> Level<'a, D> {
    pub fn new(
        ranks: &'a dyn Communicator,
        space: LevelSpace<D>,
        plan: GhostPlan,
        viscosity: f64,
    ) -> Result<Self, FlowError> {
        let map = &space.velocity.map;
        let cells = CellOperator::new(&space.chunks, map, space.cells(viscosity), 1, &[], 0);
        let zeros = || vec![0.0; map.node_count() * D];
        let (x, y) = (zeros(), zeros());
        let mut operator = LevelOperator { ranks, space, plan, cells, work: Workspace::default(), x, y };
        let dim = operator.dim();
        let mut diagonal = vec![0.0; dim];
        operator.fill_diagonal(viscosity);
        operator.gather(&mut diagonal);
        let first = operator.space.velocity.owned.start;
        for (k, entry) in diagonal.iter_mut().enumerate() {
            if !operator.space.velocity.is_free(first + k / D) {
                *entry = 1.0;
            }
        }
        let diagonal = Jacobi::new(&diagonal)?;
        let chebyshev = Chebyshev::below(cell_lambda_max::<D>()?, dim, &SWEEP);
        Ok(Self { operator, diagonal, chebyshev, b: vec![0.0; dim], z: vec![0.0; dim] })
    }

    /// Improves `z`.
    pub fn smooth(&mut self) {
        let Self { operator, diagonal, chebyshev, b, z } = self;
        chebyshev.smooth(operator, diagonal, b, z, Guess::Given);
    }
}

impl<const D: usize> LevelOperator<'_, D> {
    /// What own cells add to the diagonal, in `y`.
    fn fill_diagonal(&mut self, viscosity: f64) {
        let Self { space, y, .. } = self;
        let nodes = &space.velocity;
        let n = ReferenceMatrices::<D>::VELOCITY;
        let viscous = ReferenceMatrices::<D>::new().viscous;
        y.fill(0.0);
        for cell in space.cells(viscosity) {
            let local = nodes.map.cell(cell.cell);
            let has_hanging = local.iter().any(|&node| nodes.map.is_hanging(node as usize));
            for (i, &node) in local.iter().enumerate() {
                if !has_hanging {
                    (0..D).for_each(|c| {
                        y[node as usize * D + c] += (cell.viscous * viscous[(i * D + c) * (n + 1)]) as f32;
                    });
                    continue;
                }
                for (j, &other) in local.iter().enumerate() {
                    for (master, weight) in nodes.regular(node) {
                        let same = nodes.regular(other).find(|other| other.0 == master);
                        let weight = cell.viscous * weight * same.map_or(0.0, |same| same.1);
                        for c in 0..D {
                            let entry = viscous[(i * D + c) * n + j * D + c];
                            y[master as usize * D + c] += (weight * entry) as f32;
                        }
                    }
                }
            }
        }
    }
}

/// Largest eigenvalue of `D^-1 K` for the viscous matrix `K` of a cell and its diagonal `D`, which bounds
/// that of sums over cells.
fn cell_lambda_max<const D: usize>() -> Result<f64, KrylovError> {
    let n = ReferenceMatrices::<D>::VELOCITY;
    let viscous = ReferenceMatrices::<D>::new().viscous;
    let scale = |i: usize| viscous[i * (n + 1)].sqrt();
    let mut scaled = FnOp::new(n, |x: &[f64], y: &mut [f64]| {
        for (i, y) in y.iter_mut().enumerate() {
            *y = (0..n).map(|j| viscous[i * n + j] * x[j] / (scale(i) * scale(j))).sum();
        }
    });
    estimate_lambda_max(&mut scaled, &mut Identity, SWEEP.lanczos_steps)
}
