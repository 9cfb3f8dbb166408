//! One particle against the reference data.

use gluey_geom::Vector;
use gluey_stokes::SolverKind;
use gluey_testkit::reference::single_2d_velocities;

use crate::support::{RIGID, balls, couette, mesh, params, resolved_gaps, solve};

#[test]
fn an_off_centre_disc_moves_as_the_reference_says() {
    let table = single_2d_velocities().unwrap();
    let at = |column: &str| table.column(column).unwrap()[1];
    let disc = balls(&[Vector::<2>::new(at("x"), at("y"))]);
    let flow =
        solve(params(RIGID, SolverKind::Direct, 1e-8), mesh(&resolved_gaps(8), &disc), &disc, &couette);
    let (u, spin) = (flow.twists[0].velocity, flow.twists[0].spin[0]);
    assert!((u[0] - at("Ux")).abs() <= 2e-4, "Ux = {}", u[0]);
    assert!((u[1] - at("Uy")).abs() <= 2e-4, "Uy = {}", u[1]);
    assert!((spin - at("omega")).abs() <= 2e-3, "omega = {spin}");
}

/// By symmetry, whatever the mesh.
#[test]
fn a_centred_disc_turns_at_half_the_shear_rate() {
    let disc = balls(&[Vector::<2>::new(0.5, 0.5)]);
    let flow =
        solve(params(RIGID, SolverKind::Direct, 1e-10), mesh(&resolved_gaps(6), &disc), &disc, &couette);
    assert!(flow.twists[0].velocity.amax() < 1e-10);
    assert!((flow.twists[0].spin[0] + 0.5).abs() < 1e-8);
}
