//! A sphere that is moved or turned near a plane wall.

use std::f64::consts::PI;

use gluey_geom::{Dim, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};

use crate::case::{Case, Extent, Tables, Task, VerifyError};
use crate::method::{FILM_METHODS, Method};
use crate::number::{Kind, Number};
use crate::plot::Plot;
use crate::set_up::{level, mean_and_scatter, mesh, shift};
use crate::statistics::{largest, rms};

/// So small that the other walls are 40 radii away or more.
const RADIUS: f64 = 0.0125;

/// A distance of the centre from the wall in radii, `cosh(alpha)`, with the force on a sphere that is moved
/// along it over `6 pi mu a U` and the torque on one that is turned about an axis along it over
/// `8 pi mu a^3 w` (Goldman, Cox and Brenner 1967).
struct Place {
    alpha: f64,
    force: f64,
    torque: f64,
}

static PLACES: [Place; 4] = [
    Place { alpha: 1.0, force: 1.5675, torque: 1.0998 },
    Place { alpha: 0.5, force: 2.1514, torque: 1.3877 },
    Place { alpha: 0.3, force: 2.6475, torque: 1.7012 },
    Place { alpha: 0.1, force: 3.7863, torque: 2.5056 },
];

impl Place {
    /// Gap in radii.
    fn gap(&self) -> f64 {
        self.alpha.cosh() - 1.0
    }

    /// The force on a sphere moved towards the wall over `6 pi mu a U` (Brenner 1961).
    fn normal_force(&self) -> f64 {
        let sinh = self.alpha.sinh();
        let term = |n: f64| {
            let k = 2.0 * n + 1.0;
            let above = 2.0 * (k * self.alpha).sinh() + k * (2.0 * self.alpha).sinh();
            let below = 4.0 * (0.5 * k * self.alpha).sinh().powi(2) - (k * sinh).powi(2);
            n * (n + 1.0) / ((2.0 * n - 1.0) * (2.0 * n + 3.0)) * (above / below - 1.0)
        };
        let count = (20.0 / self.alpha) as usize;
        4.0 / 3.0 * sinh * (1..=count).map(|n| term(n as f64)).sum::<f64>()
    }
}

/// The chapter.
pub const CASE: Case = Case {
    name: "wall",
    title: "A sphere near a wall",
    text: "A sphere of radius 0.0125 near a wall of the unit box at rest, held at a velocity across or along the wall or at a spin \
           about an axis along it, at gaps of 0.54, 0.13, 0.045 and 0.005 radii and several places along the wall: relative errors of the force \
           (Brenner 1961, 10.1016/0009-2509(61)80035-3, a series; Goldman, Cox and Brenner 1967, 10.1016/0009-2509(67)80047-2, tabulated to \
           five digits) and of the torque. The other walls, 40 radii away, change these by about 1e-4. By the reciprocal theorem the \
           torque on the sphere that is moved along is the force on the one that turns: their difference over 6 pi mu a^2.",
    keys: &["a/h", "gap", "position"],
    measures: &["force across", "force along", "torque", "reciprocity"],
    tasks,
    numbers,
    plot,
};

/// Cells per radius, and places along the wall.
fn meshes(extent: Extent) -> &'static [(f64, usize)] {
    match extent {
        Extent::Quick => &[(1.6, 3), (3.2, 2)],
        Extent::Full => &[(1.6, 6), (3.2, 4), (6.4, 2)],
    }
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for method in FILM_METHODS.iter().filter(|method| method.holds_bodies) {
        for &(cells, count) in meshes(extent) {
            for place in places(method) {
                tasks.extend((0..count).map(|k| {
                    let at = [cells, place.gap(), k as f64];
                    Task::new(method.name, &at, move || measure(method, cells, place, k))
                }));
            }
        }
    }
    tasks
}

/// The thinnest film, which no mesh here resolves, is asked only of what lubricates.
fn places(method: &Method) -> &'static [Place] {
    if method.lubricates { &PLACES } else { &PLACES[..PLACES.len() - 1] }
}

