//! Timings of the Stokes core: operator, V-cycle, linear solves, one Uzawa step, and the flow of a whole time
//! step.
//!
//! `cargo bench -p gluey-stokes`; `docs/benchmarks.md` has a table of a run.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, Ramp};
use gluey_linalg::{LinOp, Preconditioner};
use gluey_stokes::{
    DirectSolver, Discretisation, FlowParams, FlowSolver, Formulation, Lubrication, MultigridSolver,
    PaperParams, PointMatrices, Problem, Refinement, SaddleSolver, SolidRegion, SolverKind, SystemOperator,
    solid_nodes,
};
use gluey_testkit::packing::Packing;

/// Offset of the rigid nodes in cells.
const OFFSET: f64 = -0.1;
/// Relative tolerance of a solve.
const TOLERANCE: f64 = 1e-8;
const VISCOSITY: f64 = 1.0;
const UNFITTED: Formulation = Formulation::Unfitted { lubrication: Lubrication::Deficit };

fn pair_2d() -> Vec<Ball<2>> {
    [(0.451, 0.51), (0.549, 0.49)].map(|(x, y)| Ball::new(Vector::<2>::new(x, y), 0.05)).to_vec()
}

fn pair_3d() -> Vec<Ball<3>> {
    [(0.3, 0.525), (0.7, 0.475)].map(|(x, y)| Ball::new(Vector::<3>::new(x, y, 0.5), 0.05)).to_vec()
}

fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] - 0.5;
    u
}

fn mesh<const D: usize>(surface: u8, balls: &[Ball<D>]) -> TreeMesh<D> {
    Refinement { coarsest: 3, surface, band: 2.0 }
        .mesh(Aabb::unit(), [1; D], [false; D], balls)
        .expect("the unit box is a cube and the levels are few")
}

/// A problem with the residual of the undisturbed flow for its right-hand side.
struct Case<const D: usize> {
    problem: Problem<D>,
    b: Vec<f64>,
}

impl<const D: usize> Case<D> {
    /// A uniform mesh without bodies.
    fn empty(level: u8) -> Self {
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level);
        Self::new(&[], mesh.expect("the unit box is a cube and the levels are few"), UNFITTED)
    }

    fn unfitted(balls: &[Ball<D>], surface: u8) -> Self {
        Self::new(balls, mesh(surface, balls), UNFITTED)
    }

    fn penalised(balls: &[Ball<D>], surface: u8) -> Self {
        Self::new(balls, mesh(surface, balls), Formulation::Paper(paper()))
    }

    fn new(balls: &[Ball<D>], mesh: TreeMesh<D>, formulation: Formulation) -> Self {
        let problem = Problem::new(mesh, balls, VISCOSITY, formulation).expect("the bodies are resolved");
        let b = problem.right_hand_side(&problem.lift(&couette), None);
        Self { problem, b }
    }

    fn prepare(&self, solver: &mut impl SaddleSolver<D>) {
        solver.prepare(&self.problem).expect("the system can be inverted");
    }

    fn dofs(&self) -> u64 {
        self.problem.discretisation().dof_count() as u64
    }
}

/// One application of the Stokes operator; throughput in unknowns.
fn operator<const D: usize>(criterion: &mut Criterion, name: &str, case: &Case<D>) {
    let mut group = criterion.benchmark_group(format!("operator-{D}d"));
    group.throughput(Throughput::Elements(case.dofs()));
    let mut operator = SystemOperator::new(&case.problem.system);
    let x: Vec<f64> = (0..case.problem.system.dim()).map(|i| (0.7 * i as f64).sin()).collect();
    let mut y = vec![0.0; x.len()];
    group.bench_function(BenchmarkId::new(name, case.dofs()), |b| b.iter(|| operator.apply(&x, &mut y)));
    group.finish();
}

