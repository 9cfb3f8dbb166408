//! Checks of a case beyond its types.

use gluey_stokes::StokesError;

use super::Case;
use super::comparable::{Mismatch, mismatch};
use super::error::{Key, Problem};
use super::mesh::MOST_ROOTS;
use super::names::{Boundary, Formulation, Hydrodynamics, Lubrication, UnknownName};
use super::neighbours::{Neighbours, nearer_than};
use super::particle_problem::ParticleProblem;
use crate::reference::{self, Reference};

/// A value that makes no sense, and its key.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Violation {
    pub key: Key,
    pub problem: Problem,
}

pub(super) type Check = Result<(), Violation>;

/// Largest number of steps.
const MAX_STEPS: f64 = 1e9;
const AXES: [char; 3] = ['x', 'y', 'z'];

/// The first thing wrong with `case`, in the order of the file format.
pub(super) fn check(case: &Case) -> Check {
    check_surroundings(case)?;
    let root = Key::default();
    check_particles(case, &root.name("particles"))?;
    check_time(case, &root.name("time"))?;
    check_contact(case, &root.name("contact"))?;
    check_flow(case, &root.name("flow"))?;
    check_reference(case, root.name("reference"))
}

/// The first thing wrong before the particles.
pub(super) fn check_surroundings(case: &Case) -> Check {
    let root = Key::default();
    check_name(&case.name, root.name("name"))?;
    if !(2..=3).contains(&case.dimension) {
        return fail(root.name("dimension"), Problem::Dimension { found: case.dimension });
    }
    finite(case.shear_rate, root.name("shear_rate"))?;
    check_force(&case.gravity, case, &root.name("gravity"))?;
    check_domain(case, &root.name("domain"))
}

fn check_name(name: &str, key: Key) -> Check {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    match !name.is_empty() && name.len() <= 64 && name.chars().all(fits) {
        true => Ok(()),
        false => fail(key, Problem::BadName),
    }
}

/// A comparison with a reference of something else would look like an error of the run.
fn check_reference(case: &Case, key: Key) -> Check {
    let Some(name) = &case.reference else { return Ok(()) };
    let Some(table) = Reference::named(name) else {
        let known = reference::NAMES.iter().map(|&name| name.to_owned()).collect();
        let unknown = UnknownName { what: "reference".to_owned(), found: name.clone(), known };
        return fail(key, Problem::UnknownName(unknown));
    };
    match mismatch(case, &table) {
        Some(Mismatch { needs, found }) => fail(key, Problem::Unfit { choice: name.clone(), needs, found }),
        None => Ok(()),
    }
}

fn check_domain(case: &Case, key: &Key) -> Check {
    coordinates(&case.lower(), case.dimension, key.name("lower"))?;
    coordinates(&case.upper(), case.dimension, key.name("upper"))?;
    let (lower, upper) = (case.lower(), case.upper());
    for d in 0..case.dimension {
        if upper[d] <= lower[d] {
            let problem = Problem::EmptyBox { axis: AXES[d], lower: lower[d], upper: upper[d] };
            return fail(key.name("upper"), problem);
        }
    }
    let roots = case.flow.mesh.root_cells;
    if !(1..=MOST_ROOTS).contains(&roots) {
        let key = Key::default().name("flow").name("mesh").name("root_cells");
        return out_of_range(f64::from(roots), &format!("from 1 to {MOST_ROOTS}"), key);
    }
    check_sheared(case, key.name("boundary"))?;
    match case.flow.hydrodynamics {
        Hydrodynamics::Stokes if case.root_cells().is_none() => {
            fail(key.name("upper"), Problem::UnevenBox { edges: case.edges() })
        }
        _ => Ok(()),
    }
}

