//! The forces between near pairs, for their table.

use gluey_contact::{Contact, Partner, Repulsion};

/// Forces between pairs at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub struct PairForces<'a> {
    /// Pairs in contact; none without a contact model.
    pub contacts: Option<&'a [Contact]>,
    /// The law by which particles repel each other.
    pub repulsion: Option<Repulsion>,
}

/// The forces of contacts by pair, sorted.
pub(super) struct ContactForces(Option<Vec<(PairOrWall, f64)>>);

/// A particle, its partner, and whether that is a wall.
type PairOrWall = (usize, usize, bool);

impl ContactForces {
    /// Contacts with several images of a partner are added up.
    pub fn of(forces: &PairForces<'_>) -> Self {
        let sorted = |contacts: &[Contact]| {
            let mut all: Vec<(PairOrWall, f64)> =
                contacts.iter().map(|one| (pair(one), one.lambda)).collect();
            all.sort_by_key(|(pair, _)| *pair);
            all
        };
        Self(forces.contacts.map(sorted))
    }

    /// The force on a pair over `6 pi eta`, positive apart; nothing without a contact model.
    pub fn on(&self, wanted: PairOrWall) -> Option<f64> {
        let all = self.0.as_ref()?;
        let first = all.partition_point(|(pair, _)| *pair < wanted);
        let of_pair = all[first..].iter().take_while(|(pair, _)| *pair == wanted);
        // A sum of none is -0.
        Some(of_pair.fold(0.0, |sum, (_, force)| sum + force))
    }
}

fn pair(contact: &Contact) -> PairOrWall {
    let first = contact.pair.first as usize;
    match contact.pair.second {
        Partner::Particle { index, .. } => (first, index as usize, false),
        Partner::Wall(wall) => (first, wall as usize, true),
    }
}

impl PairForces<'_> {
    /// The force by which surfaces of these radii at this gap repel each other; nothing where none do.
    pub(super) fn repulsion<const D: usize>(&self, gap: f64, radii: [f64; 2]) -> Option<f64> {
        let law = self.repulsion?;
        Some(if gap < law.reach() { law.at::<D>(gap, radii) } else { 0.0 })
    }
}
