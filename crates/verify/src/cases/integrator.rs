//! Orders in time of the integrators, with exact velocities.

use gluey_contact::{FilmMemory, film_reach};
use gluey_geom::{Particle, Vector};
use gluey_motion::{Configuration, Hydrodynamics, Integrator, LinearFlow, PairMobility, Scheme};
use gluey_testkit::convergence_order;
use gluey_testkit::reference::pair_3d_trajectory_unbounded;
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::number::{Number, NumberKind};
use crate::plot::{Curve, Plot};
use crate::set_up::exact_row;

const RADIUS: f64 = 0.05;
/// Before the closest approach: errors made on the way in are not undone on the way out.
const END: f64 = 7.0;
const STEPS: [u32; 4] = [700, 1400, 2800, 5600];
const SCHEMES: [(&str, Scheme); 2] =
    [("euler", Scheme::Euler), ("adams-bashforth-2", Scheme::AdamsBashforth2)];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "integrator",
    title: "Order in time",
    text: "Two spheres that meet in unbounded shear (paper, figure 7) with exact velocities (Batchelor and Green 1972) and films in balance, as in a run, to t = 7, \
           against data/reference/pair3d_trajectory_unbounded.csv (1e-8): distance of a centre from where it should be at the \
           end, and from where it began after the shear was reversed and as many steps were made back, in radii. Euler has \
           order 1, Adams-Bashforth 2 order 2; on its way back it had order 3 without films.",
    keys: &["time step"],
    measures: &["end", "return"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(_: Extent) -> Vec<Task> {
    let task = |((name, scheme), steps)| {
        let step = END / f64::from(steps);
        Task::new(name, &[step], move || measure(scheme, step, steps))
    };
    iproduct!(SCHEMES, STEPS).map(task).collect()
}

fn measure(scheme: Scheme, step: f64, steps: u32) -> Result<Vec<f64>, VerifyError> {
    let reference = pair_3d_trajectory_unbounded()?;
    let [x, y] = exact_row(&reference, &[("t", END)], ["x1", "y1"])?;
    let exact = Vector::<3>::new(x, y, 0.5);
    let starts = [Vector::<3>::new(0.3, 0.525, 0.5), Vector::<3>::new(0.7, 0.475, 0.5)];
    let mut particles = starts.map(|x| Particle::new(x, RADIUS));
    let mut integrator = Integrator::new(scheme);
    let mut films = FilmMemory::default();
    advance(1.0, &mut integrator, &mut films, &mut particles, step, steps)?;
    let end = (particles[0].pose.position - exact).norm() / RADIUS;
    integrator.reverse();
    films.reverse();
    advance(-1.0, &mut integrator, &mut films, &mut particles, step, steps)?;
    Ok(vec![end, (particles[0].pose.position - starts[0]).norm() / RADIUS])
}

fn advance(
    shear_factor: f64,
    integrator: &mut Integrator<3>,
    films: &mut FilmMemory,
    particles: &mut [Particle<3>; 2],
    step: f64,
    steps: u32,
) -> Result<(), VerifyError> {
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
    for n in 0..steps {
        let now = Configuration { shear_factor, ..Configuration::at(step * f64::from(n), particles) };
        let mut twists = flow.predict(&now)?.twists;
        integrator.with_step(step, particles, |step| {
            let near = flow.films(&now, film_reach(step, &twists, 0.0));
            films.open(step, &near, &mut twists)
        })?;
        integrator.advance(step, particles, &twists);
    }
    Ok(())
}

fn points(table: &CaseTable, measure: &str, scheme: &str) -> Vec<(f64, f64)> {
    table.values("time step", scheme, &[]).into_iter().zip(table.values(measure, scheme, &[])).collect()
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (measure, (method, _)) in iproduct!(CASE.measures, SCHEMES) {
        let (steps, errors): (Vec<f64>, Vec<f64>) = points(table, measure, method).into_iter().unzip();
        let what = format!("order of the error at the {measure}");
        numbers.push(Number::new(NumberKind::Order, what, method, convergence_order(&steps, &errors)));
        let what = format!("error at the {measure}, smallest step");
        let smallest = errors.last().copied().unwrap_or(f64::NAN);
        numbers.push(Number::new(NumberKind::Size, what, method, smallest));
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let curve = |color: usize, dashes: usize| Curve {
        label: format!("{}, {}", SCHEMES[color].0, CASE.measures[dashes]),
        color,
        dashes,
        points: points(table, CASE.measures[dashes], SCHEMES[color].0).into_iter().rev().collect(),
    };
    let curves = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(color, dashes)| curve(color, dashes));
    Plot { x: "time step", y: "error in radii", curves: curves.to_vec() }
}