/// Boxes that are sheared for ever are those of one formulation.
fn check_sheared(case: &Case, key: Key) -> Check {
    let (flow, needed) = (&case.flow, Formulation::Unfitted);
    let choice = || Boundary::Sheared.name().to_owned();
    if case.domain.boundary != Boundary::Sheared {
        return Ok(());
    }
    if flow.hydrodynamics != Hydrodynamics::Stokes {
        let needs = format!("flow.hydrodynamics = \"{}\"", Hydrodynamics::Stokes);
        return fail(
            key,
            Problem::Unfit { choice: choice(), needs, found: format!("\"{}\"", flow.hydrodynamics) },
        );
    }
    if flow.formulation != needed {
        let needs = format!("flow.formulation = \"{needed}\"");
        return fail(
            key,
            Problem::Unfit { choice: choice(), needs, found: format!("\"{}\"", flow.formulation) },
        );
    }
    if case.rheology.every == 0 {
        return out_of_range(0.0, "of 1 or more", Key::default().name("rheology").name("every"));
    }
    Ok(())
}

fn check_particles(case: &Case, key: &Key) -> Check {
    if case.suspension.is_some() || case.particles_file.is_some() {
        return fail(key.clone(), Problem::Particles(ParticleProblem::NotFilled));
    }
    if case.particles.is_empty() {
        return fail(key.clone(), Problem::NoParticles);
    }
    for (index, particle) in case.particles.iter().enumerate() {
        let key = key.index(index);
        coordinates(&particle.position, case.dimension, key.name("position"))?;
        positive(particle.radius, key.name("radius"))?;
        check_force(&particle.force, case, &key.name("force"))?;
        check_torque(&particle.torque, case, &key.name("torque"))?;
        check_inside(case, index, &key)?;
    }
    check_overlaps(case, key)
}

fn check_force(force: &Option<Vec<f64>>, case: &Case, key: &Key) -> Check {
    let Some(force) = force else { return Ok(()) };
    coordinates(force, case.dimension, key.clone())?;
    check_answered(case, key)
}

fn check_torque(torque: &Option<Vec<f64>>, case: &Case, key: &Key) -> Check {
    let Some(torque) = torque else { return Ok(()) };
    let (found, needed) = (torque.len(), if case.dimension == 2 { 1 } else { 3 });
    if found != needed {
        return fail(key.clone(), Problem::TorqueCount { found, needed, dimension: case.dimension });
    }
    torque.iter().enumerate().try_for_each(|(index, &value)| finite(value, key.index(index)))?;
    check_answered(case, key)
}

/// Only the finite-element flow answers to forces.
fn check_answered(case: &Case, key: &Key) -> Check {
    match case.flow.hydrodynamics {
        Hydrodynamics::Stokes => Ok(()),
        found => {
            let choice = "forces and torques".to_owned();
            let needs = format!("flow.hydrodynamics = \"{}\"", Hydrodynamics::Stokes);
            fail(key.clone(), Problem::Unfit { choice, needs, found: format!("\"{found}\"") })
        }
    }
}

fn check_inside(case: &Case, index: usize, key: &Key) -> Check {
    let particle = &case.particles[index];
    let (lower, upper) = (case.lower(), case.upper());
    for d in 0..case.dimension {
        let axis = AXES[d];
        let range = (lower[d] + particle.radius, upper[d] - particle.radius);
        if range.0 >= range.1 {
            let (diameter, edge) = (2.0 * particle.radius, upper[d] - lower[d]);
            return fail(key.name("radius"), Problem::TooBig { particle: index + 1, diameter, edge, axis });
        }
        let range = match case.period(d) {
            Some(period) if 4.0 * particle.radius > period => {
                let (particle, diameter) = (index + 1, 2.0 * particle.radius);
                let problem = Problem::PeriodTooShort { particle, diameter, period, axis };
                return fail(key.name("radius"), problem);
            }
            // A particle may lie across a periodic border.
            Some(_) => (lower[d], upper[d]),
            None => range,
        };
        let excess = (range.0 - particle.position[d]).max(particle.position[d] - range.1);
        if excess > 0.0 {
            let problem = Problem::OutsideBox { particle: index + 1, excess, axis, range };
            return fail(key.name("position"), problem);
        }
    }
    Ok(())
}

fn check_overlaps(case: &Case, key: &Key) -> Check {
    let overlapping = nearer_than(case, 0.0);
    let Some(Neighbours { first, second, distance, contact_distance }) = overlapping.first().copied() else {
        return Ok(());
    };
    let others = overlapping[1..].iter().map(|pair| (pair.first + 1, pair.second + 1)).collect();
    let (gap, key) = (distance - contact_distance, key.index(second).name("position"));
    let (first, second) = (first + 1, second + 1);
    fail(key, Problem::Overlap { first, second, gap, distance, contact_distance, others })
}

