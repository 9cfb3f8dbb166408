//! Statistics of the contact network: stress, coordination, clusters, and the contacts as a table.

mod clusters;

use std::io::{self, Write};

use gluey_geom::{Matrix, Vector};

pub use clusters::{Cluster, Clusters};

use crate::{Contact, ContactError, Domain, Partner};

/// The contacts of one instant, with what they join.
///
/// Forces of a step act along the normals of its beginning: [`ContactNetwork::stress`] is exact with the
/// positions (and the tilt) the step was given, and off by `O(dt)` with those after it.
///
/// ```
/// use gluey_contact::{Contact, ContactNetwork, Domain, PairKey};
/// use gluey_geom::Vector;
///
/// // Two discs in a periodic row of length 4 push each other on both sides.
/// let domain = Domain::<2>::default().with_period(0, 4.0);
/// let (positions, radii) = ([Vector::<2>::new(1.0, 0.0), Vector::<2>::new(3.0, 0.0)], [1.0; 2]);
/// let force = |pair| Contact { pair, lambda: 0.5, gamma: 0.0, gap: 0.0 };
/// let contacts = [force(PairKey::new(0, 1)), force(PairKey::across(0, 1, [-1, 0, 0]))];
/// let network = ContactNetwork::new(&contacts, &positions, &radii, &domain)?;
/// assert_eq!(network.coordination().mean, 2.0);
/// assert_eq!(network.stress(4.0 * 2.0)[(0, 0)], -0.25);
/// assert_eq!(network.clusters().clusters[0].percolates, [true, false]);
/// # Ok::<(), gluey_contact::ContactError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ContactNetwork<'a, const D: usize> {
    contacts: &'a [Contact],
    positions: &'a [Vector<D>],
    radii: &'a [f64],
    domain: &'a Domain<D>,
}

/// Position and direction of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactArm<const D: usize> {
    /// From the centre of the first particle to that of its partner (of its image), or to the foot point on
    /// the wall.
    pub branch: Vector<D>,
    /// Unit vector along it: the force on the first particle is `-lambda normal`.
    pub normal: Vector<D>,
    /// Midway between the surfaces; the foot point on a wall.
    pub point: Vector<D>,
}

/// Numbers of contacts per particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordination {
    /// Contacts of a particle on average; those between two particles count for both.
    pub mean: f64,
    /// The same among those that are no rattlers. 0 if all are.
    pub mean_of_backbone: f64,
    /// Particles that contacts cannot hold: fewer than `D + 1` of them with walls or particles that are
    /// themselves no rattlers (O'Hern et al. 2003, DOI 10.1103/PhysRevE.68.011306).
    pub rattler_count: usize,
}

impl<'a, const D: usize> ContactNetwork<'a, D> {
    /// The network of `contacts` between these particles and the walls of `domain`.
    pub fn new(
        contacts: &'a [Contact],
        positions: &'a [Vector<D>],
        radii: &'a [f64],
        domain: &'a Domain<D>,
    ) -> Result<Self, ContactError> {
        let count = positions.len().min(radii.len());
        contacts
            .iter()
            .try_for_each(|contact| ContactError::unless_known(contact.pair, count, domain.walls.len()))?;
        Ok(Self { contacts, positions, radii, domain })
    }

    /// Where a contact of this network is.
    ///
    /// # Panics
    /// If its particles or its wall are not there.
    pub fn arm(&self, contact: &Contact) -> ContactArm<D> {
        let first = contact.pair.first as usize;
        let x = self.positions[first];
        let branch = contact.pair.branch(self.positions, self.domain).expect("a contact of the network");
        match contact.pair.second {
            Partner::Wall(wall) => {
                let normal = -self.domain.walls[wall as usize].normal;
                ContactArm { branch, normal, point: x + branch }
            }
            Partner::Particle { index, .. } => {
                let (distance, normal) = (branch.norm(), branch.normalize());
                let to_middle = 0.5 * (distance + self.radii[first] - self.radii[index as usize]);
                ContactArm { branch, normal, point: x + normal * to_middle }
            }
        }
    }

