//! Particles that a case does not list: generated ones, and those of a file.

use std::path::Path;

use gluey_geom::ball_volume;
use gluey_suspension::packing::{Packing, PackingError, PackingParams};

use super::error::{CaseProblem, Key};
use super::findings::{CaseFindings, Violation};
use super::idle::idle_in_suspension;
use super::particle_problem::ParticleProblem;
use super::particles_file::ParticleList;
use super::{Case, ParticleSpec, SuspensionSpec, particles_file};
use crate::number_text::shown;

/// So many particles can be generated: the range of `suspension.count`.
const MOST_PARTICLES: f64 = 1e6;

/// The parts of a case that its particles follow from.
pub(super) const NEEDED: [&str; 6] =
    ["dimension", "domain", "flow", "particles", "suspension", "particles_file"];

/// Makes the particles of a case whose surroundings are checked, and gives the file that lists them, if one
/// does; `has_list` says whether the case lists any.
pub(super) fn fill(
    case: &mut Case,
    has_list: bool,
    folder: &Path,
    findings: &mut CaseFindings,
) -> Option<ParticleList> {
    let root = Key::default();
    let sources = [
        (has_list, "[[particles]]"),
        (case.suspension.is_some(), "[suspension]"),
        (case.particles_file.is_some(), "`particles_file`"),
    ];
    let given: Vec<&'static str> = sources.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
    match given[..] {
        [] => {
            let problem = CaseProblem::MissingKey { name: "particles".into(), example: "[[particles]]" };
            findings.add(root.name("particles"), problem);
            None
        }
        [first, second, ..] => {
            let key = root.name(if case.suspension.is_some() { "suspension" } else { "particles_file" });
            findings.add(key, CaseProblem::Particles(ParticleProblem::TwoSources { first, second }));
            None
        }
        [_] => fill_from_one(case, folder, findings),
    }
}

fn fill_from_one(case: &mut Case, folder: &Path, findings: &mut CaseFindings) -> Option<ParticleList> {
    let mut read = None;
    if let Some(file) = &case.particles_file {
        match particles_file::read(&folder.join(file), case.dimension) {
            Ok(list) => {
                (case.particles, case.particles_file) = (list.particles.clone(), None);
                read = Some(list);
            }
            Err(problems) => problems.into_iter().for_each(|problem| {
                findings.add(Key::default().name("particles_file"), CaseProblem::Particles(problem));
            }),
        }
    }
    if let Some(suspension) = &case.suspension {
        let (seed, idle) = (suspension.seed, idle_in_suspension(suspension));
        match generate(case, suspension, &Key::default().name("suspension")) {
            Ok(particles) => {
                (case.particles, case.suspension) = (particles, None);
                (case.seed, case.idle_in_suspension) = (Some(seed), idle);
            }
            Err(Violation { key, problem }) => findings.add(key, problem),
        }
    }
    read
}

fn generate(case: &Case, suspension: &SuspensionSpec, key: &Key) -> Result<Vec<ParticleSpec>, Violation> {
    check_count(case, suspension, key)?;
    let params = suspension.params().or_else(|problem| fail(problem_key(&problem, key), problem))?;
    let packed = match case.dimension {
        2 => pack::<2>(case, &params),
        _ => pack::<3>(case, &params),
    };
    let hold = |mut particles: Vec<ParticleSpec>| {
        particles.iter_mut().for_each(|particle| particle.held = suspension.held);
        particles
    };
    packed.map(hold).or_else(|error| {
        let key = packing_key(&error).map_or(key.clone(), |name| key.name(name));
        fail(key, ParticleProblem::Packing(error))
    })
}

/// Refuses a radius that takes more particles than can be listed: they would fill the memory.
fn check_count(case: &Case, suspension: &SuspensionSpec, key: &Key) -> Result<(), Violation> {
    let (Some(fraction), Some(radius), None) =
        (suspension.volume_fraction, suspension.radius, suspension.count)
    else {
        return Ok(());
    };
    let volume = case.edges().iter().product::<f64>();
    let unit = if case.dimension == 2 { ball_volume::<2>(1.0) } else { ball_volume::<3>(1.0) };
    let least = (fraction * volume / unit / MOST_PARTICLES).powf(1.0 / case.dimension as f64);
    match radius >= least {
        true => Ok(()),
        false => {
            let range = format!("of {} or more, for at most {MOST_PARTICLES} particles", shown(least));
            Err(Violation {
                key: key.name("radius"),
                problem: CaseProblem::OutOfRange { found: radius, range },
            })
        }
    }
}

fn pack<const D: usize>(case: &Case, params: &PackingParams) -> Result<Vec<ParticleSpec>, PackingError> {
    let packing = Packing::<D>::new(&case.container(), params)?;
    let particles = packing.positions.iter().zip(packing.radii);
    Ok(particles.map(|(x, radius)| ParticleSpec::new(x.iter().copied().collect(), radius)).collect())
}

fn problem_key(problem: &ParticleProblem, key: &Key) -> Key {
    match problem {
        ParticleProblem::RadiiKey { key: name, .. } => key.name("radii").name(name),
        _ => key.clone(),
    }
}

/// The key that is to be changed first.
fn packing_key(error: &PackingError) -> Option<&'static str> {
    match error {
        PackingError::TooDense { .. } | PackingError::LatticeTooDense { .. } => Some("volume_fraction"),
        PackingError::NoLattice { .. } | PackingError::ParticleTooLarge { .. } => Some("count"),
        PackingError::OtherDimension { .. } => Some("arrangement"),
        _ => None,
    }
}

fn fail<T>(key: Key, problem: ParticleProblem) -> Result<T, Violation> {
    Err(Violation { key, problem: CaseProblem::Particles(problem) })
}
