//! Times the solvers of the projection on clusters of touching particles, and prints a table.
//!
//! `cargo run --release -p gluey-contact --example solvers [seconds a solve may take]`;
//! `docs/archive/experiments/0020-contact-solver.md` has a table of a run.

use std::time::Instant;

use gluey_contact::{
    ContactError, ContactParams, ContactReport, GammaUpdate, PairContact, SolverKind, StepGeometry,
};
use gluey_geom::{Twist, Vector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Solvers that are compared.
const SOLVERS: [(&str, SolverKind); 4] = [
    ("auto", SolverKind::Auto),
    ("uzawa", SolverKind::Uzawa),
    ("accelerated", SolverKind::Accelerated),
    ("active set", SolverKind::ActiveSet),
];
/// Numbers of particles.
const COUNTS: [usize; 7] = [3, 4, 8, 20, 60, 200, 1000];

/// Discs or spheres of diameter 1 that touch their neighbours.
fn sites<const D: usize>(shape: &str, count: usize) -> Vec<Vector<D>> {
    let side = (1..).find(|side: &usize| side.pow(D as u32) >= count).unwrap_or(1);
    let index = |i: usize, d: usize| (i / side.pow(d as u32) % side) as f64;
    let chain = |i: usize| Vector::from_fn(|d, _| if d == 0 { i as f64 } else { 0.0 });
    let cubic = |i: usize| Vector::from_fn(|d, _| index(i, d));
    // Every layer above the hollows of the one below it: triangles in 2D, the face-centred packing in 3D.
    let dense = |i: usize| {
        let (x, y, z) = (index(i, 0), index(i, 1), if D == 3 { index(i, 2) } else { 0.0 });
        let [a, b, c] =
            [x + 0.5 * y + 0.5 * z, y * 0.75f64.sqrt() + z / 12f64.sqrt(), z * (2.0 / 3.0f64).sqrt()];
        Vector::from_fn(|d, _| [a, b, c][d])
    };
    let jittered = |x: Vector<D>, random: &mut ChaCha8Rng| {
        x * 1.01 + Vector::from_fn(|_, _| random.random_range(-0.005..0.005))
    };
    let mut random = ChaCha8Rng::seed_from_u64(7);
    (0..count)
        .map(|i| match shape {
            "chain" => chain(i),
            "square" => cubic(i),
            "dense" => dense(i),
            _ => jittered(dense(i), &mut random),
        })
        .collect()
}

fn flow<const D: usize>(kind: &str, x: &Vector<D>, random: &mut ChaCha8Rng) -> Vector<D> {
    match kind {
        "squeeze" => -x,
        "shear" => Vector::from_fn(|d, _| if d == 0 { x[1] - x[0] * 0.1 } else { 0.0 }),
        _ => Vector::from_fn(|_, _| random.random_range(-1.0..1.0)),
    }
}

fn solve<const D: usize>(
    positions: &[Vector<D>],
    kind: &str,
    solver: SolverKind,
    iteration_limit: usize,
) -> (f64, Result<ContactReport, ContactError>) {
    let centre = positions.iter().sum::<Vector<D>>() / positions.len() as f64;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut twists: Vec<Twist<D>> = positions
        .iter()
        .map(|x| Twist { velocity: flow(kind, &(x - centre), &mut random), ..Twist::default() })
        .collect();
    let params = ContactParams {
        solver,
        iteration_limit,
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        ..ContactParams::default()
    };
    let (radii, drift) = (vec![0.5; positions.len()], vec![Vector::zeros(); positions.len()]);
    let step = StepGeometry { positions, radii: &radii, drift: &drift, velocity_weight: 0.05, dt: 0.05 };
    let mut contact = PairContact::<D>::new(params);
    let start = Instant::now();
    let outcome = contact.correct(&step, &mut twists);
    (start.elapsed().as_secs_f64(), outcome)
}

fn table<const D: usize>(iteration_limit: usize) {
    for shape in ["chain", "square", "dense", "random"] {
        for kind in ["squeeze", "shear", "random"] {
            for count in COUNTS {
                let positions = sites::<D>(shape, count);
                let mut line = format!("| {D}D {shape} {kind} | {count} |");
                let mut rows = 0;
                for (name, solver) in SOLVERS {
                    if name == "uzawa" && count > 60 {
                        continue;
                    }
                    let (seconds, outcome) = solve(
                        &positions,
                        kind,
                        solver,
                        if solver == SolverKind::Auto { 500_000 } else { iteration_limit },
                    );
                    let told = match outcome {
                        Ok(report) => {
                            rows = report.pair_count;
                            format!("{} it {} p", report.iterations, report.passes)
                        }
                        Err(ContactError::NotConverged { residual, iterations, .. }) => {
                            format!("NOT {residual:.1e} after {iterations}")
                        }
                        Err(error) => format!("{error}").chars().take(40).collect(),
                    };
                    line += &format!(" {:.3} ms, {told} |", 1e3 * seconds);
                }
                println!("{line} {rows}");
            }
        }
    }
}

fn main() {
    let limit = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(20_000);
    table::<2>(limit);
    table::<3>(limit);
}
