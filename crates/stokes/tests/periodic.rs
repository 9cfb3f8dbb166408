//! Periodic boxes: where the border lies does not matter.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{FlowParams, FlowSolver, Formulation, Lubrication, PaperParams, Refinement, SolverKind};

const REFINEMENT: Refinement = Refinement { coarsest: 3, surface: 5, band: 2.0 };

/// The motion of a ball at `x`, in a box that is periodic in all directions but y.
fn motion<const D: usize>(x: f64, params: FlowParams) -> Twist<D> {
    let periodic: [bool; D] = std::array::from_fn(|d| d != 1);
    let mut center = Vector::<D>::repeat(0.5);
    (center[0], center[1]) = (x, 0.61);
    let ball = Ball::periodic(center, 0.1, periodic.map(|p| p.then_some(1.0)));
    let mesh: TreeMesh<D> = REFINEMENT.mesh(Aabb::unit(), [1; D], periodic, &[ball]).expect("a mesh");
    let shear = |x: &Vector<D>| {
        let mut u = Vector::zeros();
        u[0] = x[1] - 0.5;
        u
    };
    let mut solver = FlowSolver::<D>::new(params).expect("valid parameters");
    solver.solve(mesh, &[ball], &shear).expect("a flow").twists[0]
}

fn crossing_the_border_changes_nothing<const D: usize>(formulation: Formulation, solver: SolverKind) {
    let params = FlowParams { viscosity: 1.0, formulation, solver, tolerance: 1e-9 };
    let (inside, across) = (motion::<D>(0.47, params), motion::<D>(0.97, params));
    let (spin, other) = (Dim::<D>::spin_slice(&inside.spin), Dim::<D>::spin_slice(&across.spin));
    let spin_miss = spin.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!((inside.velocity - across.velocity).norm() < 1e-7 && spin_miss < 1e-6);
    // The undisturbed velocity at the centre is 0.11; the nearer wall, which moves faster, drags the ball
    // along.
    assert!((0.11..0.125).contains(&inside.velocity[0]), "{inside:?}");
    let about_z = *spin.last().expect("a spin");
    assert!((about_z + 0.5).abs() < 0.04, "{inside:?}");
}

#[test]
fn a_ball_across_the_border_moves_like_one_inside() {
    let unfitted = Formulation::Unfitted { lubrication: Lubrication::Deficit };
    let paper = Formulation::Paper(PaperParams { uzawa_steps: 2, ..PaperParams::default() });
    for formulation in [unfitted, paper] {
        crossing_the_border_changes_nothing::<2>(formulation, SolverKind::Direct);
        crossing_the_border_changes_nothing::<2>(formulation, SolverKind::Multigrid);
        crossing_the_border_changes_nothing::<3>(formulation, SolverKind::Multigrid);
    }
}
