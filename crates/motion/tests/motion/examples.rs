//! The example runs, and what it asserts holds.

#[path = "../../examples/encounter.rs"]
mod encounter;

#[test]
fn an_encounter_is_reversible() {
    encounter::main().expect("a good pair");
}
