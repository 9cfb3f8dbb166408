//! Forces and torques on bodies: reciprocity, and bodies that are held against bodies that are free.

use gluey_geom::{Aabb, Dim, Spin, Twist, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_stokes::{
    Conditions, FlowSolver, Formulation, GivenOf, Prepared, Problem, SolverKind, StokesError,
};
use nalgebra::DMatrix;

use crate::support::{
    RADIUS, SOLVERS, UNFITTED, bands, couette, doublet, flow_solver, mesh, paper, params, twist_distance,
};

/// Two unequal balls, off the middle of the box and off the lines of the mesh.
fn unequal<const D: usize>() -> [Ball<D>; 2] {
    let at = |x: f64, y: f64| {
        let mut center = Vector::<D>::repeat(0.49);
        (center[0], center[1]) = (x, y);
        center
    };
    [Ball::new(at(0.31, 0.52), 0.15), Ball::new(at(0.64, 0.43), 0.11)]
}

/// A level at which both are resolved.
fn level(dimension: usize) -> u8 {
    if dimension == 2 { 6 } else { 5 }
}

/// Different wrenches on two bodies.
fn wrenches<const D: usize>() -> [Wrench<D>; 2] {
    [0.0, 1.0].map(|body| {
        let mut torque: Spin<D> = Dim::<D>::zero_spin();
        (0..Dim::<D>::ROT).for_each(|k| torque[k] = 0.2 * body - 0.1 * (1 + k) as f64);
        Wrench { force: Vector::from_fn(|d, _| 1.0 - 0.7 * d as f64 - body), torque }
    })
}

/// Largest difference of any force or (over the radius) torque.
fn wrench_distance<const D: usize>(a: &[Wrench<D>], b: &[Wrench<D>]) -> f64 {
    let torques =
        |w: &Wrench<D>| Dim::<D>::spin_slice(&w.torque).iter().fold(0.0, |m: f64, t| m.max(t.abs()));
    let size = |w: Wrench<D>| w.force.amax().max(torques(&w) / RADIUS);
    a.iter().zip(b).map(|(&a, &b)| size(a - b)).fold(0.0, f64::max)
}

/// A solver to this tolerance.
fn solver<const D: usize>(formulation: Formulation, kind: SolverKind, tolerance: f64) -> FlowSolver<D> {
    flow_solver(params(formulation, kind, tolerance))
}

/// The two unequal balls, prepared.
fn prepared<const D: usize>(solver: &mut FlowSolver<D>) -> Prepared<'_, D> {
    let balls = unequal::<D>();
    solver.prepared(mesh(&bands(level(D)), &balls), &balls).unwrap()
}

/// Asserts that a value is at most three times what was measured.
fn small(what: &str, value: f64, measured: f64) {
    assert!(value <= 3.0 * measured, "{what}: {value:e}, was {measured:e}");
}

/// Largest difference from the mirror image, relative to the largest entry.
fn asymmetry(matrix: &DMatrix<f64>) -> f64 {
    (matrix - matrix.transpose()).amax() / matrix.amax()
}

/// Symmetric to the tolerance of the solves (reciprocal theorem), and positive definite (dissipation).
fn mobility_is_reciprocal<const D: usize>(formulation: Formulation, kind: SolverKind, least: f64) {
    let matrix = prepared::<D>(&mut solver(formulation, kind, 1e-10)).mobility().unwrap();
    small("asymmetry of the mobility", asymmetry(&matrix), 1.9e-10);
    let found = matrix.symmetric_eigen().eigenvalues.min();
    small("least eigenvalue", (found / least - 1.0).abs(), 3.5e-6);
}

#[test]
fn the_mobility_is_symmetric_and_positive_definite() {
    for kind in SOLVERS {
        mobility_is_reciprocal::<2>(UNFITTED, kind, 1.38796e-2);
    }
    mobility_is_reciprocal::<2>(paper(1e2, 2), SolverKind::Direct, 1.34657e-2);
    mobility_is_reciprocal::<3>(UNFITTED, SolverKind::Multigrid, 1.20827e-1);
    mobility_is_reciprocal::<3>(paper(1e2, 2), SolverKind::Multigrid, 1.14553e-1);
}

