//! What does not fit together in a case whose keys and values are right one by one.

use super::comparable::mismatch;
use super::error::{CaseProblem, Key};
use super::findings::CaseFindings;
use super::given::{check_force_density, check_motion};
use super::given_stress::{check_rheology, check_shear_stress, check_stress_alone, check_stress_of_free};
use super::names::{Boundary, Formulation, Hydrodynamics, Lubrication, Metric, is_file_name};
use super::neighbours::{NearParticles, nearer_than};
use super::particle_problem::ParticleProblem;
use super::{Case, ParticleSpec, Strategy, fill};
use crate::reference::ReferenceSolution;

/// Largest number of steps.
const MAX_STEPS: f64 = 1e9;
/// Smallest and largest size of a shear rate.
const RATES: (f64, f64) = (1e-100, 1e100);
const AXES: [char; 3] = ['x', 'y', 'z'];

/// Notes what does not fit together before there are particles.
pub(super) fn check_surroundings(case: &Case, findings: &mut CaseFindings) {
    let root = Key::default();
    if !is_file_name(&case.name) {
        findings.add(root.name("name"), CaseProblem::BadName);
    }
    if findings.are_good(&["flow"]) {
        check_force(&case.gravity, case, &root.name("gravity"), findings);
        if let Some(force) = &case.body_force {
            check_coordinates(force, case.dimension, root.name("body_force"), findings);
        }
    }
    if findings.are_good(&["domain"]) {
        check_box(case, &root.name("domain"), findings);
    }
    if findings.are_good(&["domain", "flow"]) {
        check_boundary(case, &root.name("domain"), findings);
    }
    check_size(case.shear_rate, root.name("shear_rate"), findings);
    if findings.are_good(&["domain", "flow", "shear_rate", "shear_stress"]) {
        check_shear_stress(case, &root, findings);
        check_rheology(case, root.name("rheology"), findings);
    }
    if findings.are_good(&["time"]) {
        check_time(case, &root.name("time"), findings);
    }
    if findings.are_good(&["output", "shear_rate"]) {
        check_output(case, &root.name("output"), findings);
    }
}

/// The square of a shear rate, which powers are made of, is a number.
fn check_size(rate: f64, key: Key, findings: &mut CaseFindings) {
    let (least, most) = RATES;
    if rate != 0.0 && !(least..=most).contains(&rate.abs()) && findings.are_good(&["shear_rate"]) {
        findings.out_of_range(key, rate, &format!("of a size from {least:e} to {most:e}, or 0"));
    }
}

/// Notes what does not fit together in a case whose particles are there.
pub(super) fn check_mutual(case: &Case, findings: &mut CaseFindings) {
    let root = Key::default();
    if findings.are_good(&fill::NEEDED) && !findings.have_unknown_part() {
        check_particles(case, &root.name("particles"), findings);
    }
    if findings.are_good(&fill::NEEDED) {
        check_stress_alone(case, &root, findings);
        check_stress_of_free(case, root.name("rheology"), findings);
    }
    if findings.are_good(&fill::NEEDED) && findings.are_good(&["body_force"]) {
        check_force_density(case, &root.name("body_force"), findings);
    }
    if findings.are_good(&fill::NEEDED) && !case.particles.is_empty() {
        check_flow(case, &root.name("flow"), findings);
        check_contact(case, &root.name("contact"), findings);
    }
    if findings.is_empty() {
        check_reference(case, root.name("reference"), findings);
    }
}

/// Notes streams without or with two intervals, and those that would write over each other.
fn check_output(case: &Case, key: &Key, findings: &mut CaseFindings) {
    for (index, output) in case.output.iter().enumerate() {
        let key = key.index(index);
        let choice = format!("output {}", index + 1);
        let intervals = [
            ("every", output.every.is_some()),
            ("every_strain", output.every_strain.is_some()),
            ("every_time", output.every_time.is_some()),
        ];
        let given: Vec<&str> =
            intervals.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name).collect();
        let one = "one of `every`, `every_strain`, `every_time`";
        match given[..] {
            [] => findings.unfit(key.name("kind"), choice, one, "none of them"),
            [first, _, ..] => findings.unfit(key.name(first), choice, one, given.join(" and ")),
            [name @ "every_strain"] if case.shear_rate == 0.0 => {
                findings.unfit(key.name(name), name, "a shear rate that is not 0", "shear_rate = 0");
            }
            _ => {}
        }
        let label = output.label();
        let before = case.output[..index].iter().position(|other| other.label() == label);
        if let Some(before) = before {
            let name = if output.label.is_some() { "label" } else { "kind" };
            let found = format!("that of output {}", before + 1);
            findings.unfit(key.name(name), format!("label = \"{label}\""), "a label of its own", found);
        }
        if !is_file_name(label) {
            findings.add(key.name("label"), CaseProblem::BadName);
        }
    }
}

