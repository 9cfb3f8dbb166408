//! Boxes that repeat themselves in all directions and slide along each other, against exact solutions.

use std::f64::consts::PI;

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Lattice, Matrix, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, Formulation, PaperParams, Refinement, SolverKind, StokesError,
};
use gluey_testkit::reference::{Table, cells_of_discs, sheared_simple_cubic_lattice, sheared_square_lattice};

use crate::support::flow_solver;

/// A box of unit height.
#[derive(Clone, Copy)]
struct Box<const D: usize> {
    periods: [f64; D],
    /// Strain, with the unit height.
    strain: f64,
    level: u8,
    solver: SolverKind,
}

impl<const D: usize> Box<D> {
    fn unit(strain: f64, level: u8) -> Self {
        let solver = if D == 2 { SolverKind::Direct } else { SolverKind::Multigrid };
        Self { periods: [1.0; D], strain, level, solver }
    }

    fn balls(&self, places: &[Vector<D>], radius: f64) -> Vec<Ball<D>> {
        let lattice = Lattice::new(self.periods.map(Some)).tilted(self.strain * self.periods[1]);
        places.iter().map(|place| Ball::in_space(place, radius, &lattice, 0.0)).collect()
    }

    /// The flow in simple shear with its stress.
    fn flow(&self, places: &[Vector<D>], radius: f64) -> Flow<D> {
        self.flow_by(&mut self.flow_solver(), places, radius)
    }

    fn flow_solver(&self) -> FlowSolver<D> {
        let params = FlowParams { solver: self.solver, tolerance: 1e-9, ..FlowParams::for_dimension(D) };
        flow_solver(params)
    }

    /// The same by a solver that may remember another flow.
    fn flow_by(&self, solver: &mut FlowSolver<D>, places: &[Vector<D>], radius: f64) -> Flow<D> {
        let balls = self.balls(places, radius);
        let mesh = self.mesh(&balls);
        solver.solve_under(mesh, &balls, &Conditions::in_linear_flow(&shear()).with_stress()).unwrap()
    }

    fn mesh(&self, balls: &[Ball<D>]) -> TreeMesh<D> {
        let domain = Aabb { lower: Vector::zeros(), upper: Vector::from(self.periods) };
        let roots = self.periods.map(|period| period as u32);
        let refinement = Refinement { coarsest: self.level, ..Refinement::to_level(self.level) };
        refinement.mesh(domain, roots, [true; D], balls).unwrap()
    }

    fn volume(&self) -> f64 {
        self.periods.iter().product()
    }
}

fn shear<const D: usize>() -> Matrix<D> {
    let mut gradient = Matrix::zeros();
    gradient[(0, 1)] = 1.0;
    gradient
}

/// Relative viscosity, first and second normal stress difference.
fn rheology<const D: usize>(flow: &Flow<D>, volume: f64) -> [f64; 3] {
    let stress = flow.stress.as_ref().unwrap().of_bodies(volume);
    let last = stress[(D - 1, D - 1)];
    [1.0 + stress[(0, 1)], stress[(0, 0)] - stress[(1, 1)], stress[(1, 1)] - last]
}

/// Spin about z of a body in space, where the undisturbed flow turns at -1/2.
fn spin<const D: usize>(flow: &Flow<D>, body: usize) -> f64 {
    Dim::<D>::spin_slice(&flow.twists[body].spin).last().unwrap() - 0.5
}

fn rows(table: &Table, columns: &[&str]) -> Vec<Vec<f64>> {
    let columns: Vec<&[f64]> = columns.iter().map(|name| table.column(name).unwrap()).collect();
    (0..table.row_count()).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}

/// A place that is nowhere special.
fn somewhere<const D: usize>(seed: f64) -> Vector<D> {
    Vector::from_fn(|d, _| (0.37 + seed * [0.618, 0.755, 0.549][d]).fract())
}