/// Bodies that are held and bodies that are free are solved for in different ways.
fn resistance_inverts_mobility<const D: usize>(kind: SolverKind) {
    let mut solver = solver(UNFITTED, kind, 1e-11);
    let mut prepared = prepared::<D>(&mut solver);
    let (mobility, resistance) = (prepared.mobility().unwrap(), prepared.resistance().unwrap());
    small("asymmetry of the resistance", asymmetry(&resistance), 1.5e-9);
    let identity = DMatrix::identity(mobility.nrows(), mobility.nrows());
    small("resistance times mobility", (&resistance * &mobility - &identity).amax(), 8.8e-8);
    // The check can fail: without the interaction of the bodies it does.
    let mut alone = resistance;
    let rigid = Dim::<D>::RIGID;
    alone.view_mut((0, rigid), (rigid, rigid)).fill(0.0);
    assert!((&alone * &mobility - &identity).amax() > 0.1);
}

#[test]
fn the_resistance_is_the_inverse_of_the_mobility() {
    for kind in SOLVERS {
        resistance_inverts_mobility::<2>(kind);
    }
    resistance_inverts_mobility::<3>(SolverKind::Multigrid);
}

/// A free body beside a held one: held as the free one moves, both need the same forces, and free under these
/// they move alike.
fn a_free_body_beside_a_held_one<const D: usize>(
    formulation: Formulation,
    kind: SolverKind,
    [force, motion]: [f64; 2],
) {
    let mut solver = solver(formulation, kind, 1e-10);
    let mut prepared = prepared::<D>(&mut solver);
    let mut driven = Twist { velocity: Vector::from_fn(|d, _| 0.3 - 0.5 * d as f64), ..Twist::default() };
    driven.spin[Dim::<D>::ROT - 1] = 1.5;
    let given = [GivenOf::Twist(driven), GivenOf::Wrench(wrenches()[1])];
    let flow = prepared.solve(&Conditions::at_rest().with_bodies(&given)).unwrap();
    assert!(twist_distance(&flow.twists[..1], &[driven]) < 1e-14);
    assert_eq!(flow.wrenches[1], wrenches()[1]);
    let held = prepared.solve(&Conditions::at_rest().with_twists(&flow.twists)).unwrap();
    let size = flow.wrenches[0].force.amax();
    small("forces", wrench_distance(&held.wrenches, &flow.wrenches) / size, force);
    let free = prepared.solve(&Conditions::at_rest().with_wrenches(&flow.wrenches)).unwrap();
    small("motions", twist_distance(&free.twists, &flow.twists), motion);
    // Again, after flows with other bodies held; and with the other one held.
    let again = prepared.solve(&Conditions::at_rest().with_bodies(&given)).unwrap();
    assert_eq!(again.twists, flow.twists);
    let other = [GivenOf::Wrench(flow.wrenches[0]), GivenOf::Twist(flow.twists[1])];
    let other = prepared.solve(&Conditions::at_rest().with_bodies(&other)).unwrap();
    small("motions", twist_distance(&other.twists, &flow.twists), motion);
}

#[test]
fn free_bodies_and_held_ones_can_be_mixed() {
    let [direct, multigrid] = SOLVERS;
    a_free_body_beside_a_held_one::<2>(UNFITTED, direct, [2.5e-14, 2e-14]);
    a_free_body_beside_a_held_one::<2>(UNFITTED, multigrid, [5.9e-8, 4.5e-9]);
    a_free_body_beside_a_held_one::<3>(UNFITTED, multigrid, [8.6e-9, 1.1e-8]);
    let mut solver = solver::<2>(UNFITTED, SolverKind::Direct, 1e-10);
    let given = [GivenOf::Twist(Twist::default())];
    let error = prepared::<2>(&mut solver).solve(&Conditions::at_rest().with_bodies(&given)).unwrap_err();
    assert_eq!(error, StokesError::Count { what: "twists", found: 1, bodies: 2 });
}

/// Flows that own their solver are those that borrow one.
#[test]
fn a_solver_may_be_kept_with_its_flows() {
    let (kind, balls) = (SolverKind::Direct, unequal::<2>());
    let refined = || mesh(&bands(level(2)), &balls);
    let mut own = solver::<2>(UNFITTED, kind, 1e-10).into_prepared(refined(), &balls).unwrap();
    let mut lender = solver::<2>(UNFITTED, kind, 1e-10);
    assert_eq!(own.mobility(), prepared::<2>(&mut lender).mobility());
    assert_eq!(own.resistance(), prepared::<2>(&mut lender).resistance());
}

