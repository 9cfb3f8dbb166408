//! The example runs, and what it asserts holds.

#[path = "../examples/suspension.rs"]
mod suspension;

#[test]
fn a_suspension_is_drawn_and_measured() {
    suspension::main();
    let balls = suspension::suspension(1);
    let tree = gluey_levelset::BallTree::new(&balls);
    let slice = suspension::slice(&tree, 0.25, 40, 20);
    assert_eq!(slice.lines().count(), 20);
    assert!(slice.contains('#') && slice.contains('+') && slice.contains('.'));
}
