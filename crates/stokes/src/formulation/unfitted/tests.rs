//! Bodies cut flat.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Vector};
use gluey_levelset::Body;
use gluey_linalg::LinOp;

use super::*;
use crate::operator::SystemOperator;
use crate::solver::{DirectSolver, SaddleSolver};
use crate::surface::Flat;

/// One body in the unit box.
struct Case<const D: usize> {
    level: u8,
    ball: Ball<D>,
    flats: Flats<D>,
}

/// What is found.
struct Found<const D: usize> {
    problem: Problem<D>,
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    twist: Twist<D>,
}

impl<const D: usize> Case<D> {
    /// A body of this radius, with flats given by directions and distances in radii.
    fn new(level: u8, center: Vector<D>, radius: f64, flats: &[(Vector<D>, f64)]) -> Self {
        let flat = |&(normal, share): &(Vector<D>, f64)| Flat {
            normal: normal.normalize(),
            distance: share * radius,
        };
        let flats = [flats.iter().map(flat).collect::<Vec<_>>()].into_iter().collect();
        Self { level, ball: Ball::new(center, radius), flats }
    }

    fn discretisation(&self) -> Discretisation<D> {
        let periodic = self.ball.period().map(|period| period.is_some());
        Discretisation::new(TreeMesh::uniform(Aabb::unit(), [1; D], periodic, self.level).unwrap())
    }

    fn problem(&self) -> Problem<D> {
        let bodies = [self.ball];
        let system =
            around(&self.discretisation(), &bodies, &self.flats, 1.0, &PenaltyFactor::new(PENALTY)).unwrap();
        let (bodies, all_bodies) = (bodies.to_vec(), bodies.to_vec());
        Problem { system, bodies, all_bodies, rigidity: Arc::new(Unfitted::new(Lubrication::None)) }
    }

    /// The flow with these values on the boundary.
    fn solve(&self, boundary: impl Fn(&Vector<D>) -> Vector<D>) -> Found<D> {
        let problem = self.problem();
        let is_border = |x: &Vector<D>| x.iter().any(|&x| x == 0.0 || x == 1.0);
        let start = |x: &Vector<D>| if is_border(x) { boundary(x) } else { Vector::zeros() };
        let lift = problem.lift(&start);
        let b = problem.right_hand_side(&lift, None);
        let mut x = vec![0.0; problem.system.dim()];
        let mut solver = DirectSolver::default();
        solver.prepare(&problem).unwrap();
        solver.solve(&problem.system, &b, &mut x, 1e-13).unwrap();
        let (velocity, pressure) = (problem.velocity(&lift, &x), problem.pressure(&x));
        let twist = problem.twists(&velocity).unwrap()[0];
        Found { problem, velocity, pressure, twist }
    }
}

fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 })
}

fn spin<const D: usize>(twist: &Twist<D>) -> f64 {
    Dim::<D>::spin_slice(&twist.spin)[Dim::<D>::ROT - 1]
}

/// Largest component of a difference of motions.
fn distance<const D: usize>(a: &Twist<D>, b: &Twist<D>) -> f64 {
    let difference = *a - *b;
    let spins = Dim::<D>::spin_slice(&difference.spin).iter().map(|s| s.abs());
    spins.fold(difference.velocity.amax(), f64::max)
}

/// Mesh levels, centres and flats in general position, two of which meet in the body.
fn general<const D: usize>() -> Case<D> {
    let center = Vector::from_fn(|d, _| 0.5 + [0.017, -0.024, 0.031][d]);
    let arm = |x: [f64; 3]| Vector::<D>::from_fn(|d, _| x[d]);
    let flats = [(arm([0.9, 0.2, -0.3]), 0.7), (arm([0.5, 0.8, 0.2]), 0.75), (arm([-0.1, -1.0, 0.1]), 0.8)];
    Case::new(if D == 2 { 5 } else { 3 }, center, if D == 2 { 0.2 } else { 0.3 }, &flats)
}

/// A body in a fluid that moves like a solid moves with it, whatever its shape.
fn a_rigid_motion_is_found<const D: usize>() {
    let case = general::<D>();
    let mut motion =
        Twist::<D> { velocity: Vector::from_fn(|d, _| 0.3 - 0.2 * d as f64), ..Twist::default() };
    let rotation = |x: &Vector<D>| Vector::<D>::from_fn(|d, _| [-x[1], x[0], 0.0][d]);
    let arm = |x: &Vector<D>| x - case.ball.center();
    let axis = |axis: usize| Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
    motion.spin += Dim::<D>::moment(&axis(0), &axis(1));
    let exact = |x: &Vector<D>| motion.velocity + rotation(&arm(x));
    let found = case.solve(exact);
    assert!(distance(&found.twist, &motion) < 1e-9, "{D}D: {:?}", found.twist);
    let (space, nodes) = (&found.problem.system.space, &found.problem.discretisation().velocity);
    for n in (0..nodes.node_count()).filter(|&n| space.is_free(n)) {
        let u = Vector::<D>::from_column_slice(&found.velocity[n * D..][..D]);
        assert!((u - exact(&nodes.point(n))).amax() < 1e-9);
    }
    let wrench = found.problem.wrenches(&found.velocity, &found.pressure, None, &Matrix::zeros()).unwrap()[0];
    assert!(wrench.force.amax() < 1e-9, "{D}D: {wrench:?}");
}

