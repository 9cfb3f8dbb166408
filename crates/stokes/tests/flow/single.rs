//! One particle by symmetry; against the reference data see `unfitted`.

use gluey_geom::Vector;
use gluey_stokes::SolverKind;

use crate::support::{UNFITTED, balls, bands, couette, mesh, params, solve};

/// By symmetry, whatever the mesh.
#[test]
fn a_centred_disc_turns_at_half_the_shear_rate() {
    let disc = balls(&[Vector::<2>::new(0.5, 0.5)]);
    let flow = solve(params(UNFITTED, SolverKind::Direct, 1e-10), mesh(&bands(6), &disc), &disc, &couette);
    assert!(flow.twists[0].velocity.amax() < 1e-10);
    assert!((flow.twists[0].spin[0] + 0.5).abs() < 1e-8);
}
