//! An application of the preconditioner allocates nothing.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_linalg::Preconditioner;
use gluey_stokes::{
    Formulation, Lubrication, MultigridSolver, PaperParams, Problem, Refinement, SaddleSolver, SolveReport,
};
use gluey_testkit::allocation::{CountingAllocator, count_in_all_threads};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Two balls whose cells meet: bodies near each other have the most parts of the preconditioner.
fn problem<const D: usize>(formulation: Formulation) -> Problem<D> {
    let (radius, level) = if D == 2 { (0.1, 6) } else { (0.14, 5) };
    let balls = [-1.0, 1.0].map(|side| {
        let mut centre = Vector::<D>::repeat(0.49);
        centre[0] += side * (radius + 0.005);
        Ball::new(centre, radius)
    });
    let mesh: TreeMesh<D> = Refinement::to_level(level)
        .mesh(Aabb::unit(), [1; D], [false; D], &balls)
        .expect("the unit box is a cube and the levels are few");
    Problem::new(mesh, &balls, 1.0, formulation).expect("the bodies are resolved")
}

fn steady_work_allocates_nothing<const D: usize>(formulation: Formulation) {
    let problem = problem::<D>(formulation);
    let (mut solver, system) = (MultigridSolver::default(), &problem.system);
    solver.prepare(&problem).expect("the system can be inverted");
    let b = problem.right_hand_side(&vec![0.0; system.velocity_dim()], Some(&|x| x.add_scalar(-0.3)));

    let (r, mut z) = (&b[..system.velocity_dim()], vec![0.0; system.velocity_dim()]);
    let cycle = solver.velocity_cycle().expect("the solver is prepared");
    let mut count = || count_in_all_threads(|| cycle.apply(r, &mut z)).1;
    let (first, second) = (count(), count());
    assert!(first > 0, "the counter counts");
    assert_eq!(second, 0, "{D}D, {formulation:?}: a velocity cycle");

    // What a solve sets up does not depend on how often the preconditioner is applied in it.
    let mut x = vec![0.0; b.len()];
    let mut solve = |tolerance| -> (SolveReport, usize) {
        x.fill(0.0);
        count_in_all_threads(|| solver.solve(system, &b, &mut x, tolerance).expect("it converges"))
    };
    let [_, (long, most), (short, least)] = [1e-7, 1e-7, 1e-2].map(&mut solve);
    assert!(long.iterations > short.iterations + 5, "{} and {}", long.iterations, short.iterations);
    assert_eq!(most, least, "{D}D, {formulation:?}: {} and {} iterations", long.iterations, short.iterations);
}

/// In one thread, since other tests and the pool of threads are counted too.
#[test]
fn steady_work_of_the_preconditioner_allocates_nothing() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let film = Formulation::Paper(PaperParams { viscosity_ratio: 1e3, ..PaperParams::default() });
    one.install(|| {
        let unfitted = Formulation::Unfitted { lubrication: Lubrication::Deficit };
        steady_work_allocates_nothing::<2>(unfitted);
        steady_work_allocates_nothing::<2>(film);
        steady_work_allocates_nothing::<3>(unfitted);
        steady_work_allocates_nothing::<3>(film);
    });
}
