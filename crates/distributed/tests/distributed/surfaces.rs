//! Bodies whose surfaces cut the mesh: flows on ranks beside those of the serial solver of `unfitted`, at its
//! tolerance and in as many iterations.

use gluey_distributed::{BoxFlow, LocalFlow, SurfaceBodies, equal_cuts};
use gluey_fem::ImplicitTree;
use gluey_geom::{Aabb, Dim, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::Ranks;
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, Formulation, GivenOf, Lubrication, Refinement, SolverKind,
};

use crate::support::{is_in_fluid, on_ranks, velocities};

/// Ten times less than what ranks may differ by: the weights of the pressures of a part lack what distant
/// cells add at hanging nodes, so that its iterates are others, each as good.
const TOLERANCE: f64 = 1e-12;
/// What ranks may differ by in 2D, with hanging nodes.
const LIMIT: f64 = 1e-11;
/// What one rank may differ from one process by: only pressures lose their mean, of which wrenches are
/// sums.
const ALONE: f64 = 1.4e-15;

/// What drives a flow beside the walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drive {
    /// Forces and torques on the bodies.
    Wrenches,
    /// These, and a force on fluid and bodies.
    Force,
    /// The motion of the first body, the others are free under forces and torques.
    Motion,
    /// The same in a box without walls, where nothing flows on the mean.
    MotionWithoutMean,
}

/// Bodies in a shear flow.
struct Example<const D: usize> {
    bodies: Vec<(Vector<D>, f64)>,
    /// Levels of the cells away from bodies and at them.
    levels: [u8; 2],
    /// In the first direction.
    is_periodic: bool,
    lubrication: Lubrication,
    drive: Drive,
}

impl<const D: usize> Example<D> {
    fn refinement(&self) -> Refinement {
        let [coarsest, surface] = self.levels;
        Refinement { coarsest, surface, band: 2.0 }
    }

    fn balls(&self) -> Vec<Ball<D>> {
        let period = self.periodic().map(|is_periodic| is_periodic.then_some(1.0));
        self.bodies.iter().map(|&(center, radius)| Ball::periodic(center, radius, period)).collect()
    }

    fn periodic(&self) -> [bool; D] {
        let has_walls = self.drive != Drive::MotionWithoutMean;
        std::array::from_fn(|d| !has_walls || self.is_periodic && d == 0)
    }

    /// The same flow with what drives it.
    fn under<T>(&self, solve: impl FnOnce(&Conditions<'_, D>) -> T) -> T {
        let wrenches = self.wrenches();
        let mut motion = Twist { velocity: Vector::from_fn(|d, _| [0.3, -0.2, 0.1][d]), ..Twist::default() };
        motion.spin[0] = 0.4;
        let given = |k: usize| if k == 0 { GivenOf::Twist(motion) } else { GivenOf::Wrench(wrenches[k]) };
        let given: Vec<GivenOf<D>> = (0..wrenches.len()).map(given).collect();
        let force = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { 2.0 + x[1] } else { 0.5 });
        let conditions = Conditions::boundary(&shear).with_wrenches(&wrenches);
        match self.drive {
            Drive::Wrenches => solve(&conditions),
            Drive::Force => solve(&conditions.with_force(Some(&force))),
            Drive::Motion => solve(&Conditions::boundary(&shear).with_bodies(&given)),
            Drive::MotionWithoutMean => solve(&Conditions::at_rest().with_bodies(&given).without_mean_flow()),
        }
    }

    fn wrenches(&self) -> Vec<Wrench<D>> {
        let wrench = |k: usize| {
            let mut wrench = Wrench::default();
            wrench.force[k % D] = 0.1;
            wrench.torque[0] = 0.004 * (1.0 + k as f64);
            wrench
        };
        (0..self.bodies.len()).map(wrench).collect()
    }

