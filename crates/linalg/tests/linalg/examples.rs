//! The examples run, and what they assert holds.

#[path = "../../examples/two_grid.rs"]
mod two_grid;

#[test]
fn two_grid_iterations_do_not_grow_with_the_grid() {
    two_grid::main().expect("the example runs");
}
