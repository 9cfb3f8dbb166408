//! Who is near whom: contact numbers, clusters, percolation, fabric.

use gluey_contact::{Clusters, Contact, ContactError, ContactNetwork, Coordination, Domain, PairKey};
use gluey_geom::{Matrix, Vector};

use crate::{Container, for_each_pair};

/// Pairs, and particles at walls, whose gap is at most a given one.
///
/// ```
/// use gluey_geom::Vector;
/// use gluey_suspension::{Container, structure::ProximityNetwork};
/// // One disc whose images along x touch it.
/// let container = Container::<2>::periodic(&Vector::<2>::new(2.0, 5.0));
/// let network = ProximityNetwork::new(&container, &[Vector::zeros()], &[1.0], 1e-9);
/// assert_eq!(network.coordination()?.mean, 2.0);
/// assert_eq!(network.clusters()?.clusters[0].percolates, [true, false]);
/// assert_eq!(network.fabric().map(|fabric| fabric[(0, 0)]), Some(1.0));
/// # Ok::<(), gluey_contact::ContactError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ProximityNetwork<const D: usize> {
    contacts: Vec<Contact>,
    normals: Vec<Vector<D>>,
    positions: Vec<Vector<D>>,
    radii: Vec<f64>,
    domain: Domain<D>,
}

impl<const D: usize> ProximityNetwork<D> {
    /// Finds the pairs with a gap of at most `reach`, a length.
    pub fn new(container: &Container<D>, positions: &[Vector<D>], radii: &[f64], reach: f64) -> Self {
        let mut network = Self {
            contacts: Vec::new(),
            normals: Vec::new(),
            positions: positions.to_vec(),
            radii: radii.to_vec(),
            domain: walls(container),
        };
        network.add_pairs(container, reach);
        network.add_walls(reach);
        network
    }

    fn add_pairs(&mut self, container: &Container<D>, reach: f64) {
        let Self { contacts, normals, positions, radii, .. } = self;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        for_each_pair(container, positions, 2.0 * largest + reach, |pair| {
            let distance = pair.arm.norm();
            let gap = distance - radii[pair.first] - radii[pair.second];
            if gap <= reach {
                let image = std::array::from_fn(|d| if d < D { pair.image[d] } else { 0 });
                contacts.push(near(PairKey::across(pair.first, pair.second, image), gap));
                normals.push(pair.arm / distance);
            }
        });
    }

    fn add_walls(&mut self, reach: f64) {
        for (wall, plane) in self.domain.walls.iter().enumerate() {
            for (particle, (x, radius)) in self.positions.iter().zip(&self.radii).enumerate() {
                let gap = plane.distance(x) - radius;
                if gap <= reach {
                    self.contacts.push(near(PairKey::wall(particle, wall), gap));
                }
            }
        }
    }

    /// How many neighbours particles have; walls count.
    pub fn coordination(&self) -> Result<Coordination, ContactError> {
        Ok(self.network()?.coordination())
    }

    /// Groups of neighbours of neighbours, and along which periodic axes they are endless.
    pub fn clusters(&self) -> Result<Clusters<D>, ContactError> {
        Ok(self.network()?.clusters())
    }

    /// Fabric tensor `<n (x) n>` over the pairs, of trace 1 (Oda 1982, DOI 10.3208/sandf1972.22.4_96);
    /// `1 / D` on the diagonal without a preferred direction; none without pairs. Walls do not count.
    pub fn fabric(&self) -> Option<Matrix<D>> {
        let sum: Matrix<D> = self.normals.iter().map(|n| n * n.transpose()).sum();
        (!self.normals.is_empty()).then(|| sum / self.normals.len() as f64)
    }

    /// Number of pairs of particles.
    pub fn pair_count(&self) -> usize {
        self.normals.len()
    }

    /// The contacts, those between particles first.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn network(&self) -> Result<ContactNetwork<'_, D>, ContactError> {
        ContactNetwork::new(&self.contacts, &self.positions, &self.radii, &self.domain)
    }
}

/// A contact that is no more than near.
fn near(pair: PairKey, gap: f64) -> Contact {
    Contact { pair, lambda: 0.0, gamma: 0.0, gap }
}

/// The walls of a container, two per walled axis, the lower one first.
fn walls<const D: usize>(container: &Container<D>) -> Domain<D> {
    let mut all = Domain::inside(container.bounds());
    let is_walled: Vec<bool> = (0..2 * D).map(|wall| container.is_walled(wall / 2)).collect();
    let mut is_walled = is_walled.into_iter();
    all.walls.retain(|_| is_walled.next().unwrap_or(false));
    all
}

#[cfg(test)]
mod tests {
    use gluey_geom::Aabb;

    use super::*;

    /// A face-centred cubic lattice of touching spheres of diameter 1.
    fn fcc(cells: usize) -> (Container<3>, Vec<Vector<3>>) {
        let edge = 2f64.sqrt();
        let basis = [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
        let corner = |i: usize| {
            Vector::<3>::new((i % cells) as f64, (i / cells % cells) as f64, (i / cells / cells) as f64)
        };
        let site = |i: usize| (corner(i / 4) + Vector::from(basis[i % 4])) * edge;
        let container = Container::periodic(&Vector::repeat(cells as f64 * edge));
        (container, (0..4 * cells.pow(3)).map(site).collect())
    }

    #[test]
    fn a_dense_crystal_has_twelve_neighbours_in_all_directions() {
        for cells in [1, 2, 3] {
            let (container, positions) = fcc(cells);
            let network = ProximityNetwork::new(&container, &positions, &vec![0.5; positions.len()], 1e-9);
            assert_eq!(network.coordination().expect("known").mean, 12.0);
            let clusters = network.clusters().expect("known");
            assert_eq!((clusters.clusters.len(), clusters.clusters[0].percolates), (1, [true; 3]));
            let fabric = network.fabric().expect("pairs");
            assert!((fabric - Matrix::<3>::identity() / 3.0).norm() < 1e-12);
        }
    }

    #[test]
    fn walls_are_neighbours_and_chains_end_there() {
        let bounds = Aabb { lower: Vector::<2>::zeros(), upper: Vector::<2>::new(4.0, 2.0) };
        let container = Container::new(bounds, [true, false]);
        let positions = [Vector::<2>::new(1.0, 1.0), Vector::<2>::new(3.0, 1.0)];
        let network = ProximityNetwork::new(&container, &positions, &[1.0; 2], 1e-9);
        assert_eq!(network.coordination().expect("known").mean, 4.0);
        let clusters = network.clusters().expect("known");
        assert_eq!(clusters.clusters[0].percolates, [true, false]);
        assert!(clusters.clusters[0].bridges(0, 1));
    }
}
