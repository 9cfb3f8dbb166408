//! Suspensions in equilibrium: viscosity and settling velocity of many configurations beside those of the
//! literature.

use gluey_geom::{Aabb, Lattice, Matrix, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_stokes::{Conditions, FlowSolver, Prepared, Refinement, StokesError};
use gluey_suspension::Container;
use gluey_suspension::packing::{Amount, Arrangement, Packing, PackingParams};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::literature::{settling_lost_in_box, settling_of_spheres, viscosity_of_spheres};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::statistics::{mean, scatter};

/// Fractions of the box that particles fill.
const FRACTIONS: [f64; 4] = [0.1, 0.2, 0.3, 0.4];
/// Bodies in a box, in 2D and 3D.
const COUNTS: [usize; 2] = [18, 20];
/// Configurations of each fraction, in 2D and 3D.
const CONFIGURATIONS: [usize; 2] = [12, 10];
/// Finest levels in 2D and 3D: 64 and 16 cells per edge.
const LEVELS: [u8; 2] = [6, 4];
/// Smallest gap, in radii.
const GAP: f64 = 1e-3;
/// Sweeps of the Monte Carlo moves; mean gaps and contact values stand still from a few hundred on.
const SWEEPS: usize = 2000;

/// Relative viscosity of discs in equilibrium: 18 discs, 12 configurations, spectral boundary integrals;
/// standard errors 0.002, 0.006, 0.020, 0.03.
const DISCS: [f64; 4] = [1.240, 1.601, 2.193, 3.19];
/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "equilibrium",
    title: "Suspensions in equilibrium",
    text: "Hard discs and spheres in equilibrium, eighteen and twenty in a periodic box, 12 and 10 configurations of each fraction: mean \
           of the relative viscosity over all directions, relative error, and mean settling velocity under equal forces without mean flow, \
           over that of a single sphere, absolute error. Spheres against Riest et al. 2015 (10.1039/C4SM02816A) for the viscosity and the \
           polynomial for static settling, to which the velocity in a box is brought by the correction of Ladd 1990 \
           (10.1063/1.458830), 1.7601 S(0) (phi/N)^(1/3) over the viscosity with S(0) of Carnahan and Starling; discs against spectral \
           boundary integrals, known to 0.2 to 1 %. The error of a mean is that of its configurations too, whose standard error stands \
           beside it. 64 and 16 cells per edge: 2.7 to 5.4 and 1.7 to 2.7 in a radius.",
    keys: &["dimension", "phi", "seed"],
    measures: &["viscosity", "settling"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let fractions = if extent == Extent::Quick { &FRACTIONS[..1] } else { &FRACTIONS };
    let of_fraction = |(method, &phi): (&'static Method, &f64)| {
        let task = move |dimension: usize, seed: usize| {
            let measure = if dimension == 2 { measure::<2> } else { measure::<3> };
            let at = [dimension as f64, phi, seed as f64];
            Task::new(method.name, &at, move || measure(method, phi, seed))
        };
        [2, 3].into_iter().flat_map(move |d| (0..CONFIGURATIONS[d - 2]).map(move |seed| task(d, seed)))
    };
    iproduct!(IN_SHEARED_BOXES, fractions).flat_map(of_fraction).collect()
}

fn measure<const D: usize>(method: &Method, phi: f64, seed: usize) -> Result<Vec<f64>, VerifyError> {
    let bodies = bodies::<D>(phi, seed)?;
    let level = LEVELS[D - 2];
    let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; D], [true; D], &bodies)?;
    let mut solver = FlowSolver::new(method.params::<D>(1e-5))?;
    let mut prepared = solver.prepared(mesh, &bodies)?;
    let viscosity = viscosity(&mut prepared)?;
    let settling = if D == 3 { settling(&mut prepared, &bodies)? } else { f64::NAN };
    Ok(vec![viscosity, settling])
}

fn bodies<const D: usize>(phi: f64, seed: usize) -> Result<Vec<Ball<D>>, VerifyError> {
    let container = Container::<D>::periodic(&Vector::repeat(1.0));
    let params = PackingParams {
        arrangement: Arrangement::Equilibrium { sweep_count: SWEEPS },
        min_gap: GAP,
        seed: seed as u64,
        ..PackingParams::new(Amount::Count { fraction: phi, count: COUNTS[D - 2] })
    };
    let Packing { positions, radii } = Packing::new(&container, &params)?;
    let lattice = Lattice::new([Some(1.0); D]);
    let places = positions.iter().zip(radii);
    Ok(places.map(|(place, radius)| Ball::in_space(place, radius, &lattice, 0.0)).collect())
}

