//! Contact of discs or spheres in a sheared box on several ranks, and what they said to each other: a line of
//! JSON for each number of them. One rank does what a process without ranks does.
//!
//! ```sh
//! cargo run --release -p gluey-distributed --example shear_contact -- --count 10000 --ranks 1,8,64
//! cargo build --release -p gluey-distributed --example shear_contact --features mpi
//! mpirun -n 2 target/release/examples/shear_contact --dimension 3 --count 1000000
//! ```
//!
//! Particles of diameter 1 in no order, `u* = (y, 0, 0)`, images that slide; `--help` lists the options.
//! Counts are those of the last step. Times go to the standard error, so that equal runs print equal lines:
//! those of steps, and the processor time that each rank took for the last one, where the system counts it.

mod common;

use std::time::Instant;

use clap::Parser;
use common::{TrafficRecord, fail, hash, on_ranks};
use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, ContactReport, Domain, GammaUpdate, PairContact, SolverKind,
    StepGeometry, WithFixed,
};
use gluey_distributed::{ContactLoad, SharedContact};
use gluey_geom::{Twist, Vector};
use gluey_parallel::{Communicator, Ranks, Traffic};
use gluey_testkit::packing::Packing;
use serde::Serialize;

/// Contact of discs or spheres in a sheared box on several ranks.
#[derive(Clone, Debug, Parser, Serialize)]
struct Options {
    #[arg(long, default_value_t = 3)]
    dimension: usize,
    /// Particles.
    #[arg(long, default_value_t = 1000)]
    count: usize,
    /// Of the area or volume that particles fill.
    #[arg(long, default_value_t = 0.4)]
    fraction: f64,
    /// Length of a step, in units of the shear rate's inverse.
    #[arg(long, default_value_t = 0.05)]
    dt: f64,
    #[arg(long, default_value_t = 4)]
    steps: usize,
    /// Residual in diameters [default: 1e-13 of the largest displacement].
    #[arg(long)]
    tolerance: Option<f64>,
    /// auto, uzawa, accelerated or active-set.
    #[arg(long, default_value = "auto")]
    solver: SolverKind,
    /// Gaps at the end of the step are exact.
    #[arg(long)]
    exact: bool,
    /// Ranks as threads, one run for each number; without it, the processes of `mpirun`.
    #[arg(long, value_delimiter = ',')]
    #[serde(skip)]
    ranks: Vec<usize>,
}

fn main() {
    let options = Options::parse();
    on_ranks(&options.ranks, |ranks| run(&options, ranks));
}

/// The line of a run, on each rank.
fn run(options: &Options, ranks: &Ranks) -> String {
    // A rank has one thread, this one.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let _pool = pool.unwrap_or_else(|error| fail(&error.to_string()));
    match options.dimension {
        2 => steps::<2>(options, ranks),
        3 => steps::<3>(options, ranks),
        other => fail(&format!("--dimension {other}: 2 or 3")),
    }
}

fn steps<const D: usize>(options: &Options, ranks: &Ranks) -> String {
    let (mut shear, is_first) = (Shear::<D>::new(options, ranks), ranks.rank() == 0);
    let (mut report, mut traffic, mut worked) = (ContactReport::default(), Traffic::default(), 0);
    for step in 0..options.steps {
        let before = ranks.traffic();
        let (start, start_of_work) = (Instant::now(), processor_time());
        report = shear.step(step, options);
        (traffic, worked) = (ranks.traffic().since(before), processor_time() - start_of_work);
        if is_first {
            let (seconds, iterations) = (start.elapsed().as_secs_f64(), report.iterations);
            eprintln!("step {step}: {seconds:.4} s, {iterations} iterations, {:?}", shear.contact.load());
        }
    }
    let worked = ranks.all_gather(&[worked]).into_iter().map(|time| time as f64 * 1e-9);
    let worked: Vec<f64> = worked.collect();
    if is_first {
        eprintln!("processor time of each rank: {worked:.3?} s");
    }
    let traffic = TrafficRecord::new(ranks, &traffic);
    let record = Record::new(options, ranks.size(), &report, (&shear, traffic));
    serde_json::to_string(&record).unwrap_or_else(|error| fail(&error.to_string()))
}