    fn solve(&self, ranks: &Ranks) -> LocalFlow<D> {
        let (balls, refinement) = (self.balls(), self.refinement());
        let tree_of_balls = BallTree::new(&balls);
        let wants = |lower: &Vector<D>, h: f64, level: u8| refinement.wants(lower, h, level, &tree_of_balls);
        let deepest = refinement.surface;
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; D], self.periodic(), deepest, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        let bodies = SurfaceBodies { balls: &balls, lubrication: self.lubrication };
        let flow = BoxFlow { viscosity: 1.7, tolerance: TOLERANCE, max_iterations: 300 };
        self.under(|conditions| {
            flow.solve_around_surfaces(&bodies, &mut tree, &cuts, ranks, conditions).unwrap()
        })
    }

    fn serial(&self) -> Flow<D> {
        let balls = self.balls();
        let mesh = self.refinement().mesh(Aabb::unit(), [1; D], self.periodic(), &balls).unwrap();
        let formulation = Formulation::Unfitted { lubrication: self.lubrication };
        let params =
            FlowParams { viscosity: 1.7, formulation, solver: SolverKind::Multigrid, tolerance: TOLERANCE };
        let mut solver = FlowSolver::<D>::new(params).unwrap();
        self.under(|conditions| solver.solve_under(mesh, &balls, conditions).unwrap())
    }

    /// Velocities of the fluid and twists are those of the serial solver on these numbers of ranks but for a
    /// limit, in as many iterations, within one, and the same bits run after run.
    fn check(&self, sizes: &[usize], limit: f64) {
        self.check_within(sizes, limit, 0);
    }

    /// The same with more iterations, or fewer, on several ranks.
    fn check_within(&self, sizes: &[usize], limit: f64, slack: usize) {
        let (serial, balls) = (self.serial(), self.balls());
        let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x) };
        let scale = serial.velocity.iter().copied().map(f64::abs).fold(0.0, largest);
        for &size in sizes {
            let run = || on_ranks(size, |ranks| self.solve(ranks)).unwrap();
            let parts = run();
            let velocity = velocities(&parts);
            assert_eq!(velocity.len() * D, serial.velocity.len());
            let pairs = velocity.iter().zip(serial.velocity.as_chunks::<D>().0);
            let points = parts.iter().flat_map(LocalFlow::points);
            let in_fluid = pairs.zip(points).filter(|pair| is_in_fluid(&balls, &pair.1));
            let differences = in_fluid.map(|((a, &b), _)| (a - Vector::from(b)).norm() / scale);
            let difference = differences.fold(0.0, largest);
            let twists = parts[0].flow.twists.iter().zip(&serial.twists);
            let of_twists = twists.map(|(a, b)| distance(a, b)).fold(0.0, largest);
            let iterations = [parts[0].flow.iteration_count, serial.iteration_count];
            let of_wrenches = self.largest_wrench_difference(&parts[0].flow, &serial);
            println!(
                "{size} ranks: {difference:.1e}, twists {of_twists:.1e}, wrenches {of_wrenches:.1e}, iterations {iterations:?}"
            );
            assert!(difference < limit && of_twists < limit, "{size} ranks: {difference:e} {of_twists:e}");
            assert!(of_wrenches < limit, "{size} ranks: {of_wrenches:e}");
            assert!(
                size > 1 || difference.max(of_twists).max(of_wrenches) < ALONE,
                "one rank is one process"
            );
            let solves = parts[0].flow.solve_count;
            assert_eq!(solves, serial.solve_count, "{size} ranks");
            assert!(iterations[0].abs_diff(iterations[1]) <= solves + slack, "{size} ranks: {iterations:?}");
            let again = run();
            assert_eq!(
                (velocities(&again), &again[0].flow.twists),
                (velocity, &parts[0].flow.twists),
                "the same bits"
            );
        }
    }

    /// Forces and torques on bodies, mean velocity and mean force beside those of the serial solver, over the
    /// largest force.
    fn largest_wrench_difference(&self, part: &Flow<D>, serial: &Flow<D>) -> f64 {
        assert_eq!(part.mean_velocity.is_some(), serial.mean_velocity.is_some());
        let mean = part.mean_velocity.zip(serial.mean_velocity).map_or(0.0, |(a, b)| (a - b).norm());
        let scale = serial.wrenches.iter().map(|wrench| wrench.force.norm()).fold(0.0, f64::max);
        let force = (part.mean_force - serial.mean_force).norm() / scale.max(serial.mean_force.norm());
        let wrenches = part.wrenches.iter().zip(&serial.wrenches);
        let differences = wrenches.map(|(a, b)| {
            let torques = Dim::<D>::spin_slice(&a.torque).iter().zip(Dim::<D>::spin_slice(&b.torque));
            let torque = torques.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            (a.force - b.force).norm().max(torque) / scale
        });
        differences.fold(mean.max(force), |m, x| if x.is_nan() { f64::NAN } else { m.max(x) })
    }
}

