//! Set-ups and measurements that the tests share.

use gluey_distributed::LocalFlow;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, LevelSet};
use gluey_parallel::{RankFailure, Ranks, Threads};
use gluey_stokes::{Lubrication, Refinement, Suspension};
use gluey_testkit::compute_alone;

/// Free particles that nothing but the shear drives, in the unit box, which is periodic in the first
/// direction.
pub fn suspension<const D: usize>(
    refinement: Refinement,
    lubrication: Lubrication,
    radii: Vec<f64>,
) -> Suspension<D> {
    Suspension {
        domain: Aabb::unit(),
        roots: [1; D],
        periods: std::array::from_fn(|d| (d == 0).then_some(1.0)),
        refinement,
        lubrication,
        radii,
        wrenches: Vec::new(),
        given: Vec::new(),
        force_density: None,
        shear_rate: 1.0,
        shear_stress: None,
    }
}

/// What ranks that are threads return, in their order.
pub fn on_ranks<R: Send>(size: usize, work: impl Fn(&Ranks) -> R + Sync) -> Result<Vec<R>, RankFailure> {
    Threads::run(size, |ranks| {
        compute_alone();
        work(ranks)
    })
}

/// Velocities of all ranks, one after the other.
pub fn velocities<const D: usize>(parts: &[LocalFlow<D>]) -> Vec<Vector<D>> {
    parts.iter().flat_map(|part| part.velocity()).collect()
}

/// Largest difference over the largest of `a`.
pub fn largest_difference<const D: usize>(a: &[Vector<D>], b: &[Vector<D>]) -> f64 {
    assert_eq!(a.len(), b.len());
    let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x) };
    let scale = a.iter().map(Vector::norm).fold(0.0, largest);
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, largest) / scale
}

/// Whether the fluid is at a point. In bodies velocities are polynomials that nothing holds but the
/// tolerance.
pub fn is_in_fluid<const D: usize>(balls: &[Ball<D>], x: &Vector<D>) -> bool {
    balls.iter().all(|ball| ball.value(x) < 0.0)
}