fn check_time(case: &Case, key: &Key) -> Check {
    let time = &case.time;
    positive(time.step, key.name("step"))?;
    positive(time.end, key.name("end"))?;
    let steps = time.end / time.step;
    if steps > MAX_STEPS {
        let problem = Problem::TooManySteps { end: time.end, step: time.step, steps };
        return fail(key.name("step"), problem);
    }
    time.reverse_at.map_or(Ok(()), |at| positive(at, key.name("reverse_at")))?;
    time.strain_amplitude
        .map_or(Ok(()), |amplitude| check_cycles(case, amplitude, key.name("strain_amplitude")))
}

/// A shear that oscillates is there, nothing else turns it round, and it does so between steps.
fn check_cycles(case: &Case, amplitude: f64, key: Key) -> Check {
    positive(amplitude, key.clone())?;
    let choice = || format!("strain_amplitude = {amplitude}");
    let unfit = |needs: &str, found: String| {
        fail(key.clone(), Problem::Unfit { choice: choice(), needs: needs.to_owned(), found })
    };
    if case.shear_rate == 0.0 {
        return unfit("a shear rate that is not 0", "shear_rate = 0".to_owned());
    }
    if let Some(at) = case.time.reverse_at {
        return unfit("no time.reverse_at beside it", format!("reverse_at = {at}"));
    }
    let steps = case.steps_to(amplitude);
    if steps < 0.5 || (steps - steps.round()).abs() > 1e-6 * steps {
        return unfit("a whole number of steps for this strain", format!("{steps:.6}"));
    }
    Ok(())
}

fn check_contact(case: &Case, key: &Key) -> Check {
    let contact = &case.contact;
    if !(contact.threshold >= 0.0 && contact.threshold < 1.0) {
        return out_of_range(contact.threshold, "from 0 to less than 1", key.name("threshold"));
    }
    if !(1e-15..=1e-3).contains(&contact.tolerance) {
        return out_of_range(contact.tolerance, "from 1e-15 to 1e-3", key.name("tolerance"));
    }
    match contact.gamma_min {
        Some(floor) if !(floor < 0.0 && floor.is_finite()) => {
            out_of_range(floor, "less than 0", key.name("gamma_min"))
        }
        _ => Ok(()),
    }
}

fn check_flow(case: &Case, key: &Key) -> Check {
    let flow = &case.flow;
    between(flow.tolerance, 0.0, 0.1, key.name("tolerance"))?;
    check_mesh(case, &key.name("mesh"))?;
    check_paper(case, &key.name("paper"))?;
    check_lubrication(case, key.name("lubrication"))?;
    let offset = flow.pair_mobility.gap_offset;
    if !(offset >= 0.0 && offset.is_finite()) {
        return out_of_range(offset, "of 0 or more", key.name("pair-mobility").name("gap_offset"));
    }
    match flow.hydrodynamics {
        Hydrodynamics::PairMobility => check_pair_mobility(case, key.name("hydrodynamics")),
        Hydrodynamics::Stokes => Ok(()),
    }
}

/// Deficits are those of one formulation.
fn check_lubrication(case: &Case, key: Key) -> Check {
    let (flow, needed) = (&case.flow, Formulation::Unfitted);
    if case.lubrication() == Lubrication::None || flow.formulation == needed {
        return Ok(());
    }
    let choice = Lubrication::Deficit.name().to_owned();
    let needs = format!("flow.formulation = \"{needed}\"");
    fail(key, Problem::Unfit { choice, needs, found: format!("\"{}\"", flow.formulation) })
}