/// One V-cycle on the velocities; throughput in unknowns.
fn cycle<const D: usize>(criterion: &mut Criterion, name: &str, case: &Case<D>) {
    let mut group = criterion.benchmark_group(format!("cycle-{D}d"));
    group.throughput(Throughput::Elements(case.dofs()));
    let mut solver = MultigridSolver::default();
    case.prepare(&mut solver);
    let cycle = solver.velocity_cycle().expect("the solver is prepared");
    let r = &case.b[..case.problem.system.velocity_dim()];
    let mut z = vec![0.0; r.len()];
    group.bench_function(BenchmarkId::new(name, case.dofs()), |b| b.iter(|| cycle.apply(r, &mut z)));
    group.finish();
}

/// Set-up of a solver, and a solve from zero to the tolerance; throughput in unknowns.
fn solver<const D: usize, S: SaddleSolver<D> + Default>(
    criterion: &mut Criterion,
    name: &str,
    case: &Case<D>,
) {
    let mut group = criterion.benchmark_group(format!("solver-{D}d"));
    group.throughput(Throughput::Elements(case.dofs()));
    let mut solver = S::default();
    group.bench_function(BenchmarkId::new(format!("{name}-prepare"), case.dofs()), |b| {
        b.iter(|| case.prepare(&mut solver));
    });
    group.bench_function(BenchmarkId::new(format!("{name}-solve"), case.dofs()), |b| {
        b.iter(|| {
            let mut x = vec![0.0; case.problem.system.dim()];
            solver.solve(&case.problem.system, &case.b, &mut x, TOLERANCE).expect("it converges")
        });
    });
    group.finish();
}

/// Mesh, assembly, set-up and solve for a pair that has moved by one step, again and again forth and back, so
/// that every step starts from the flow before it as in a run. Contact and integration of the motion, which
/// cost microseconds, are left out.
fn step<const D: usize>(
    criterion: &mut Criterion,
    name: &str,
    params: FlowParams,
    balls: Vec<Ball<D>>,
    surface: u8,
    dt: f64,
) {
    let mut solver = FlowSolver::<D>::new(params).expect("the parameters are in range");
    let mut flow = |balls: &[Ball<D>]| {
        solver.solve(mesh(surface, balls), balls, &couette).expect("the bodies are resolved")
    };
    let twists = flow(&balls).twists;
    let moved: Vec<Ball<D>> =
        balls.iter().zip(&twists).map(|(b, t)| Ball::new(b.center() + t.velocity * dt, 0.05)).collect();
    let mut group = criterion.benchmark_group("step");
    let mut forth = false;
    group.bench_function(name, |b| {
        b.iter(|| {
            forth = !forth;
            flow(if forth { &moved } else { &balls })
        });
    });
    group.finish();
}

fn operators(criterion: &mut Criterion) {
    operator(criterion, "constant", &Case::<2>::empty(8));
    operator(criterion, "constant", &Case::<3>::empty(5));
    operator(criterion, "unfitted", &Case::unfitted(&pair_2d(), 7));
    operator(criterion, "paper", &Case::penalised(&pair_2d(), 7));
    operator(criterion, "unfitted", &Case::unfitted(&pair_3d(), 6));
    operator(criterion, "paper", &Case::penalised(&pair_3d(), 6));
}

fn cycles(criterion: &mut Criterion) {
    cycle(criterion, "unfitted", &Case::unfitted(&pair_2d(), 7));
    cycle(criterion, "paper", &Case::penalised(&pair_2d(), 7));
    cycle(criterion, "unfitted", &Case::unfitted(&pair_3d(), 6));
    cycle(criterion, "paper", &Case::penalised(&pair_3d(), 6));
}

fn solvers(criterion: &mut Criterion) {
    let (unfitted, soft) = (Case::unfitted(&pair_2d(), 7), Case::penalised(&pair_2d(), 7));
    solver::<2, DirectSolver>(criterion, "unfitted-direct", &unfitted);
    solver::<2, MultigridSolver<2>>(criterion, "unfitted-multigrid", &unfitted);
    // A further step of Uzawa's iteration is one more solve with what is prepared.
    solver::<2, DirectSolver>(criterion, "paper-direct-uzawa-step", &soft);
    solver::<2, MultigridSolver<2>>(criterion, "paper-multigrid-uzawa-step", &soft);
    solver::<3, MultigridSolver<3>>(criterion, "unfitted-multigrid", &Case::unfitted(&pair_3d(), 6));
    solver::<3, MultigridSolver<3>>(criterion, "paper-multigrid-uzawa-step", &Case::penalised(&pair_3d(), 6));
}

