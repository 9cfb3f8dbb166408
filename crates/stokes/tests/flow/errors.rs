//! What cannot be computed is answered with a typed error that says why.

use gluey_fem::{MeshError, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_linalg::KrylovError;
use gluey_stokes::{FlowParams, FlowSolver, Formulation, PaperParams, SolverKind, StokesError};

use crate::support::{
    RADIUS, SOLVERS, UNFITTED, balls, bands, bump, couette, mesh, pair_at, paper, params, try_solve,
    twist_distance,
};

fn one_disc() -> Vec<Ball<2>> {
    balls(&[Vector::<2>::new(0.52, 0.47)])
}

#[test]
fn a_body_smaller_than_a_cell_is_refused() {
    let pair = balls(&[Vector::<2>::new(0.3, 0.5), Vector::<2>::new(0.5, 0.5)]);
    for formulation in [UNFITTED, paper(1e3, 1)] {
        for solver in SOLVERS {
            let refused =
                try_solve(params(formulation, solver, 1e-8), mesh(&bands(3), &pair), &pair, &couette);
            let expected = StokesError::Unresolved { body: 0, radius: RADIUS, cell_size: 0.125 };
            assert_eq!(refused.err(), Some(expected));
        }
    }
    let spheres = balls(&[Vector::<3>::repeat(0.5)]);
    let refused = try_solve(
        params(UNFITTED, SolverKind::Multigrid, 1e-8),
        mesh(&bands(3), &spheres),
        &spheres,
        &couette,
    );
    assert!(matches!(refused, Err(StokesError::Unresolved { body: 0, .. })));
}

#[test]
fn a_body_that_is_nowhere_is_refused() {
    let error = |at: f64, formulation| {
        let mut bodies = one_disc();
        bodies.push(Ball::new(Vector::repeat(at), RADIUS));
        let mesh = mesh(&bands(6), &one_disc());
        try_solve(params(formulation, SolverKind::Direct, 1e-8), mesh, &bodies, &couette).unwrap_err()
    };
    for formulation in [UNFITTED, paper(1e3, 1)] {
        for at in [f64::NAN, 3.0] {
            let error = error(at, formulation);
            assert!(matches!(error, StokesError::Unresolved { body: 1, .. }), "{formulation:?}: {error:?}");
        }
    }
}

/// A disc in another, but for a sliver: a cell in the sliver is its own, but no quadrature point is. A field
/// read there would leave the disc at rest while everything around it moves.
#[test]
fn a_body_that_another_hides_is_refused() {
    let (cell, center) = (1.0 / 32.0, Vector::<2>::new(0.4, 0.5 + 1.0 / 64.0));
    let hidden = center + Vector::<2>::new(0.2 - 2.0 * cell + 1e-6, 0.0);
    let bodies = [Ball::new(center, 0.2), Ball::new(hidden, 2.0 * cell)];
    let refused = try_solve(
        params(paper(1e2, 1), SolverKind::Direct, 1e-8),
        mesh(&bands(5), &bodies),
        &bodies,
        &couette,
    );
    let expected = StokesError::NoSolid { body: 1, radius: 2.0 * cell, cell_size: cell };
    assert_eq!(refused.err(), Some(expected));
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = params(UNFITTED, SolverKind::Direct, 1e-8);
    let soft = |p: PaperParams| FlowParams { formulation: Formulation::Paper(p), ..good };
    let usual = PaperParams::default();
    let cases: Vec<(&str, FlowParams)> = vec![
        ("viscosity", FlowParams { viscosity: 0.0, ..good }),
        ("viscosity", FlowParams { viscosity: -1.0, ..good }),
        ("viscosity", FlowParams { viscosity: f64::NAN, ..good }),
        ("viscosity", FlowParams { viscosity: f64::INFINITY, ..good }),
        ("tolerance", FlowParams { tolerance: 0.0, ..good }),
        ("tolerance", FlowParams { tolerance: 1.0, ..good }),
        ("tolerance", FlowParams { tolerance: f64::NAN, ..good }),
        ("viscosity_ratio", soft(PaperParams { viscosity_ratio: 1.0, ..usual })),
        ("viscosity_ratio", soft(PaperParams { viscosity_ratio: -5.0, ..usual })),
        ("viscosity_ratio", soft(PaperParams { viscosity_ratio: f64::NAN, ..usual })),
        ("rho", soft(PaperParams { rho: 0.0, ..usual })),
        ("rho", soft(PaperParams { rho: 4.0, ..usual })),
        ("rho", soft(PaperParams { rho: f64::NAN, ..usual })),
        ("ramp", soft(PaperParams { ramp: 0.0, ..usual })),
        ("ramp", soft(PaperParams { ramp: f64::NAN, ..usual })),
        ("uzawa_steps", soft(PaperParams { uzawa_steps: 0, ..usual })),
        ("quadrature", soft(PaperParams { quadrature: 0, ..usual })),
    ];
    for (wrong, params) in cases {
        match FlowSolver::<2>::new(params).err() {
            Some(StokesError::Parameter { name, .. }) => assert_eq!(name, wrong),
            other => panic!("{wrong}: {other:?} for {params:?}"),
        }
    }
    assert!(FlowSolver::<2>::new(good).is_ok());
    assert!(FlowSolver::<3>::new(soft(usual)).is_ok());
}

#[test]
fn without_convergence_the_residuals_are_handed_back() {
    let disc = one_disc();
    for formulation in [UNFITTED, paper(1e3, 1)] {
        let run = |solver| {
            try_solve(params(formulation, solver, 1e-30), mesh(&bands(6), &disc), &disc, &couette).err()
        };
        match run(SolverKind::Multigrid) {
            Some(StokesError::Krylov(KrylovError::NotConverged { iterations, history, .. })) => {
                assert_eq!(history.len(), iterations + 1);
                let least = history.iter().copied().fold(f64::INFINITY, f64::min);
                assert!(least < 1e-8 * history[0], "{least:e} of {:e}", history[0]);
            }
            other => panic!("{formulation:?}: {other:?}"),
        }
        // The direct solver stops at rounding error and says no more than that is possible.
        assert_eq!(run(SolverKind::Direct), None);
    }
}

/// A mass over such a viscosity is zero in single precision.
#[test]
fn a_viscosity_beyond_single_precision_is_noticed() {
    let disc = one_disc();
    let thick = FlowParams { viscosity: 1e45, ..params(UNFITTED, SolverKind::Multigrid, 1e-8) };
    let refused = try_solve(thick, mesh(&bands(5), &disc), &disc, &couette).err().unwrap();
    assert!(matches!(refused, StokesError::PressureMass(_)), "{refused:?}");
    assert!(refused.to_string().starts_with("the mass of the pressures: diagonal entry"), "{refused}");
}

#[test]
fn boundary_data_that_are_no_numbers_are_noticed() {
    let disc = one_disc();
    for formulation in [UNFITTED, paper(1e3, 1)] {
        for solver in SOLVERS {
            let torn = |x: &Vector<2>| if x[0] == 0.0 { Vector::repeat(f64::NAN) } else { couette(x) };
            let refused = try_solve(params(formulation, solver, 1e-8), mesh(&bands(5), &disc), &disc, &torn);
            assert!(refused.is_err(), "{formulation:?}, {solver:?}");
        }
    }
}

#[test]
fn a_mesh_beyond_the_finest_lattice_is_refused() {
    for surface in [30, 40, 250] {
        let refused = bands(surface).mesh(Aabb::unit(), [1; 2], [false; 2], &one_disc());
        assert!(matches!(refused, Err(MeshError::TooFine { .. })), "{:?}", refused.map(|m| m.cell_count()));
    }
}

/// Discs that touch, and discs that overlap a little: cells and even nodes belong to both. The film between
/// them is closed, and its row has a scale of 1e11.
#[test]
fn touching_bodies_that_share_cells_are_no_obstacle() {
    for (place, gap) in (0..4).flat_map(|place| [0.0, -0.05].map(|gap| (f64::from(place), gap))) {
        let center = Vector::<2>::new(0.503 + 7e-4 * place, 0.497 - 3e-4 * place);
        let pair = pair_at(center, gap, 30.0 + 3.0 * place);
        for formulation in [UNFITTED, paper(1e3, 1)] {
            let [direct, multigrid] = SOLVERS.map(|solver| {
                let params = params(formulation, solver, 1e-12);
                let flow = try_solve(params, mesh(&bands(6), &pair), &pair, &couette).unwrap();
                let most = if solver == SolverKind::Direct { 8 } else { 100 };
                assert!(flow.iteration_count <= most, "{params:?}: {} iterations", flow.iteration_count);
                flow.twists
            });
            assert!(twist_distance(&direct, &multigrid) < 1e-7, "{formulation:?}, gap {gap}");
            assert!(direct.iter().all(|t| t.velocity.amax() < 0.1), "{direct:?}");
        }
    }
}

/// The coarsest mesh that a tree has may be fine, and a tree may have but one.
#[test]
fn meshes_that_cannot_be_coarsened_are_solved_on() {
    for (roots, level) in [([3, 3], 0), ([3, 3], 1), ([7, 7], 0), ([1, 1], 1)] {
        let [direct, multigrid] = SOLVERS.map(|solver| {
            let mesh = TreeMesh::uniform(Aabb::unit(), roots, [false; 2], level).unwrap();
            let start = |x: &Vector<2>| couette(x) + bump(x);
            try_solve(params(UNFITTED, solver, 1e-10), mesh, &[], &start).unwrap()
        });
        let difference = direct.velocity.iter().zip(&multigrid.velocity).map(|(a, b)| (a - b).abs());
        let difference = difference.fold(0.0, f64::max);
        assert!(difference < 1e-8, "{roots:?}, level {level}: {difference:e}");
    }
}
