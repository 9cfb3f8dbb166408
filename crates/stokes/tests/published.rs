//! The crate as strangers get it: packaged, unpacked, and used by a program that knows nothing of this
//! workspace.

use std::path::Path;

use gluey_testkit::Stranger;

/// A program on `gluey-stokes` alone.
const PROGRAM: &str = r#"use gluey_stokes::geom::{Aabb, Vector};
use gluey_stokes::levelset::Ball;
use gluey_stokes::{FlowParams, FlowSolver, Refinement, StokesError};

fn main() -> Result<(), StokesError> {
    let mut solver = FlowSolver::<2>::new(FlowParams::for_dimension(2))?;
    for y in [0.5, 0.6, 0.7] {
        let disc = [Ball::new(Vector::<2>::new(0.5, y), 0.15)];
        let mesh = Refinement::to_level(4).mesh(Aabb::unit(), [1, 1], [false; 2], &disc)?;
        let flow = solver.solve(mesh, &disc, &|x| Vector::<2>::new(x[1] - 0.5, 0.0))?;
        println!("{:.3} {:.3}", flow.twists[0].velocity[0].abs(), flow.twists[0].spin[0]);
    }
    Ok(())
}
"#;

#[test]
fn a_program_outside_the_workspace_runs() {
    assert!(PROGRAM.lines().count() <= 15);
    let stranger = Stranger {
        uses: "gluey-stokes",
        default_features: true,
        packages: &[
            "gluey-geom",
            "gluey-parallel",
            "gluey-linalg",
            "gluey-levelset",
            "gluey-fem",
            "gluey-contact",
            "gluey-motion",
            "gluey-stokes",
        ],
        program: PROGRAM,
        folder: Path::new(env!("CARGO_TARGET_TMPDIR")).join("published-stokes"),
    };
    let printed = stranger.run();
    let rows: Vec<Vec<f64>> = printed
        .lines()
        .map(|line| line.split(' ').filter_map(|number| number.parse().ok()).collect())
        .collect();
    // At rest in the middle, faster and faster above, and always turning at about half the shear rate.
    assert_eq!(rows.len(), 3);
    assert!(rows[0][0] < 1e-3 && rows.windows(2).all(|pair| pair[1][0] > pair[0][0] + 0.08), "{printed}");
    assert!(rows.iter().all(|row| (row[1] + 0.5).abs() < 0.1), "{printed}");
}
