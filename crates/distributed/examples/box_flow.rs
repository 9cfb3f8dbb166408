//! Flow in a box on several ranks, and what they said to each other: a line of JSON for each number of them.
//!
//! ```sh
//! cargo run --release -p gluey-distributed --example box_flow -- --dimension 3 --level 4 --ranks 1,8,64
//! cargo build --release -p gluey-distributed --example box_flow --features mpi
//! mpirun -n 8 target/release/examples/box_flow --dimension 3 --level 4
//! ```
//!
//! `--help` lists the options. Times, and the most memory that a process held, go to the standard error, so
//! that equal runs print equal lines.

mod common;

use std::time::Instant;

use clap::Parser;
use common::{Spread, TrafficRecord, fail, hash, on_ranks};
use gluey_distributed::{BoxFlow, LevelSizes, LocalFlow, SurfaceBodies, equal_cuts};
use gluey_fem::ImplicitTree;
use gluey_geom::{Aabb, Dim, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::{Conditions, Lubrication, Refinement};
use serde::Serialize;

/// Flow in a box on several ranks.
#[derive(Clone, Debug, Parser)]
struct Options {
    #[arg(long, default_value_t = 2)]
    dimension: usize,
    /// `2^L` cells along an edge.
    #[arg(long, default_value_t = 5)]
    level: u8,
    /// Fine cells at a sphere only.
    #[arg(long)]
    adaptive: bool,
    /// Three rigid bodies, and fine cells around these only.
    #[arg(long)]
    bodies: bool,
    /// The two bodies of S2 and S3 in the shear of `bench-stokes`, all cells as fine.
    #[arg(long)]
    pair: bool,
    #[arg(long, default_value_t = 1e-8)]
    tolerance: f64,
    /// This rank fails before the solve, to see that all end.
    #[arg(long)]
    fail_rank: Option<usize>,
    /// Ranks as threads, one run for each number; without it, the processes of `mpirun`.
    #[arg(long, value_delimiter = ',')]
    ranks: Vec<usize>,
}

fn main() {
    let options = Options::parse();
    on_ranks(&options.ranks, |ranks| run(&options, ranks));
}

/// The line of a run, the same on all ranks.
fn run(options: &Options, ranks: &Ranks) -> String {
    match options.dimension {
        2 => solve::<2>(options, ranks),
        3 => solve::<3>(options, ranks),
        other => fail(&format!("--dimension {other}: 2 or 3")),
    }
}

fn solve<const D: usize>(options: &Options, ranks: &Ranks) -> String {
    let balls = match options {
        Options { pair: true, .. } => pair::<D>(),
        Options { bodies: true, .. } => bodies::<D>(),
        _ => Vec::new(),
    };
    let tree_of_balls = BallTree::new(&balls);
    let coarsest = options.level.saturating_sub(2);
    let around = Refinement { coarsest, ..Refinement::to_level(options.level) };
    let wants = |lower: &Vector<D>, h: f64, level: u8| {
        if options.bodies {
            return around.wants(lower, h, level, &tree_of_balls);
        }
        let distance = (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.45)).norm() - 0.3;
        !options.adaptive || level < 2 || distance.abs() < h
    };
    let walls = |x: &Vector<D>| {
        let mut u = Vector::<D>::zeros();
        if options.pair {
            u[0] = x[1] - 0.5;
            return u;
        }
        u[0] = x[1] * (0.3 + x[D - 1]);
        u[1] = (2.0 * std::f64::consts::TAU * x[0]).sin() * (1.0 - x[1]) * x[1];
        u
    };
    let start = Instant::now();
    let tree = ImplicitTree::new(Aabb::unit(), [1; D], [false; D], options.level, &wants);
    let mut tree = tree.unwrap_or_else(|error| fail(&error.to_string()));
    let cuts = equal_cuts(&tree, ranks);
    assert_ne!(options.fail_rank, Some(ranks.rank()), "this rank was told to fail");
    let flow = BoxFlow { viscosity: 1.0, tolerance: options.tolerance, max_iterations: 200 };
    let wrenches = if options.pair { Vec::new() } else { wrenches(balls.len()) };
    let bodies = SurfaceBodies { balls: &balls, lubrication: Lubrication::Deficit };
    let conditions = Conditions::boundary(&walls).with_wrenches(&wrenches);
    let mine = flow.solve_around_surfaces(&bodies, &mut tree, &cuts, ranks, &conditions);
    let mine = mine.unwrap_or_else(|error| fail(&error.to_string()));
    let seconds = start.elapsed().as_secs_f64();
    let peaks = ranks.all_gather(&[peak_kibibytes()]);
    if ranks.rank() == 0 {
        let most = peaks.into_iter().max().unwrap_or(0) / 1024;
        eprintln!("{} ranks, {seconds:.2} s, at most {most} MiB in a process", ranks.size());
    }
    let line = serde_json::to_string(&Record::new(options, ranks, &mine));
    line.unwrap_or_else(|error| fail(&error.to_string()))
}

