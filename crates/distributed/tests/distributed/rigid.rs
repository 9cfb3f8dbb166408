//! Rigid bodies whose cells ranks share: their flow and their motions are those of the serial solver, and the
//! same on any number of ranks.

use gluey_distributed::{BoxFlow, LocalFlow, SurfaceBodies, equal_cuts};
use gluey_fem::ImplicitTree;
use gluey_geom::{Aabb, Dim, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::Ranks;
use gluey_stokes::{
    Conditions, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind, StokesError,
};

use crate::support::{is_in_fluid, largest_difference, on_ranks, velocities};

const FLOW: BoxFlow = BoxFlow { viscosity: 1.7, tolerance: 2e-12, max_iterations: 200 };
const FORMULATION: Formulation = Formulation::Unfitted { lubrication: Lubrication::Deficit };

/// Bodies in a box, with fine cells around them.
#[derive(Clone, Copy)]
struct Example<'a> {
    /// Places and radii in the unit box; the third coordinate counts in 3D only.
    bodies: &'a [([f64; 3], f64)],
    refinement: Refinement,
    /// In the first direction.
    is_periodic: bool,
}

/// Finest cells everywhere within two cells of a body.
const fn to_level(coarsest: u8, surface: u8) -> Refinement {
    Refinement { coarsest, surface, band: 2.0 }
}

const ONE_SMALL: Example<'_> =
    Example { bodies: &[([0.2, 0.22, 0.2], 0.09)], refinement: to_level(4, 5), is_periodic: false };
const PAIR: Example<'_> = Example {
    bodies: &[([0.37, 0.45, 0.5], 0.2), ([0.71, 0.62, 0.48], 0.12)],
    refinement: to_level(3, 5),
    is_periodic: false,
};
/// The second lies across the border.
const PERIODIC: Example<'_> = Example {
    bodies: &[([0.4, 0.35, 0.52], 0.14), ([0.98, 0.6, 0.4], 0.16), ([0.5, 0.76, 0.7], 0.1)],
    refinement: to_level(3, 5),
    is_periodic: true,
};

/// A film a tenth of a cell thick.
const TOUCHING: Example<'_> = Example {
    bodies: &[([0.32, 0.45, 0.5], 0.17), ([0.663, 0.47, 0.48], 0.17)],
    refinement: to_level(3, 5),
    is_periodic: false,
};

impl Example<'_> {
    fn balls<const D: usize>(&self) -> Vec<Ball<D>> {
        let period = std::array::from_fn(|d| (self.is_periodic && d == 0).then_some(1.0));
        let place = |x: &[f64; 3]| Vector::<D>::from_fn(|d, _| x[d]);
        self.bodies.iter().map(|(x, radius)| Ball::periodic(place(x), *radius, period)).collect()
    }

    fn periodic<const D: usize>(&self) -> [bool; D] {
        std::array::from_fn(|d| self.is_periodic && d == 0)
    }

    fn wrenches<const D: usize>(&self) -> Vec<Wrench<D>> {
        let wrench = |k: usize| {
            let mut wrench = Wrench::default();
            wrench.force[k % D] = 0.3;
            wrench.torque[0] = 0.02 * (1.0 + k as f64);
            wrench
        };
        (0..self.bodies.len()).map(wrench).collect()
    }

    fn solve<const D: usize>(&self, ranks: &Ranks) -> LocalFlow<D> {
        let (balls, wrenches) = (self.balls(), self.wrenches());
        let tree_of_balls = BallTree::new(&balls);
        let wants =
            |lower: &Vector<D>, h: f64, level: u8| self.refinement.wants(lower, h, level, &tree_of_balls);
        let surface = self.refinement.surface;
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; D], self.periodic(), surface, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        let bodies = SurfaceBodies { balls: &balls, lubrication: Lubrication::Deficit };
        let conditions = Conditions::boundary(&walls).with_wrenches(&wrenches);
        FLOW.solve_around_surfaces(&bodies, &mut tree, &cuts, ranks, &conditions).unwrap()
    }

    /// Velocities and twists of the serial solver, more exact than those of the ranks.
    fn serial<const D: usize>(&self, solver: SolverKind) -> (Vec<Vector<D>>, Vec<Twist<D>>) {
        let (balls, wrenches) = (self.balls(), self.wrenches());
        let mesh = self.refinement.mesh(Aabb::unit(), [1; D], self.periodic(), &balls).unwrap();
        let params =
            FlowParams { viscosity: FLOW.viscosity, formulation: FORMULATION, solver, tolerance: 1e-13 };
        let conditions = Conditions::boundary(&walls).with_wrenches(&wrenches);
        let flow = FlowSolver::<D>::new(params).unwrap().solve_under(mesh, &balls, &conditions).unwrap();
        (flow.velocity.as_chunks::<D>().0.iter().map(|&u| u.into()).collect(), flow.twists)
    }
}

/// Divergence-free, and as much in as out on every mesh.
fn walls<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] * (0.3 + x[D - 1]) - 0.2;
    u
}