/// Largest errors of viscosity (relative), normal stress differences (by the excess of viscosity) and spin.
fn errors_of_lattice<const D: usize>(
    level: u8,
    radius: impl Fn(f64) -> f64,
    exact: impl Iterator<Item = Vec<f64>>,
) -> [f64; 3] {
    let mut errors = [0.0f64; 3];
    for (index, exact) in exact.enumerate() {
        let in_box = Box::<D>::unit(exact[1], level);
        let flow = in_box.flow(&[somewhere(index as f64)], radius(exact[0]));
        let [viscosity, n1, n2] = rheology(&flow, in_box.volume());
        let normal = (n1 - exact[3]).abs().max(if D == 3 { (n2 - exact[4]).abs() } else { 0.0 });
        let found = [
            (viscosity / exact[2] - 1.0).abs(),
            normal / (exact[2] - 1.0),
            (spin(&flow, 0) - exact[exact.len() - 1]).abs(),
        ];
        errors = std::array::from_fn(|k| errors[k].max(found[k]));
    }
    errors
}

#[test]
fn a_sheared_square_lattice_has_its_viscosity_at_every_strain() {
    let exact = rows(&sheared_square_lattice().unwrap(), &["phi", "strain", "eta_r", "N1", "omega"]);
    // 16 cells a period: 2.9 and 4.9 cells a radius.
    let wanted = exact.into_iter().filter(|row| row[0] >= 0.1 && row[0] <= 0.5);
    let errors = errors_of_lattice::<2>(4, |phi| (phi / PI).sqrt(), wanted);
    println!("square lattice: {errors:?}");
    assert!(errors[0] < 8e-4 && errors[1] < 1.3e-3 && errors[2] < 2e-4, "{errors:?}");
}

#[test]
fn a_sheared_simple_cubic_lattice_has_its_viscosity_at_every_strain() {
    let exact =
        rows(&sheared_simple_cubic_lattice().unwrap(), &["phi", "strain", "eta_r", "N1", "N2", "omega_z"]);
    // Eight cells a period: 2.3 and 3.3 cells a radius.
    let wanted = exact.into_iter().filter(|row| row[0] <= 0.3);
    let errors = errors_of_lattice::<3>(3, |phi| (0.75 * phi / PI).cbrt(), wanted);
    println!("simple cubic lattice: {errors:?}");
    assert!(errors[0] < 4e-3 && errors[1] < 5e-3 && errors[2] < 5e-4, "{errors:?}");
}

#[test]
fn every_disc_of_a_cell_has_its_velocity() {
    let names = ["cell", "strain", "radius", "x", "y", "u", "v", "omega", "eta_r", "N1"];
    let all = rows(&cells_of_discs().unwrap(), &names);
    for cell in [0.0, 1.0] {
        let discs: Vec<&Vec<f64>> = all.iter().filter(|row| row[0] == cell).collect();
        let places: Vec<_> = discs.iter().map(|row| Vector::<2>::new(row[3], row[4])).collect();
        let in_box = Box::<2>::unit(discs[0][1], 5);
        let flow = in_box.flow(&places, discs[0][2]);
        let misses = discs.iter().enumerate().map(|(k, row)| {
            let velocity = (flow.twists[k].velocity - Vector::<2>::new(row[5], row[6])).norm();
            [velocity, (spin(&flow, k) - row[7]).abs()]
        });
        let worst = misses.fold([0.0f64; 2], |worst, miss| [worst[0].max(miss[0]), worst[1].max(miss[1])]);
        let [viscosity, n1, _] = rheology(&flow, 1.0);
        let errors = [viscosity / discs[0][8] - 1.0, n1 - discs[0][9]];
        println!("cell {cell}: {worst:?} {errors:?}");
        // The undisturbed velocity at the upper border is 1.
        assert!(worst[0] < 1e-3 && worst[1] < 1.5e-2, "{worst:?}");
        assert!(errors.iter().all(|e| e.abs() < 1e-3), "{errors:?}");
    }
}

