//! Approximate inverse of the pressure Schur complement, as in the serial solver: the weighted mass of the
//! pressures over twice the viscosity by Chebyshev's method, and the pressures as large as the box from a
//! small mesh.

mod mass;
mod weights;
mod whole_box;

use gluey_fem::ImplicitTree;
use gluey_geom::{Dim, Space};
use gluey_linalg::{Chebyshev, Guess, Jacobi, estimate_lambda_max_from};
use gluey_parallel::Ranks;
use gluey_stokes::part::{LANCZOS_STEPS, mass_iteration};

use crate::agreement::agreed;
use crate::flow::FlowError;
use crate::pressures::SharedPressures;
use crate::space::LevelSpace;
use mass::Masses;
use mass::SharedMass;
pub use weights::Flowing;
use whole_box::WholeBox;

/// The cells whose pressures there are.
#[derive(Clone, Copy)]
pub struct PressureCells<'a> {
    pub viscosity: f64,
    pub flowing: &'a Flowing,
    pub masses: &'a Masses<'a>,
}

/// What a pressure is of a rank: its own ones first, then ghosts.
pub struct SchurInverse<'a, const D: usize> {
    mass: SharedMass<'a>,
    jacobi: Jacobi<f32>,
    chebyshev: Chebyshev<f32>,
    whole_box: Option<WholeBox<D>>,
}

impl<'a, const D: usize> SchurInverse<'a, D>
where
    Dim<D>: Space<D>,
{
    /// For cells of these masses. All ranks call this.
    pub fn new(
        tree: &ImplicitTree<'_, D>,
        ranks: &'a Ranks,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        cells: &PressureCells<'_>,
    ) -> Result<Self, FlowError> {
        let PressureCells { viscosity, flowing, masses } = *cells;
        let weights = weights::weights(ranks, space, pressures, flowing, viscosity);
        let mut mass = SharedMass::new(ranks, space, pressures, masses, &weights)?;
        let whole_box = agreed(ranks, WholeBox::new(tree, ranks, space, pressures, viscosity))?;
        let mut jacobi = agreed(ranks, Jacobi::new(&mass.diagonal))?;
        let start = space.pressure.owned.clone().zip(&pressures.is_free);
        let start: Vec<f32> = start.map(|(q, &is_free)| pseudo_random(space, q, is_free)).collect();
        let largest = estimate_lambda_max_from(start, &mut mass, &mut jacobi, LANCZOS_STEPS);
        let largest = largest.map_err(FlowError::Krylov)?;
        let chebyshev = mass_iteration::<D>(space.pressure.owned.len(), largest);
        Ok(Self { mass, jacobi, chebyshev, whole_box })
    }

    /// `z` close to `S^-1 r` at the owned pressures, up to a constant. Both are zero but at unknowns.
    pub fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        let Self { mass, jacobi, chebyshev, whole_box } = self;
        chebyshev.smooth(mass, jacobi, r, z, Guess::Zero);
        if let Some(whole_box) = whole_box {
            whole_box.add(mass.ranks, r, z);
        }
    }
}

/// A number between -1/2 and 1/2 that depends on the place of a node alone, zero where no pressure is
/// unknown.
fn pseudo_random<const D: usize>(space: &LevelSpace<D>, node: usize, is_free: bool) -> f32 {
    let mut x = space.pressure.map.key(node).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let fraction = ((x ^ (x >> 31)) >> 40) as f32 / (1u32 << 24) as f32;
    if is_free { fraction - 0.5 } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failure here is a failing test")]
mod tests;
