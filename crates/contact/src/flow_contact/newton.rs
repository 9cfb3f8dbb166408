//! Newton's method on what pairs ask for (Alart and Curnier 1991, 10.1016/0045-7825(91)90022-X).
//!
//! With the motions `u = u_0 + W F` the forces are those with `F = A(F, u)`, see [`super::coulomb`]. Where no
//! pair passes from one state to another (apart, stuck, slipping) `A` is smooth:
//!
//! `dA = (N + S) dF - (N / d_n + S / d_t) du`, `N = (n + mu e) n^T`, `S = 1 - n n^T` for a pair that sticks
//! and `|P| / |F_t - v_t / d_t| (1 - n n^T - e e^T)` for one that slips along `e`.
//!
//! So a solution whose states are known is found to rounding in a few steps, also one that sweeps leave again
//! since the friction of others drives them away from it.

use gluey_geom::{Matrix, Vector};
use nalgebra::{DMatrix, DVector};

use super::coulomb::{Coulomb, PairForce, PairMotion, Wish};
use super::touch::Touch;

/// Pairs at most: a step takes a second for so many.
const MOST_PAIRS: usize = 400;
/// Newton steps from one state, at most.
const STEPS: usize = 12;
/// Steps are halved so often at most.
const HALVINGS: usize = 5;
/// Forces are taken over where the residual is so many times smaller than it was.
const GAIN: f64 = 10.0;

/// Forces near a solution, where Newton's method leads to one from `forces`, with which pairs move like this;
/// else these. Without repulsion only.
pub(super) fn improve<const D: usize>(
    problem: &Coulomb<'_, D>,
    blocks: &[Matrix<D>],
    forces: &mut [PairForce<D>],
    motions: Vec<PairMotion<D>>,
) {
    let is_suited = |touch: &Touch<D>| touch.repulsion.is_none();
    if forces.len() > MOST_PAIRS || !problem.touches.iter().all(is_suited) {
        return;
    }
    let mut now = Iterate { wish: problem.wish(forces, &motions), forces: forces.to_vec(), motions };
    let wanted = now.wish.residual / GAIN;
    for _ in 0..STEPS {
        let Some(change) = step(problem, blocks, &now) else { break };
        let shares = (0..=HALVINGS).map(|k| 0.5f64.powi(k as i32));
        let mut tried = shares.map(|share| (share, now.moved(problem, blocks, &change, share)));
        let is_better =
            |(share, next): &(f64, Iterate<D>)| next.wish.residual < (1.0 - 0.1 * share) * now.wish.residual;
        let Some((_, next)) = tried.find(is_better) else { break };
        now = next;
        if now.wish.residual <= problem.params.tolerance {
            break;
        }
    }
    if now.wish.residual <= wanted {
        forces.copy_from_slice(&now.forces);
    }
}

/// Forces, how pairs move with them, and what they ask for then.
struct Iterate<const D: usize> {
    forces: Vec<PairForce<D>>,
    motions: Vec<PairMotion<D>>,
    wish: Wish<D>,
}

impl<const D: usize> Iterate<D> {
    /// This and a share of a change of the forces.
    fn moved(
        &self,
        problem: &Coulomb<'_, D>,
        blocks: &[Matrix<D>],
        change: &[Vector<D>],
        share: f64,
    ) -> Self {
        let (mut forces, mut motions) = (self.forces.clone(), self.motions.clone());
        let weight = problem.step.velocity_weight;
        for ((force, change), blocks) in forces.iter_mut().zip(change).zip(blocks.chunks_exact(change.len()))
        {
            force.contact += change * share;
            for ((motion, touch), block) in motions.iter_mut().zip(problem.touches).zip(blocks) {
                motion.add(touch, &(block * change * share), weight);
            }
        }
        let wish = problem.wish(&forces, &motions);
        Self { forces, motions, wish }
    }
}

/// The change of the forces by which `A(F, u)` is met to first order; none where it is not determined.
fn step<const D: usize>(
    problem: &Coulomb<'_, D>,
    blocks: &[Matrix<D>],
    now: &Iterate<D>,
) -> Option<Vec<Vector<D>>> {
    let count = now.forces.len();
    let (mut jacobian, mut load) = (DMatrix::zeros(D * count, D * count), DVector::zeros(D * count));
    for (k, touch) in problem.touches.iter().enumerate() {
        let [normal, sticking] = problem.slopes(touch, &now.forces[k], &now.motions[k]);
        let [along, across] = touch.compliance;
        let of_motion = normal / along + sticking / across;
        for j in 0..count {
            let block = of_motion * blocks[j * count + k];
            jacobian.view_mut((D * k, D * j), (D, D)).copy_from(&block);
        }
        let mut own = jacobian.view_mut((D * k, D * k), (D, D));
        own += Matrix::<D>::identity() - normal - sticking;
        load.rows_mut(D * k, D).copy_from(&(now.wish.asked[k].contact - now.forces[k].contact));
    }
    let change = jacobian.lu().solve(&load)?;
    change
        .iter()
        .all(|x| x.is_finite())
        .then(|| change.as_slice().chunks_exact(D).map(Vector::from_column_slice).collect())
}