/// A comparison with a reference of something else would look like an error of the run.
fn check_reference(case: &Case, key: Key, findings: &mut CaseFindings) {
    let Some((name, table)) =
        case.reference.as_ref().and_then(|name| Some((name, ReferenceSolution::named(name)?)))
    else {
        return;
    };
    if let Some((needs, found)) = mismatch(case, &table) {
        findings.unfit(key, format!("\"{name}\""), needs, found);
    }
}

fn check_box(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let (lower, upper) = (case.lower(), case.upper());
    let are_corners = [("lower", &lower), ("upper", &upper)]
        .map(|(name, corner)| check_coordinates(corner, case.dimension, key.name(name), findings));
    if are_corners == [true, true] {
        for axis in (0..case.dimension).filter(|&axis| upper[axis] <= lower[axis]) {
            let problem = CaseProblem::EmptyBox { axis: AXES[axis], lower: lower[axis], upper: upper[axis] };
            findings.add(key.name("upper"), problem);
        }
    }
}

/// Boxes that are sheared for ever are those of one formulation; a mesh is made of cubes.
fn check_boundary(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let (flow, needed) = (&case.flow, Formulation::Unfitted);
    let mut unfit = |needs: String, found: &str| {
        let choice = format!("\"{}\"", Boundary::Sheared);
        findings.unfit(key.name("boundary"), choice, needs, format!("\"{found}\""));
    };
    let (is_flow, is_sheared) =
        (flow.hydrodynamics == Hydrodynamics::Stokes, case.domain.boundary == Boundary::Sheared);
    if is_sheared && !is_flow {
        unfit(format!("flow.hydrodynamics = \"{}\"", Hydrodynamics::Stokes), flow.hydrodynamics.name());
    } else if is_sheared && flow.formulation != needed {
        unfit(format!("flow.formulation = \"{needed}\""), flow.formulation.name());
    }
    if is_flow && case.root_cells().is_none() {
        findings.add(key.name("upper"), CaseProblem::UnevenBox { edges: case.edges() });
    }
}

fn check_particles(case: &Case, key: &Key, findings: &mut CaseFindings) {
    if case.suspension.is_some() || case.particles_file.is_some() {
        return findings.add(key.clone(), CaseProblem::Particles(ParticleProblem::NotFilled));
    }
    if case.particles.is_empty() {
        return findings.add(key.clone(), CaseProblem::NoParticles);
    }
    let mut can_meet = true;
    for (index, particle) in case.particles.iter().enumerate() {
        let key = key.index(index);
        check_force(&particle.force, case, &key.name("force"), findings);
        check_torque(&particle.torque, case, &key.name("torque"), findings);
        check_given(case, particle, &key, findings);
        can_meet &= check_coordinates(&particle.position, case.dimension, key.name("position"), findings)
            && check_inside(case, index, &key, findings);
    }
    if can_meet {
        check_overlaps(case, key, findings);
    }
}

fn check_force(force: &Option<Vec<f64>>, case: &Case, key: &Key, findings: &mut CaseFindings) {
    let Some(force) = force else { return };
    check_coordinates(force, case.dimension, key.clone(), findings);
    check_answered(case, key, findings);
}

/// The motion of a particle that is held or driven.
fn check_given(case: &Case, particle: &ParticleSpec, key: &Key, findings: &mut CaseFindings) {
    if let Some(velocity) = &particle.velocity {
        check_coordinates(velocity, case.dimension, key.name("velocity"), findings);
    }
    if let Some(spin) = &particle.spin {
        check_rotation("a spin", spin, case.dimension, &key.name("spin"), findings);
    }
    check_motion(case, particle, key, findings);
}

fn check_torque(torque: &Option<Vec<f64>>, case: &Case, key: &Key, findings: &mut CaseFindings) {
    let Some(torque) = torque else { return };
    check_rotation("a torque", torque, case.dimension, key, findings);
    check_answered(case, key, findings);
}

/// Notes a torque or spin that has not as many numbers as there are axes to turn about.
fn check_rotation(
    what: &'static str,
    numbers: &[f64],
    dimension: usize,
    key: &Key,
    findings: &mut CaseFindings,
) {
    let (found, needed) = (numbers.len(), if dimension == 2 { 1 } else { 3 });
    if found != needed {
        findings.add(key.clone(), CaseProblem::RotationCount { what, found, needed, dimension });
    }
}

