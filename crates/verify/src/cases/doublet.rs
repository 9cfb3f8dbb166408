//! Reversibility: a pair that turns half around comes back to its distance.

use gluey_geom::{Particle, Vector};
use gluey_motion::{Integrator, Scheme};
use gluey_stokes::{FlowSolver, Refinement};

use crate::case::{Case, Extent, Number, Tables, Task, VerifyError};
use crate::method::{METHODS, Method};
use crate::plot::Plot;
use crate::set_up::{RADIUS, couette, level, mesh, pair};

/// Gap at the start, in radii.
const GAP: f64 = 0.5;
/// No pair takes longer, in units of the time step.
const MOST_TIME: f64 = 40.0;

/// The chapter.
pub const CASE: Case = Case {
    name: "doublet",
    title: "Reversibility of a doublet",
    text: "Two free discs of radius 0.05 around the centre of the unit box with u = (y - 1/2, 0) on all sides, half a radius apart on \
           a line along the flow, turn around each other. Stokes flow is reversible and the set-up has a mirror: after half \
           a turn their gap is exactly what it was. Adams-Bashforth 2, no contact law. Gap after half a turn less that at the \
           start, in radii.",
    keys: &["a/h", "time step"],
    measures: &["gap", "time of half a turn", "smallest gap"],
    tasks,
    numbers,
    plot,
};

/// Cells per radius and time step.
fn runs(extent: Extent) -> &'static [(f64, f64)] {
    match extent {
        Extent::Quick => &[(3.2, 0.2)],
        Extent::Full => &[(3.2, 0.2), (6.4, 0.1), (12.8, 0.05)],
    }
}

fn tasks(extent: Extent) -> Vec<Task> {
    let task = |method: &'static Method, (cells, step): (f64, f64)| {
        Task::new(method.name, &[cells, step], move || measure(method, cells, step))
    };
    METHODS.iter().flat_map(|method| runs(extent).iter().map(move |&run| task(method, run))).collect()
}

fn measure(method: &Method, cells: f64, step: f64) -> Result<Vec<f64>, VerifyError> {
    let gap_fraction = if method.refines_films { 1.0 } else { 0.0 };
    let refinement = Refinement { gap_fraction, gap_levels: 9, ..Refinement::to_level(level(RADIUS, cells)) };
    let start = pair(Vector::<2>::repeat(0.5), RADIUS, GAP, 0.0);
    let mut particles = start.map(|disc| Particle::new(*disc.center(), RADIUS));
    let mut solver = FlowSolver::new(method.params::<2>(1e-9))?;
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let (mut before, mut smallest) = ((0.0, GAP), GAP);
    let steps = (MOST_TIME / step) as usize;
    for n in 0..steps {
        let discs = particles.map(|p| gluey_levelset::Ball::new(p.pose.position, p.radius));
        let flow = solver.solve(mesh(&refinement, &discs)?, &discs, &couette)?;
        integrator.advance(step, &mut particles, &flow.twists);
        let line = particles[1].pose.position - particles[0].pose.position;
        let now = (turned(&line), particles[0].gap(&particles[1]) / RADIUS);
        smallest = now.1.min(smallest);
        // The line is along the flow again when it has turned by -180 degrees: where y changes sign.
        if before.0 < 0.0 && now.0 >= 0.0 {
            let part = -before.0 / (now.0 - before.0);
            let gap = before.1 + part * (now.1 - before.1);
            return Ok(vec![gap - GAP, (n as f64 + part) * step, smallest]);
        }
        before = now;
    }
    Err(VerifyError::NoHalfTurn(steps))
}

/// Sine of the angle of the line of centres: negative while it turns clockwise through the lower half.
fn turned(line: &Vector<2>) -> f64 {
    line[1] / line.norm()
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for method in METHODS {
        for cells in table.steps("a/h", method.name, &[]) {
            numbers.extend(table.values("gap", method.name, &[("a/h", cells)]).into_iter().map(|value| {
                Number { what: format!("gap after half a turn, a/h = {cells}"), method: method.name, value }
            }));
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    Plot::of_methods(
        "cells per radius *a*/*h*",
        "change of the gap in radii",
        &["half a turn"],
        |method, _| {
            let change = table.values("gap", method, &[]).into_iter().map(f64::abs);
            table.values("a/h", method, &[]).into_iter().zip(change).collect()
        },
    )
}
