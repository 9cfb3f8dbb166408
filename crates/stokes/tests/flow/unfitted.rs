//! The unfitted formulation against the reference data, at walls, across periodic borders, at contact.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Spin, Twist, Vector, Wrench};
use gluey_levelset::{Ball, LevelSet};
use gluey_linalg::{LinOp, vector};
use gluey_stokes::{Conditions, Flow, Problem, Refinement, SolverKind, StokesError, SystemOperator};
use gluey_testkit::reference::{pair_2d_velocities, single_2d_velocities};

use crate::support::{
    RADIUS, UNFITTED, balls, bands, couette, flow_solver, mesh, pair_at, pair_motion, params, solve,
    strain_inside, try_solve, twist_distance,
};

fn flow<const D: usize>(balls: &[Ball<D>], level: u8, solver: SolverKind) -> Flow<D> {
    let refinement = Refinement { band: 3.0, ..bands(level) };
    solve(params(UNFITTED, solver, 1e-9), mesh(&refinement, balls), balls, &couette)
}

/// Shifts of the bodies by parts of a cell, no two of which are reflections of each other.
fn shifts(level: u8) -> impl Iterator<Item = Vector<2>> {
    let h = 0.5f64.powi(level.into());
    (0..8).map(move |k| {
        Vector::<2>::new(0.125 * f64::from(k) - 0.4375, 0.125 * f64::from(3 * k % 8) - 0.46875) * h
    })
}

/// Mean and standard deviation.
fn statistics(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    (mean, square.sqrt())
}

#[test]
fn a_disc_does_not_feel_the_lattice() {
    let table = single_2d_velocities().unwrap();
    let at = |column: &str| table.column(column).unwrap()[1];
    let errors = shifts(6).map(|shift| {
        let twist =
            flow(&balls(&[Vector::<2>::new(at("x") + shift[0], at("y"))]), 6, SolverKind::Direct).twists[0];
        (twist.velocity[0] - at("Ux"), twist.spin[0] - at("omega"))
    });
    let (speeds, spins): (Vec<f64>, Vec<f64>) = errors.unzip();
    let ((speed, scatter), (spin, spin_scatter)) = (statistics(&speeds), statistics(&spins));
    assert!(speed.abs() < 6e-6 && scatter < 2e-6, "{speed:e} +- {scatter:e}");
    assert!(spin.abs() < 4e-5 && spin_scatter < 2e-5, "{spin:e} +- {spin_scatter:e}");
}

/// Error of the normal speed at 135 degrees over the shifts: mean and standard deviation.
fn normal_speed(gap: f64, level: u8) -> (f64, f64) {
    let table = pair_2d_velocities().unwrap();
    let column = |name: &str| table.column(name).unwrap();
    let row = (0..table.row_count())
        .find(|&r| column("xi")[r] == gap && column("theta_deg")[r] == 45.0)
        .expect("the reference has this gap");
    let errors: Vec<f64> = shifts(level)
        .map(|shift| {
            let pair = pair_at(Vector::<2>::repeat(0.5) + shift, gap, 45.0);
            let found = pair_motion(&pair, &flow(&pair, level, SolverKind::Direct).twists);
            found.normal_speed / column("vn")[row] - 1.0
        })
        .collect();
    statistics(&errors)
}

#[test]
fn pairs_approach_as_the_reference_says() {
    for (level, gap, bias, scatter) in
        [(6, 1.0, 2.5e-3, 2e-4), (6, 0.2, 0.12, 0.06), (7, 1.0, 1.5e-4, 3e-5), (7, 0.2, 0.011, 4e-4)]
    {
        let (mean, deviation) = normal_speed(gap, level);
        assert!(mean.abs() < bias && deviation < scatter, "{level} {gap}: {mean:e} +- {deviation:e}");
    }
}

/// Two bodies that share cells.
fn the_operator_is_symmetric<const D: usize>(level: u32) {
    let pair =
        [0.3, 0.58].map(|x| Ball::new(Vector::<D>::from_fn(|d, _| if d == 0 { x } else { 0.4 }), 0.13));
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level as u8).unwrap();
    let problem = Problem::new(mesh, &pair, 1.3, UNFITTED).unwrap();
    let system = &problem.system;
    let mut operator = SystemOperator::new(system);
    let [x, y] = [1, 2].map(|seed| {
        let mut x = vec![0.0; system.dim()];
        vector::fill_pseudo_random(seed, &mut x);
        system.reduce(&mut x);
        x
    });
    let (mut ax, mut ay) = (x.clone(), y.clone());
    operator.apply(&x, &mut ax);
    operator.apply(&y, &mut ay);
    let difference = (vector::dot(&x, &ay) - vector::dot(&y, &ax)).abs();
    let scale = vector::norm(&x) * vector::norm(&ay);
    assert!(difference < 1e-14 * scale, "{D}D: {difference:e} of {scale:e}");
}

#[test]
fn the_operator_is_symmetric_to_round_off() {
    the_operator_is_symmetric::<2>(5);
    the_operator_is_symmetric::<3>(4);
}

