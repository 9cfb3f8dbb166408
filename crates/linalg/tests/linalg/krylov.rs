//! Krylov methods against the direct solver, in mixed precision, and every way to fail.

use std::sync::Arc;

use crate::support::{Rounded, laplacian_2d, pseudo_random, relative_residual, stokes_2d};
use gluey_linalg::{
    DirectSpd, FnOp, Gcr, GcrParams, Identity, Jacobi, KrylovError, KrylovReport, LinOp, Ordering,
    Preconditioner, Reference, RefinementParams, SparseMatrix, Symbolic, vector,
};

fn gcr(
    params: GcrParams,
    a: &mut SparseMatrix,
    b: &[f64],
    x: &mut [f64],
) -> Result<KrylovReport, KrylovError> {
    Gcr::new(params).solve(a, &mut Identity, b, x, Reference::RightHandSide)
}

fn direct(a: &SparseMatrix) -> DirectSpd {
    let symbolic = Symbolic::new(a.pattern().clone(), Ordering::Amd).expect("symmetric");
    let mut solver = DirectSpd::new(Arc::new(symbolic), RefinementParams::default()).expect("fits");
    solver.factorise(a.values()).expect("positive definite");
    solver
}

/// A convection-diffusion matrix: not symmetric.
fn upwind(n: usize) -> SparseMatrix {
    let mut triplets = Vec::new();
    for row in 0..n {
        triplets.push((row, row, 3.0 + 0.01 * row as f64));
        if row > 0 {
            triplets.extend([(row, row - 1, -2.0), (row - 1, row, -0.5)]);
        }
    }
    SparseMatrix::from_triplets(n, n, &triplets).expect("in range")
}

#[test]
fn gcr_agrees_with_the_direct_solver() {
    let mut a = laplacian_2d(25);
    let b = pseudo_random(1, 625);
    let mut expected = vec![0.0; 625];
    direct(&a).solve(&b, &mut expected).expect("solvable");
    let mut jacobi = Jacobi::new(&a.diagonal()).expect("positive");
    let params =
        GcrParams { relative_tolerance: 1e-12, restart: 30, max_iterations: 2000, ..Default::default() };
    let mut x = vec![0.0; 625];
    gcr(params, &mut a, &b, &mut x).expect("converges");
    assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-9));
    x.fill(0.0);
    Gcr::new(params).solve(&mut a, &mut jacobi, &b, &mut x, Reference::RightHandSide).expect("converges");
    assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-9));
}

#[test]
fn small_systems_end_in_as_many_steps_as_unknowns() {
    let mut a = upwind(6);
    let b = pseudo_random(2, 6);
    let mut x = [0.0; 6];
    let params = GcrParams { relative_tolerance: 1e-13, ..Default::default() };
    let report = gcr(params, &mut a, &b, &mut x).expect("converges");
    assert!(report.iterations <= 6);
    assert!(relative_residual(&a, &b, &x) < 1e-13);
}

#[test]
fn an_exact_preconditioner_needs_one_step() {
    let mut a = laplacian_2d(15);
    let b = pseudo_random(1, 225);
    let mut x = vec![0.0; 225];
    let mut exact = direct(&a);
    let report = Gcr::new(GcrParams::default())
        .solve(&mut a, &mut exact, &b, &mut x, Reference::RightHandSide)
        .expect("converges");
    assert_eq!(report.iterations, 1);
}

#[test]
fn the_history_falls_and_ends_with_the_true_residual() {
    let mut a = upwind(300);
    let b = pseudo_random(1, 300);
    let mut x = pseudo_random(2, 300);
    let mut solver = Gcr::new(GcrParams { restart: 7, relative_tolerance: 1e-10, ..Default::default() });
    let report =
        solver.solve(&mut a, &mut Identity, &b, &mut x, Reference::RightHandSide).expect("converges");
    let history = solver.residual_history();
    assert_eq!(history.len(), report.iterations + 1);
    assert_eq!(history[0], report.initial_norm);
    assert_eq!(history[report.iterations], report.residual_norm);
    assert!(history.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-10)));
    let size = vector::norm(&b);
    assert!((relative_residual(&a, &b, &x) * size / report.residual_norm - 1.0).abs() < 1e-3);
    assert!(report.residual_norm <= 1e-10 * size);
}

