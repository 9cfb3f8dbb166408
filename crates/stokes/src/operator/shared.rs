//! Operators that ranks share: each applies its own cells, and what they add up is the product.

use gluey_linalg::LinOp;
use gluey_parallel::Halo;

/// An operator on vectors that hold the same at ghosts as at their owners.
pub struct Summed<'a, A> {
    /// Of own cells.
    pub operator: &'a mut A,
    /// Of its vectors.
    pub halo: &'a mut Halo,
}

impl<A: LinOp<f32>> LinOp<f32> for Summed<'_, A> {
    fn dim(&self) -> usize {
        self.operator.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.operator.apply(x, y);
        self.halo.sum(y);
    }
}

/// An operator on vectors that are zero at ghosts, whose scalar products are sums over ranks.
pub struct OnOwned<'a, A> {
    /// Of own cells.
    operator: &'a mut A,
    halo: &'a mut Halo,
    x: Vec<f32>,
}

impl<'a, A: LinOp<f32>> OnOwned<'a, A> {
    /// The operator with the halo of its vectors.
    pub fn new(operator: &'a mut A, halo: &'a mut Halo) -> Self {
        let x = vec![0.0; operator.dim()];
        Self { operator, halo, x }
    }
}

impl<A: LinOp<f32>> LinOp<f32> for OnOwned<'_, A> {
    fn dim(&self) -> usize {
        self.operator.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.x.copy_from_slice(x);
        self.halo.update(&mut self.x);
        self.operator.apply(&self.x, y);
        self.halo.accumulate(y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.halo.sum_over_ranks(sums);
    }
}