/// Both solvers, on meshes of every kind and bodies in every place.
fn solvers_agree<const D: usize>(balls: &[Ball<D>], mesh: &dyn Fn() -> TreeMesh<D>, tolerance: f64) {
    let twists = |solver| solve(params(UNFITTED, solver, 1e-9), mesh(), balls, &couette).twists;
    let [direct, multigrid]: [Vec<Twist<D>>; 2] = [SolverKind::Direct, SolverKind::Multigrid].map(twists);
    let distance = twist_distance(&direct, &multigrid);
    assert!(distance < tolerance, "{distance:e}");
}

#[test]
fn both_solvers_give_the_same_motion() {
    let pair = pair_at(Vector::<2>::new(0.5, 0.51), 0.05, 30.0);
    solvers_agree(&pair, &|| mesh(&bands(6), &pair), 3e-7);
    let sphere = [Ball::new(Vector::<3>::new(0.47, 0.55, 0.5), 0.2)];
    let coarse = Refinement { coarsest: 2, ..bands(3) };
    solvers_agree(&sphere, &|| mesh(&coarse, &sphere), 3e-7);
}

/// A body across a periodic border moves as one in the middle does.
fn the_border_is_not_felt<const D: usize>(level: u8, solver: SolverKind) {
    let mut periodic = [true; D];
    periodic[1] = false;
    let period = periodic.map(|is_periodic| is_periodic.then_some(1.0));
    let motion = |x: f64| {
        let center = Vector::<D>::from_fn(|d, _| if d == 1 { 0.4 } else { x });
        let ball = [Ball::periodic(center, 0.2, period)];
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], periodic, level).unwrap();
        solve(params(UNFITTED, solver, 1e-9), mesh, &ball, &couette).twists
    };
    let distance = twist_distance(&motion(0.5), &motion(0.0));
    assert!(distance < 1e-7, "{distance:e}");
}

#[test]
fn periodic_borders_are_not_felt() {
    the_border_is_not_felt::<2>(5, SolverKind::Direct);
    the_border_is_not_felt::<3>(3, SolverKind::Multigrid);
}

/// Bodies that touch, overlap by rounding, or lean on a wall have a flow, and move with it. The mesh does not
/// see the film between them: they approach at a few thousandths of a radius whatever the gap.
#[test]
fn bodies_may_touch_each_other_and_walls() {
    for gap in [1e-9, 0.0, -1e-12] {
        let pair = pair_at(Vector::<2>::new(0.5, 0.5), gap, 45.0);
        let motion = pair_motion(&pair, &flow(&pair, 6, SolverKind::Direct).twists);
        assert!(motion.normal_speed.abs() < 0.015 * RADIUS, "{gap:e}: {motion:?}");
        assert!(motion.line_rotation < -0.3 && motion.line_rotation > -0.7, "{gap:e}: {motion:?}");
    }
    for gap in [1e-3, 1e-9, 0.0] {
        let disc = balls(&[Vector::<2>::new(0.5, (1.0 + gap) * RADIUS)]);
        let twist = flow(&disc, 6, SolverKind::Direct).twists[0];
        // The wall moves at -1/2.
        assert!(twist.velocity[0] < -0.45 && twist.velocity[1].abs() < 8e-5, "{gap:e}: {twist:?}");
    }
    let spheres: Vec<Ball<3>> =
        [-1.0, 1.0].iter().map(|s| Ball::new(Vector::<3>::new(0.5 + s * 0.15, 0.5, 0.5), 0.15)).collect();
    let twists = flow(&spheres, 4, SolverKind::Multigrid).twists;
    assert!((twists[0].velocity - twists[1].velocity)[0].abs() < 1e-3, "{twists:?}");
}

#[test]
fn surfaces_that_meet_cells_of_different_sizes_are_refused() {
    let disc = balls(&[Vector::<2>::new(0.5, 0.5)]);
    let mesh =
        TreeMesh::refine(Aabb::unit(), [1; 2], [false; 2], 7, |lower, _, level| level < 6 || lower[0] > 0.5)
            .unwrap();
    let refused = try_solve(params(UNFITTED, SolverKind::Direct, 1e-6), mesh, &disc, &couette);
    let error = refused.unwrap_err();
    assert!(matches!(error, StokesError::CoarseSurface { body: 0 }), "{error:?}");
    assert!(error.to_string().contains("the surface of body 1 meets cells of different sizes"));
}

/// The flow continues beyond surfaces; bodies are drawn as they move.
fn bodies_are_rigid_in_pictures<const D: usize>(level: u8, kind: SolverKind) {
    let ball = [Ball::new(Vector::<D>::from_fn(|d, _| 0.47 + 0.06 * d as f64), 0.21)];
    let flow = flow(&ball, level, kind);
    let drawn = Flow { velocity: flow.velocity_with_bodies(&ball), ..flow.clone() };
    let [before, after] = [&flow, &drawn].map(|flow| strain_inside(flow, &ball, 0.0));
    assert!(before > 1e-3 && after < 1e-14, "{before:e} {after:e}");
    let nodes = &flow.discretisation.velocity;
    let is_fluid = |n: &usize| ball[0].value(&nodes.point(*n)) < 0.0;
    let same = |n: usize| drawn.velocity[n * D..][..D] == flow.velocity[n * D..][..D];
    assert!((0..nodes.node_count()).filter(is_fluid).all(same));
}

