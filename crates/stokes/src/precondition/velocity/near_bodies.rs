//! Relaxation of the nodes around the bodies.
//!
//! A coarser mesh has its own rigid nodes, so what lies between its surface and that of the finer mesh it
//! cannot correct: errors that reach over two or three cells from a body, too smooth for the sweep of a
//! level. Of all errors the V-cycle reduces these the least (`docs/design/preconditioner.md`). As Brandt
//! (1984) advises for boundaries, some more relaxation there restores the rate of the interior, at the price
//! of the few cells it acts on. In 3D these are most of the cells of the finest mesh, and the iterations
//! saved do not pay for it.
//!
//! After the sweep of the level the error `e` on the nodes within [`RELAXED_RINGS`] cells of a body and on
//! the twists is smoothed by Chebyshev's method for `E^T A E e = E^T (b - A x)`, all else at rest.

use gluey_linalg::{Chebyshev, ChebyshevParams, Guess, LinOp};

use super::SAFETY;
use crate::operator::{BlockDiagonal, CountedOperator, Restricted, acting, add_at};
use crate::space::{ActiveCell, VelocitySpace, nodes_of_cells_with};

/// Dimensions in which the nodes around bodies are few enough.
pub const RELAXED_DIMENSIONS: usize = 2;
/// Cells between a body and the farthest relaxed nodes.
pub const RELAXED_RINGS: usize = 3;
/// A sweep, which damps more of the spectrum than that of a level, since no coarser mesh helps.
pub const RELAXED_SWEEP: ChebyshevParams =
    ChebyshevParams { degree: 6, ratio: 20.0, safety: SAFETY, lanczos_steps: 0 };

/// The sweep around the bodies of one level.
#[derive(Clone, Debug)]
pub struct NearBodies<const D: usize> {
    /// `E^T A E` on the nodes around the bodies and the twists.
    operator: Restricted<f32, D>,
    diagonal: BlockDiagonal,
    chebyshev: Chebyshev<f32>,
    /// On the unknowns of the sweep.
    r: Vec<f32>,
    e: Vec<f32>,
}

impl<const D: usize> NearBodies<D> {
    /// For a level that acts with `cells` and smooths by `diagonal`, with eigenvalues up to `lambda_max`;
    /// `None` in 3D and without bodies. All ranks call this.
    pub fn new(
        space: &VelocitySpace<D>,
        cells: &[ActiveCell],
        diagonal: &BlockDiagonal,
        lambda_max: f64,
    ) -> Option<Self> {
        let discretisation = space.discretisation();
        if D > RELAXED_DIMENSIONS {
            return None;
        }
        let nodes = &discretisation.velocity;
        let mut near: Vec<bool> = (0..nodes.node_count()).map(|n| space.body_of(n).is_some()).collect();
        let mut count = [near.iter().filter(|near| **near).count() as f64];
        space.halo().sum_over_ranks(&mut count);
        if count[0] == 0.0 {
            return None;
        }
        for _ in 0..RELAXED_RINGS {
            near = nodes_of_cells_with(nodes, &near);
            // A ring may reach a part through cells that it does not have.
            space.join_marks(&mut near);
        }
        space.share_marks(&mut near);
        let relaxed = |n: &usize| near[*n] && space.is_free(*n);
        let nodal = (0..near.len()).filter(relaxed).flat_map(|n| n * D..(n + 1) * D);
        let mut positions: Vec<u32> = nodal.map(|k| k as u32).collect();
        let diagonal = diagonal.restricted(&positions);
        positions.extend((space.full_dim()..space.dim()).map(|k| k as u32));
        let acting = acting(discretisation, cells, &near);
        let operator = Restricted::new(CountedOperator::new(space, &acting, cells.len()), positions);
        let dim = operator.dim();
        let chebyshev = Chebyshev::below(lambda_max, dim, &RELAXED_SWEEP);
        Some(Self { operator, diagonal, chebyshev, r: vec![0.0; dim], e: vec![0.0; dim] })
    }

    /// Smooths `A x = b` from the present `x`.
    pub fn smooth(&mut self, b: &[f32], x: &mut [f32]) {
        let Self { operator, diagonal, chebyshev, r, e } = self;
        operator.residual(b, x, r);
        chebyshev.smooth(operator, diagonal, r, e, Guess::Zero);
        add_at(operator.positions(), e, x);
    }

    /// Applications since the last call, each counted as its share of the cells of the level.
    pub fn take_applications(&mut self) -> f64 {
        self.operator.take_applications()
    }
}
