//! Set-ups and measurements that the tests share.

use gluey_fem::TreeMesh;
use gluey_fem::element::{gauss_cube, value};
use gluey_geom::{Aabb, Dim, Twist, Vector};
use gluey_levelset::{Ball, Body, LevelSet};
use gluey_stokes::{
    Flow, FlowParams, FlowSolver, Formulation, Lubrication, PaperParams, ParticleVelocity, Refinement,
    SolverKind, StokesError,
};
use gluey_testkit::compute_alone;
use gluey_testkit::exact::StokesSolution;

/// Radius of the particles in the reference data.
pub const RADIUS: f64 = 0.05;
/// Both linear solvers.
pub const SOLVERS: [SolverKind; 2] = [SolverKind::Direct, SolverKind::Multigrid];
/// `unfitted` as cases have it by default.
pub const UNFITTED: Formulation = Formulation::Unfitted { lubrication: Lubrication::Deficit };

/// The paper's formulation with a viscosity ratio and a number of Uzawa steps.
pub fn paper(viscosity_ratio: f64, uzawa_steps: usize) -> Formulation {
    Formulation::Paper(PaperParams { viscosity_ratio, uzawa_steps, ..PaperParams::default() })
}

/// As [`paper`], with the velocity at the centre as that of the particle.
pub fn paper_at_center(viscosity_ratio: f64, uzawa_steps: usize) -> Formulation {
    let particle_velocity = ParticleVelocity::Center;
    let params = PaperParams { viscosity_ratio, uzawa_steps, particle_velocity, ..PaperParams::default() };
    Formulation::Paper(params)
}

/// Parameters for unit viscosity.
pub fn params(formulation: Formulation, solver: SolverKind, tolerance: f64) -> FlowParams {
    FlowParams { viscosity: 1.0, formulation, solver, tolerance }
}

/// A mesh with cells of `2^-surface` at the surfaces.
pub fn bands(surface: u8) -> Refinement {
    Refinement { coarsest: 3, surface, band: 2.0 }
}

/// The mesh of the unit box.
pub fn mesh<const D: usize>(refinement: &Refinement, balls: &[Ball<D>]) -> TreeMesh<D> {
    refinement.mesh(Aabb::unit(), [1; D], [false; D], balls).unwrap()
}

/// A mesh with hanging nodes: cells of `2^-level`, and half that size in one corner of the box.
pub fn graded<const D: usize>(level: u8) -> TreeMesh<D> {
    TreeMesh::refine(Aabb::unit(), [1; D], [false; D], level + 1, |lower, _, l| {
        l < level || lower.iter().all(|&x| x < 0.45)
    })
    .unwrap()
}

/// A solver of flows that computes on the thread of its test.
pub fn flow_solver<const D: usize>(params: FlowParams) -> FlowSolver<D> {
    compute_alone();
    FlowSolver::new(params).unwrap()
}

/// One flow, computed from nothing.
pub fn try_solve<const D: usize>(
    params: FlowParams,
    mesh: TreeMesh<D>,
    balls: &[Ball<D>],
    boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
) -> Result<Flow<D>, StokesError> {
    compute_alone();
    FlowSolver::new(params)?.solve(mesh, balls, boundary)
}

/// As [`try_solve`], where failure fails the test.
pub fn solve<const D: usize>(
    params: FlowParams,
    mesh: TreeMesh<D>,
    balls: &[Ball<D>],
    boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
) -> Flow<D> {
    try_solve(params, mesh, balls, boundary).unwrap()
}

/// Couette flow `(y - 1/2) e_x`.
pub fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] - 0.5;
    u
}

/// A divergence-free field that vanishes on the boundary of the unit box: added to boundary data, it changes
/// what the solver starts from and must not change what it finds.
pub fn bump<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let (g, slope) = (|t: f64| (t * (1.0 - t)).powi(2), |t: f64| 2.0 * t * (1.0 - t) * (1.0 - 2.0 * t));
    let depth: f64 = (2..D).map(|d| 16.0 * g(x[d])).product();
    let mut u = Vector::zeros();
    u[0] = 100.0 * depth * g(x[0]) * slope(x[1]);
    u[1] = -100.0 * depth * slope(x[0]) * g(x[1]);
    u
}

/// Discs or spheres of the reference radius.
pub fn balls<const D: usize>(centers: &[Vector<D>]) -> Vec<Ball<D>> {
    centers.iter().map(|&center| Ball::new(center, RADIUS)).collect()
}

/// Two balls around `center` at a gap of `gap` radii, the line of centres at `degrees` in the plane of shear.
pub fn pair_at<const D: usize>(center: Vector<D>, gap: f64, degrees: f64) -> Vec<Ball<D>> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut arm = Vector::zeros();
    arm[0] = cos * RADIUS * (1.0 + 0.5 * gap);
    arm[1] = sin * RADIUS * (1.0 + 0.5 * gap);
    balls(&[center - arm, center + arm])
}

