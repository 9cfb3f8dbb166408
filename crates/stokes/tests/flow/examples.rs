//! The examples run, and what they assert holds.

#[path = "../../examples/sedimenting_sphere.rs"]
mod sedimenting_sphere;
#[path = "../../examples/two_discs.rs"]
mod two_discs;

#[test]
fn a_sphere_settles_by_the_law_of_stokes() {
    sedimenting_sphere::main().unwrap();
}

#[test]
fn two_discs_approach_as_the_reference_says() {
    two_discs::main().unwrap();
}
