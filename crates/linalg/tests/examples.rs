//! The examples run, and show what they say.

// Its `main` function is not called here.
#[allow(dead_code)]
#[path = "../examples/two_grid.rs"]
mod two_grid;

#[test]
fn two_grid_iterations_do_not_grow_with_the_grid() {
    let counts = [15, 31, 63].map(|n| two_grid::iterations(n).expect("converges"));
    assert!(counts.iter().all(|&count| count <= counts[0] + 1 && count < 15), "{counts:?}");
}
