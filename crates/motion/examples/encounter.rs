//! Two spheres pass each other in shear flow, the flow is reversed, and they go back: exactly, as time steps
//! get shorter.
//!
//! `cargo run --release -p gluey-motion --example encounter`

use gluey_geom::{Particle, Vector};
use gluey_motion::{
    Configuration, Hydrodynamics, Integrator, LinearFlow, PairMobility, PairMobilityError, Scheme,
};

/// Time until the flow is reversed, in inverse shear rates.
const TURN: f64 = 10.0;

/// The smallest gap on the way, in radii, and how far the first sphere ends from where it began.
pub fn there_and_back(scheme: Scheme, dt: f64) -> Result<(f64, f64), PairMobilityError> {
    let start = [[-4.0, 0.6], [4.0, -0.6]].map(|[x, y]| Particle::new(Vector::<3>::new(x, y, 0.0), 1.0));
    let mut particles = start;
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.0));
    let mut integrator = Integrator::new(scheme);
    let (step_count, mut smallest) = ((TURN / dt).round() as usize, f64::INFINITY);
    let mut shear_factor = 1.0;
    for step in 0..2 * step_count {
        if step == step_count {
            shear_factor = -1.0;
            integrator.reverse();
        }
        let now = Configuration { shear_factor, ..Configuration::at(step as f64 * dt, &particles) };
        let predicted = flow.predict(&now)?;
        integrator.advance(dt, &mut particles, &predicted.twists);
        smallest = particles[0].gap(&particles[1]).min(smallest);
    }
    Ok((smallest, (particles[0].pose.position - start[0].pose.position).norm()))
}

/// Prints a table of both schemes, and checks their orders.
pub fn main() -> Result<(), PairMobilityError> {
    for (scheme, order) in [(Scheme::Euler, 1), (Scheme::AdamsBashforth2, 2)] {
        println!("{scheme}\n{:>8} {:>14} {:>12}", "dt", "smallest gap", "error");
        let mut before = f64::INFINITY;
        for dt in [0.1, 0.05, 0.025, 0.0125] {
            let (smallest, error) = there_and_back(scheme, dt)?;
            println!("{dt:>8} {smallest:>14.6} {error:>12.2e}");
            assert!(smallest > 0.0 && error < 0.7f64.powi(order) * before, "{error} after {before}");
            before = error;
        }
    }
    Ok(())
}
