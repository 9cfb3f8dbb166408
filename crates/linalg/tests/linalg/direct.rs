//! Direct solvers: exact answers, reuse of the symbolic part, refinement, and every way to fail.

use std::sync::Arc;

use crate::support::{laplacian_2d, pseudo_random, relative_residual, stokes_2d, stokes_2d_around};
use gluey_linalg::{
    DirectError, DirectIndefinite, DirectSpd, IndefiniteParams, Ordering, Pattern, RefinementParams,
    Regularise, SparseMatrix, Symbolic,
};

fn symbolic(matrix: &SparseMatrix, ordering: Ordering<'_>) -> Arc<Symbolic> {
    Arc::new(Symbolic::new(matrix.pattern().clone(), ordering).expect("symmetric pattern"))
}

fn indefinite(matrix: &SparseMatrix, ordering: Ordering<'_>) -> DirectIndefinite {
    DirectIndefinite::new(symbolic(matrix, ordering), IndefiniteParams::default()).expect("fits")
}

fn spd(matrix: &SparseMatrix) -> DirectSpd {
    DirectSpd::new(symbolic(matrix, Ordering::Amd), RefinementParams::default()).expect("fits")
}

/// `[[A, B^T], [B, 0]]` with exact integer solutions.
fn small_saddle() -> SparseMatrix {
    let triplets =
        [(0, 0, 2.0), (1, 1, 1.0), (0, 2, 1.0), (2, 0, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 0.0)];
    SparseMatrix::from_triplets(3, 3, &triplets).expect("in range")
}

#[test]
fn small_systems_are_solved_exactly() {
    let a = small_saddle();
    let expected = [3.0, -2.0, 5.0];
    let mut b = [0.0; 3];
    a.multiply(&expected, &mut b);
    let mut solver = indefinite(&a, Ordering::Natural);
    solver.factorise(a.values()).expect("regular");
    let mut x = [f64::NAN; 3];
    solver.solve(&b, &mut x).expect("solvable");
    assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-14), "{x:?}");
}

#[test]
fn a_saddle_point_is_solved_to_the_tolerance() {
    let saddle = stokes_2d(12, |x, y| if (x - 0.4).hypot(y - 0.5) < 0.2 { 1e3 } else { 1.0 });
    let expected = pseudo_random(3, saddle.is_pressure.len());
    let mut b = vec![0.0; expected.len()];
    saddle.matrix.multiply(&expected, &mut b);
    let mut solver = indefinite(&saddle.matrix, Ordering::Amd);
    let factor = solver.factorise(saddle.matrix.values()).expect("regular");
    assert!(!factor.regularised);
    let mut x = vec![0.0; b.len()];
    let report = solver.solve(&b, &mut x).expect("solvable");
    assert!(report.residual_norm <= 1e-12 * report.right_hand_side_norm);
    assert!(
        (relative_residual(&saddle.matrix, &b, &x) * report.right_hand_side_norm / report.residual_norm
            - 1.0)
            .abs()
            < 0.1
    );
    assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-8));
}

#[test]
fn one_symbolic_part_serves_many_matrices() {
    let first = stokes_2d(8, |_, _| 1.0);
    let second = stokes_2d(8, |x, y| 1.0 + x + 2.0 * y);
    assert_eq!(first.matrix.pattern(), second.matrix.pattern());
    let shared = symbolic(&first.matrix, Ordering::Amd);
    let mut solver = DirectIndefinite::new(shared.clone(), IndefiniteParams::default()).expect("fits");
    let b = pseudo_random(1, first.is_pressure.len());
    let mut x = vec![0.0; b.len()];
    for matrix in [&first.matrix, &second.matrix, &first.matrix] {
        solver.factorise(matrix.values()).expect("regular");
        solver.solve(&b, &mut x).expect("solvable");
        assert!(relative_residual(matrix, &b, &x) < 1e-9);
        let mut fresh = DirectIndefinite::new(shared.clone(), IndefiniteParams::default()).expect("fits");
        fresh.factorise(matrix.values()).expect("regular");
        let mut again = vec![1.0; b.len()];
        fresh.solve(&b, &mut again).expect("solvable");
        assert_eq!(x, again, "a used solver must give the bits of a fresh one");
    }
}

/// Every pressure before every velocity: each first pivot is zero, on which the plain factorisation returns
/// NaN.
fn pressures_first(is_pressure: &[bool]) -> Vec<usize> {
    let (mut order, velocities): (Vec<usize>, Vec<usize>) =
        (0..is_pressure.len()).partition(|&unknown| is_pressure[unknown]);
    order.extend(velocities);
    order
}