#[test]
fn bodies_are_rigid_where_a_flow_is_drawn() {
    bodies_are_rigid_in_pictures::<2>(5, SolverKind::Direct);
    bodies_are_rigid_in_pictures::<3>(4, SolverKind::Multigrid);
}

/// Bodies of which two have a thin film between them and one a thin film at the wall.
fn crowd<const D: usize>() -> Vec<Ball<D>> {
    let at = |x: f64, y: f64| Vector::<D>::from_fn(|d, _| if d == 1 { y } else { x });
    let mut apart = at(0.3, 0.6);
    apart[0] += 0.302;
    [at(0.3, 0.6), apart, at(0.55, 0.16)].map(|center| Ball::new(center, 0.15)).to_vec()
}

/// The flow around free bodies in a box at rest.
fn at_rest<const D: usize>(
    level: u8,
    force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>,
    wrenches: &[Wrench<D>],
) -> Vec<Twist<D>> {
    let kind = if D == 2 { SolverKind::Direct } else { SolverKind::Multigrid };
    let conditions = Conditions::at_rest().with_force(force).with_wrenches(wrenches);
    let bodies = crowd::<D>();
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
    let mut solver = flow_solver(params(UNFITTED, kind, 1e-10));
    solver.solve_under(mesh, &bodies, &conditions).unwrap().twists
}

/// A pressure balances a force with a potential: to rounding where the potential is linear, to the error of
/// the pressure where it is quadratic. The same force along one axis that grows along the other stirs.
fn a_pressure_balances<const D: usize>(level: u8, [linear, quadratic]: [f64; 2]) {
    let rest = vec![Twist::default(); 3];
    let distance =
        |force: &dyn Fn(&Vector<D>) -> Vector<D>| twist_distance(&at_rest(level, Some(force), &[]), &rest);
    let along = |f: f64| Vector::<D>::from_fn(|d, _| if d == 0 { f } else { 0.0 });
    let uniform = distance(&|_| Vector::<D>::from_fn(|d, _| 1.0 - 0.4 * d as f64));
    assert!(uniform < linear, "{D}D: {uniform:e}");
    let growing = distance(&|x| along(x[0]));
    assert!(growing < quadratic, "{D}D: {growing:e}");
    let stirred = distance(&|x| along(x[1]));
    assert!(stirred > 100.0 * growing, "{D}D: {stirred:e} {growing:e}");
}

#[test]
fn nothing_moves_under_a_force_with_a_potential() {
    a_pressure_balances::<2>(5, [1e-12, 1e-5]);
    a_pressure_balances::<3>(4, [1e-9, 1e-4]);
}

/// Weight sinks alike with and without buoyancy.
#[test]
fn a_uniform_force_adds_nothing_to_wrenches() {
    let wrench = |f: f64| Wrench { force: Vector::<2>::new(f, -1.0), torque: Spin::<2>::new(0.1 * f) };
    let wrenches = [0.2, -0.3, 0.1].map(wrench);
    let buoyed = at_rest::<2>(5, Some(&|_| Vector::<2>::new(0.3, 1.0)), &wrenches);
    let distance = twist_distance(&buoyed, &at_rest::<2>(5, None, &wrenches));
    assert!(distance < 1e-12 && buoyed[0].velocity.norm() > 1e-3, "{distance:e} {buoyed:?}");
}

/// What holds bodies at rest is the opposite of the force on the fluid and them, as far as walls do not carry
/// it: all of it between periodic borders.
fn holding_takes_the_whole_force<const D: usize>(level: u8, kind: SolverKind) {
    let ball = Ball::periodic(Vector::<D>::repeat(0.1), 0.3, [Some(1.0); D]);
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [true; D], level).unwrap();
    let force = |_: &Vector<D>| Vector::<D>::from_fn(|d, _| 1.0 - 0.4 * d as f64);
    let still = [Twist::default()];
    let conditions = Conditions::at_rest().with_force(Some(&force)).with_twists(&still);
    let mut solver = flow_solver(params(UNFITTED, kind, 1e-10));
    let held = solver.solve_under(mesh, &[ball], &conditions).unwrap().wrenches[0];
    assert!((held.force + force(&Vector::zeros())).norm() < 1e-8, "{held:?}");
}

#[test]
fn a_body_that_is_held_carries_the_force_on_a_periodic_box() {
    holding_takes_the_whole_force::<2>(4, SolverKind::Direct);
    holding_takes_the_whole_force::<2>(4, SolverKind::Multigrid);
    holding_takes_the_whole_force::<3>(4, SolverKind::Multigrid);
}
