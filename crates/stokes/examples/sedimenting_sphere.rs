//! A sphere that settles, against Stokes' law without walls and its correction for a duct.
//!
//! Under the force `F` a sphere of radius `a` moves with `U0 = F / (6 pi eta a)` in an unbounded fluid
//! (Stokes 1851). On the axis of a square duct of width `2 l` it moves with
//! `U = U0 (1 - 1.9033 a/l + O((a/l)^3))` (Happel and Bart 1974, Applied Scientific Research 29, 241). In a
//! circular duct of radius `l` the coefficients are 2.1044 and 2.0888 (Haberman and Sayre 1958); the latter
//! times `(a/l)^3` is the size of what is left out here.
//!
//! Both are computed in a box of `1 x 3 x 1`. In the first the boundary moves as Stokes' exact solution does,
//! so the box is not felt. In the second it is at rest; the ends of the box are three half-widths from the
//! sphere, where the flow in a duct has decayed to less than a thousandth.
//!
//! `cargo run --release --example sedimenting_sphere`

use std::f64::consts::PI;

use gluey_geom::{Aabb, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_stokes::{Conditions, FlowParams, FlowSolver, Refinement, StokesError};

const RADIUS: f64 = 0.05;
const HALF_WIDTH: f64 = 0.5;
/// Stokes' law then gives the velocity one.
const FORCE: f64 = 6.0 * PI * RADIUS;

/// Stokes' flow around a sphere that moves with velocity one down the y axis, with `r` from its centre.
fn stokes_flow(r: &Vector<3>) -> Vector<3> {
    let down = Vector::<3>::new(0.0, -1.0, 0.0);
    let a = RADIUS / r.norm();
    if a >= 1.0 {
        return down;
    }
    let along = r * (r.dot(&down) / r.norm_squared());
    (down + along) * (0.75 * a) + (down - along * 3.0) * (0.25 * a.powi(3))
}

/// Velocities in the unbounded fluid and in the duct, with cells of `2^-level` around the sphere.
pub fn velocities(level: u8) -> Result<[f64; 2], StokesError> {
    let sphere = Ball::new(Vector::<3>::new(0.5, 1.5, 0.5), RADIUS);
    let domain = Aabb { lower: Vector::zeros(), upper: Vector::<3>::new(1.0, 3.0, 1.0) };
    let refinement = Refinement { coarsest: 2, ..Refinement::to_level(level) };
    let from_centre = |x: &Vector<3>| sphere.arm(x);
    let weight = [Wrench { force: Vector::<3>::new(0.0, -FORCE, 0.0), ..Wrench::default() }];
    let mut solver = FlowSolver::new(FlowParams::for_dimension(3))?;
    let mut velocity = |boundary: &dyn Fn(&Vector<3>) -> Vector<3>| -> Result<f64, StokesError> {
        let mesh = refinement.mesh(domain, [1, 3, 1], [false; 3], &[sphere])?;
        let conditions = Conditions::boundary(boundary).with_wrenches(&weight);
        Ok(-solver.solve_under(mesh, &[sphere], &conditions)?.twists[0].velocity[1])
    };
    Ok([velocity(&|x| stokes_flow(&from_centre(x)))?, velocity(&|_| Vector::zeros())?])
}

/// Prints and checks the velocities on two meshes.
pub fn main() -> Result<(), StokesError> {
    let ratio = RADIUS / HALF_WIDTH;
    let (stokes, duct) = (1.0, 1.0 - 1.9033 * ratio);
    println!("cells per radius  unbounded  error     duct    error");
    for (level, allowed) in [(6, 0.003), (7, 0.003)] {
        let [free, slowed] = velocities(level)?;
        let errors = [free / stokes - 1.0, slowed / duct - 1.0];
        let cells = RADIUS * 2f64.powi(level.into());
        let [e0, e1] = errors.map(|error| 100.0 * error);
        println!("{cells:<16}  {free:.4}     {e0:+.2} %   {slowed:.4}  {e1:+.2} %");
        assert!(errors.iter().all(|error| error.abs() < allowed), "{free} {slowed}");
        // Errors at the surface are the same in both: the effect of the walls alone is found more exactly.
        let walls = slowed / free - duct;
        assert!(walls.abs() < 0.004, "{walls}");
    }
    println!("exact             {stokes:.4}               {duct:.4}  +- {:.4}", 2.09 * ratio.powi(3));
    Ok(())
}