/// One preparation for four flows, in any order, against four solvers.
fn one_preparation_serves_all<const D: usize>(formulation: Formulation, kind: SolverKind) {
    let (balls, wrenches) = (unequal::<D>(), wrenches::<D>());
    let twists = [Twist::default(), Twist { velocity: Vector::repeat(0.3), ..Twist::default() }];
    let gravity = |x: &Vector<D>| Vector::repeat(x[0]);
    let sheared = Conditions::boundary(&couette);
    let free = [
        Conditions::at_rest().with_wrenches(&wrenches),
        sheared.with_wrenches(&wrenches),
        sheared.with_force(Some(&gravity)),
    ];
    let held = (formulation == UNFITTED).then(|| sheared.with_twists(&twists));
    let all: Vec<_> = held.into_iter().chain(free).collect();
    let mut many = solver(formulation, kind, 1e-10);
    let mut prepared = prepared::<D>(&mut many);
    for conditions in all.iter().rev() {
        let together = prepared.solve(conditions).unwrap();
        let mesh = mesh(&bands(level(D)), &balls);
        let alone = solver(formulation, kind, 1e-10).solve_under(mesh, &balls, conditions).unwrap();
        assert_eq!(together.twists, alone.twists, "{formulation:?}, {kind:?}");
        assert_eq!((together.wrenches, together.velocity), (alone.wrenches, alone.velocity));
    }
}

#[test]
fn several_right_hand_sides_are_as_good_as_separate_solves() {
    for formulation in [UNFITTED, paper(1e2, 2)] {
        for kind in SOLVERS {
            one_preparation_serves_all::<2>(formulation, kind);
        }
        one_preparation_serves_all::<3>(formulation, SolverKind::Multigrid);
    }
}

/// Flows add up: shear, forces on the bodies, and both. A held body needs what moves a free one.
fn flows_add_up<const D: usize>(formulation: Formulation, kind: SolverKind) {
    let wrenches = wrenches::<D>();
    let mut solver = solver(formulation, kind, 1e-11);
    let mut prepared = prepared::<D>(&mut solver);
    let sheared = Conditions::boundary(&couette);
    let mut solve = |conditions: Conditions<'_, D>| prepared.solve(&conditions).unwrap();
    let (shear, both) = (solve(sheared), solve(sheared.with_wrenches(&wrenches)));
    let alone = solve(Conditions::at_rest().with_wrenches(&wrenches));
    let sum: Vec<_> = shear.twists.iter().zip(&alone.twists).map(|(&a, &b)| a + b).collect();
    small("superposition", twist_distance(&sum, &both.twists), 3e-10);
    assert!(wrenches.iter().zip(&alone.twists).map(|(w, v)| w.power(v)).sum::<f64>() > 0.1);
    if formulation == UNFITTED {
        let held = solve(sheared.with_twists(&both.twists));
        small("wrenches of held bodies", wrench_distance(&held.wrenches, &wrenches), 2.4e-8);
        let drifting = solve(sheared.with_twists(&shear.twists));
        let none = vec![Wrench::default(); 2];
        small("wrenches on bodies that drift", wrench_distance(&drifting.wrenches, &none), 4.9e-9);
    }
}

#[test]
fn shear_and_forces_add_up() {
    for formulation in [UNFITTED, paper(1e2, 2)] {
        for kind in SOLVERS {
            flows_add_up::<2>(formulation, kind);
        }
        flows_add_up::<3>(formulation, SolverKind::Multigrid);
    }
}

