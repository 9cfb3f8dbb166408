//! The forces between near pairs, for their table.

use gluey_contact::{Contact, ContactForce, PairKey, Partner, Repulsion};

/// Forces between pairs at an instant.
#[derive(Clone, Debug, Default)]
pub struct PairForces<'a, const D: usize> {
    /// Pairs in contact; none without a contact model.
    pub contacts: Option<&'a [Contact]>,
    /// Their forces over `6 pi eta`, one for each, where they act in the flow.
    pub in_flow: Option<Vec<ContactForce<D>>>,
    /// The law by which particles repel each other.
    pub repulsion: Option<Repulsion>,
}

/// The forces of contacts by pair, sorted.
pub(super) struct ContactForces {
    normal: Option<Vec<(PairOrWall, f64)>>,
    rubbing: Option<Vec<(PairOrWall, Rubbing)>>,
}

/// Tangential force and motion of a contact in the flow.
#[derive(Clone, Copy)]
struct Rubbing {
    pressing: f64,
    friction: f64,
    slip: f64,
    slides: bool,
    floor: f64,
}

/// A particle, its partner, and whether that is a wall.
type PairOrWall = (usize, usize, bool);

impl ContactForces {
    /// Those of a run.
    pub fn of<const D: usize>(forces: &PairForces<'_, D>) -> Self {
        let rubbing = |one: &ContactForce<D>| {
            let (pressing, friction, slip) = (one.pressing(), one.tangential().norm(), one.slip.norm());
            (pair(one.pair), Rubbing { pressing, friction, slip, slides: one.slides, floor: one.floor })
        };
        Self {
            normal: forces.contacts.map(|all| sorted(all.iter().map(|one| (pair(one.pair), one.lambda)))),
            rubbing: forces.in_flow.as_ref().map(|all| sorted(all.iter().map(rubbing))),
        }
    }

    /// The normal force on a pair over `6 pi eta`, positive apart, added up where it touches several images
    /// of a partner; nothing without a contact model.
    pub fn on(&self, wanted: PairOrWall) -> Option<f64> {
        // A sum of none is -0.
        Some(of_pair(self.normal.as_ref()?, wanted).fold(0.0, |sum, force| sum + force))
    }

    /// Cells of friction, slip, whether it slides, and roughness in radii `a`, of the image of a partner that
    /// is pressed most, each with a comma behind it. Empty without a contact, none where none is in the flow.
    pub fn cells_of_rubbing(&self, wanted: PairOrWall, a: f64) -> String {
        let Some(all) = &self.rubbing else { return String::new() };
        let most = of_pair(all, wanted).max_by(|one, other| one.pressing.total_cmp(&other.pressing));
        most.map_or(",,,,".to_owned(), |Rubbing { friction, slip, slides, floor, .. }| {
            format!("{friction:.16e},{slip:.16e},{},{:.16e},", u8::from(slides), floor / a)
        })
    }
}

fn sorted<T>(all: impl Iterator<Item = (PairOrWall, T)>) -> Vec<(PairOrWall, T)> {
    let mut all: Vec<_> = all.collect();
    all.sort_by_key(|(pair, _)| *pair);
    all
}

/// What of sorted contacts belongs to a pair.
fn of_pair<T: Copy>(all: &[(PairOrWall, T)], wanted: PairOrWall) -> impl Iterator<Item = T> {
    let first = all.partition_point(|(pair, _)| *pair < wanted);
    all[first..].iter().take_while(move |(pair, _)| *pair == wanted).map(|(_, one)| *one)
}

fn pair(key: PairKey) -> PairOrWall {
    let first = key.first as usize;
    match key.second {
        Partner::Particle { index, .. } => (first, index as usize, false),
        Partner::Wall(wall) => (first, wall as usize, true),
    }
}

impl<const D: usize> PairForces<'_, D> {
    /// The force by which surfaces of these radii at this gap repel each other; nothing where none do.
    pub(super) fn repulsion(&self, gap: f64, radii: [f64; 2]) -> Option<f64> {
        let law = self.repulsion?;
        Some(if gap < law.reach() { law.at::<D>(gap, radii) } else { 0.0 })
    }
}
