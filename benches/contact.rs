//! Timings of contact: search, graph, projection and whole steps of spheres in a shear flow.
//!
//! Spheres of diameter 1 at the volume fraction 0.4, in no order, `u* = (y, 0, 0)`, `dt = 0.05`, residual
//! below 1e-6 diameters. `cargo bench -p gluey-contact`; `docs/benchmarks.md` has a table of a run.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use gluey_contact::broadphase::{Broadphase, CellList, Hierarchy};
use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, GammaUpdate, PairContact, SolverKind, StepGeometry,
};
use gluey_geom::{Twist, Vector};
use gluey_testkit::packing::Packing;

const DT: f64 = 0.05;
const COUNTS: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Steps before a warm one is timed.
const STEPS_BEFORE: usize = 3;

/// Spheres on their way.
struct Shear {
    positions: Vec<Vector<3>>,
    radii: Vec<f64>,
    drift: Vec<Vector<3>>,
    contact: PairContact<3>,
    rate: f64,
}

impl Shear {
    fn new(positions: &[Vector<3>], law: ContactLaw, solver: SolverKind) -> Self {
        let count = positions.len();
        let side = positions.iter().map(|x| x.y).fold(0.0, f64::max);
        // The tolerance is relative to the largest displacement, which grows with the cloud.
        let tolerance = 1e-6 / f64::max(0.5, DT * side);
        let params = ContactParams {
            law,
            solver,
            gamma_update: GammaUpdate::Consistent,
            tolerance,
            ..Default::default()
        };
        Self {
            positions: positions.to_vec(),
            radii: vec![0.5; count],
            drift: vec![Vector::zeros(); count],
            contact: PairContact::new(params),
            rate: 1.0,
        }
    }

    fn predicted(&self) -> Vec<Twist<3>> {
        let flow = |x: &Vector<3>| Vector::<3>::new(self.rate * x.y, 0.0, 0.0);
        self.positions.iter().map(|x| Twist { velocity: flow(x), ..Twist::default() }).collect()
    }

    /// Corrects velocities; the time that takes.
    fn correct(&mut self, twists: &mut [Twist<3>]) -> Duration {
        let (positions, radii, drift) = (&self.positions, &self.radii, &self.drift);
        let step = StepGeometry { positions, radii, drift, velocity_weight: DT, dt: DT };
        let start = Instant::now();
        black_box(self.contact.correct(&step, twists).expect("feasible"));
        start.elapsed()
    }

    fn step(&mut self) -> Duration {
        let mut twists = self.predicted();
        let elapsed = self.correct(&mut twists);
        for (x, twist) in self.positions.iter_mut().zip(&twists) {
            *x += twist.velocity * DT;
        }
        elapsed
    }

    fn reverse(&mut self) {
        self.rate = -self.rate;
        self.contact.reverse();
    }
}

fn search(criterion: &mut Criterion, positions: &[Vector<3>]) {
    let count = positions.len();
    let mut group = criterion.benchmark_group("search, pairs nearer than 0.2 diameters");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    let radii = vec![0.6; count];
    let mut pairs = Vec::new();
    let mut cells = CellList::default();
    group.bench_function(BenchmarkId::new("cell list", count), |bencher| {
        bencher.iter(|| cells.meeting(positions, &radii, count, &mut pairs));
    });
    if count <= 100_000 {
        group.bench_function(BenchmarkId::new("hierarchy (parry)", count), |bencher| {
            bencher.iter(|| Hierarchy.meeting(positions, &radii, count, &mut pairs));
        });
    }
}

/// A step of particles that do not move: the graph is found anew, or is known.
fn graph(criterion: &mut Criterion, positions: &[Vector<3>]) {
    let count = positions.len();
    let mut group = criterion.benchmark_group("graph, no motion");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    let still = || {
        let mut shear = Shear::new(positions, ContactLaw::Inelastic, SolverKind::ActiveSet);
        shear.rate = 0.0;
        shear
    };
    group.bench_function(BenchmarkId::new("new", count), |bencher| {
        bencher.iter_batched_ref(still, |shear| _ = shear.step(), BatchSize::PerIteration);
    });
    let mut known = still();
    known.step();
    group.bench_function(BenchmarkId::new("known", count), |bencher| bencher.iter(|| known.step()));
}

fn steps(criterion: &mut Criterion, positions: &[Vector<3>]) {
    let count = positions.len();
    let mut group = criterion.benchmark_group("step");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    for (name, solver) in [("active set", SolverKind::ActiveSet), ("accelerated", SolverKind::Accelerated)] {
        group.bench_function(BenchmarkId::new(format!("cold, inelastic, {name}"), count), |bencher| {
            bencher.iter_custom(|times| {
                (0..times).map(|_| Shear::new(positions, ContactLaw::Inelastic, solver).step()).sum()
            });
        });
    }
    for (name, turns) in [("warm, inelastic", false), ("warm, gluey, reversed", true)] {
        group.bench_function(BenchmarkId::new(name, count), |bencher| {
            bencher.iter_custom(|times| (0..times).map(|_| warm_step(positions, turns)).sum());
        });
    }
}

fn warm_step(positions: &[Vector<3>], turns: bool) -> Duration {
    let law = if turns { ContactLaw::Gluey } else { ContactLaw::Inelastic };
    let mut shear = Shear::new(positions, law, SolverKind::ActiveSet);
    for _ in 0..STEPS_BEFORE {
        shear.step();
    }
    if turns {
        shear.reverse();
    }
    shear.step()
}

fn contact(criterion: &mut Criterion) {
    // Times are those of one thread.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("no pool before this one");
    for count in COUNTS {
        let positions = Packing::<3>::fluid(count, 0.4, 1).positions;
        search(criterion, &positions);
        graph(criterion, &positions);
        steps(criterion, &positions);
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    targets = contact
}
criterion_main!(benches);