#[test]
fn references_and_guesses_decide_when_to_stop() {
    let mut a = laplacian_2d(10);
    let b = pseudo_random(1, 100);
    let mut solved = vec![0.0; 100];
    direct(&a).solve(&b, &mut solved).expect("solvable");
    let mut x = solved.clone();
    let report = gcr(GcrParams::default(), &mut a, &b, &mut x).expect("converges");
    assert_eq!((report.iterations, &x), (0, &solved));

    let mut near = solved.clone();
    near.iter_mut().for_each(|x| *x *= 1.0 + 1e-3);
    let counts: Vec<usize> = [Reference::RightHandSide, Reference::InitialResidual, Reference::Norm(1e3)]
        .into_iter()
        .map(|reference| {
            let mut x = near.clone();
            let mut gcr = Gcr::new(GcrParams::default());
            gcr.solve(&mut a, &mut Identity, &b, &mut x, reference).expect("converges").iterations
        })
        .collect();
    assert!(counts[2] < counts[0] && counts[0] < counts[1], "{counts:?}");

    let mut x = vec![1.0; 100];
    let params = GcrParams { absolute_floor: 1e-6, ..Default::default() };
    let report = gcr(params, &mut a, &[0.0; 100], &mut x).expect("the floor stops it");
    assert!(report.residual_norm <= 1e-6 && report.iterations > 0);
}

#[test]
fn a_preconditioner_may_change_in_every_step() {
    let mut a = laplacian_2d(40);
    let (n, mut inner_a) = (1600, a.clone());
    // The inner iteration stops early: a different operator in every step.
    let mut inner = Gcr::new(GcrParams { relative_tolerance: 1e-2, ..Default::default() });
    let mut inner = FnOp::new(n, move |r: &[f64], z: &mut [f64]| {
        z.fill(0.0);
        inner.solve(&mut inner_a, &mut Identity, r, z, Reference::RightHandSide).expect("converges");
    });
    let b = pseudo_random(1, n);
    let mut x = vec![0.0; n];
    let mut outer = Gcr::new(GcrParams { relative_tolerance: 1e-10, ..Default::default() });
    let report = outer.solve(&mut a, &mut inner, &b, &mut x, Reference::RightHandSide).expect("converges");
    assert!(relative_residual(&a, &b, &x) <= 1e-10);
    assert!(report.iterations <= 10, "{report:?}");
}

#[test]
fn runs_repeat_bit_for_bit_and_reuse_their_workspace() {
    let mut saddle = stokes_2d(6, |x, _| 1.0 + 10.0 * x);
    let b = pseudo_random(1, saddle.is_pressure.len());
    let mut solver = Gcr::new(GcrParams { relative_tolerance: 1e-6, restart: 300, ..Default::default() });
    let mut run = || {
        let mut x = vec![0.0; b.len()];
        let report = solver.solve(&mut saddle.matrix, &mut Identity, &b, &mut x, Reference::RightHandSide);
        (report, x)
    };
    let first = run();
    assert!(first.0.is_ok(), "{first:?}");
    assert_eq!(first, run());
}

#[test]
fn giving_up_returns_the_history_and_the_best_iterate() {
    let mut a = laplacian_2d(30);
    let b = pseudo_random(1, 900);
    let mut x = vec![0.0; 900];
    let params = GcrParams { max_iterations: 5, relative_tolerance: 1e-12, ..Default::default() };
    let error = gcr(params, &mut a, &b, &mut x).expect_err("five steps are too few");
    let KrylovError::NotConverged { iterations: 5, residual_norm, history, .. } = error else {
        panic!("{error:?}");
    };
    assert_eq!(history.len(), 6);
    assert!(residual_norm < history[0]);
    assert!((relative_residual(&a, &b, &x) * vector::norm(&b) / residual_norm - 1.0).abs() < 1e-9);
}