/// Only the finite-element flow answers to forces.
fn check_answered(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let found = case.flow.hydrodynamics;
    if found != Hydrodynamics::Stokes {
        let needs = format!("flow.hydrodynamics = \"{}\"", Hydrodynamics::Stokes);
        findings.unfit(key.clone(), "a force", needs, format!("\"{found}\""));
    }
}

/// Contacts whose forces act in the flow need one that answers to them, and films where they are rough; those
/// of smooth surfaces are for flows without films, which would keep these apart by themselves.
fn check_contact(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let (flow, contact) = (&case.flow, &case.contact);
    let (strategy, metric) = (contact.strategy, contact.metric());
    let is_rough = strategy == Strategy::Rough;
    if is_rough && metric == Metric::Drag {
        let found = format!("\"{metric}\"");
        let needs = format!("contact.metric = \"{}\"", Metric::Flow);
        return findings.unfit(key.name("strategy"), format!("\"{strategy}\""), needs, found);
    }
    if metric == Metric::Drag {
        return;
    }
    if !(is_rough || matches!(strategy, Strategy::Inelastic | Strategy::Gluey)) {
        let needs = "the strategy \"rough\", \"gluey\" or \"inelastic\"".to_owned();
        return findings.unfit(key.name("metric"), format!("\"{metric}\""), needs, format!("\"{strategy}\""));
    }
    let choice = format!("\"{strategy}\" in the metric of the flow");
    if is_rough && flow.hydrodynamics == Hydrodynamics::PairMobility {
        // Which knows what forces along the line of centres do.
        if contact.friction != 0.0 {
            let found = contact.friction.to_string();
            findings.unfit(key.name("friction"), "the pair mobility", "friction = 0".to_owned(), found);
        }
        return;
    }
    let lubrication = if is_rough { Lubrication::Deficit } else { Lubrication::None };
    let wanted = [
        ("flow.hydrodynamics", Hydrodynamics::Stokes.name(), flow.hydrodynamics.name()),
        ("flow.formulation", Formulation::Unfitted.name(), flow.formulation.name()),
        ("flow.lubrication", lubrication.name(), case.lubrication().name()),
    ];
    if let Some((name, needed, found)) = wanted.into_iter().find(|(_, needed, found)| needed != found) {
        let needs = format!("{name} = \"{needed}\"");
        findings.unfit(key.name("strategy"), choice, needs, format!("\"{found}\""));
    }
}

/// Notes where the particle has no room in the box, or is not inside. Whether it is in the box or near it:
/// what lies at the end of the world cannot be looked for neighbours.
fn check_inside(case: &Case, index: usize, key: &Key, findings: &mut CaseFindings) -> bool {
    let particle = &case.particles[index];
    let (lower, upper) = (case.lower(), case.upper());
    let mut is_near = true;
    for d in 0..case.dimension {
        let axis = AXES[d];
        let range = (lower[d] + particle.radius, upper[d] - particle.radius);
        if range.0 >= range.1 {
            let (diameter, edge) = (2.0 * particle.radius, upper[d] - lower[d]);
            findings
                .add(key.name("radius"), CaseProblem::TooBig { particle: index + 1, diameter, edge, axis });
            return false;
        }
        let range = match case.period(d) {
            Some(period) if 4.0 * particle.radius > period => {
                let (particle, diameter) = (index + 1, 2.0 * particle.radius);
                let problem = CaseProblem::PeriodTooShort { particle, diameter, period, axis };
                findings.add(key.name("radius"), problem);
                return false;
            }
            // A particle may lie across a periodic border.
            Some(_) => (lower[d], upper[d]),
            None => range,
        };
        let excess = (range.0 - particle.position[d]).max(particle.position[d] - range.1);
        if excess > 0.0 {
            let problem = CaseProblem::OutsideBox { particle: index + 1, excess, axis, range };
            findings.add(key.name("position"), problem);
            is_near &= excess < upper[d] - lower[d];
        }
    }
    is_near
}

fn check_overlaps(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let overlapping = nearer_than(case, 0.0);
    let Some(NearParticles { first, second, distance, contact_distance }) = overlapping.first().copied()
    else {
        return;
    };
    let others = overlapping[1..].iter().map(|pair| (pair.first + 1, pair.second + 1)).collect();
    let (gap, key) = (distance - contact_distance, key.index(second).name("position"));
    let (first, second) = (first + 1, second + 1);
    findings.add(key, CaseProblem::Overlap { first, second, gap, distance, contact_distance, others });
}