#[test]
fn zero_pivots_are_found_and_cured_by_regularisation() {
    let saddle = stokes_2d(8, |_, _| 1.0);
    let order = pressures_first(&saddle.is_pressure);
    let mut solver = indefinite(&saddle.matrix, Ordering::Custom(&order));
    let factor = solver.factorise(saddle.matrix.values()).expect("cured");
    assert!(factor.regularised);
    let b = pseudo_random(1, order.len());
    let mut x = vec![0.0; order.len()];
    let report = solver.solve(&b, &mut x).expect("solvable");
    assert!(report.refinements >= 1);
    let mut plain = indefinite(&saddle.matrix, Ordering::Amd);
    plain.factorise(saddle.matrix.values()).expect("regular");
    let mut expected = vec![0.0; order.len()];
    plain.solve(&b, &mut expected).expect("solvable");
    let size = gluey_linalg::vector::norm(&expected);
    gluey_linalg::vector::axpy(-1.0, &expected, &mut x);
    assert!(gluey_linalg::vector::norm(&x) < 1e-9 * size);
}

#[test]
fn weak_pressures_beside_solids_are_solved() {
    // Discs anywhere on the grid leave pressures that see a handful of velocities, which AMD eliminates
    // first.
    let mut unique_count = 0;
    for k in 0..20 {
        let (x0, y0) = (0.3 + 0.011 * k as f64, 0.4 + 0.007 * k as f64);
        let solid = |x: f64, y: f64| (x - x0).hypot(y - y0) < 0.15 || (x - x0 - 0.31).hypot(y - y0) < 0.15;
        let saddle = stokes_2d_around(24, |_, _| 1.0, solid);
        let expected = pseudo_random(1, saddle.is_pressure.len());
        let mut b = vec![0.0; expected.len()];
        saddle.matrix.multiply(&expected, &mut b);
        let shared = symbolic(&saddle.matrix, Ordering::Amd);
        let solutions = [Regularise::WhenNeeded, Regularise::Always].map(|regularise| {
            let params = IndefiniteParams { regularise, ..Default::default() };
            let mut solver = DirectIndefinite::new(shared.clone(), params).expect("fits");
            let factor = solver.factorise(saddle.matrix.values()).expect("cured");
            assert!(factor.regularised && factor.probe_residual < 1e-7, "{factor:?}");
            let mut x = vec![0.0; b.len()];
            let report = solver.solve(&b, &mut x).expect("solvable");
            assert!(report.refinements <= 2 && !report.limited_by_rounding, "{report:?}");
            x
        });
        assert_eq!(solutions[0], solutions[1]);
        let close = |unknown: usize| (solutions[0][unknown] - expected[unknown]).abs() < 1e-9;
        let free = |unknown: &usize| !saddle.is_pressure[*unknown];
        assert!((0..b.len()).filter(free).all(close), "position {k}");
        unique_count += usize::from((0..b.len()).all(close));
        assert!(solutions[0].iter().all(|x| x.abs() < 10.0), "no noise in the null space, position {k}");
    }
    // In some positions a few pressures see fewer velocities than they are: these are not unique, velocities
    // are.
    assert_eq!(unique_count, 14);
}

#[test]
fn without_the_cure_a_broken_factor_is_an_error() {
    let saddle = stokes_2d(4, |_, _| 1.0);
    let order = pressures_first(&saddle.is_pressure);
    let shared = symbolic(&saddle.matrix, Ordering::Custom(&order));
    let params = IndefiniteParams { regularise: Regularise::Never, ..Default::default() };
    let mut solver = DirectIndefinite::new(shared, params).expect("fits");
    let error = solver.factorise(saddle.matrix.values()).expect_err("zero pivots");
    assert_eq!(error, DirectError::Singular { probe_residual: f64::INFINITY });
    let mut x = vec![0.0; order.len()];
    assert_eq!(solver.solve(&vec![1.0; order.len()], &mut x), Err(DirectError::NotFactorised));
}

#[test]
fn singular_matrices_do_not_pass() {
    let zero_row = SparseMatrix::from_triplets(2, 2, &[(0, 0, 1.0), (1, 1, 0.0)]).expect("in range");
    let error = indefinite(&zero_row, Ordering::Amd).factorise(zero_row.values()).expect_err("singular");
    assert!(matches!(error, DirectError::Singular { .. }));
    let rank_one = [(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0)];
    let rank_one = SparseMatrix::from_triplets(2, 2, &rank_one).expect("in range");
    let mut solver = indefinite(&rank_one, Ordering::Amd);
    let outcome = solver.factorise(rank_one.values()).and_then(|_| solver.solve(&[1.0, 2.0], &mut [0.0; 2]));
    assert!(outcome.is_err(), "(1, 2) is not in the range");
    assert_eq!(
        spd(&rank_one).factorise(rank_one.values()),
        Err(DirectError::NotPositiveDefinite { pivot: 1 })
    );
}