#[test]
fn truncated_bodies_move_with_a_fluid_that_moves_like_a_solid() {
    a_rigid_motion_is_found::<2>();
    a_rigid_motion_is_found::<3>();
}

/// Constant pressures push no body, since its surface is closed.
fn constants_are_in_the_kernel<const D: usize>() {
    let problem = general::<D>().problem();
    let system = &problem.system;
    let mut x = vec![0.0f64; system.dim()];
    for q in (0..system.pressure.dim()).filter(|&q| system.pressure.is_free(q)) {
        x[system.velocity_dim() + q] = 1.0;
    }
    let mut y = vec![0.0f64; system.dim()];
    SystemOperator::new(system).apply(&x, &mut y);
    let worst = y.iter().fold(0.0, |m: f64, y| m.max(y.abs()));
    assert!(worst < 1e-9, "{D}D: {worst:e}");
}

#[test]
fn constant_pressures_do_no_work_on_truncated_bodies() {
    constants_are_in_the_kernel::<2>();
    constants_are_in_the_kernel::<3>();
}

/// Mirror images of a body and a shear move as mirror images.
fn symmetries_hold<const D: usize>() {
    let case = general::<D>();
    let twist = case.solve(couette).twist;
    for mirrors in 1..1 << D {
        let sides = Vector::<D>::from_fn(|d, _| if mirrors >> d & 1 == 1 { -1.0 } else { 1.0 });
        let middle = Vector::repeat(0.5);
        let center = middle + (case.ball.center() - middle).component_mul(&sides);
        let flat = |flat: &Flat<D>| Flat { normal: flat.normal.component_mul(&sides), ..*flat };
        let flats = [case.flats.of(0).iter().map(flat).collect::<Vec<_>>()].into_iter().collect();
        let ball = Ball::new(center, case.ball.bounding_radius());
        let image = Case { ball, flats, ..case }.solve(couette).twist;
        // The image of the shear is the shear or its opposite; spins are axial vectors.
        let shear = sides[0] * sides[1];
        let velocity = twist.velocity.component_mul(&sides) * shear;
        let mut error = (image.velocity - velocity).amax();
        let [spin, expected] = [&image.spin, &twist.spin].map(Dim::<D>::spin_slice);
        for (k, (spin, expected)) in spin.iter().zip(expected).enumerate() {
            let axial = if D == 2 { sides.product() } else { sides.product() * sides[k] };
            error = error.max((spin - axial * shear * expected).abs());
        }
        assert!(error < 1e-9, "{D}D, {sides:?}: {error:e}");
    }
    let plain = Case { flats: Flats::none(1), ..case }.solve(couette).twist;
    let ratio = spin(&twist) / spin(&plain);
    assert!((0.7..1.3).contains(&ratio) && (ratio - 1.0).abs() > 1e-3, "{D}D: {ratio}");
}

#[test]
fn truncated_bodies_keep_the_symmetries_of_a_shear() {
    symmetries_hold::<2>();
    symmetries_hold::<3>();
}

/// Planes beyond the ball change no bit.
fn far_planes_change_nothing<const D: usize>() {
    let mut case = general::<D>();
    let discretisation = case.discretisation();
    let cut = |flats: &Flats<D>| CutCells::new(&discretisation, &[case.ball], flats);
    let plain = cut(&Flats::none(1));
    let is_plain = |other: CutCells<D>| {
        other.states == plain.states
            && other.cells.iter().map(|c| &c.moments).eq(plain.cells.iter().map(|c| &c.moments))
    };
    assert!(!is_plain(cut(&case.flats)));
    case.flats = Case::new(case.level, *case.ball.center(), 0.3, &[(Vector::repeat(1.0), 1.0)]).flats;
    assert!(is_plain(cut(&case.flats)));
}

#[test]
fn planes_beyond_a_body_change_no_bit() {
    far_planes_change_nothing::<2>();
    far_planes_change_nothing::<3>();
}

