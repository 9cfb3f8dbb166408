//! The crate as strangers get it: packaged, unpacked, and used by a program that knows nothing of this
//! workspace.

use std::path::Path;

use gluey_testkit::Stranger;

/// A program on `gluey-contact` alone.
const PROGRAM: &str = r#"use gluey_contact::geom::{Twist, Vector};
use gluey_contact::{ContactError, ContactModel, ContactParams, PairContact, StepGeometry};
fn main() -> Result<(), ContactError> {
    let (mut positions, radii, drift) = ([[0.0, 0.0], [2.1, 0.3]].map(Vector::from), [1.0; 2], [Vector::zeros(); 2]);
    let mut contact = PairContact::<2>::new(ContactParams::default());
    for step in 0..40 {
        let push = if step < 20 { 1.0 } else { -1.0 };
        let mut twists = [push, -push].map(|x| Twist { velocity: Vector::<2>::new(x, 0.0), ..Twist::default() });
        let geometry = StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: 0.05, dt: 0.05 };
        contact.correct(&geometry, &mut twists)?;
        positions.iter_mut().zip(&twists).for_each(|(x, twist)| *x += twist.velocity * 0.05);
        println!("{:.3} {}", (positions[1] - positions[0]).norm() - 2.0, contact.contacts().len());
    }
    Ok(())
}
"#;

#[test]
fn a_program_outside_the_workspace_runs() {
    assert!(PROGRAM.lines().count() <= 15);
    let stranger = Stranger {
        uses: "gluey-contact",
        default_features: false,
        packages: &["gluey-geom", "gluey-contact"],
        program: PROGRAM,
        folder: Path::new(env!("CARGO_TARGET_TMPDIR")).join("published"),
    };
    let printed = stranger.run();
    let gaps: Vec<&str> = printed.lines().collect();
    // They meet, stay together until the pull has made up for the push, and part.
    assert_eq!(gaps.len(), 40);
    assert!(gaps.contains(&"0.000 1") && gaps[39].ends_with(" 0"), "{printed}");
}