/// The setting of the tables in `docs/benchmarks.md`: the paper's viscosity ratio, one solve.
fn paper() -> PaperParams {
    PaperParams { viscosity_ratio: 1e3, uzawa_steps: 1, ..PaperParams::default() }
}

/// Steps of the cases `pair-2d` and `pair-3d`; `docs/benchmarks.md` names the meshes.
fn steps(criterion: &mut Criterion) {
    let paper = Formulation::Paper(paper());
    let params =
        |formulation, solver| FlowParams { viscosity: VISCOSITY, formulation, solver, tolerance: TOLERANCE };
    step(criterion, "pair-2d-paper", params(paper, SolverKind::Direct), pair_2d(), 7, 0.025);
    step(criterion, "pair-2d-unfitted", params(UNFITTED, SolverKind::Direct), pair_2d(), 7, 0.025);
    step(criterion, "pair-3d-paper", params(paper, SolverKind::Multigrid), pair_3d(), 6, 0.05);
    step(criterion, "pair-3d-unfitted", params(UNFITTED, SolverKind::Multigrid), pair_3d(), 6, 0.05);
}

/// Fifty spheres in a periodic cube, and as many copies of it as it takes; `docs/benchmarks.md` names the
/// mesh.
fn suspension(copies: usize) -> (Vec<Ball<3>>, [u32; 3], Vector<3>) {
    let packing = Packing::<3>::fluid(50, 0.2, 1);
    let tiles = [1, 2, 4].map(|before| if copies > before { 2 } else { 1 });
    let extent = Vector::from(tiles.map(f64::from)) * packing.side;
    let period = [Some(extent[0]), None, Some(extent[2])];
    let image = |k: usize| Vector::from_fn(|d, _| (k >> d & 1) as f64 * packing.side);
    let copy = |k: usize| packing.positions.iter().map(move |x| Ball::periodic(x + image(k), 0.48, period));
    ((0..copies).flat_map(copy).collect(), tiles, extent)
}

/// Where the bodies are on a mesh: what must not grow faster than its cells.
fn suspensions(criterion: &mut Criterion) {
    let matrices = PointMatrices::new(PaperParams::default().quadrature);
    for copies in [1, 2, 4, 8] {
        let (balls, roots, extent) = suspension(copies);
        let domain = Aabb { lower: Vector::zeros(), upper: extent };
        let refinement = Refinement { coarsest: 3, surface: 5, band: 2.0 };
        let mesh = || refinement.mesh(domain, roots, [true, false, true], &balls).expect("a box of cubes");
        let discretisation = Discretisation::new(mesh());
        let (nodes, ramp) = (&discretisation.velocity, Ramp::new(discretisation.mesh.size(5)));
        let region = SolidRegion::new(&discretisation, &balls, ramp, &matrices);
        let velocity = vec![1.0; nodes.node_count() * 3];
        let mut group = criterion.benchmark_group("suspension");
        let id = |what: &str| BenchmarkId::new(what, balls.len());
        group.throughput(Throughput::Elements(discretisation.mesh.cell_count() as u64));
        group.bench_function(id("mesh"), |b| b.iter(&mesh));
        group.bench_function(id("solid-nodes"), |b| {
            b.iter(|| solid_nodes(&discretisation, &balls, OFFSET));
        });
        group.bench_function(id("solid-region"), |b| {
            b.iter(|| SolidRegion::new(&discretisation, &balls, ramp, &matrices));
        });
        group.bench_function(id("touched-nodes"), |b| b.iter(|| region.touched_nodes(nodes, &balls)));
        group.bench_function(id("twists"), |b| {
            b.iter(|| region.twists(&discretisation, &balls, &matrices, &velocity));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    targets = operators, cycles, solvers, steps, suspensions
}
criterion_main!(benches);