/// A flat on faces of cells is as one a little beside them.
#[test]
fn flats_may_lie_on_faces_of_cells() {
    let h = 0.5f64.powi(5);
    let spin = |distance: f64| {
        let normals = [Vector::<2>::x(), -Vector::<2>::x(), Vector::<2>::y()];
        let flats = normals.map(|n| (n, distance / 0.2));
        spin(&Case::new(5, Vector::repeat(0.5), 0.2, &flats).solve(couette).twist)
    };
    let on = spin(5.0 * h);
    for beside in [1e-4, -1e-4, 1e-10, -1e-10, 1e-15, -1e-15] {
        let difference = on - spin((5.0 + beside) * h);
        assert!(difference.abs() < 1e-4, "{beside:e}: {difference:e}");
    }
}

/// Nor is the border of a periodic box felt.
#[test]
fn truncated_bodies_may_lie_across_a_periodic_border() {
    let motion = |x: f64| {
        let case = general::<2>();
        let ball = Ball::periodic(Vector::<2>::new(x, 0.4), 0.2, [Some(1.0), None]);
        let is_wall = |x: &Vector<2>| if x[1] == 0.0 || x[1] == 1.0 { couette(x) } else { Vector::zeros() };
        Case { ball, ..case }.solve(is_wall).twist
    };
    assert!(distance(&motion(0.5), &motion(0.0)) < 1e-9);
}

/// Largest penalty around two touching bodies with a slab of this width in cells between them.
fn penalty_around_slab<const D: usize>(
    level: u8,
    [middle, normal]: [Vector<D>; 2],
    radius: f64,
    width: f64,
) -> Result<f64, StokesError> {
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
    let bodies = [-1.0, 1.0].map(|side| Ball::new(middle + normal * (side * radius), radius));
    let distance = radius - 0.5 * width * mesh.size(level);
    let flats = [1.0, -1.0].map(|side| Some(Flat { normal: normal * side, distance }));
    let system = around(
        &Discretisation::new(mesh),
        &bodies,
        &flats.into_iter().collect(),
        1.0,
        &PenaltyFactor::new(PENALTY),
    )?;
    let surfaces = system.surfaces().unwrap();
    Ok((0..surfaces.cut.cells.len()).map(|place| surfaces.penalty(place)).fold(0.0, f64::max))
}

/// All cells in the slab between flats that face each other have roots and moderate eigenvalues, whatever its
/// direction: 95 is the largest.
fn slabs_are_resolved<const D: usize>(level: u8, radius: f64, count: usize) {
    for k in 0..count {
        let (x, cell) = (k as f64, 0.5f64.powi(level.into()));
        let normal = Vector::<D>::from_fn(|d, _| [(0.7 * x).cos(), (0.7 * x).sin(), 0.8 - 0.3 * x][d]);
        let middle = Vector::from_fn(|d, _| 0.5 + 0.3 * cell * (x * (1.0 + d as f64)).sin());
        for width in [1.0, 1.5] {
            let largest = penalty_around_slab(level, [middle, normal.normalize()], radius, width).unwrap();
            let largest = largest / PENALTY;
            assert!(largest < 108.0, "{D}D, {k}: {largest}");
        }
    }
}

#[test]
fn slabs_between_bodies_are_resolved() {
    slabs_are_resolved::<2>(6, 0.15, 16);
    slabs_are_resolved::<3>(4, 0.2, 4);
}

/// Where penalties are far too small, the error names the first root whose block is not positive, and a body
/// at its surface.
fn blocks_that_are_not_positive_are_named<const D: usize>(level: u8) {
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
    let discretisation = Discretisation::new(mesh);
    let bodies = [0.27, 0.71].map(|x| Ball::new(Vector::<D>::repeat(x), 0.19));
    let penalty = PenaltyFactor::new(0.01);
    let system = around(&discretisation, &bodies, &Flats::none(2), 1.0, &penalty).unwrap();
    let elements = Elements::new(&system, gluey_fem::ReferenceMatrices::<D>::VELOCITY);
    let surfaces = system.surfaces().unwrap();
    let error = SurfaceCorrection::new(&elements, surfaces, &system.space).err().unwrap();
    let StokesError::SurfaceBlock { center, body, .. } = error else { panic!("{error}") };
    let from_center = Vector::<D>::from_column_slice(&center) - bodies[body].center();
    let cells = (from_center.norm() - 0.19).abs() / discretisation.finest_cell_size();
    assert!(cells < 2.0 * (D as f64).sqrt(), "{cells} cells from the surface of body {body}");
}

#[test]
fn errors_of_the_smoother_name_cell_and_body() {
    blocks_that_are_not_positive_are_named::<2>(4);
    blocks_that_are_not_positive_are_named::<3>(4);
}