/// Velocities and spins, one after the other.
fn motions<const D: usize>(twists: &[Twist<D>]) -> Vec<Vector<D>> {
    let spin = |twist: &Twist<D>| {
        Vector::from_fn(|d, _| Dim::<D>::spin_slice(&twist.spin).get(d).copied().unwrap_or(0.0))
    };
    twists.iter().flat_map(|twist| [twist.velocity, spin(twist)]).collect()
}

fn ranks_move_bodies_as_the_serial_solver_does<const D: usize>(example: Example<'_>, solver: SolverKind) {
    let (balls, (velocity, twists)) = (example.balls::<D>(), example.serial::<D>(solver));
    let alone = example.solve::<D>(&Ranks::alone());
    for size in [1, 2, 3, 4, 8] {
        let run = || on_ranks(size, |ranks| example.solve::<D>(ranks)).unwrap();
        let parts = run();
        let found = velocities(&parts);
        let points: Vec<Vector<D>> = parts.iter().flat_map(LocalFlow::points).collect();
        let [exact, fluid] = [&velocity, &found].map(|all| {
            let in_fluid = all.iter().zip(&points).filter(|(_, x)| is_in_fluid(&balls, x));
            in_fluid.map(|(u, _)| *u).collect::<Vec<_>>()
        });
        let difference = largest_difference(&exact, &fluid);
        let motion = largest_difference(&motions(&twists), &motions(&parts[0].flow.twists));
        println!(
            "{size} ranks: {difference:.1e}, {motion:.1e}, iterations {}",
            parts[0].flow.iteration_count
        );
        assert!(difference < 4.2e-10, "{size} ranks: velocities {difference:e}");
        assert!(motion < 1.4e-9, "{size} ranks: bodies {motion:e}");
        let is_close =
            |part: &LocalFlow<D>| part.flow.iteration_count.abs_diff(alone.flow.iteration_count) <= 1;
        assert!(
            parts.iter().all(is_close),
            "{} {}",
            parts[0].flow.iteration_count,
            alone.flow.iteration_count
        );
        assert!(
            parts.iter().all(|part| part.flow.twists == parts[0].flow.twists),
            "ranks agree on all bodies"
        );
        let again = if size == 1 { vec![alone.clone()] } else { run() };
        assert_eq!(
            (velocities(&again), &again[0].flow.twists),
            (found, &parts[0].flow.twists),
            "the same bits"
        );
    }
}

#[test]
fn ranks_move_bodies_as_the_serial_solver_does_in_2d() {
    for example in [ONE_SMALL, PAIR, PERIODIC, TOUCHING] {
        ranks_move_bodies_as_the_serial_solver_does::<2>(example, SolverKind::Direct);
    }
}

#[test]
fn ranks_move_bodies_as_the_serial_solver_does_in_3d() {
    for example in [ONE_SMALL, PAIR, PERIODIC, TOUCHING] {
        let Refinement { coarsest, surface, .. } = example.refinement;
        let example = Example { refinement: to_level(coarsest - 1, surface - 1), ..example };
        ranks_move_bodies_as_the_serial_solver_does::<3>(example, SolverKind::Multigrid);
    }
}

/// Copies of twists on ranks that do not own the body.
fn ghost_bodies(example: Example<'_>, size: usize) -> usize {
    let parts = on_ranks(size, |ranks| example.solve::<2>(ranks)).unwrap();
    let finest = parts.iter().map(|part| part.levels[part.levels.len() - 1]);
    assert_eq!(finest.clone().map(|level| level.bodies).sum::<usize>(), example.bodies.len());
    finest.map(|level| level.ghost_bodies).sum()
}

#[test]
fn a_body_is_known_to_the_ranks_whose_cells_it_touches() {
    assert_eq!(ghost_bodies(ONE_SMALL, 2), 0, "a body in the first half of the cells");
    assert!(ghost_bodies(PAIR, 8) >= 6);
}

/// What all ranks say.
fn errors(example: Example<'_>, wrenches: &[Wrench<2>]) -> Vec<StokesError> {
    let (balls, wants) = (example.balls::<2>(), |_: &Vector<2>, _: f64, _: u8| true);
    let found = on_ranks(3, |ranks| {
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [false; 2], 3, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        let bodies = SurfaceBodies { balls: &balls, lubrication: Lubrication::Deficit };
        let conditions = Conditions::boundary(&walls).with_wrenches(wrenches);
        FLOW.solve_around_surfaces(&bodies, &mut tree, &cuts, ranks, &conditions).unwrap_err()
    });
    found.unwrap()
}

#[test]
fn all_ranks_refuse_what_cannot_be_computed() {
    let tiny = Example { bodies: &[([0.4, 0.5, 0.5], 0.2), ([0.81, 0.3, 0.5], 0.05)], ..PAIR };
    let (radius, cell_size) = (0.05, 0.125);
    let refused = StokesError::Unresolved { body: 1, radius, cell_size };
    assert_eq!(errors(tiny, &[]), vec![refused; 3]);
    let one = [Wrench::default()];
    assert_eq!(errors(PAIR, &one), vec![StokesError::Count { what: "wrenches", found: 1, bodies: 2 }; 3]);
}
