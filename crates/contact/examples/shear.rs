//! A dense layer of discs between two walls, periodic in x, in the shear flow `u = (y, 0)`. Writes a picture.
//!
//! `cargo run --release -p gluey-contact --example shear [shear.svg]`

#[path = "shared/picture.rs"]
mod picture;

use std::error::Error;

use gluey_contact::{
    ContactModel, ContactNetwork, ContactParams, Domain, GammaUpdate, PairContact, SolverKind, StepGeometry,
    Wall,
};
use gluey_geom::{Twist, Vector};

/// Shears `columns` times `rows` discs of radii about 1 by `strain`.
pub fn shear(columns: usize, rows: usize, strain: f64) -> Result<String, Box<dyn Error>> {
    let (spacing, dt) = (1.95, 0.01);
    let (length, height) = (spacing * columns as f64, spacing * rows as f64);
    let domain = Domain::default()
        .with_period(0, length)
        .with_wall(Wall::new(&Vector::<2>::zeros(), &Vector::<2>::y()))
        .with_wall(Wall::new(&Vector::<2>::new(0.0, height), &-Vector::<2>::y()));
    let count = columns * rows;
    // A lattice out of order; the first step parts what overlaps.
    let wave = |i: usize, rate: f64| (rate * i as f64).sin();
    let radii: Vec<f64> = (0..count).map(|i| 0.9 + 0.1 * wave(i, 1.7)).collect();
    let site = |i: usize| {
        let lattice = Vector::<2>::new((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5) * spacing;
        lattice + Vector::<2>::new(wave(i, 4.3), wave(i, 2.9)) * 0.25
    };
    let mut positions: Vec<_> = (0..count).map(site).collect();

    let params = ContactParams {
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        solver: SolverKind::ActiveSet,
        tolerance: 1e-8,
        ..ContactParams::default()
    };
    let mut contact = PairContact::new(params).within(domain.clone());
    let drift = vec![Vector::zeros(); count];
    for _ in 0..(strain / dt).round() as usize {
        let flow = |x: &Vector<2>| Twist { velocity: Vector::<2>::new(x.y, 0.0), ..Twist::default() };
        let mut twists: Vec<_> = positions.iter().map(flow).collect();
        let step =
            StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: dt, dt };
        contact.correct(&step, &mut twists)?;
        positions.iter_mut().zip(&twists).for_each(|(x, twist)| *x += twist.velocity * dt);
    }
    let network = ContactNetwork::new(contact.contacts(), &positions, &radii, &domain)?;
    println!("contact stress {:.3}", network.stress(length * height));
    println!("largest cluster {:?}", network.clusters().largest());
    Ok(picture::draw(contact.contacts(), &positions, &radii, &domain))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "shear.svg".into());
    std::fs::write(&path, shear(32, 14, 2.0)?)?;
    println!("{path}");
    Ok(())
}