fn check_time(case: &Case, key: &Key, findings: &mut CaseFindings) {
    let time = &case.time;
    let steps = time.end / time.step;
    if steps > MAX_STEPS {
        let problem = CaseProblem::TooManySteps { end: time.end, step: time.step, steps };
        findings.add(key.name("step"), problem);
    }
    if let Some(amplitude) = time.strain_amplitude
        && findings.are_good(&["shear_rate"])
    {
        check_cycles(case, amplitude, key.name("strain_amplitude"), findings);
    }
}

/// A shear that oscillates is there, nothing else turns it round, and it does so between steps.
fn check_cycles(case: &Case, amplitude: f64, key: Key, findings: &mut CaseFindings) {
    let choice = format!("strain_amplitude = {amplitude}");
    let mut unfit = |needs: &str, found: String| findings.unfit(key.clone(), &choice, needs, found);
    if let Some(at) = case.time.reverse_at {
        unfit("no time.reverse_at beside it", format!("reverse_at = {at}"));
    }
    if case.shear_rate == 0.0 {
        return unfit("a shear rate that is not 0", "shear_rate = 0".to_owned());
    }
    let steps = case.steps_to(amplitude);
    if steps < 0.5 || (steps - steps.round()).abs() > 1e-6 * steps {
        unfit("a whole number of steps for this strain", format!("{steps:.6}"));
    }
}

fn check_flow(case: &Case, key: &Key, findings: &mut CaseFindings) {
    check_mesh(case, &key.name("mesh"), findings);
    check_lubrication(case, key.name("lubrication"), findings);
    if case.flow.hydrodynamics == Hydrodynamics::PairMobility {
        check_pair_mobility(case, key.name("hydrodynamics"), findings);
    }
}

/// Deficits are those of one formulation.
fn check_lubrication(case: &Case, key: Key, findings: &mut CaseFindings) {
    let (flow, needed) = (&case.flow, Formulation::Unfitted);
    if case.lubrication() == Lubrication::None || flow.formulation == needed {
        return;
    }
    let choice = format!("\"{}\"", Lubrication::Deficit);
    let found = format!("\"{}\"", flow.formulation);
    findings.unfit(key, choice, format!("flow.formulation = \"{needed}\""), found);
}

fn check_mesh(case: &Case, key: &Key, findings: &mut CaseFindings) {
    // An analytic model has no mesh to be too fine.
    let (Some(root_size), Some(finest), Some(level)) =
        (case.root_size(), case.finest_level(), case.surface_level())
    else {
        return;
    };
    let cells = f64::from(1u32 << finest) / root_size;
    let radii = case.particles.iter().map(|particle| particle.radius).enumerate();
    let small: Vec<(usize, f64)> = radii.filter(|(_, radius)| radius * cells < 1.0).collect();
    if !small.is_empty() {
        let least = (1.0 + 1e-3) / cells;
        let key = Key::default().name("particles");
        return small.into_iter().for_each(|(index, radius)| {
            let problem = CaseProblem::TooSmall { particle: index + 1, radius, least };
            findings.add(key.index(index).name("radius"), problem);
        });
    }
    if level > f64::from(finest) {
        let (radius, cells_per_radius) = (case.smallest_radius(), case.cells_per_radius());
        let largest = radius * cells;
        let problem = CaseProblem::MeshTooFine { cells_per_radius, radius, level, finest, largest };
        return findings.add(key.name("cells_per_radius"), problem);
    }
    let level = level as u32;
    if let Some(found) = case.flow.mesh.coarsest_level.filter(|&found| found > level) {
        let problem = CaseProblem::CoarseTooFine { found, finest: level };
        findings.add(key.name("coarsest_level"), problem);
    }
}

/// The analytic model knows two equal spheres in unbounded shear.
fn check_pair_mobility(case: &Case, key: Key, findings: &mut CaseFindings) {
    let choice = format!("\"{}\"", Hydrodynamics::PairMobility);
    let radii: Vec<f64> = case.particles.iter().map(|particle| particle.radius).collect();
    let found = match (case.dimension, radii.as_slice()) {
        (3, [a, b]) if a == b => return,
        (3, [a, b]) => format!("radii {a} and {b}"),
        (3, _) => format!("{} particles", radii.len()),
        (dimension, _) => format!("dimension {dimension}"),
    };
    findings.unfit(key, choice, "dimension 3 and two particles of equal radius", found);
}

/// Whether there is a coordinate for each axis; notes it where there is not.
fn check_coordinates(values: &[f64], dimension: usize, key: Key, findings: &mut CaseFindings) -> bool {
    let found = values.len();
    if found != dimension {
        findings.add(key, CaseProblem::CoordinateCount { found, dimension });
    }
    found == dimension
}