/// The pair of the paper's figure 5, nearly touching.
pub fn doublet() -> Vec<Ball<2>> {
    balls(&[Vector::<2>::new(0.451, 0.51), Vector::<2>::new(0.549, 0.49)])
}

/// How two balls move relative to each other in the plane of shear.
#[derive(Clone, Copy, Debug)]
pub struct PairMotion {
    /// `(U2 - U1).e`, negative when they approach.
    pub normal_speed: f64,
    /// Rate at which the line of centres turns.
    pub line_rotation: f64,
    /// Spins about the axis of vorticity.
    pub spins: [f64; 2],
}

/// Relative motion of the first two balls.
pub fn pair_motion<const D: usize>(balls: &[Ball<D>], twists: &[Twist<D>]) -> PairMotion {
    let line = balls[1].center() - balls[0].center();
    let e = line.normalize();
    let relative = twists[1].velocity - twists[0].velocity;
    let about_vorticity = |body: usize| twists[body].spin[Dim::<D>::ROT - 1];
    PairMotion {
        normal_speed: relative.dot(&e),
        line_rotation: (e[0] * relative[1] - e[1] * relative[0]) / line.norm(),
        spins: [about_vorticity(0), about_vorticity(1)],
    }
}

/// Largest difference of any velocity or (times the radius) spin.
pub fn twist_distance<const D: usize>(a: &[Twist<D>], b: &[Twist<D>]) -> f64 {
    let spin = |t: &Twist<D>, k: usize| Dim::<D>::spin_slice(&t.spin)[k];
    let distance = |(a, b): (&Twist<D>, &Twist<D>)| {
        let spins = (0..Dim::<D>::ROT).map(|k| RADIUS * (spin(a, k) - spin(b, k)).abs());
        spins.fold((a.velocity - b.velocity).amax(), f64::max)
    };
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(distance).fold(0.0, f64::max)
}

/// Largest nodal error of the velocity.
pub fn nodal_error<const D: usize>(flow: &Flow<D>, exact: &dyn Fn(&Vector<D>) -> Vector<D>) -> f64 {
    let nodes = &flow.discretisation.velocity;
    let error = |n: usize| {
        let u = Vector::<D>::from_column_slice(&flow.velocity[n * D..][..D]);
        (u - exact(&nodes.point(n))).amax()
    };
    (0..nodes.node_count()).map(error).fold(0.0, f64::max)
}

/// Largest deviation of the nodal velocity from the rigid motion of a ball, `depth` or more inside its
/// surface, relative to `a` times the shear rate 1.
pub fn strain_inside<const D: usize>(flow: &Flow<D>, balls: &[Ball<D>], depth: f64) -> f64 {
    let nodes = &flow.discretisation.velocity;
    let mut worst: f64 = 0.0;
    for (ball, twist) in balls.iter().zip(&flow.twists) {
        for n in (0..nodes.node_count()).filter(|&n| ball.value(&nodes.point(n)) >= depth) {
            let u = Vector::<D>::from_column_slice(&flow.velocity[n * D..][..D]);
            let deviation = u - twist.velocity_at(&ball.arm(&nodes.point(n)));
            worst = worst.max(deviation.amax() / ball.bounding_radius());
        }
    }
    worst
}

/// L2 errors of the velocity and of the pressure less its mean, by a Gauss rule on every cell.
pub fn l2_errors<const D: usize>(flow: &Flow<D>, exact: &impl StokesSolution<D>) -> (f64, f64) {
    let rule = gauss_cube::<D>(4);
    let Flow { discretisation, velocity, pressure, .. } = flow;
    let (mut volume, mut u_square, mut p_mean, mut p_square) = (0.0, 0.0, 0.0, 0.0);
    for (index, cell) in discretisation.mesh.cells().iter().enumerate() {
        let (lower, h) = (discretisation.mesh.lower_corner(cell), discretisation.cell_size(index));
        for (at, weight) in &rule {
            let x = lower + Vector::from_fn(|d, _| h * at[d]);
            let mut du = -exact.velocity(&x);
            for (i, &n) in discretisation.velocity.cell(index).iter().enumerate() {
                let shape = value::<D>(2, i, at);
                du += Vector::<D>::from_column_slice(&velocity[n as usize * D..][..D]) * shape;
            }
            let nodes = discretisation.pressure.cell(index).iter().enumerate();
            let p: f64 = nodes.map(|(i, &n)| value::<D>(1, i, at) * pressure[n as usize]).sum();
            let (dp, weight) = (p - exact.pressure(&x), weight * h.powi(D as i32));
            volume += weight;
            u_square += weight * du.norm_squared();
            p_mean += weight * dp;
            p_square += weight * dp * dp;
        }
    }
    (u_square.sqrt(), (p_square - p_mean * p_mean / volume).max(0.0).sqrt())
}
