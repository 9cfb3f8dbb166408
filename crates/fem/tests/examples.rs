//! The examples run, and show what they say.

// Its `main` function is not called here.
#[allow(dead_code)]
#[path = "../examples/poisson.rs"]
mod poisson;

use gluey_testkit::convergence_order;

fn poisson_is_of_third_order<const D: usize>(levels: [u8; 3]) {
    let solutions = levels.map(|level| poisson::solve::<D>(level).expect("positive definite"));
    assert!(solutions.iter().all(|solution| solution.hanging > 0));
    let order = convergence_order(&levels.map(|l| 0.5f64.powi(l.into())), &solutions.map(|s| s.error));
    assert!((order - 3.0).abs() < 0.2, "{D}D: {order}");
}

#[test]
fn poisson_converges_at_order_three() {
    poisson_is_of_third_order::<2>([3, 4, 5]);
    poisson_is_of_third_order::<3>([2, 3, 4]);
}
