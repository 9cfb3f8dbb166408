//! A thousand discs settle under gravity onto a floor between two walls. Writes a picture.
//!
//! `cargo run --release -p gluey-contact --example settle [settle.svg]`

#[path = "shared/picture.rs"]
mod picture;

use std::error::Error;

use gluey_contact::{
    ContactLaw, ContactModel, ContactNetwork, ContactParams, Domain, PairContact, SolverKind, StepGeometry,
    Wall,
};
use gluey_geom::{Twist, Vector};

/// Lets `count` discs of radii about 1 fall for some time at the speed 1 in a box 80 wide.
pub fn settle(count: usize, time: f64) -> Result<String, Box<dyn Error>> {
    let (width, columns, dt) = (80.0, 32, 0.25);
    let wall = |x, direction| Wall::new(&Vector::<2>::new(x, 0.0), &direction);
    let floor = wall(0.0, Vector::<2>::y());
    let domain = Domain::default()
        .with_wall(floor)
        .with_wall(wall(0.0, Vector::<2>::x()))
        .with_wall(wall(width, -Vector::<2>::x()));
    // A loose lattice out of order, of different discs.
    let wave = |i: usize, rate: f64| (rate * i as f64).sin();
    let radii: Vec<f64> = (0..count).map(|i| 0.85 + 0.15 * wave(i, 1.7)).collect();
    let site = |i: usize| {
        let lattice = Vector::<2>::new((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5) * 2.5;
        lattice + Vector::<2>::new(wave(i, 4.3), wave(i, 2.9)) * 0.2
    };
    let mut positions: Vec<_> = (0..count).map(site).collect();

    // Without pulls the gap may stay linear in the step: discs are then a little farther apart, never nearer.
    let params = ContactParams {
        law: ContactLaw::Inelastic,
        solver: SolverKind::ActiveSet,
        tolerance: 1e-5,
        ..ContactParams::default()
    };
    let mut contact = PairContact::new(params).within(domain.clone());
    let drift = vec![Vector::zeros(); count];
    let falling = Twist { velocity: -Vector::<2>::y(), ..Twist::default() };
    for _ in 0..(time / dt) as usize {
        let mut twists = vec![falling; count];
        let step =
            StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: dt, dt };
        contact.correct(&step, &mut twists)?;
        positions.iter_mut().zip(&twists).for_each(|(x, twist)| *x += twist.velocity * dt);
    }
    let network = ContactNetwork::new(contact.contacts(), &positions, &radii, &domain)?;
    println!("{} contacts, {:?}", contact.contacts().len(), network.coordination());
    Ok(picture::draw(contact.contacts(), &positions, &radii, &domain))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "settle.svg".into());
    std::fs::write(&path, settle(1000, 80.0)?)?;
    println!("{path}");
    Ok(())
}