/// The penalised solid takes up the whole force and torque, also where its cells are cut.
fn loads_are_exact<const D: usize>(measured: f64) {
    let (balls, wrenches) = (unequal::<D>(), wrenches::<D>());
    let mesh = mesh(&bands(level(D)), &balls);
    let problem = Problem::new(mesh, &balls, 1.0, paper(1e2, 2)).unwrap();
    let mut b = vec![0.0; problem.system.dim()];
    problem.add_wrenches(&wrenches, &mut b).unwrap();
    let nodes = problem.system.space.nodes();
    for (body, ball) in balls.iter().enumerate() {
        let mut sum = Wrench::<D>::default();
        let is_near = |n: &usize| ball.arm(&nodes.point(*n)).norm() < ball.bounding_radius() + 0.05;
        for n in (0..nodes.node_count()).filter(is_near) {
            let force = Vector::<D>::from_column_slice(&b[n * D..][..D]);
            let torque = Dim::<D>::moment(&ball.arm(&nodes.point(n)), &force);
            sum = sum + Wrench { force, torque };
        }
        small("loads of a wrench", wrench_distance(&[sum], &[wrenches[body]]), measured);
    }
}

#[test]
fn a_penalised_solid_takes_up_all_of_a_wrench() {
    loads_are_exact::<2>(8.3e-15);
    loads_are_exact::<3>(1.8e-13);
}

/// The solvers for held bodies: with a film between them, and with so many that they act as a porous medium.
fn iterations_of_held<const D: usize>(balls: &[Ball<D>], kind: SolverKind) -> usize {
    let mut solver = flow_solver(params(UNFITTED, kind, 1e-8));
    let level = if D == 2 { 7 } else { 5 };
    let mut prepared = solver.prepared(mesh(&bands(level), balls), balls).unwrap();
    let rest = vec![Twist::default(); balls.len()];
    prepared.solve(&Conditions::boundary(&couette).with_twists(&rest)).unwrap().iteration_count
}

#[test]
fn held_bodies_take_few_iterations() {
    let grid = |k: usize| Vector::<2>::new(0.2 + 0.15 * (k % 5) as f64, 0.2 + 0.15 * (k / 5) as f64);
    let crowd: Vec<_> = (0..25).map(|k| Ball::new(grid(k), 0.03 + 0.001 * k as f64)).collect();
    for (balls, measured) in [(doublet(), [1, 21]), (crowd, [1, 48])] {
        let found = SOLVERS.map(|kind| iterations_of_held(&balls, kind));
        assert!(found.iter().zip(measured).all(|(found, measured)| *found <= measured + 4), "{found:?}");
    }
    let spheres = [0.352, 0.648].map(|x| Ball::new(Vector::<3>::new(x, 0.5, 0.49), 0.14));
    let found = iterations_of_held(&spheres, SolverKind::Multigrid);
    assert!(found <= 20 + 2, "{found}");
}

#[test]
fn what_cannot_be_answered_is_refused() {
    let balls = unequal::<2>();
    let fine = || bands(5).mesh(Aabb::unit(), [1; 2], [false; 2], &balls).unwrap();
    let mut solver = solver::<2>(UNFITTED, SolverKind::Direct, 1e-10);
    let mut prepared = solver.prepared(fine(), &balls).unwrap();
    let (one, twist) = ([Wrench::default()], [Twist::default()]);
    let few = prepared.solve(&Conditions::at_rest().with_wrenches(&one)).err().unwrap();
    assert_eq!(few, StokesError::Count { what: "wrenches", found: 1, bodies: 2 });
    assert_eq!(few.to_string(), "1 wrenches for 2 bodies: give one for each");
    let few = prepared.solve(&Conditions::at_rest().with_twists(&twist)).err();
    assert_eq!(few, Some(StokesError::Count { what: "twists", found: 1, bodies: 2 }));
    let mut torn = wrenches::<2>();
    torn[1].torque[0] = f64::NAN;
    assert!(prepared.solve(&Conditions::at_rest().with_wrenches(&torn)).is_err());
    // What failed leaves no trace.
    assert!(prepared.solve(&Conditions::at_rest().with_wrenches(&wrenches())).is_ok());

    let mut solver = self::solver::<2>(paper(1e2, 2), SolverKind::Direct, 1e-10);
    let mut soft = solver.prepared(fine(), &balls).unwrap();
    let flow = soft.solve(&Conditions::boundary(&couette)).unwrap();
    let held = soft.solve(&Conditions::at_rest().with_twists(&flow.twists)).err();
    assert_eq!(held, Some(StokesError::Unsupported { what: "bodies that are held" }));
    assert_eq!(soft.stresslets(&flow).err(), Some(StokesError::Unsupported { what: "stresslets" }));
}
