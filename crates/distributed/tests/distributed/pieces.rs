//! Fields that ranks have of their own cells: together those of the serial solver, each cell once.

use std::collections::BTreeMap;

use gluey_distributed::{BoxFlow, SharedHydrodynamics, SharedSuspension, SuspensionError};
use gluey_fem::element::{multi_index, value};
use gluey_geom::{Particle, Vector};
use gluey_levelset::{Ball, BallTree};
use gluey_motion::{Configuration, Fields, Hydrodynamics};
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind,
};

use crate::support::{self, on_ranks};

/// Places and radii; the third lies across the border of the box in the first direction.
const BODIES: [([f64; 3], f64); 3] =
    [([0.4, 0.35, 0.52], 0.14), ([0.5, 0.76, 0.7], 0.1), ([0.98, 0.6, 0.4], 0.16)];

fn suspension<const D: usize>(lubrication: Lubrication) -> SharedSuspension<D> {
    let surface = if D == 2 { 5 } else { 4 };
    let flow = BoxFlow { viscosity: 1.7, tolerance: 1e-11, max_iterations: 200 };
    let refinement = Refinement { coarsest: surface - 2, surface, band: 2.0 };
    let radii = BODIES.map(|body| body.1).to_vec();
    SharedSuspension { flow, suspension: support::suspension(refinement, lubrication, radii) }
}

fn particles<const D: usize>() -> Vec<Particle<D>> {
    BODIES.iter().map(|(x, radius)| Particle::new(Vector::from_fn(|d, _| x[d]), *radius)).collect()
}

fn balls<const D: usize>(suspension: &SharedSuspension<D>) -> Vec<Ball<D>> {
    let ball = |(x, radius): &([f64; 3], f64)| {
        Ball::periodic(Vector::from_fn(|d, _| x[d]), *radius, suspension.suspension.periods)
    };
    BODIES.iter().map(ball).collect()
}

fn serial<const D: usize>(suspension: &SharedSuspension<D>) -> Flow<D> {
    let balls = balls(suspension);
    let mesh = suspension.suspension.mesh(&balls).unwrap();
    let viscosity = suspension.flow.viscosity;
    let formulation = Formulation::Unfitted { lubrication: suspension.suspension.lubrication };
    let params = FlowParams { viscosity, formulation, solver: SolverKind::Multigrid, tolerance: 1e-12 };
    let shear = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 });
    FlowSolver::new(params).unwrap().solve_under(mesh, &balls, &Conditions::boundary(&shear)).unwrap()
}

/// The fields of all ranks.
fn shown<const D: usize>(suspension: &SharedSuspension<D>, size: usize) -> Vec<Fields<D>> {
    let found = on_ranks(size, |ranks| {
        let mut flow = SharedHydrodynamics::new(suspension, ranks);
        flow.predict(&Configuration::at(0.0, &particles())).unwrap();
        flow.fields().unwrap()
    });
    found.unwrap()
}

/// The corner and the far corner of a cell, to the bit.
fn key<const D: usize>(lower: &Vector<D>, upper: &Vector<D>) -> Vec<u64> {
    lower.iter().chain(upper.iter()).map(|x| x.to_bits()).collect()
}