fn measure(method: &Method, cells: f64, place: &Place, position: usize) -> Result<Vec<f64>, VerifyError> {
    let mut center = Vector::<3>::repeat(0.5) + shift::<3>(position) * (RADIUS / cells);
    center[1] = (1.0 + place.gap()) * RADIUS;
    let sphere = [Ball::new(center, RADIUS)];
    let mesh = mesh(&Refinement::to_level(level(RADIUS, cells)), &sphere)?;
    let mut solver = FlowSolver::new(method.params::<3>(1e-9))?;
    let mut prepared = solver.prepared(mesh, &sphere)?;
    let mut held = |twist: Twist<3>| -> Result<Wrench<3>, VerifyError> {
        Ok(prepared.solve(&Conditions::at_rest().with_twists(&[twist]))?.wrenches[0])
    };
    let moved = |axis: usize| Twist { velocity: unit(axis), ..Twist::default() };
    let turned = Twist { spin: unit(2), ..Twist::default() };
    let (across, along, turned) = (held(moved(1))?, held(moved(0))?, held(turned)?);
    let (force, torque) = (6.0 * PI * RADIUS, 8.0 * PI * RADIUS.powi(3));
    Ok(vec![
        across.force[1] / force / place.normal_force() - 1.0,
        along.force[0] / force / place.force - 1.0,
        turned.torque[2] / torque / place.torque - 1.0,
        (along.torque[2] - turned.force[0]) / (force * RADIUS),
    ])
}

fn unit(axis: usize) -> Vector<3>
where
    Dim<3>: Space<3>,
{
    Vector::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 })
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for method in FILM_METHODS.iter().filter(|method| method.holds_bodies) {
        for cells in table.steps("a/h", method.name, &[]) {
            for gap in places(method).iter().map(Place::gap) {
                for measure in &CASE.measures[..3] {
                    let name = format!("{measure}, a/h = {cells}, gap {gap:.3} a");
                    let at = [("a/h", cells), ("gap", gap)];
                    numbers.extend(mean_and_scatter(&table, method.name, measure, &at, &name));
                }
            }
        }
        let asymmetry = largest(&table.values("reciprocity", method.name, &[]));
        numbers.push(Number::new(Kind::Size, "reciprocity".to_owned(), method.name, asymmetry));
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    Plot::of_methods(
        "gap in radii",
        "rms relative error, *a*/*h* = 3.2",
        &CASE.measures[..3],
        |method, thing| {
            let at = |gap| [("a/h", 3.2), ("gap", gap)];
            let error = |gap| rms(&table.values(CASE.measures[thing], method, &at(gap)));
            PLACES.iter().map(Place::gap).map(|gap| (gap, error(gap))).collect()
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near contact `1/e - ln(e)/5 + 0.97128` (Cox and Brenner 1967), far away 1 + 9/8 of the distance's
    /// inverse.
    #[test]
    fn the_series_has_its_limits() {
        let near = Place { alpha: 0.05, force: 0.0, torque: 0.0 };
        let gap = near.gap();
        let expansion = 1.0 / gap - 0.2 * gap.ln() + 0.97128;
        assert!((near.normal_force() / expansion - 1.0).abs() < 1e-4, "{} {expansion}", near.normal_force());
        let far = Place { alpha: 6.0, force: 0.0, torque: 0.0 };
        let expansion = 1.0 / (1.0 - 9.0 / 8.0 / 6f64.cosh());
        assert!((far.normal_force() / expansion - 1.0).abs() < 1e-6);
    }

    /// The expansions near contact of Chaoui and Feuillebois 2003, 10.1093/qjmam/56.3.381.
    #[test]
    fn tabulated_values_have_their_limit() {
        for Place { alpha, force, torque } in &PLACES[2..] {
            let gap = alpha.cosh() - 1.0;
            let log = -gap.ln();
            let along = 8.0 / 15.0 * log + 0.95429 + 64.0 / 375.0 * gap * log + 0.42945 * gap;
            let turned = 0.4 * log + 0.37089 + 66.0 / 125.0 * gap * log + 0.34008 * gap;
            assert!((along - force).abs() < 1e-3, "{along} {force}");
            assert!((turned - torque).abs() < 4e-3, "{turned} {torque}");
        }
    }
}
