//! Bodies with gaps narrower than cells: flows on ranks beside those of the serial solver, at its tolerance
//! and in as many iterations.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_distributed::{BoxFlow, MyFlow, Suspension};
use gluey_geom::{Aabb, Dim, Space, Vector};
use gluey_levelset::Ball;
use gluey_parallel::{Communicator, Threads};
use gluey_stokes::{
    Conditions, CutCellPressures, Flow, FlowParams, FlowSolver, Formulation, Refinement, SolverKind,
    default_offset,
};

/// Of the flows that are compared.
const TOLERANCE: f64 = 1e-11;
/// Of those that they are compared with.
const EXACT: f64 = 1e-13;

/// Bodies of one radius in a shear flow.
struct Example<const D: usize> {
    centers: Vec<Vector<D>>,
    radius: f64,
    /// Levels of the cells away from bodies and at them.
    levels: [u8; 2],
    /// In the first direction.
    is_periodic: bool,
}

impl<const D: usize> Example<D>
where
    Dim<D>: Space<D>,
{
    fn suspension(&self) -> Suspension<D> {
        let [coarsest, surface] = self.levels;
        Suspension {
            flow: BoxFlow { viscosity: 1.0, tolerance: TOLERANCE, max_iterations: 200 },
            domain: Aabb::unit(),
            roots: [1; D],
            periods: std::array::from_fn(|d| (self.is_periodic && d == 0).then_some(1.0)),
            refinement: Refinement { coarsest, surface, band: 2.0, gap_fraction: 0.0, gap_levels: 0 },
            formulation: Formulation::RigidDofs {
                offset: default_offset(D),
                cut_cell_pressures: CutCellPressures::Aggregate,
            },
            radii: vec![self.radius; self.centers.len()],
            wrenches: Vec::new(),
            given: Vec::new(),
            force_density: None,
            shear_rate: 1.0,
            shear_stress: None,
        }
    }

    fn solve(&self, ranks: &dyn Communicator) -> MyFlow<D> {
        self.suspension().solve(ranks, &self.centers, &[], 1.0).unwrap()
    }

    fn serial(&self, tolerance: f64) -> Flow<D> {
        let Suspension { domain, roots, periods, refinement, formulation, .. } = self.suspension();
        let ball = |&center: &Vector<D>| Ball::periodic(center, self.radius, periods);
        let balls: Vec<Ball<D>> = self.centers.iter().map(ball).collect();
        let mesh = refinement.mesh(domain, roots, periods.map(|p| p.is_some()), &balls).unwrap();
        let solver = SolverKind::Multigrid;
        let params = FlowParams { viscosity: 1.0, formulation, solver, tolerance };
        let shear = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 });
        let conditions = Conditions::boundary(&shear);
        FlowSolver::<D>::new(params).unwrap().solve_under(mesh, &balls, &conditions).unwrap()
    }

    /// Velocities are within `limit` of the exact ones on these numbers of ranks, in as many iterations as
    /// the serial solver takes, within one, and the same bits run after run.
    fn check(&self, sizes: &[usize], limit: f64) {
        let [exact, serial] = [EXACT, TOLERANCE].map(|tolerance| self.serial(tolerance));
        let scale = exact.velocity.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        for &size in sizes {
            let run = || Threads::run(size, |ranks| self.solve(ranks)).unwrap();
            let parts = run();
            let velocity = velocities(&parts);
            assert_eq!(velocity.len(), exact.velocity.len());
            let differences = velocity.iter().zip(&exact.velocity).map(|(a, b)| (a - b).abs());
            let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x) };
            let difference = differences.fold(0.0, largest) / scale;
            println!(
                "{} bodies, {size} ranks: {difference:.1e}, iterations {} and {}",
                self.centers.len(),
                parts[0].iterations,
                serial.iteration_count
            );
            assert!(difference < limit, "{size} ranks: {difference:e}");
            let iterations = parts[0].iterations;
            assert!(iterations.abs_diff(serial.iteration_count) <= 1, "{size} ranks: {iterations}");
            let again = run();
            assert_eq!((velocities(&again), &again[0].twists), (velocity, &parts[0].twists), "the same bits");
        }
    }
}

fn velocities<const D: usize>(parts: &[MyFlow<D>]) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    parts.iter().flat_map(|part| part.velocity.iter().flatten().copied()).collect()
}

/// The discs of trio-2d, the first two with this gap in radii, the third as near to the second.
fn trio(gap: f64) -> Example<2> {
    let distance = 0.05 * (2.0 + gap);
    let second = Vector::<2>::new(0.5 + 0.8 * distance, 0.51 - 0.6 * distance);
    let third = second + Vector::<2>::new(0.9 * distance, 0.19f64.sqrt() * distance);
    let centers = vec![Vector::<2>::new(0.5, 0.51), second, third];
    Example { centers, radius: 0.05, levels: [5, 7], is_periodic: true }
}

/// The spheres of pair-3d with this gap.
fn pair(gap: f64) -> Example<3> {
    let distance = 0.05 * (2.0 + gap);
    let first = Vector::<3>::new(0.45, 0.51, 0.5);
    let second = first + Vector::<3>::new(0.8 * distance, -0.6 * distance, 0.0);
    Example { centers: vec![first, second], radius: 0.05, levels: [3, 5], is_periodic: false }
}

/// Fifty spheres at random, some of which nearly touch, in a box with walls.
fn fifty(levels: [u8; 2]) -> Example<3> {
    let radius = 0.08;
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    let mut centers: Vec<Vector<3>> = Vec::new();
    while centers.len() < 50 {
        let center = Vector::<3>::from_fn(|_, _| 1.02 * radius + (1.0 - 2.04 * radius) * next());
        if centers.iter().all(|other| (other - center).norm() > 2.005 * radius) {
            centers.push(center);
        }
    }
    Example { centers, radius, levels, is_periodic: false }
}

#[test]
fn three_discs_move_as_in_the_serial_solver() {
    for gap in [0.1, 0.01, 1e-3, 1e-5] {
        trio(gap).check(&[1, 2, 3, 4, 8], 3e-10);
    }
}

#[test]
fn two_spheres_move_as_in_the_serial_solver() {
    for gap in [1.0, 0.1, 1e-3] {
        pair(gap).check(&[1, 2, 3, 4, 8], 3.6e-12);
    }
}

#[test]
fn fifty_spheres_move_as_in_the_serial_solver() {
    fifty([3, 4]).check(&[1, 3, 8], 4.2e-10);
}