/// Where the seam is and how the cell is named: the box moved, a strain more, two boxes side by side.
fn the_seam_is_nowhere<const D: usize>(level: u8, tolerance: f64) {
    let (strain, radius) = (0.35, 0.13);
    let places = [0.0, 1.0, 2.0].map(somewhere::<D>);
    let here = Box::<D>::unit(strain, level);
    let flow = here.flow(&places, radius);
    let found = rheology(&flow, 1.0);
    let same = |other: &Flow<D>, volume: f64, tolerance: f64| {
        let other_rheology = rheology(other, volume);
        let miss = (0..3).map(|k| (found[k] - other_rheology[k]).abs()).fold(0.0, f64::max);
        let of_body = |k: usize| (flow.twists[k].velocity - other.twists[k].velocity).norm();
        let worst = (0..3).map(of_body).fold(miss, f64::max);
        assert!(worst < tolerance, "{D}D: {worst:e}");
    };
    // The next strain is the same lattice, mirrored numbers and all.
    same(&Box::unit(strain + 1.0, level).flow(&places, radius), 1.0, 1e-7);
    // Whole cells away the same equations: across the upper border bodies are elsewhere along x.
    let mut by = Vector::<D>::from_fn(|d, _| 0.25 * [1.0, 2.0, 3.0][d]);
    by[0] += strain * by[1];
    same(&here.flow(&places.map(|x| x + by), radius), 1.0, 1e-7);
    let double = Box { periods: std::array::from_fn(|d| if d == 0 { 2.0 } else { 1.0 }), ..here };
    let mut copies = places.to_vec();
    copies.extend(places.map(|mut x| {
        x[0] += 1.0;
        x
    }));
    same(&double.flow(&copies, radius), 2.0, 1e-7);
    // Anywhere else up to the discretisation.
    same(&here.flow(&places.map(|x| x + somewhere::<D>(5.3)), radius), 1.0, tolerance);
}

#[test]
fn the_result_does_not_know_where_the_seam_is() {
    the_seam_is_nowhere::<2>(4, 2e-3);
    the_seam_is_nowhere::<3>(3, 1e-2);
}

/// The stress does the power that is dissipated, and multigrid and direct solver agree.
fn routes_agree<const D: usize>(level: u8, tolerance: f64) {
    let places = [0.0, 1.0, 2.0].map(somewhere::<D>);
    let in_box = Box::<D>::unit(-0.2, level);
    let [direct, multigrid] = [SolverKind::Direct, SolverKind::Multigrid]
        .map(|solver| Box { solver, ..in_box }.flow(&places, 0.14));
    let viscosity = rheology(&direct, 1.0)[0];
    let dissipation = direct.stress.as_ref().unwrap().dissipation;
    println!("{D}D: {viscosity} {dissipation} {}", multigrid.iteration_count);
    assert!((dissipation / viscosity - 1.0).abs() < tolerance, "{viscosity} {dissipation}");
    let other = rheology(&multigrid, 1.0)[0];
    assert!((other / viscosity - 1.0).abs() < 1e-7, "{viscosity} {other}");
    let miss = (0..3).map(|k| (direct.twists[k].velocity - multigrid.twists[k].velocity).norm());
    assert!(miss.fold(0.0, f64::max) < 1e-7);
    assert!(multigrid.iteration_count <= 35, "{}", multigrid.iteration_count);
}

#[test]
fn the_stress_does_the_power_that_is_dissipated() {
    routes_agree::<2>(5, 2e-3);
    routes_agree::<3>(3, 1e-2);
}

/// A cut cell whose nodes belong to good cells other than its root: with the penalties that the polynomials
/// of roots ask for, the velocities in it are wild, and the power of the first flow is 8 % too large.
#[test]
fn penalties_grow_where_the_flow_asks_for_it() {
    let radius = 0.039_894_228;
    let few = [[0.728_130_5, 0.303_644_1], [0.670_116_2, 0.218_358_6], [0.834_979_7, 0.318_224_3]];
    let more = [[0.606_799_8, 0.943_534_6], [0.683_600_9, 0.979_068_0], [0.519_435_5, 0.991_085_7]];
    for (strain, places) in [(-0.48, few), (-0.24, more)] {
        let places = places.map(Vector::<2>::from);
        let fine = rheology(&Box::<2>::unit(strain, 7).flow(&places, radius), 1.0)[0];
        let coarse = Box::<2>::unit(strain, 5);
        for solver in [SolverKind::Direct, SolverKind::Multigrid] {
            let flow = Box { solver, ..coarse }.flow(&places, radius);
            let viscosity = rheology(&flow, 1.0)[0];
            let dissipation = flow.stress.as_ref().unwrap().dissipation;
            println!("{solver:?}: {viscosity} {dissipation} {fine} {}", flow.iteration_count);
            assert!((viscosity / fine - 1.0).abs() < 3e-3, "{viscosity} {fine}");
            assert!((dissipation / viscosity - 1.0).abs() < 3e-3, "{viscosity} {dissipation}");
        }
    }
}