/// Relative viscosity, the mean over all directions: of the shears in the planes of two axes, and of the
/// extensions in these.
fn viscosity<const D: usize>(prepared: &mut Prepared<'_, D>) -> Result<f64, VerifyError> {
    let planes = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
    let [mut shears, mut extensions] = [Vec::new(), Vec::new()];
    for (d, e) in planes {
        let mut gradient = Matrix::<D>::zeros();
        gradient[(d, e)] = 1.0;
        shears.push(stress_of_bodies(prepared, &gradient)?[(d, e)]);
        gradient.fill(0.0);
        [gradient[(d, d)], gradient[(e, e)]] = [0.5, -0.5];
        let stress = stress_of_bodies(prepared, &gradient)?;
        extensions.push(0.5 * (stress[(d, d)] - stress[(e, e)]));
    }
    // Symmetric matrices without trace: D (D - 1) / 2 shears, D - 1 extensions.
    let share = D as f64 / (D as f64 + 2.0);
    Ok(1.0 + share * mean(&shears) + (1.0 - share) * mean(&extensions))
}

fn stress_of_bodies<const D: usize>(
    prepared: &mut Prepared<'_, D>,
    gradient: &Matrix<D>,
) -> Result<Matrix<D>, VerifyError> {
    let flow = prepared.solve(&Conditions::in_linear_flow(gradient).with_stress())?;
    let stress = flow.stress.ok_or(StokesError::Unsupported { what: "stresses of suspensions" })?;
    Ok(stress.of_bodies(1.0))
}

/// Mean velocity under equal forces, over that of a single sphere, without mean flow; mean over the axes.
fn settling<const D: usize>(prepared: &mut Prepared<'_, D>, bodies: &[Ball<D>]) -> Result<f64, VerifyError> {
    let mut velocities = Vec::new();
    for axis in 0..D {
        let unit = Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
        let wrenches = vec![Wrench { force: unit, ..Wrench::default() }; bodies.len()];
        // The gradient of the mean pressure, which acts on bodies too.
        let balance = |_: &Vector<D>| -unit * bodies.len() as f64;
        let conditions = Conditions::at_rest().with_wrenches(&wrenches).with_force(Some(&balance));
        velocities.extend(prepared.solve(&conditions)?.twists.iter().map(|twist| twist.velocity[axis]));
    }
    Ok(mean(&velocities) * 6.0 * std::f64::consts::PI * bodies[0].bounding_radius())
}

/// Relative viscosity of discs or spheres.
fn expected(dimension: usize, phi: f64) -> f64 {
    let place = FRACTIONS.iter().position(|&fraction| fraction == phi);
    match (dimension, place) {
        (2, Some(place)) => DISCS[place],
        (2, None) => f64::NAN,
        _ => viscosity_of_spheres(phi),
    }
}

/// Errors of the means of viscosity and settling velocity.
fn errors(table: &CaseTable, method: &str, dimension: usize, phi: f64) -> [f64; 2] {
    let at = [("dimension", dimension as f64), ("phi", phi)];
    let mean_of = |measure: &str| mean(&table.values(measure, method, &at));
    let settling = mean_of("settling") + settling_lost_in_box(phi, COUNTS[1]);
    [mean_of("viscosity") / expected(dimension, phi) - 1.0, settling - settling_of_spheres(phi)]
}

