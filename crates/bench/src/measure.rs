//! One timed solve of the Stokes core in a unit box.
//!
//! All cases have the Couette velocity `u = (y - 1/2) e_x` on the whole boundary and viscosity 1 in the
//! fluid; [`crate::cases`] says what is inside. The guess is zero and the tolerance relative to the residual
//! it leaves.

use std::io::IsTerminal;

use anyhow::anyhow;
use gluey_fem::{MeshError, TreeMesh};
use gluey_geom::{Aabb, Dim, Twist};
use gluey_levelset::Ball;
use gluey_linalg::{LinOp, parallel, vector};
use gluey_stokes::{
    MultigridSolver, Problem, Refinement, SaddleSolver, SolveReport, StokesSystem, SystemOperator,
};

use crate::machine::{SolveTimes, Stopwatch};
use crate::options::StokesBenchOptions;
use crate::report::Report;
use crate::{cases, machine};

/// Viscosity of the fluid.
const VISCOSITY: f64 = 1.0;
/// Level of the coarsest cells of an adaptive mesh.
const COARSEST_LEVEL: u8 = 3;
/// Cells of each size around a particle in an adaptive mesh.
const BAND: f64 = 2.0;
/// Timed applications of the operator, of which the median counts.
const OPERATOR_SAMPLES: usize = 15;

/// Solves the case once, on as many threads as asked for.
pub fn run(options: &StokesBenchOptions) -> anyhow::Result<Report> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.get()).build();
    let pool = pool.map_err(|error| anyhow!("cannot start the threads: {error}"))?;
    pool.install(|| match options.case.dimension() {
        2 => measure::<2>(options),
        _ => measure::<3>(options),
    })
}

/// A solve, and what it took.
struct Solved<const D: usize> {
    report: SolveReport,
    times: SolveTimes,
    residual_rel: f64,
    twists: Vec<Twist<D>>,
}

fn measure<const D: usize>(options: &StokesBenchOptions) -> anyhow::Result<Report> {
    progress(options, "mesh, operator and levels");
    let (problem, mut solver, setup) = prepare::<D>(options)?;
    progress(options, "solve");
    let solved = solve(options, &problem, &mut solver)?;
    // Before the arrays of the triad take their part.
    let peak_rss_mb = machine::peak_rss_mb();
    progress(options, "operator and triad");
    let operator_cpu_s = operator_cpu_s(&problem.system);
    let triad_gb_s = machine::triad_gb_s();
    let dofs = problem.discretisation().dof_count();
    let dofs_per_s = solved.times.cpu.map(|s| dofs as f64 / s);
    Ok(Report {
        case: options.case,
        formulation: options.formulation,
        n: options.cells_per_side(),
        adaptive: options.adaptive,
        tolerance: options.tolerance,
        contrast: options.contrast_used(),
        threads: options.threads.get(),
        dofs,
        cells: problem.discretisation().mesh.cell_count(),
        levels: solver.level_count(),
        setup_s: setup.wall,
        setup_cpu_s: setup.cpu,
        solve_s: solved.times.wall,
        solve_cpu_s: solved.times.cpu,
        iterations: solved.report.iterations,
        fine_operator_applications: solved.report.fine_operator_applications,
        residual_rel: solved.residual_rel,
        dofs_per_s,
        operator_dofs_per_s: operator_cpu_s.map(|s| dofs as f64 / s),
        peak_rss_mb,
        triad_gb_s,
        dofs_per_triad_gb: dofs_per_s.map(|rate| rate / triad_gb_s),
        velocities: solved.twists.iter().map(|t| t.velocity.as_slice().to_vec()).collect(),
        spins: solved.twists.iter().map(|t| Dim::<D>::spin_slice(&t.spin).to_vec()).collect(),
    })
}

/// Everything up to the first iteration, but for the right-hand side.
fn prepare<const D: usize>(
    options: &StokesBenchOptions,
) -> anyhow::Result<(Problem<D>, MultigridSolver<D>, SolveTimes)> {
    let formulation = options.formulation();
    let stopwatch = Stopwatch::start();
    let mesh = mesh(options, &options.case.balls_of_the_mesh())?;
    let problem = Problem::new(mesh, &options.case.balls(), VISCOSITY, formulation)?;
    let mut solver = MultigridSolver::default();
    solver.prepare(&problem)?;
    Ok((problem, solver, stopwatch.stop()))
}

/// `n` cells a side everywhere, or where the particles are.
fn mesh<const D: usize>(options: &StokesBenchOptions, balls: &[Ball<D>]) -> Result<TreeMesh<D>, MeshError> {
    let (roots, periodic) = ([1; D], [false; D]);
    if !options.adaptive {
        return TreeMesh::uniform(Aabb::unit(), roots, periodic, options.level());
    }
    let (coarsest, surface) = (COARSEST_LEVEL.min(options.level()), options.level());
    Refinement { coarsest, surface, band: BAND }.mesh(Aabb::unit(), roots, periodic, balls)
}

fn solve<const D: usize>(
    options: &StokesBenchOptions,
    problem: &Problem<D>,
    solver: &mut MultigridSolver<D>,
) -> anyhow::Result<Solved<D>> {
    let lift = problem.lift(&cases::couette);
    let b = problem.right_hand_side(&lift, options.case.force());
    let mut x = parallel::filled(0.0, problem.system.dim());
    let stopwatch = Stopwatch::start();
    let report = solver.solve(&problem.system, &b, &mut x, options.tolerance)?;
    let times = stopwatch.stop();
    let twists = problem.twists(&problem.velocity(&lift, &x))?;
    Ok(Solved { report, times, residual_rel: residual_rel(&problem.system, &b, &x), twists })
}

/// `|b - A x| / |b|`, computed anew.
fn residual_rel<const D: usize>(system: &StokesSystem<D>, b: &[f64], x: &[f64]) -> f64 {
    let mut r = vec![0.0; b.len()];
    SystemOperator::new(system).apply(x, &mut r);
    vector::residual_from_product(b, &mut r);
    vector::norm(&r) / vector::norm(b)
}

/// CPU seconds of one application of the Stokes operator in `f64`.
fn operator_cpu_s<const D: usize>(system: &StokesSystem<D>) -> Option<f64> {
    let mut operator = SystemOperator::new(system);
    let (mut x, mut y) = (vec![0.0; system.dim()], vec![0.0; system.dim()]);
    vector::fill_pseudo_random(1, &mut x);
    operator.apply(&x, &mut y);
    let mut samples: Vec<f64> = (0..OPERATOR_SAMPLES)
        .filter_map(|_| {
            let stopwatch = Stopwatch::start();
            operator.apply(&x, &mut y);
            stopwatch.stop().cpu
        })
        .collect();
    samples.sort_by(f64::total_cmp);
    samples.get(samples.len() / 2).copied()
}

/// What goes on, for somebody who waits at a terminal.
fn progress(options: &StokesBenchOptions, what: &str) {
    if std::io::stderr().is_terminal() {
        eprintln!("{:?}, N = {}: {what}", options.case, options.cells_per_side());
    }
}
