//! Two discs that a shear flow presses together, against values of high-order finite elements on a mesh
//! fitted to the discs.
//!
//! The discs have the radius `a = 0.05` and lie at the centre of the unit box, whose boundary moves with
//! `u = (y - 1/2, 0)`, so that the line of their centres makes 135 degrees with the flow. The closer they
//! are, the more slowly they approach: the film between them resists like `gap^(-3/2)`. The mesh is refined
//! until its cells are smaller than the gap; what is left of the error is that of a surface between nodes,
//! relative to the gap.
//!
//! `cargo run --release --example two_discs`

use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{FlowParams, FlowSolver, Refinement, StokesError};

const RADIUS: f64 = 0.05;

/// Gaps in radii, speeds of approach as `data/reference/pair2d_velocities.csv` has them (mirrored: there the
/// discs separate), and the relative error that is allowed here.
const EXACT: [(f64, f64, f64); 4] = [
    (1.0, 0.043_694_33, 1e-3),
    (0.2, 0.007_508_277, 1e-3),
    (0.1, 0.003_020_839, 0.01),
    (0.01, 1.091_295e-4, 0.005),
];

/// Speed at which two discs at a gap (in radii) approach.
pub fn approach(gap: f64) -> Result<f64, StokesError> {
    let arm = Vector::<2>::new(-1.0, 1.0).normalize() * (RADIUS * (1.0 + 0.5 * gap));
    // A little off the centre, so that the discs lie on no line of the mesh.
    let centre = Vector::<2>::new(0.503, 0.4985);
    let discs = [centre - arm, centre + arm].map(|centre| Ball::new(centre, RADIUS));
    let mesh = Refinement::to_level(8).mesh(Aabb::unit(), [1, 1], [false; 2], &discs)?;
    let shear = |x: &Vector<2>| Vector::<2>::new(x[1] - 0.5, 0.0);
    let flow = FlowSolver::new(FlowParams::for_dimension(2))?.solve(mesh, &discs, &shear)?;
    Ok((flow.twists[0].velocity - flow.twists[1].velocity).dot(&arm.normalize()))
}

/// Prints and checks the speeds of approach.
pub fn main() -> Result<(), StokesError> {
    println!("gap/a  approach  exact     error");
    for (gap, exact, allowed) in EXACT {
        let speed = approach(gap)?;
        let error = speed / exact - 1.0;
        println!("{gap:<5}  {speed:.6}  {exact:.6}  {:+.2} %", 100.0 * error);
        assert!(error.abs() < allowed, "gap {gap}: {speed} and {exact}");
    }
    Ok(())
}
