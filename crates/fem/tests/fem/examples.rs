//! The examples run, and what they assert holds.

#[path = "../../examples/poisson.rs"]
mod poisson;

use gluey_testkit::convergence_order;

#[test]
fn poisson_converges_at_order_three() {
    poisson::main().expect("the example runs");
}

#[test]
fn poisson_converges_at_order_three_in_3d() {
    let levels = [2, 3, 4];
    let solutions = levels.map(|level| poisson::solve::<3>(level).expect("positive definite"));
    assert!(solutions.iter().all(|solution| solution.hanging > 0));
    let order = convergence_order(&levels.map(|l| 0.5f64.powi(l.into())), &solutions.map(|s| s.error));
    assert!((order - 3.0).abs() < 0.2, "{order}");
}