fn shear<const D: usize>(x: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 })
}

fn distance<const D: usize>(a: &Twist<D>, b: &Twist<D>) -> f64 {
    let spins = Dim::<D>::spin_slice(&a.spin).iter().zip(Dim::<D>::spin_slice(&b.spin));
    let spins = spins.map(|(a, b)| (a - b).abs());
    spins.chain([(a.velocity - b.velocity).norm()]).fold(0.0, f64::max)
}

/// Two bodies of different radii with this gap over the first one's, and a third across the border.
fn three<const D: usize>(gap: f64, levels: [u8; 2], lubrication: Lubrication) -> Example<D> {
    let [a, b] = [0.13, 0.1];
    let first = Vector::<D>::from_fn(|d, _| [0.37, 0.46, 0.52][d]);
    let normal = Vector::<D>::from_fn(|d, _| [0.8, 0.55, 0.24][d]).normalize();
    let second = first + normal * (a + b + gap * a);
    let third = Vector::<D>::from_fn(|d, _| [0.98, 0.25, 0.4][d]);
    let bodies = vec![(first, a), (second, b), (third, 0.12)];
    Example { bodies, levels, is_periodic: true, lubrication, drive: Drive::Wrenches }
}

/// Fifty spheres at random, some of which nearly touch, in a box with walls.
fn fifty(levels: [u8; 2], lubrication: Lubrication) -> Example<3> {
    let radius = 0.08;
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    let mut bodies: Vec<(Vector<3>, f64)> = Vec::new();
    while bodies.len() < 50 {
        let center = Vector::<3>::from_fn(|_, _| 1.02 * radius + (1.0 - 2.04 * radius) * next());
        if bodies.iter().all(|(other, _)| (other - center).norm() > 2.005 * radius) {
            bodies.push((center, radius));
        }
    }
    Example { bodies, levels, is_periodic: false, lubrication, drive: Drive::Wrenches }
}

#[test]
fn bodies_apart_move_as_in_the_serial_solver() {
    three::<2>(0.5, [4, 5], Lubrication::None).check(&[1, 2, 3, 4, 8], LIMIT);
    three::<3>(0.5, [3, 4], Lubrication::None).check(&[1, 2, 3, 8], 1e-12);
}

#[test]
fn films_are_those_of_the_serial_solver() {
    for gap in [0.3, 0.02, 1e-4] {
        three::<2>(gap, [4, 5], Lubrication::Deficit).check(&[1, 2, 3, 4, 8], LIMIT);
        three::<3>(gap, [3, 4], Lubrication::Deficit).check(&[1, 2, 3, 8], 8e-13);
    }
}

#[test]
fn fifty_spheres_move_as_in_the_serial_solver() {
    // Blocks inside of spheres on two ranks are in two pieces: other iterates, 54 of them in place of 49,
    // which end at the same tolerance.
    fifty([3, 4], Lubrication::Deficit).check_within(&[3], 3.2e-10, 8);
}

/// A force on the fluid, a body that is driven, and one in a box without walls where nothing flows on the
/// mean.
#[test]
fn forces_on_the_fluid_and_given_motions_are_those_of_the_serial_solver() {
    for drive in [Drive::Force, Drive::Motion, Drive::MotionWithoutMean] {
        let flat = three::<2>(0.1, [4, 5], Lubrication::Deficit);
        Example { drive, ..flat }.check(&[1, 2, 5], LIMIT);
        let solid = three::<3>(0.1, [3, 4], Lubrication::Deficit);
        Example { drive, ..solid }.check(&[1, 3], 1e-12);
    }
}