/// The largest differences of velocities and pressures, over the largest of these, and of level sets.
fn differences<const D: usize>(
    suspension: &SharedSuspension<D>,
    flow: &Flow<D>,
    pieces: &[Fields<D>],
) -> [f64; 3] {
    let (balls, count) = (balls(suspension), 3usize.pow(D as u32));
    let tree = BallTree::new(&balls);
    let mut cells = BTreeMap::new();
    for piece in pieces {
        assert_eq!(piece.viscosity, vec![1.7; piece.points.len()]);
        for nodes in piece.cells.chunks_exact(count) {
            let corner = |place: usize| &piece.points[nodes[place] as usize];
            let twice = cells.insert(key(corner(0), corner(count - 1)), (piece, nodes));
            assert!(twice.is_none(), "a cell at {} in two pieces", corner(0));
        }
    }
    let space = &flow.discretisation;
    let (mesh, largest) = (&space.mesh, |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x.abs()) });
    let scale = [&flow.velocity, &flow.pressure].map(|x| x.iter().copied().fold(0.0, largest));
    let mut found = [0.0; 3];
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        let (piece, nodes) =
            cells.remove(&key(&lower, &(lower + Vector::repeat(h)))).expect("a piece has it");
        for (place, &point) in nodes.iter().enumerate() {
            let (point, local) = (point as usize, multi_index::<D>(place, 3).map(|k| 0.5 * k as f64));
            let x = lower + Vector::from_fn(|d, _| h * local[d]);
            assert_eq!(piece.points[point], x);
            let u = &flow.velocity[space.velocity.cell(index)[place] as usize * D..][..D];
            let corners = space.pressure.cell(index).iter().enumerate();
            let p: f64 = corners.map(|(q, &n)| value::<D>(1, q, &local) * flow.pressure[n as usize]).sum();
            let at = |d: usize| (piece.velocity[point][d] - u[d]) / scale[0];
            found[0] = (0..D).map(at).fold(found[0], largest);
            found[1] = largest(found[1], (piece.pressure[point] - p) / scale[1]);
            found[2] = largest(found[2], piece.level_set[point] - tree.nearest(&x).unwrap().1);
        }
    }
    assert!(cells.is_empty(), "{} cells that the serial solver does not have", cells.len());
    found
}

fn pieces_are_the_fields_of_the_serial_solver<const D: usize>(lubrication: Lubrication, limits: [f64; 2]) {
    let suspension = suspension::<D>(lubrication);
    let flow = serial(&suspension);
    for size in [1, 2, 3, 8] {
        let pieces = shown(&suspension, size);
        assert_eq!(pieces.len(), size);
        assert!(pieces.iter().all(|piece| !piece.cells.is_empty()));
        let [velocity, pressure, level_set] = differences(&suspension, &flow, &pieces);
        println!("{D}D, {size} ranks: velocities {velocity:.1e}, pressures {pressure:.1e}");
        assert!(velocity < limits[0], "{size} ranks: velocities {velocity:e}");
        assert!(pressure < limits[1], "{size} ranks: pressures {pressure:e}");
        assert_eq!(level_set, 0.0, "{size} ranks: level sets");
    }
}

#[test]
fn pieces_are_the_fields_of_the_serial_solver_in_2d() {
    pieces_are_the_fields_of_the_serial_solver::<2>(Lubrication::Deficit, [2.2e-8, 2.5e-7]);
}

#[test]
fn pieces_are_the_fields_of_the_serial_solver_in_3d() {
    pieces_are_the_fields_of_the_serial_solver::<3>(Lubrication::Deficit, [1.2e-8, 2.1e-8]);
}

/// More ranks than cells: some have none.
#[test]
fn a_rank_without_cells_has_an_empty_piece() {
    for lubrication in [Lubrication::None, Lubrication::Deficit] {
        let mut suspension = suspension::<2>(lubrication);
        suspension.suspension.refinement = Refinement { coarsest: 3, surface: 3, band: 2.0 };
        suspension.suspension.radii = vec![0.14, 0.13, 0.16];
        let pieces = shown(&suspension, 70);
        assert_eq!(pieces.iter().map(|piece| piece.cells.len() / 9).sum::<usize>(), 64);
        assert!(pieces.iter().any(|piece| piece.points.is_empty()));
    }
}

/// There is nothing to show of a flow that failed.
#[test]
fn a_flow_that_failed_has_no_fields() {
    let mut suspension = suspension::<2>(Lubrication::Deficit);
    suspension.suspension.radii = vec![0.001; 3];
    let found = on_ranks(2, |ranks| {
        let mut flow = SharedHydrodynamics::new(&suspension, ranks);
        let error = flow.predict(&Configuration::at(0.0, &particles())).unwrap_err();
        assert!(matches!(error, SuspensionError::Flow(_)), "{error}");
        flow.fields().is_some()
    });
    assert_eq!(found.unwrap(), [false, false]);
}