/// Particles on their way.
struct Shear<'a, const D: usize> {
    positions: Vec<Vector<D>>,
    radii: Vec<f64>,
    drift: Vec<Vector<D>>,
    side: f64,
    contact: SharedContact<'a, D>,
}

impl<'a, const D: usize> Shear<'a, D> {
    fn new(options: &Options, ranks: &'a Ranks) -> Self {
        let Packing { positions, side } = Packing::<D>::fluid(options.count, options.fraction, 1);
        let farthest = f64::max(0.5, options.dt * side);
        let params = ContactParams {
            law: ContactLaw::Gluey,
            exact_gap: options.exact,
            gamma_update: GammaUpdate::Consistent,
            solver: options.solver,
            tolerance: options.tolerance.map_or(ContactParams::default().tolerance, |t| t / farthest),
            ..ContactParams::default()
        };
        let domain = Domain::periodic(&Vector::repeat(side));
        let contact = PairContact::with_mobility(params, WithFixed::default()).within(domain);
        let (radii, drift) = (vec![0.5; positions.len()], vec![Vector::zeros(); positions.len()]);
        Self { positions, radii, drift, side, contact: SharedContact::new(contact, ranks) }
    }

    fn step(&mut self, number: usize, options: &Options) -> ContactReport {
        let tilt_step = self.side * options.dt;
        self.contact.set_sliding(number as f64 * tilt_step, tilt_step);
        let flow = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { x[1] } else { 0.0 });
        let mut twists: Vec<Twist<D>> =
            self.positions.iter().map(|x| Twist { velocity: flow(x), ..Twist::default() }).collect();
        let (positions, radii, drift) = (&self.positions, &self.radii, &self.drift);
        let step = StepGeometry { positions, radii, drift, velocity_weight: options.dt, dt: options.dt };
        let report = self.contact.correct(&step, &mut twists);
        let report = report.unwrap_or_else(|error| fail(&error.to_string()));
        for (x, twist) in self.positions.iter_mut().zip(&twists) {
            *x += twist.velocity * options.dt;
        }
        report
    }
}

/// Nanoseconds that the processor gave this thread; 0 where Linux does not say.
fn processor_time() -> u64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    told.split(' ').next().and_then(|time| time.parse().ok()).unwrap_or(0)
}

#[derive(Serialize)]
struct Record {
    #[serde(flatten)]
    options: Options,
    ranks: usize,
    iterations: usize,
    passes: usize,
    residual: f64,
    contacts: usize,
    pairs: usize,
    most_pairs_of_a_rank: usize,
    /// In islands that reach across ranks.
    shared_pairs: usize,
    /// Of the bits of all positions, forces and memory.
    checksum: String,
    traffic: TrafficRecord,
    modelled_communication_seconds: f64,
}

impl Record {
    fn new<const D: usize>(
        options: &Options,
        ranks: usize,
        report: &ContactReport,
        (shear, traffic): (&Shear<'_, D>, TrafficRecord),
    ) -> Self {
        let contacts = shear.contact.contacts();
        let of_contacts = contacts.iter().flat_map(|contact| [contact.lambda, contact.gamma]);
        let numbers = shear.positions.iter().flat_map(|x| x.iter().copied()).chain(of_contacts);
        let hash = hash(numbers.map(f64::to_bits));
        let ContactLoad { most_pairs, shared_pair_count, .. } = shear.contact.load();
        Self {
            options: options.clone(),
            ranks,
            iterations: report.iterations,
            passes: report.passes,
            residual: report.residual,
            contacts: contacts.len(),
            pairs: report.pair_count,
            most_pairs_of_a_rank: most_pairs,
            shared_pairs: shared_pair_count,
            checksum: format!("{hash:016x}"),
            modelled_communication_seconds: traffic.modelled_seconds(ranks),
            traffic,
        }
    }
}