/// No equation determines the mean velocity of a box without walls. Were it kept, guesses extrapolated from
/// two solutions would make it grow exponentially from step to step.
#[test]
fn the_next_guess_forgets_the_mean_velocity() {
    let (in_box, places) = (Box::<3>::unit(0.3, 3), [somewhere(1.0)]);
    let mut solver = in_box.flow_solver();
    let flow = in_box.flow_by(&mut solver, &places, 0.25);
    let mut drifting = solver.warm_start().unwrap().0.clone();
    drifting.velocity.iter_mut().for_each(|u| *u += 1e3);
    // The body drifts with the fluid: velocity, then spin.
    drifting.bodies.iter_mut().take(3).for_each(|u| *u += 1e3);
    let mesh = in_box.mesh(&in_box.balls(&places, 0.25));
    solver.set_warm_start(mesh, drifting, None).unwrap();
    let again = in_box.flow_by(&mut solver, &places, 0.25);
    let kept = &solver.warm_start().unwrap().0.velocity;
    let largest = kept.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    assert!(largest < 10.0, "{largest}");
    assert!((spin(&flow, 0) - spin(&again, 0)).abs() < 1e-7);
    assert!(again.iteration_count < flow.iteration_count);
}

/// Bodies that are held need no force in all, and films act between images that slide.
#[test]
fn forces_on_held_bodies_sum_to_zero() {
    let in_box = Box::<2>::unit(0.3, 5);
    // The second lies above the first across the seam, a film of 0.02 a between them.
    let radius = 0.11;
    let first = Vector::<2>::new(0.4, 0.93);
    let above = first + Vector::<2>::new(0.6, 0.8) * (2.02 * radius);
    let balls = in_box.balls(&[first, above], radius);
    let mesh = Refinement::to_level(5).mesh(Aabb::unit(), [1, 1], [true; 2], &balls).unwrap();
    let params = FlowParams { tolerance: 1e-10, ..FlowParams::for_dimension(2) };
    let mut solver = flow_solver::<2>(params);
    let mut prepared = solver.prepared(mesh, &balls).unwrap();
    let conditions = Conditions::in_linear_flow(&shear());
    let free = prepared.solve(&conditions).unwrap();
    assert_eq!(free.films.len(), 1);
    // As one body but for little: by the film.
    let approach = (free.twists[1].velocity - free.twists[0].velocity + shear::<2>() * (above - first))
        .dot(&(above - first).normalize());
    assert!(approach.abs() < 0.02 * radius, "{approach}");
    let twists = vec![Default::default(); 2];
    let held = prepared.solve(&conditions.with_twists(&twists)).unwrap();
    let [a, b] = [held.wrenches[0].force, held.wrenches[1].force];
    assert!((a + b).norm() < 1e-7 * a.norm() && a.norm() > 1.0, "{a} {b}");
}

#[test]
fn other_formulations_say_that_they_cannot() {
    let paper = Formulation::Paper(PaperParams::default());
    let balls = Box::<2>::unit(0.0, 4).balls(&[somewhere(0.0)], 0.2);
    let mesh = Refinement::to_level(4).mesh(Aabb::unit(), [1, 1], [true; 2], &balls).unwrap();
    let params = FlowParams { formulation: paper, ..FlowParams::for_dimension(2) };
    let refused = flow_solver::<2>(params).solve_under(mesh, &balls, &Conditions::in_linear_flow(&shear()));
    assert!(matches!(refused, Err(StokesError::Unsupported { .. })), "{refused:?}");
}