fn check_mesh(case: &Case, key: &Key) -> Check {
    let mesh = &case.flow.mesh;
    if !(mesh.band >= 0.0 && mesh.band <= 1e3) {
        return out_of_range(mesh.band, "from 0 to 1000", key.name("band"));
    }
    let cells = case.cells_per_radius();
    if !(cells >= 1.0 && cells.is_finite()) {
        return out_of_range(cells, "of 1 or more", key.name("cells_per_radius"));
    }
    // An analytic model has no mesh to be too fine.
    let (Some(root_size), Some(finest), Some(level)) =
        (case.root_size(), case.finest_level(), case.surface_level())
    else {
        return Ok(());
    };
    if level > f64::from(finest) {
        let radius = case.smallest_radius();
        let largest = radius / root_size * f64::from(1u32 << finest);
        let problem = Problem::MeshTooFine { cells_per_radius: cells, radius, level, finest, largest };
        return fail(key.name("cells_per_radius"), problem);
    }
    let level = level as u32;
    if mesh.coarsest_level > level {
        let problem = Problem::CoarseTooFine { found: mesh.coarsest_level, finest: level };
        return fail(key.name("coarsest_level"), problem);
    }
    check_rigid_dofs(case, finest - level)
}

/// `levels_left` is what the tree has beyond the level of the surfaces.
fn check_rigid_dofs(case: &Case, levels_left: u32) -> Check {
    let key = Key::default().name("flow").name("rigid-dofs");
    let rigid = &case.flow.rigid_dofs;
    between(rigid.offset.unwrap_or(0.0), -1.0, 1.0, key.name("offset"))?;
    if rigid.gap_fraction != 0.0 && !(0.1..=10.0).contains(&rigid.gap_fraction) {
        return out_of_range(rigid.gap_fraction, "from 0.1 to 10, or 0", key.name("gap_fraction"));
    }
    match rigid.gap_levels {
        Some(levels) if levels > levels_left => {
            let range = format!("from 0 to {levels_left} with surfaces this fine");
            out_of_range(f64::from(levels), &range, key.name("gap_levels"))
        }
        _ => Ok(()),
    }
}

/// The solver knows the ranges of its parameters, which have the names of the keys.
fn check_paper(case: &Case, key: &Key) -> Check {
    match case.flow.paper.params().check() {
        Err(StokesError::Parameter { name, value: found, wanted }) => {
            finite(found, key.name(name))?;
            fail(key.name(name), Problem::Parameter { found, wanted })
        }
        _ => Ok(()),
    }
}

/// The analytic model knows two equal spheres in unbounded shear.
fn check_pair_mobility(case: &Case, key: Key) -> Check {
    let choice = Hydrodynamics::PairMobility.name().to_owned();
    let needs = "dimension 3 and two particles of equal radius".to_owned();
    let radii: Vec<f64> = case.particles.iter().map(|particle| particle.radius).collect();
    let found = match (case.dimension, radii.as_slice()) {
        (3, [a, b]) if a == b => return Ok(()),
        (3, [a, b]) => format!("radii {a} and {b}"),
        (3, _) => format!("{} particles", radii.len()),
        (dimension, _) => format!("dimension {dimension}"),
    };
    fail(key, Problem::Unfit { choice, needs, found })
}

fn coordinates(values: &[f64], dimension: usize, key: Key) -> Check {
    if values.len() != dimension {
        return fail(key, Problem::CoordinateCount { found: values.len(), dimension });
    }
    values.iter().enumerate().try_for_each(|(index, &value)| finite(value, key.index(index)))
}

fn finite(value: f64, key: Key) -> Check {
    match value.is_finite() {
        true => Ok(()),
        false => fail(key, Problem::NotFinite { found: value }),
    }
}

fn positive(value: f64, key: Key) -> Check {
    finite(value, key.clone())?;
    match value > 0.0 {
        true => Ok(()),
        false => out_of_range(value, "greater than 0", key),
    }
}

/// `lower < value < upper`.
fn between(value: f64, lower: f64, upper: f64, key: Key) -> Check {
    finite(value, key.clone())?;
    match lower < value && value < upper {
        true => Ok(()),
        false => out_of_range(value, &format!("between {lower} and {upper}, without the ends"), key),
    }
}

fn out_of_range(found: f64, range: &str, key: Key) -> Check {
    finite(found, key.clone())?;
    fail(key, Problem::OutOfRange { found, range: range.to_owned() })
}

fn fail(key: Key, problem: Problem) -> Check {
    Err(Violation { key, problem })
}