/// Standard error of the mean.
fn standard_error(values: &[f64]) -> f64 {
    scatter(values) / (values.len() as f64).sqrt()
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (method, dimension) in iproduct!(IN_SHEARED_BOXES, [2, 3]) {
        for phi in table.steps("phi", method.name, &[("dimension", dimension as f64)]) {
            let at = [("dimension", dimension as f64), ("phi", phi)];
            let scale = [expected(dimension, phi), 1.0];
            let errors = errors(table, method.name, dimension, phi);
            for (k, measure) in CASE.measures.iter().enumerate().take(dimension - 1) {
                let name = format!("{measure}, {dimension}D, phi = {phi}");
                let scatter = standard_error(&table.values(measure, method.name, &at)) / scale[k];
                numbers.push(Number::new(NumberKind::Error, name.clone(), method.name, errors[k]));
                numbers.push(Number::new(NumberKind::Size, name + ", standard error", method.name, scatter));
            }
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["2D, viscosity", "3D, viscosity", "3D, settling"];
    Plot::of_methods("fraction", "error of the mean", &things, |method, thing| {
        let dimension = if thing == 0 { 2 } else { 3 };
        let fractions = table.steps("phi", method, &[("dimension", dimension as f64)]);
        let error = |phi| errors(table, method, dimension, phi)[thing / 2].abs();
        fractions.into_iter().map(|phi| (phi, error(phi))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::literature::HASIMOTO;

    /// Values of the formulas as they are tabulated.
    #[test]
    fn formulas_give_their_tables() {
        for (phi, eta) in [(0.1, 1.311), (0.2, 1.808), (0.3, 2.654), (0.4, 4.257)] {
            assert!((viscosity_of_spheres(phi) - eta).abs() < 6e-4);
        }
        assert!((viscosity_of_spheres(1e-4) - 1.0 - 2.5e-4 - 5.002e-8).abs() < 1e-10);
        assert!((settling_of_spheres(1e-4) - (1.0 - 6.5464e-4)).abs() < 3e-7);
        // In a dilute box all that is lost is what a lattice loses.
        assert!((settling_lost_in_box(1e-6, 1) - HASIMOTO * 1e-2).abs() < 1e-6);
    }

    /// A single sphere is a simple cubic lattice, whose drag Hasimoto (1959) and Sangani and Acrivos (1982,
    /// 10.1016/0301-9322(82)90047-7) expanded.
    #[test]
    fn a_single_sphere_settles_like_a_lattice() {
        let phi: f64 = 0.064;
        let exact = 1.0 - HASIMOTO * phi.cbrt() + phi - 1.5593 * phi.powi(2) + 3.9799 * phi.powf(8.0 / 3.0)
            - 3.0734 * phi.powf(10.0 / 3.0);
        let radius = (0.75 * phi / std::f64::consts::PI).cbrt();
        let lattice = Lattice::new([Some(1.0); 3]);
        let body = [Ball::in_space(&Vector::repeat(0.5), radius, &lattice, 0.0)];
        let mesh = Refinement::to_level(3).mesh(Aabb::unit(), [1; 3], [true; 3], &body).unwrap();
        let method = IN_SHEARED_BOXES[0];
        let mut solver = FlowSolver::new(method.params::<3>(1e-7)).unwrap();
        let settling = settling(&mut solver.prepared(mesh, &body).unwrap(), &body).unwrap();
        assert!((settling - exact).abs() < 2e-3, "{settling} instead of {exact}");
    }

    /// `2.5 phi` (Einstein 1911) and `2 phi` (Brady 1984, 10.1016/0301-9322(84)90064-8, for discs) where
    /// bodies are far from their images.
    #[test]
    fn dilute_suspensions_have_the_coefficients_of_einstein() {
        fn coefficient<const D: usize>(phi: f64, level: u8) -> f64 {
            let volume = if D == 2 { std::f64::consts::PI } else { 4.0 * std::f64::consts::PI / 3.0 };
            let radius = (phi / volume).powf(1.0 / D as f64);
            let place = Vector::from_fn(|d, _| 0.41 + 0.013 * d as f64);
            let body = [Ball::in_space(&place, radius, &Lattice::new([Some(1.0); D]), 0.0)];
            let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; D], [true; D], &body).unwrap();
            let method = IN_SHEARED_BOXES[0];
            let mut solver = FlowSolver::new(method.params::<D>(1e-7)).unwrap();
            (viscosity(&mut solver.prepared(mesh, &body).unwrap()).unwrap() - 1.0) / phi
        }
        let [discs, spheres] = [coefficient::<2>(1e-3, 8), coefficient::<3>(1e-3, 6)];
        assert!((discs / 2.0 - 1.0).abs() < 4e-3, "{discs}");
        assert!((spheres / 2.5 - 1.0).abs() < 4e-3, "{spheres}");
    }
}