    /// The contact stress in the volume `V` (in 2D an area) that the particles take up,
    ///
    /// `sigma = -(1/V) sum over contacts of lambda n (x) r`,
    ///
    /// with `n`, `r` the normal and the branch vector of [`ContactArm`] (Love 1927, note B; Christoffersen,
    /// Mehrabadi and Nemat-Nasser 1981, DOI 10.1115/1.3157619). Tension is positive, so that particles
    /// pressed together have a negative trace; unit: that of lambda times length over volume, to be
    /// multiplied by `6 pi eta`. A wall counts with the arm from the centre to the wall. Symmetric, since
    /// contact forces are central.
    pub fn stress(&self, volume: f64) -> Matrix<D> {
        let mut sum = Matrix::zeros();
        for contact in self.contacts {
            let ContactArm { branch, normal, .. } = self.arm(contact);
            sum -= normal * branch.transpose() * contact.lambda;
        }
        sum / volume
    }

    /// The sum of the forces of its contacts on each particle, over `6 pi eta`: what a contact model with the
    /// metric of Stokes drag has added to the velocities, times the radii.
    ///
    /// A particle between two that press alike feels none.
    pub fn forces(&self) -> Vec<Vector<D>> {
        let mut forces = vec![Vector::zeros(); self.positions.len()];
        for contact in self.contacts {
            let push = self.arm(contact).normal * contact.lambda;
            let (first, second) = contact.pair.particles();
            forces[first] -= push;
            if let Some(second) = second {
                forces[second] += push;
            }
        }
        forces
    }

    /// How many contacts particles have.
    pub fn coordination(&self) -> Coordination {
        let count = self.positions.len();
        let mut is_held = vec![true; count];
        let mut degrees = vec![0; count];
        self.count_contacts(&is_held, &mut degrees);
        let mean = mean_of(&degrees, count);
        // Without a rattler others may rattle.
        while degrees.iter().zip(&is_held).any(|(degree, held)| *held && *degree <= D) {
            is_held.iter_mut().zip(&degrees).for_each(|(held, degree)| *held &= *degree > D);
            self.count_contacts(&is_held, &mut degrees);
        }
        let held_count = is_held.iter().filter(|held| **held).count();
        Coordination {
            mean,
            mean_of_backbone: mean_of(&degrees, held_count),
            rattler_count: count - held_count,
        }
    }

    /// Contacts of each particle with walls and with those that count.
    fn count_contacts(&self, counts_in: &[bool], degrees: &mut [usize]) {
        degrees.fill(0);
        for contact in self.contacts {
            let (first, second) = contact.pair.particles();
            let members = [Some(first), second];
            if members.iter().flatten().all(|&particle| counts_in[particle]) {
                members.iter().flatten().for_each(|&particle| degrees[particle] += 1);
            }
        }
    }

    /// The connected components: particles that touch each other directly or by way of others. Walls join
    /// nothing.
    pub fn clusters(&self) -> Clusters<D> {
        Clusters::of(self.contacts, self.positions.len(), &self.domain.lattice)
    }

    /// Writes a table, one row per contact, as comma-separated values with a header:
    ///
    /// `first` (number of the particle, from 1), `partner` (`particle` or `wall`), `second` (its number, from
    /// 1), `image_x`, ..., `lambda`, `gamma`, `gap`, `normal_x`, ..., `point_x`, .... Numbers are written so
    /// that they are read back exactly.
    pub fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        let axes = &["x", "y", "z"][..D];
        let columns = |name: &str| -> String { axes.iter().map(|axis| format!(",{name}_{axis}")).collect() };
        let [images, normals, points] = ["image", "normal", "point"].map(columns);
        writeln!(out, "first,partner,second{images},lambda,gamma,gap{normals}{points}")?;
        for contact in self.contacts {
            let Contact { pair, lambda, gamma, gap } = contact;
            let (kind, second, image) = match pair.second {
                Partner::Particle { index, image } => ("particle", index, image),
                Partner::Wall(wall) => ("wall", wall, [0; 3]),
            };
            let ContactArm { normal, point, .. } = self.arm(contact);
            write!(out, "{},{kind},{}", u64::from(pair.first) + 1, u64::from(second) + 1)?;
            image[..D].iter().try_for_each(|n| write!(out, ",{n}"))?;
            write!(out, ",{lambda},{gamma},{gap}")?;
            normal.iter().chain(point.iter()).try_for_each(|x| write!(out, ",{x}"))?;
            writeln!(out)?;
        }
        Ok(())
    }
}

fn mean_of(degrees: &[usize], count: usize) -> f64 {
    if count == 0 { 0.0 } else { degrees.iter().sum::<usize>() as f64 / count as f64 }
}
