//! Sweeps over the pairs of a crowd, one after the other: block Gauss-Seidel on what the force of each does
//! to the velocities of all (Moreau 1999, 10.1016/S0045-7825(98)00387-9; Jean 1999, the same issue). Now and
//! then Newton's method goes on from where they are: there are solutions that sweeps come near to and leave.

use gluey_geom::{Matrix, Vector};

use super::coulomb::{Coulomb, PairForce, PairMotion};
use super::newton;

/// Sweeps between two looks at what the forces really do.
const SWEEPS: usize = 20;
/// Pairs at most: a block for each two of so many takes 1.2 GB in 3D.
const MOST_PAIRS: usize = 4000;

/// Velocities of all pairs under a force of each.
pub(super) struct Sweeps<const D: usize> {
    /// Blocks of the Delassus operator: those of the force of a pair lie together.
    pub(super) blocks: Vec<Matrix<D>>,
    /// What pairs yield among the others, along the normal and across it.
    compliance: Vec<[f64; 2]>,
    /// Improvements so far.
    count: usize,
}

impl<const D: usize> Sweeps<D> {
    /// Those of a problem; `None` where it has too many pairs.
    pub fn new(problem: &mut Coulomb<'_, D>) -> Option<Self> {
        let touches = problem.touches;
        let count = touches.len();
        if count > MOST_PAIRS {
            return None;
        }
        let mut blocks = vec![Matrix::<D>::zeros(); count * count];
        for (k, blocks) in blocks.chunks_exact_mut(count).enumerate() {
            for d in 0..D {
                let force = Vector::from_fn(|e, _| f64::from(u8::from(e == d)));
                let twists = problem.response(&touches[k], &force);
                for (block, touch) in blocks.iter_mut().zip(touches) {
                    block.set_column(d, &(touch.velocity(&twists) - touch.slide));
                }
            }
        }
        let compliance = touches.iter().enumerate().map(|(k, touch)| {
            let along = touch.normal.dot(&(blocks[k * (count + 1)] * touch.normal));
            let plane = Matrix::identity() - touch.normal * touch.normal.transpose();
            let across = plane * blocks[k * (count + 1)] * plane;
            // The larger of at most two eigenvalues that are not zero.
            let (sum, squares) = (across.trace(), across.norm_squared());
            [along, 0.5 * (sum + (2.0 * squares - sum * sum).max(0.0).sqrt())]
        });
        Some(Self { compliance: compliance.collect(), blocks, count: 0 })
    }

    /// Better forces from `forces`, with which pairs move like this.
    pub fn improve(
        &mut self,
        problem: &Coulomb<'_, D>,
        forces: &mut [PairForce<D>],
        mut motions: Vec<PairMotion<D>>,
    ) {
        let (touches, weight) = (problem.touches, problem.step.velocity_weight);
        for _ in 0..SWEEPS {
            for (k, blocks) in self.blocks.chunks_exact(forces.len()).enumerate() {
                let touch = &touches[k];
                let asked = problem.asked(touch, &forces[k], self.compliance[k], &motions[k]);
                let change = asked.minus(&forces[k]).total(touch);
                forces[k] = asked;
                for ((motion, touch), block) in motions.iter_mut().zip(touches).zip(blocks) {
                    motion.add(touch, &(block * change), weight);
                }
            }
        }
        self.count += 1;
        if self.count.is_power_of_two() {
            newton::improve(problem, &self.blocks, forces, motions);
        }
    }
}