#[test]
fn a_singular_operator_ends_without_looping() {
    let mut a = SparseMatrix::from_triplets(2, 2, &[(0, 0, 1.0), (1, 1, 0.0)]).expect("in range");
    let mut x = [0.0; 2];
    let error = gcr(GcrParams::default(), &mut a, &[1.0, 1.0], &mut x).expect_err("no solution");
    assert!(matches!(error, KrylovError::NotConverged { iterations, .. } if iterations < 10), "{error:?}");
    let report = gcr(GcrParams::default(), &mut a, &[1.0, 0.0], &mut x);
    assert!(report.is_ok(), "in the range: {report:?}");
}

#[test]
fn a_tolerance_beyond_rounding_ends_without_looping() {
    let params = GcrParams { relative_tolerance: 1e-30, ..Default::default() };
    for n in [2, 3, 5, 40] {
        let b = pseudo_random(4, n);
        let ends_near_rounding = |solved: Result<KrylovReport, KrylovError>| match solved {
            Ok(KrylovReport { residual_norm, .. }) | Err(KrylovError::NotConverged { residual_norm, .. }) => {
                assert!(residual_norm <= 1e-14 * vector::norm(&b), "{residual_norm:e}");
            }
            Err(other) => panic!("{other:?}"),
        };
        ends_near_rounding(gcr(params, &mut upwind(n), &b, &mut vec![0.0; n]));
        let (mut a, mut x) = (Rounded::new(n, upwind(n)), vec![0.0; n]);
        let mut narrow = Gcr::<f64, f32>::with_steps(params);
        ends_near_rounding(narrow.solve(&mut a, &mut Identity, &b, &mut x, Reference::RightHandSide));
    }
}

/// One in double precision and 1/1.6 in single: a correction by what the steps know leaves -0.6 of the
/// residual.
struct Inexact;

