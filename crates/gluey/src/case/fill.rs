//! Particles that a case does not list: generated ones, and those of a file.

use std::path::Path;

use gluey_geom::{Dim, Space};
use gluey_suspension::packing::{Packing, PackingError, PackingParams};

use super::error::{CaseError, Key, Problem};
use super::particle_problem::ParticleProblem;
use super::validate::{Check, Violation, check_surroundings};
use super::{Case, ParticleSpec, SuspensionSpec, particles_file};

impl Case {
    /// Makes the particles that `suspension` or `particles_file` describe, if one of them is there, and
    /// forgets the description: a case made by a program is then as if it had been read. Files are looked for
    /// in `folder`.
    pub fn fill_particles(&mut self, folder: impl AsRef<Path>) -> Result<(), CaseError> {
        let has_list = !self.particles.is_empty();
        let filled = check_surroundings(self).and_then(|()| fill(self, has_list, folder.as_ref()));
        filled.map_err(|violation| CaseError::of_value(&self.name, violation.key, violation.problem))
    }
}

/// Makes the particles of a case whose surroundings are checked; `has_list` says whether it lists any.
pub(super) fn fill(case: &mut Case, has_list: bool, folder: &Path) -> Check {
    let root = Key::default();
    let sources = [
        (has_list, "[[particles]]"),
        (case.suspension.is_some(), "[suspension]"),
        (case.particles_file.is_some(), "`particles_file`"),
    ];
    let given: Vec<&'static str> = sources.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
    match given[..] {
        [] => {
            let problem = Problem::MissingKey { name: "particles".into(), example: "[[particles]]" };
            return Err(Violation { key: root.name("particles"), problem });
        }
        [first, second, ..] => {
            let key = root.name(if case.suspension.is_some() { "suspension" } else { "particles_file" });
            return fail(key, ParticleProblem::TwoSources { first, second });
        }
        [_] => {}
    }
    if let Some(file) = &case.particles_file {
        let read = particles_file::read(&folder.join(file), case.dimension);
        case.particles = read.or_else(|problem| fail(root.name("particles_file"), problem))?;
        case.particles_file = None;
    }
    if let Some(suspension) = &case.suspension {
        let seed = suspension.seed;
        case.particles = generate(case, suspension, &root.name("suspension"))?;
        case.seed = Some(seed);
        case.suspension = None;
    }
    Ok(())
}

fn generate(case: &Case, suspension: &SuspensionSpec, key: &Key) -> Result<Vec<ParticleSpec>, Violation> {
    let params = suspension.params().or_else(|problem| fail(problem_key(&problem, key), problem))?;
    let packed = match case.dimension {
        2 => pack::<2>(case, &params),
        _ => pack::<3>(case, &params),
    };
    packed.or_else(|error| {
        let key = packing_key(&error).map_or(key.clone(), |name| key.name(name));
        fail(key, ParticleProblem::Packing(error))
    })
}

fn pack<const D: usize>(case: &Case, params: &PackingParams) -> Result<Vec<ParticleSpec>, PackingError>
where
    Dim<D>: Space<D>,
{
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
    Err(Violation { key, problem: Problem::Particles(problem) })
}