/// The most memory that this process has held, where the system tells.
fn peak_kibibytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Two bodies a tenth of a radius apart or less.
fn pair<const D: usize>() -> Vec<Ball<D>> {
    let at = |x: [f64; 3]| Ball::new(Vector::from_fn(|d, _| x[d]), 0.05);
    vec![at([0.45, 0.51, 0.5]), at([0.55, 0.49, 0.5])]
}

/// Three bodies of unlike sizes.
fn bodies<const D: usize>() -> Vec<Ball<D>> {
    let at = |x: [f64; 3], radius| Ball::new(Vector::from_fn(|d, _| x[d]), radius);
    vec![at([0.31, 0.4, 0.52], 0.17), at([0.7, 0.33, 0.45], 0.13), at([0.58, 0.72, 0.6], 0.19)]
}

/// A force on each body, and a torque on it.
fn wrenches<const D: usize>(count: usize) -> Vec<Wrench<D>> {
    let wrench = |k: usize| {
        let mut wrench = Wrench::default();
        (wrench.force[k % D], wrench.torque[0]) = (0.3, 0.01 * (k + 1) as f64);
        wrench
    };
    (0..count).map(wrench).collect()
}

#[derive(Serialize)]
struct LevelRecord {
    cells: u64,
    nodes: u64,
    /// Ghosts over owned, for all ranks together.
    ghost_cells: f64,
    ghost_nodes: f64,
    cells_of_a_rank: Spread,
    neighbours: Spread,
}

#[derive(Serialize)]
struct Record {
    dimension: usize,
    level: u8,
    adaptive: bool,
    bodies: bool,
    pair: bool,
    tolerance: f64,
    ranks: usize,
    iterations: usize,
    relative_residual: f64,
    /// Of the bits of all velocities, pressures and motions of bodies.
    checksum: String,
    levels: Vec<LevelRecord>,
    setup: TrafficRecord,
    solve: TrafficRecord,
    modelled_communication_seconds: f64,
}

impl Record {
    fn new<const D: usize>(options: &Options, ranks: &Ranks, mine: &LocalFlow<D>) -> Self {
        let motions = mine
            .flow
            .twists
            .iter()
            .flat_map(|twist| twist.velocity.iter().chain(Dim::<D>::spin_slice(&twist.spin)));
        let velocity = mine.velocity();
        let bits = velocity.iter().flatten().chain(mine.pressure()).chain(motions).map(|x| x.to_bits());
        let hashes = ranks.all_gather(&[hash(bits)]);
        let &Options { dimension, level, adaptive, bodies, pair, tolerance, .. } = options;
        let solve = TrafficRecord::new(ranks, &mine.flow.solve_traffic);
        Self {
            dimension,
            level,
            adaptive,
            bodies,
            pair,
            tolerance,
            ranks: ranks.size(),
            iterations: mine.flow.iteration_count,
            relative_residual: mine.flow.residual,
            checksum: format!("{:016x}", hash(hashes.into_iter())),
            levels: mine.levels.iter().map(|sizes| LevelRecord::new(ranks, sizes)).collect(),
            setup: TrafficRecord::new(ranks, &mine.setup_traffic),
            modelled_communication_seconds: solve.modelled_seconds(ranks.size()),
            solve,
        }
    }
}

impl LevelRecord {
    fn new(ranks: &Ranks, own: &LevelSizes) -> Self {
        let sum = |own: usize| ranks.all_gather(&[own as u64]).into_iter().sum::<u64>();
        let (cells, nodes) = (sum(own.cells), sum(own.nodes));
        Self {
            cells,
            nodes,
            ghost_cells: sum(own.ghost_cells) as f64 / cells as f64,
            ghost_nodes: sum(own.ghost_nodes) as f64 / nodes as f64,
            cells_of_a_rank: Spread::new(ranks, own.cells as u64),
            neighbours: Spread::new(ranks, own.neighbours as u64),
        }
    }
}