impl LinOp<f64> for Inexact {
    fn dim(&self) -> usize {
        2
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
}

impl LinOp<f32> for Inexact {
    fn dim(&self) -> usize {
        2
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        y.copy_from_slice(&[x[0] / 1.6, x[1] / 1.6]);
    }
}

#[test]
fn a_correction_without_a_step_may_reach_the_target() {
    let params = GcrParams { relative_tolerance: 0.4, ..Default::default() };
    let mut x = [0.0; 2];
    let report = Gcr::<f64, f32>::with_steps(params)
        .solve(&mut Inexact, &mut Identity, &[3.0, 4.0], &mut x, Reference::RightHandSide)
        .expect("0.36 is less than 0.4");
    assert_eq!(report.iterations, 1);
    assert!((report.residual_norm / 5.0 - 0.36).abs() < 1e-5, "{report:?}");
}

#[test]
fn numbers_that_are_not_finite_are_reported_and_kept_out_of_x() {
    let nan = |_: &[f64], z: &mut [f64]| z.fill(f64::NAN);
    let mut a = laplacian_2d(3);
    let mut x = [0.5; 9];
    let mut solver = Gcr::new(GcrParams::default());
    let bad_m = solver.solve(&mut a, &mut FnOp::new(9, nan), &[1.0; 9], &mut x, Reference::RightHandSide);
    assert_eq!((bad_m, x), (Err(KrylovError::NotFinite { iteration: 1 }), [0.5; 9]));
    let bad_a =
        solver.solve(&mut FnOp::new(9, nan), &mut Identity, &[1.0; 9], &mut x, Reference::RightHandSide);
    assert_eq!(bad_a, Err(KrylovError::NotFinite { iteration: 0 }));
    let bad_b = gcr(GcrParams::default(), &mut a, &[f64::INFINITY; 9], &mut x);
    assert_eq!(bad_b, Err(KrylovError::NotFinite { iteration: 0 }));
}

#[test]
fn wrong_lengths_are_refused() {
    let mut a = laplacian_2d(3);
    let error = gcr(GcrParams::default(), &mut a, &[1.0; 8], &mut [0.0; 9]);
    assert_eq!(error, Err(KrylovError::DimensionMismatch { expected: 9, found: 8 }));
    let error = gcr(GcrParams::default(), &mut a, &[1.0; 9], &mut [0.0; 10]);
    assert_eq!(error, Err(KrylovError::DimensionMismatch { expected: 9, found: 10 }));
}

/// A nonsymmetric operator with diagonal from 1 to `contrast`, and the preconditioner that takes out most of
/// it.
fn ill_conditioned(n: usize, contrast: f64) -> (impl LinOp<f64>, impl Preconditioner<f64>) {
    let diagonal: Vec<f64> = (0..n).map(|i| contrast.powf(i as f64 / n as f64)).collect();
    let inverse: Vec<f64> = (0..n).map(|i| 1.0 / (diagonal[i] * (1.0 + 0.4 * (i as f64).sin()))).collect();
    let action = move |x: &[f64], y: &mut [f64]| {
        for i in 0..n {
            let after = x.get(i + 1).copied().unwrap_or(0.0);
            let before = if i < 7 { 0.0 } else { x[i - 7] };
            y[i] = diagonal[i] * (x[i] + 0.3 * after - 0.1 * before);
        }
    };
    let inverse = move |r: &[f64], z: &mut [f64]| {
        z.iter_mut().zip(r.iter().zip(&inverse)).for_each(|(z, (r, d))| *z = r * d);
    };
    (FnOp::new(n, action), FnOp::new(n, inverse))
}

#[test]
fn vectors_in_single_precision_do_not_limit_the_residual() {
    let n = 5000;
    let (mut a, mut m) = ill_conditioned(n, 1e8);
    let b = pseudo_random(3, n);
    let mut work = vec![0.0; n];
    for tolerance in [1e-6, 1e-10, 1e-13] {
        let params = GcrParams { relative_tolerance: tolerance, ..Default::default() };
        let mut x = vec![0.0; n];
        let wide =
            Gcr::new(params).solve(&mut a, &mut m, &b, &mut x, Reference::RightHandSide).expect("converges");
        x.fill(0.0);
        let mut solver = Gcr::<f64, f32>::with_steps(params);
        let (mut a, mut m) = (Rounded::new(n, &mut a), Rounded::new(n, &mut m));
        let narrow = solver.solve(&mut a, &mut m, &b, &mut x, Reference::RightHandSide).expect("converges");
        LinOp::<f64>::apply(&mut a, &x, &mut work);
        vector::residual_from_product(&b, &mut work);
        assert!(vector::norm(&work) <= tolerance * vector::norm(&b));
        assert!(narrow.iterations <= wide.iterations + 1, "{narrow:?} {wide:?}");
        assert_eq!(solver.residual_history().last(), Some(&narrow.residual_norm));
    }
}

#[test]
fn solutions_have_the_same_bits_for_any_number_of_threads() {
    let n = 100_000;
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let (a, m) = ill_conditioned(n, 1e4);
            let (mut a, mut m) = (Rounded::new(n, a), Rounded::new(n, m));
            let b = pseudo_random(3, n);
            let mut x = vec![0.0; n];
            let mut solver = Gcr::<f64, f32>::with_steps(GcrParams::default());
            let report =
                solver.solve(&mut a, &mut m, &b, &mut x, Reference::RightHandSide).expect("converges");
            (report, x, solver.residual_history().to_vec())
        })
    };
    let one = solve(1);
    for threads in [2, 4] {
        assert!(solve(threads) == one);
    }
}
