//! A periodic suspension of large and small spheres: draws a slice through it and measures how much of it is
//! solid.
//!
//! `cargo run --release -p gluey-levelset --example suspension`

use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Ramp, ViscosityLaw};

/// Large spheres on a lattice in the unit box, a small one between any eight of them.
pub fn suspension(per_side: usize) -> Vec<Ball<3>> {
    let spacing = 1.0 / per_side as f64;
    let site = |i: usize| {
        Vector::<3>::from_fn(|d, _| (0.25 + (i / per_side.pow(d as u32) % per_side) as f64) * spacing)
    };
    let ball = |x: Vector<3>, radius: f64| Ball::periodic(x, radius * spacing, [Some(1.0); 3]);
    let large = (0..per_side.pow(3)).map(|i| ball(site(i), 0.4));
    let small = (0..per_side.pow(3)).map(|i| ball(site(i) + Vector::repeat(0.5 * spacing), 0.15));
    large.chain(small).collect()
}

/// Part of the box that is solid, by the midpoints of `count` cells along each axis.
pub fn solid_fraction(tree: &BallTree<'_, 3>, count: usize) -> f64 {
    let middle = |n: usize| (n as f64 + 0.5) / count as f64;
    let is_solid = |i: usize| {
        let x = Vector::<3>::new(middle(i % count), middle(i / count % count), middle(i / count / count));
        tree.nearest_within(&x, 0.0).is_some()
    };
    (0..count.pow(3)).filter(|&i| is_solid(i)).count() as f64 / count.pow(3) as f64
}

/// The plane `z`: `#` where the viscosity is that of the solid, `+` in the ramp, `.` in the fluid.
pub fn slice(tree: &BallTree<'_, 3>, z: f64, columns: usize, rows: usize) -> String {
    let (ramp, law) = (Ramp::new(0.02), ViscosityLaw { fluid: 1.0, ratio: 1e3 });
    let symbol = |column: usize, row: usize| {
        let [x, y] = [(column, columns), (row, rows)].map(|(n, count)| (n as f64 + 0.5) / count as f64);
        let (_, alpha) = tree.nearest(&Vector::<3>::new(x, y, z)).expect("there are balls");
        match law.mix(ramp.fraction(alpha)) {
            viscosity if viscosity >= 1e3 => '#',
            viscosity if viscosity > 1.0 => '+',
            _ => '.',
        }
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| symbol(column, row)).chain(['\n'])).collect()
}

/// Prints the slice and the fraction, and compares the latter with the volume of the spheres.
pub fn main() {
    let balls = suspension(3);
    let tree = BallTree::new(&balls);
    print!("{}", slice(&tree, 0.08, 78, 39));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (0.4f64.powi(3) + 0.15f64.powi(3));
    let found = solid_fraction(&tree, 80);
    println!("solid: {found:.4}, exactly {exact:.4}");
    assert!((found - exact).abs() < 2e-3);
}
