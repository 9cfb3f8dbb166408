//! Makes a thousand hard spheres in equilibrium at several volume fractions, with the time that takes and the
//! pair correlation at contact, against Carnahan and Starling's.
//!
//! `cargo run --release -p gluey-suspension --example hard_spheres [count]`

use std::error::Error;
use std::time::Instant;

use gluey_geom::Vector;
use gluey_suspension::Container;
use gluey_suspension::packing::{Amount, Packing, PackingParams};
use gluey_suspension::structure::{RadialDistribution, contact_value};

fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().nth(1).map_or(Ok(1000), |text| text.parse())?;
    let container = Container::<3>::periodic(&Vector::repeat(1.0));
    println!("fraction   seconds   g(2a)   exact");
    for fraction in [0.1, 0.2, 0.3, 0.4, 0.5] {
        let begin = Instant::now();
        let spheres = Packing::new(&container, &PackingParams::new(Amount::Count { fraction, count }))?;
        let seconds = begin.elapsed().as_secs_f64();
        let a = spheres.radii[0];
        let mut radial = RadialDistribution::new(&container, 4.0 * a, 80);
        radial.add(&container, &spheres.positions, a);
        let contact = radial.at_contact(2.0 * a).unwrap_or(f64::NAN);
        println!("{fraction:8} {seconds:9.2} {contact:7.2} {:7.2}", contact_value::<3>(fraction));
    }
    Ok(())
}
