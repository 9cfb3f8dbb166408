//! Flow in a box on several ranks, and what they said to each other: a line of JSON for each number of them.
//!
//! ```sh
//! cargo run --release -p gluey-distributed --example box_flow -- --dimension 3 --level 4 --ranks 1,8,64
//! cargo build --release -p gluey-distributed --example box_flow --features mpi
//! mpirun -n 8 target/release/examples/box_flow --dimension 3 --level 4
//! ```
//!
//! Options: `--dimension 2|3`, `--level L` (`2^L` cells along an edge), `--adaptive` (fine cells at a sphere
//! only), `--bodies` (three rigid bodies, and fine cells around these only), `--pair` (the two bodies of S2
//! and S3 in the shear of `bench-stokes`, all cells as fine), `--unfitted` (bodies whose surfaces cut cells,
//! with films; without it, bodies whose nodes move with them), `--tolerance T`, `--ranks N,M,...` (threads;
//! without it, the processes of `mpirun`), `--fail-rank R` (this rank fails before the solve, to see that all
//! end). Times, and the most memory that a process held, go to the standard error, so that equal runs print
//! equal lines.

use std::time::Instant;

use gluey_distributed::{BoxFlow, LevelSizes, MyFlow, RigidBodies, SurfaceBodies, equal_cuts};
use gluey_fem::ImplicitTree;
use gluey_geom::{Aabb, Dim, Space, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Threads, Traffic};
use gluey_stokes::{Conditions, Lubrication, Refinement};
use serde::Serialize;

/// Latency of a message and bytes a second of a rank, of the model.
const LATENCY: f64 = 1e-6;
const BANDWIDTH: f64 = 12e9;

#[derive(Clone, Copy, Debug)]
struct Options {
    dimension: usize,
    level: u8,
    adaptive: bool,
    bodies: bool,
    pair: bool,
    unfitted: bool,
    tolerance: f64,
    fail_rank: Option<usize>,
}

fn main() {
    let mut options = Options {
        dimension: 2,
        level: 5,
        adaptive: false,
        bodies: false,
        pair: false,
        unfitted: false,
        tolerance: 1e-8,
        fail_rank: None,
    };
    let mut ranks: Option<Vec<usize>> = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let switch = match name.as_str() {
            "--adaptive" => Some(&mut options.adaptive),
            "--bodies" => Some(&mut options.bodies),
            "--pair" => Some(&mut options.pair),
            "--unfitted" => Some(&mut options.unfitted),
            _ => None,
        };
        if let Some(switch) = switch {
            *switch = true;
            continue;
        }
        let value = arguments.next().unwrap_or_else(|| fail(&format!("{name} needs a value")));
        match name.as_str() {
            "--dimension" => options.dimension = number(&name, &value),
            "--level" => options.level = number(&name, &value),
            "--tolerance" => options.tolerance = number(&name, &value),
            "--fail-rank" => options.fail_rank = Some(number(&name, &value)),
            "--ranks" => ranks = Some(value.split(',').map(|n| number(&name, n)).collect()),
            _ => fail(&format!(
                "{name} is no option: --dimension, --level, --adaptive, --bodies, --pair, --unfitted, --tolerance, --ranks, --fail-rank"
            )),
        }
    }
    let Some(ranks) = ranks else { return processes(&options) };
    for size in ranks {
        match Threads::run(size, |ranks| run(&options, ranks)) {
            Ok(lines) => println!("{}", lines[0]),
            Err(failure) => fail(&failure.to_string()),
        }
    }
}

fn number<T: std::str::FromStr>(name: &str, value: &str) -> T {
    value.parse().unwrap_or_else(|_| fail(&format!("{name} {value}: a number is needed")))
}

fn fail(why: &str) -> ! {
    eprintln!("error: {why}");
    std::process::exit(1);
}

#[cfg(feature = "mpi")]
fn processes(options: &Options) {
    let ended = gluey_parallel::Processes::run(|ranks| {
        let line = run(options, ranks);
        if ranks.rank() == 0 {
            println!("{line}");
        }
    });
    ended.unwrap_or_else(|error| fail(&error.to_string()));
}

#[cfg(not(feature = "mpi"))]
fn processes(_: &Options) {
    fail("--ranks is needed: this program was built without the feature mpi");
}

/// The line of a run, the same on all ranks.
fn run(options: &Options, ranks: &dyn Communicator) -> String {
    match options.dimension {
        2 => solve::<2>(options, ranks),
        3 => solve::<3>(options, ranks),
        other => fail(&format!("--dimension {other}: 2 or 3")),
    }
}

