//! Reversibility: a pair that turns half around comes back to its distance.

use gluey_contact::{BodyStep, Film, FilmError, FilmMemory, FilmReport, PairKey, film_reach};
use gluey_geom::{Aabb, Particle, Twist, Vector};
use gluey_levelset::Ball;
use gluey_motion::{Integrator, Scheme};
use gluey_stokes::{FlowSolver, Partner, Refinement};

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{DEFAULT_TOLERANCE, RADIUS, couette, level, mesh, pair};
use crate::statistics::mean;

/// No pair takes longer for half a turn.
const MOST_TIME: f64 = 40.0;
/// Half a turn of the doublet of figure 5 (data/reference/README.md).
const HALF_TURN: f64 = 7.769130;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "doublet",
    title: "Reversibility of a doublet",
    text: "Two free discs of radius 0.05 around the centre of the unit box with u = (y - 1/2, 0) on all sides turn around each \
           other. Stokes flow is reversible and the set-up has a mirror: after half a turn their gap is exactly what it was. \
           Start 0 is half a radius apart on a line along the flow, start 1 the pair of figure 5, 4e-4 radii apart, whose half \
           turn takes 7.769130 (data/reference/pair2d_trajectory.csv, 1e-7) and which only formulations that refine or lubricate films hold apart. \
           As a run of such a case does it by default: Adams-Bashforth 2, films in balance where the formulation lubricates, solver \
           tolerance 1e-6, its mesh; no contact law. Gap after half a turn less that at the start, in radii.",
    keys: &["start", "a/h", "time step"],
    measures: &["gap", "half a turn", "smallest gap"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

/// Cells per radius and time step.
fn runs(extent: Extent) -> &'static [(f64, f64)] {
    extent.pick(&[(6.4, 0.1), (12.8, 0.1)], &[(6.4, 0.1), (12.8, 0.1), (12.8, 0.05), (25.6, 0.1)])
}

fn tasks(extent: Extent) -> Vec<Task> {
    let task = |method: &'static Method, start: f64, (cells, step): (f64, f64)| {
        Task::new(method.name, &[start, cells, step], move || measure(method, start, cells, step))
    };
    let of_method = |method: &'static Method| {
        let starts = if method.lubricates { &[0.0, 1.0][..] } else { &[0.0] };
        starts.iter().flat_map(move |&start| runs(extent).iter().map(move |&run| task(method, start, run)))
    };
    METHODS.iter().flat_map(of_method).collect()
}

/// The centres at the start.
fn start(number: f64) -> [Vector<2>; 2] {
    match number {
        1.0 => [Vector::<2>::new(0.451, 0.51), Vector::<2>::new(0.549, 0.49)],
        _ => pair(Vector::<2>::repeat(0.5), RADIUS, 0.5, 0.0).map(|disc| *disc.center()),
    }
}

fn measure(method: &Method, number: f64, cells: f64, step: f64) -> Result<Vec<f64>, VerifyError> {
    let refinement = Refinement::to_level(level(RADIUS, cells));
    let mut particles = start(number).map(|center| Particle::new(center, RADIUS));
    let first = particles[1].pose.position - particles[0].pose.position;
    let gap_at_start = particles[0].gap(&particles[1]) / RADIUS;
    let mut solver = FlowSolver::new(method.params::<2>(DEFAULT_TOLERANCE))?;
    let (mut integrator, mut memory) = (Integrator::new(Scheme::AdamsBashforth2), FilmMemory::default());
    let (mut before, mut smallest) = ((0.0, gap_at_start), gap_at_start);
    let steps = (MOST_TIME / step) as usize;
    for n in 0..steps {
        let discs = particles.map(|p| Ball::new(p.pose.position, p.radius));
        let mut twists = solver.solve(mesh(&refinement, &discs)?, &discs, &couette)?.twists;
        if method.lubricates {
            integrator
                .with_step(step, &particles, |step| open_films(&mut memory, step, &discs, &mut twists))?;
        }
        integrator.advance(step, &mut particles, &twists);
        let line = particles[1].pose.position - particles[0].pose.position;
        let now = (sine(&first, &line), particles[0].gap(&particles[1]) / RADIUS);
        smallest = now.1.min(smallest);
        // Negative while the line turns clockwise through the first half.
        if before.0 < 0.0 && now.0 >= 0.0 {
            let part = -before.0 / (now.0 - before.0);
            let gap = before.1 + part * (now.1 - before.1);
            return Ok(vec![gap - gap_at_start, (n as f64 + part) * step, smallest]);
        }
        before = now;
    }
    Err(VerifyError::NoHalfTurn(steps))
}

/// As a run does it in each step: films have the gaps that their impulses give.
fn open_films(
    memory: &mut FilmMemory,
    step: &BodyStep<'_, 2>,
    discs: &[Ball<2>],
    twists: &mut [Twist<2>],
) -> Result<FilmReport, FilmError> {
    let reach = film_reach(step, twists, 0.0);
    let film = |film: gluey_stokes::Film<2>| Film {
        pair: name(&film),
        branch: film.branch(),
        slide: Vector::zeros(),
        is_held: [false; 2],
        gap: film.gap,
        curvature_radius: film.curvature_radius(),
    };
    let films: Vec<Film<2>> =
        gluey_stokes::films(discs, &Aabb::unit(), reach).into_iter().map(film).collect();
    memory.open(step, &films, twists)
}

/// The name of a film, its walls counted by axes.
fn name(film: &gluey_stokes::Film<2>) -> PairKey {
    let body = film.body as usize;
    match film.partner {
        Partner::Body(other) => PairKey::new(body, other as usize),
        Partner::Wall { axis, is_upper } => PairKey::wall(body, 2 * axis as usize + usize::from(is_upper)),
    }
}

/// Sine of the angle from one line to another.
fn sine(first: &Vector<2>, line: &Vector<2>) -> f64 {
    (first[0] * line[1] - first[1] * line[0]) / (first.norm() * line.norm())
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in METHODS.iter().map(|method| method.name) {
        for (start, name) in [(0.0, "half a radius apart"), (1.0, "figure 5")] {
            for cells in table.steps("a/h", method, &[("start", start)]) {
                for step in table.steps("time step", method, &[("start", start), ("a/h", cells)]) {
                    let at = [("start", start), ("a/h", cells), ("time step", step)];
                    let run = format!("{name}, a/h = {cells}, step {step}");
                    let value = mean(&table.values("gap", method, &at));
                    let what = format!("{run}, change of the gap");
                    numbers.push(Number::new(NumberKind::Error, what, method, value));
                    if start == 1.0 {
                        let value = mean(&table.values("half a turn", method, &at)) / HALF_TURN - 1.0;
                        let what = format!("{run}, time of half a turn");
                        numbers.push(Number::new(NumberKind::Error, what, method, value));
                    }
                }
            }
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["half a radius apart", "figure 5"];
    Plot::of_methods("cells per radius *a*/*h*", "change of the gap in radii", &things, |method, start| {
        let at = [("start", start as f64), ("time step", 0.1)];
        let change = table.values("gap", method, &at).into_iter().map(f64::abs);
        table.values("a/h", method, &at).into_iter().zip(change).collect()
    })
}
