//! Names of contacts: which particle touches which partner.

use std::fmt;

use gluey_geom::Vector;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::Domain;

/// A contact of the particle `first` with another particle or a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct PairKey {
    /// The particle; of two, the one with the smaller index.
    pub first: u32,
    /// Its partner.
    pub second: Partner,
}

/// The partner of a particle in a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Partner {
    /// Another particle, or a periodic image of it: `x_index` and [`Domain::shift`] of the image (`0` in
    /// directions without a period).
    Particle {
        /// Its index.
        index: u32,
        /// How many periods it is moved by.
        image: [i32; 3],
    },
    /// A wall of the [`crate::Domain`].
    Wall(u32),
}

impl PairKey {
    /// The pair of two particles, given in any order.
    pub fn new(i: usize, j: usize) -> Self {
        Self::across(i, j, [0; 3])
    }

    /// The pair of particle `i` with an image of particle `j`.
    pub fn across(i: usize, j: usize, image: [i32; 3]) -> Self {
        let (first, index, image) = if i <= j { (i, j, image) } else { (j, i, image.map(|n| -n)) };
        Self { first: first as u32, second: Partner::Particle { index: index as u32, image } }
    }

    /// The contact of a particle with a wall.
    pub fn wall(particle: usize, wall: usize) -> Self {
        Self { first: particle as u32, second: Partner::Wall(wall as u32) }
    }

    /// The particles: the second is `None` for a wall.
    pub fn particles(self) -> (usize, Option<usize>) {
        match self.second {
            Partner::Particle { index, .. } => (self.first as usize, Some(index as usize)),
            Partner::Wall(_) => (self.first as usize, None),
        }
    }

    /// Vector from the first particle to its partner at the beginning of the domain's step: to the centre of
    /// the image, or to the foot point on the wall; `None` if one of them is not there.
    pub fn branch<const D: usize>(self, positions: &[Vector<D>], domain: &Domain<D>) -> Option<Vector<D>> {
        let x = positions.get(self.first as usize)?;
        match self.second {
            Partner::Particle { index, image } => {
                Some(positions.get(index as usize)? + domain.shift(&image) - x)
            }
            Partner::Wall(wall) => {
                let wall = domain.walls.get(wall as usize)?;
                Some(wall.normal * -wall.distance(x))
            }
        }
    }
}

/// Particles and walls are counted from 1, as in case files and tables.
impl fmt::Display for PairKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |index: u32| u64::from(index) + 1;
        let first = number(self.first);
        match self.second {
            Partner::Particle { index, image: [0, 0, 0] } => {
                write!(f, "particles {first} and {}", number(index))
            }
            Partner::Particle { index, image } => {
                write!(f, "particles {first} and {} (its image {image:?})", number(index))
            }
            Partner::Wall(wall) => write!(f, "particle {first} and wall {}", number(wall)),
        }
    }
}
