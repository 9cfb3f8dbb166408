//! Seconds of one thread for the direct solution of 2D Stokes, Q2-Q1, with two discs of another viscosity
//! (`inf`: rigid): `cargo run --release -p gluey-linalg --example direct_timing [cells per side] [contrast]`.

#[path = "../tests/support/mod.rs"]
mod support;

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use gluey_linalg::{DirectIndefinite, IndefiniteParams, Ordering, Regularise, Symbolic};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let n: usize = arguments.next().map_or(Ok(64), |text| text.parse())?;
    let contrast: f64 = arguments.next().map_or(Ok(1.0), |text| text.parse())?;
    let inside = |x: f64, y: f64| (x - 0.4).hypot(y - 0.45) < 0.15 || (x - 0.7).hypot(y - 0.55) < 0.15;
    let viscosity = |x, y| if inside(x, y) && contrast.is_finite() { contrast } else { 1.0 };
    let saddle = support::stokes_2d_around(n, viscosity, |x, y| inside(x, y) && contrast.is_infinite());
    let b = support::pseudo_random(1, saddle.is_pressure.len());
    let mut x = vec![0.0; b.len()];

    let regularise = if contrast.is_infinite() { Regularise::Always } else { Regularise::WhenNeeded };
    let params = IndefiniteParams { regularise, ..Default::default() };
    let (symbolic, symbolic_s) = timed(|| Symbolic::new(saddle.matrix.pattern().clone(), Ordering::Amd));
    let mut solver = DirectIndefinite::new(Arc::new(symbolic?), params)?;
    let (factor, first_s) = timed(|| solver.factorise(saddle.matrix.values()));
    let factor = factor?;
    let (again, numeric_s) = timed(|| solver.factorise(saddle.matrix.values()));
    again?;
    let (report, solve_s) = timed(|| solver.solve(&b, &mut x));
    println!("unknowns {}, entries {}", b.len(), saddle.matrix.values().len());
    println!("factor entries {}, {factor:?}", solver.symbolic().factor_entry_count());
    println!("symbolic {symbolic_s:.3} s, numeric {first_s:.3} then {numeric_s:.3} s, solve {solve_s:.3} s");
    println!("{:?} {:?}", report?, solver.residual_history());
    Ok(())
}

fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}