fn solve<const D: usize>(options: &Options, ranks: &dyn Communicator) -> String
where
    Dim<D>: Space<D>,
{
    let balls = match options {
        Options { pair: true, .. } => pair::<D>(),
        Options { bodies: true, .. } => bodies::<D>(),
        _ => Vec::new(),
    };
    let tree_of_balls = BallTree::new(&balls);
    let around = Refinement {
        coarsest: options.level.saturating_sub(2),
        surface: options.level,
        band: 2.0,
        gap_fraction: 0.0,
        gap_levels: 0,
    };
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
    let (balls, wrenches) = (&balls[..], &wrenches[..]);
    let mine = if options.unfitted {
        let bodies = SurfaceBodies { balls, lubrication: Lubrication::Deficit };
        let conditions = Conditions::boundary(&walls).with_wrenches(wrenches);
        flow.solve_around_surfaces(&bodies, &mut tree, &cuts, ranks, &conditions)
    } else {
        let offset = if options.pair { gluey_stokes::default_offset(D) } else { -0.1 };
        flow.solve_around(&RigidBodies { balls, offset, wrenches }, &mut tree, &cuts, ranks, &walls)
    };
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
fn wrenches<const D: usize>(count: usize) -> Vec<Wrench<D>>
where
    Dim<D>: Space<D>,
{
    let wrench = |k: usize| {
        let mut wrench = Wrench::default();
        (wrench.force[k % D], wrench.torque[0]) = (0.3, 0.01 * (k + 1) as f64);
        wrench
    };
    (0..count).map(wrench).collect()
}

/// A number of each rank: the mean and the largest.
#[derive(Serialize)]
struct Spread {
    mean: f64,
    largest: u64,
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

/// Of a rank, in the solve.
#[derive(Serialize)]
struct TrafficRecord {
    messages: Spread,
    bytes: Spread,
    exchanges: u64,
    reductions: u64,
}

#[derive(Serialize)]
struct Record {
    dimension: usize,
    level: u8,
    adaptive: bool,
    bodies: bool,
    pair: bool,
    unfitted: bool,
    tolerance: f64,
    ranks: usize,
    iterations: usize,
    relative_residual: f64,
    /// Of the bits of all velocities, pressures and motions of bodies.
    checksum: String,
    levels: Vec<LevelRecord>,
    setup: TrafficRecord,
    solve: TrafficRecord,
    /// Latency of all messages of the rank that sends most, its bytes, and the hops of all sums: as if
    /// nothing overlapped.
    modelled_communication_seconds: f64,
}

impl Record {
    fn new<const D: usize>(options: &Options, ranks: &dyn Communicator, mine: &MyFlow<D>) -> Self
    where
        Dim<D>: Space<D>,
    {
        let motions = mine
            .twists
            .iter()
            .flat_map(|twist| twist.velocity.iter().chain(Dim::<D>::spin_slice(&twist.spin)));
        let bits = mine.velocity.iter().flatten().chain(&mine.pressure).chain(motions).map(|x| x.to_bits());
        let hashes = ranks.all_gather(&[bits.fold(FNV_OFFSET, mix)]);
        let &Options { dimension, level, adaptive, bodies, pair, unfitted, tolerance, .. } = options;
        let solve = TrafficRecord::new(ranks, &mine.solve_traffic);
        let hops = 2.0 * (ranks.size() as f64).log2().ceil() * solve.reductions as f64;
        let modelled_communication_seconds =
            LATENCY * (solve.messages.largest as f64 + hops) + solve.bytes.largest as f64 / BANDWIDTH;
        Self {
            dimension,
            level,
            adaptive,
            bodies,
            pair,
            unfitted,
            tolerance,
            ranks: ranks.size(),
            iterations: mine.iterations,
            relative_residual: mine.relative_residual,
            checksum: format!("{:016x}", hashes.into_iter().fold(FNV_OFFSET, mix)),
            levels: mine.levels.iter().map(|sizes| LevelRecord::new(ranks, sizes)).collect(),
            setup: TrafficRecord::new(ranks, &mine.setup_traffic),
            solve,
            modelled_communication_seconds,
        }
    }
}

impl TrafficRecord {
    fn new(ranks: &dyn Communicator, own: &Traffic) -> Self {
        Self {
            messages: spread(ranks, own.messages),
            bytes: spread(ranks, own.bytes),
            exchanges: own.exchanges,
            reductions: own.reductions,
        }
    }
}

impl LevelRecord {
    fn new(ranks: &dyn Communicator, own: &LevelSizes) -> Self {
        let sum = |own: usize| ranks.all_gather(&[own as u64]).into_iter().sum::<u64>();
        let (cells, nodes) = (sum(own.cells), sum(own.nodes));
        Self {
            cells,
            nodes,
            ghost_cells: sum(own.ghost_cells) as f64 / cells as f64,
            ghost_nodes: sum(own.ghost_nodes) as f64 / nodes as f64,
            cells_of_a_rank: spread(ranks, own.cells as u64),
            neighbours: spread(ranks, own.neighbours as u64),
        }
    }
}

fn spread(ranks: &dyn Communicator, own: u64) -> Spread {
    let all = ranks.all_gather(&[own]);
    let largest = all.iter().copied().max().unwrap_or(0);
    Spread { mean: all.iter().sum::<u64>() as f64 / all.len() as f64, largest }
}

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

/// Fowler, Noll and Vo's hash, byte by byte.
fn mix(hash: u64, bits: u64) -> u64 {
    bits.to_le_bytes()
        .iter()
        .fold(hash, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
