//! Times arrangements of more and more spheres, random ones or, with a number of sweeps, such in
//! equilibrium: the time for each sphere should not grow.
//!
//! `cargo run --release -p gluey-suspension --example packing_times [largest count [sweeps]]`

use std::error::Error;
use std::time::Instant;

use gluey_geom::Vector;
use gluey_suspension::Container;
use gluey_suspension::packing::{Amount, Arrangement, Packing, PackingParams};

fn main() -> Result<(), Box<dyn Error>> {
    let number = |place| std::env::args().nth(place).map(|text| text.parse::<usize>()).transpose();
    let most = number(1)?.unwrap_or(2000);
    let arrangement = match number(2)? {
        Some(sweep_count) => Arrangement::Equilibrium { sweep_count },
        None => Arrangement::Random,
    };
    let container = Container::<3>::periodic(&Vector::repeat(1.0));
    println!("fraction   spheres   seconds   microseconds each");
    for fraction in [0.3, 0.5, 0.55] {
        for count in [200, 2000, 20000].into_iter().filter(|&count| count <= most) {
            let amount = Amount::Count { fraction, count };
            let params = PackingParams { arrangement, ..PackingParams::new(amount) };
            let begin = Instant::now();
            Packing::new(&container, &params)?;
            let seconds = begin.elapsed().as_secs_f64();
            println!("{fraction:8} {count:9} {seconds:9.3} {:9.1}", seconds / count as f64 * 1e6);
        }
    }
    Ok(())
}