#[test]
fn data_that_are_not_finite_are_named() {
    let a = laplacian_2d(5);
    let mut values = a.values().to_vec();
    values[7] = f64::NAN;
    let expected = DirectError::NotFinite { what: "matrix", position: 7 };
    assert_eq!(indefinite(&a, Ordering::Amd).factorise(&values), Err(expected.clone()));
    assert_eq!(spd(&a).factorise(&values), Err(expected));
    let mut solver = spd(&a);
    solver.factorise(a.values()).expect("positive definite");
    let mut b = vec![1.0; 25];
    b[3] = f64::INFINITY;
    let expected = DirectError::NotFinite { what: "right-hand side", position: 3 };
    assert_eq!(solver.solve(&b, &mut [0.0; 25]), Err(expected));
}

#[test]
fn a_tolerance_out_of_reach_returns_the_history() {
    // The factor reads one triangle; an unsymmetric matrix is therefore solved for its symmetric twin.
    let mut a = laplacian_2d(4);
    a.add(0, 1, 3.0).expect("in pattern");
    let mut solver = spd(&a);
    solver.factorise(a.values()).expect("the lower triangle is positive definite");
    match solver.solve(&pseudo_random(1, 16), &mut [0.0; 16]) {
        Err(DirectError::NotConverged { residual_norm, target_norm, history }) => {
            assert!(residual_norm > target_norm && history.len() >= 2);
            assert_eq!(history, solver.residual_history());
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn rounding_is_told_from_failure() {
    let a = laplacian_2d(30);
    let params = RefinementParams { relative_tolerance: 0.0, ..Default::default() };
    let mut solver = DirectSpd::new(symbolic(&a, Ordering::Amd), params).expect("fits");
    solver.factorise(a.values()).expect("positive definite");
    let report = solver.solve(&pseudo_random(1, 900), &mut vec![0.0; 900]).expect("as good as it gets");
    assert!(report.limited_by_rounding);
}

#[test]
fn both_solvers_and_all_orderings_agree() {
    let a = laplacian_2d(20);
    let b = pseudo_random(5, 400);
    let mut expected = vec![0.0; 400];
    let mut cholesky = spd(&a);
    cholesky.factorise(a.values()).expect("positive definite");
    cholesky.solve(&b, &mut expected).expect("solvable");
    assert!(relative_residual(&a, &b, &expected) < 1e-12);
    let backwards: Vec<usize> = (0..400).rev().collect();
    for ordering in [Ordering::Amd, Ordering::Natural, Ordering::Custom(&backwards)] {
        let mut solver = indefinite(&a, ordering);
        assert!(!solver.factorise(a.values()).expect("regular").regularised);
        let mut x = vec![0.0; 400];
        solver.solve(&b, &mut x).expect("solvable");
        assert!(x.iter().zip(&expected).all(|(x, e)| (x - e).abs() < 1e-11));
    }
}

#[test]
fn bad_patterns_orderings_and_lengths_are_refused() {
    let one_sided = Pattern::from_entries(2, 2, &[(0, 0), (0, 1), (1, 1)]).expect("in range");
    let hollow = Pattern::from_entries(2, 2, &[(0, 1), (1, 0)]).expect("in range");
    for pattern in [one_sided, hollow] {
        let error = Symbolic::new(Arc::new(pattern), Ordering::Amd).expect_err("refused");
        assert_eq!(error, DirectError::PatternNotSymmetric);
    }
    let a = laplacian_2d(2);
    for (order, place) in [(&[0, 1, 1, 2][..], 2), (&[0, 1, 2, 4], 3), (&[0, 1, 2], 3)] {
        let error = Symbolic::new(a.pattern().clone(), Ordering::Custom(order)).expect_err("refused");
        assert_eq!(error, DirectError::BadOrdering { place });
    }
    let mut solver = spd(&a);
    assert!(matches!(solver.factorise(&[1.0]), Err(DirectError::Values(_))));
    solver.factorise(a.values()).expect("positive definite");
    let mismatch = DirectError::DimensionMismatch { expected: 4, found: 3 };
    assert_eq!(solver.solve(&[1.0; 3], &mut [0.0; 4]), Err(mismatch.clone()));
    assert_eq!(solver.solve(&[1.0; 4], &mut [0.0; 3]), Err(mismatch));
}
