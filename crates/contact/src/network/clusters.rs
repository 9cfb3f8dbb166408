//! Clusters by union-find whose edges carry images: a cluster percolates where a way round leads to another
//! image.

use gluey_geom::Lattice;

use crate::{Contact, Partner};

/// The connected components of a contact network; particles without a contact are clusters of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clusters<const D: usize> {
    /// The clusters, the largest first; of equal ones, that with the smallest particle.
    pub clusters: Vec<Cluster<D>>,
    /// Index of the cluster of each particle.
    pub of_particle: Vec<u32>,
}

/// A connected component.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cluster<const D: usize> {
    /// How many particles it has.
    pub size: usize,
    /// In which periodic directions one can walk from contact to contact and arrive at another image of the
    /// start. In a tilted lattice the second direction is that of the image one period up in `y` that is
    /// nearest to straight above.
    pub percolates: [bool; D],
    /// The walls it touches, sorted.
    pub walls: Vec<u32>,
}

impl<const D: usize> Cluster<D> {
    /// Whether it reaches from one wall to the other.
    pub fn bridges(&self, wall: u32, other: u32) -> bool {
        wall != other && [wall, other].iter().all(|wall| self.walls.contains(wall))
    }
}

impl<const D: usize> Clusters<D> {
    /// The largest cluster; `None` if there are no particles.
    pub fn largest(&self) -> Option<&Cluster<D>> {
        self.clusters.first()
    }

    /// How many clusters there are of each size, as `(size, count)`, sizes decreasing.
    pub fn size_distribution(&self) -> Vec<(usize, usize)> {
        let same_size = self.clusters.chunk_by(|a, b| a.size == b.size);
        same_size.map(|clusters| (clusters[0].size, clusters.len())).collect()
    }

    /// Finds them.
    pub(super) fn of(contacts: &[Contact], count: usize, lattice: &Lattice<D>) -> Self {
        let mut forest = Forest::new(count);
        let mut loops = Vec::new();
        for contact in contacts {
            if let Partner::Particle { index, image } = contact.pair.second {
                loops.extend(
                    forest.join(contact.pair.first, index, image).map(|way| (contact.pair.first, way)),
                );
            }
        }
        let (clusters, of_particle) = forest.sorted();
        let mut found = Self { clusters, of_particle };
        for (particle, mut way) in loops {
            way[0] += way[1] * lattice.turns();
            let cluster = &mut found.clusters[found.of_particle[particle as usize] as usize];
            (0..D).for_each(|d| cluster.percolates[d] |= way[d] != 0);
        }
        for contact in contacts {
            if let Partner::Wall(wall) = contact.pair.second {
                let cluster = found.of_particle[contact.pair.first as usize];
                found.clusters[cluster as usize].walls.push(wall);
            }
        }
        for cluster in &mut found.clusters {
            cluster.walls.sort_unstable();
            cluster.walls.dedup();
        }
        found
    }
}

/// Trees of particles. The image `images[i]` of particle `i` is in one piece with the parent itself.
struct Forest {
    parents: Vec<u32>,
    images: Vec<[i32; 3]>,
}

impl Forest {
    fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect(), images: vec![[0; 3]; count] }
    }

    /// The root of a particle, and the particle's image that is in one piece with it. Halves the path.
    fn root(&mut self, mut particle: u32) -> (u32, [i32; 3]) {
        let mut image = [0; 3];
        loop {
            let here = particle as usize;
            let above = self.parents[here] as usize;
            if above == here {
                return (particle, image);
            }
            if self.parents[above] as usize != above {
                self.images[here] = sum(self.images[here], self.images[above]);
                self.parents[here] = self.parents[above];
            }
            image = sum(image, self.images[here]);
            particle = self.parents[here];
        }
    }

    /// Joins `i` with the image of `j`. If they were joined already: which image of `i` the way round leads
    /// to, if another.
    fn join(&mut self, i: u32, j: u32, image: [i32; 3]) -> Option<[i32; 3]> {
        let ((root, of_i), (other, of_j)) = (self.root(i), self.root(j));
        // The image of j that is in one piece with i's root, by way of this contact, less the one by way of
        // j's root.
        let apart = difference(sum(of_i, image), of_j);
        if root == other {
            return Some(apart).filter(|apart| *apart != [0; 3]);
        }
        if root < other {
            (self.parents[other as usize], self.images[other as usize]) = (root, apart);
        } else {
            (self.parents[root as usize], self.images[root as usize]) = (other, difference([0; 3], apart));
        }
        None
    }

    /// The clusters, the largest first, and the cluster of each particle.
    fn sorted<const D: usize>(mut self) -> (Vec<Cluster<D>>, Vec<u32>) {
        let count = self.parents.len();
        let roots: Vec<u32> = (0..count as u32).map(|particle| self.root(particle).0).collect();
        let mut sizes = vec![0; count];
        roots.iter().for_each(|&root| sizes[root as usize] += 1);
        // The root of a cluster is its smallest particle.
        let mut order: Vec<u32> = (0..count as u32).filter(|&i| sizes[i as usize] > 0).collect();
        order.sort_by_key(|&root| std::cmp::Reverse(sizes[root as usize]));
        let mut places = vec![0; count];
        (0..).zip(&order).for_each(|(place, &root)| places[root as usize] = place);
        let cluster =
            |&root: &u32| Cluster { size: sizes[root as usize], percolates: [false; D], walls: Vec::new() };
        (order.iter().map(cluster).collect(), roots.iter().map(|&root| places[root as usize]).collect())
    }
}

fn sum(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|d| a[d] + b[d])
}

fn difference(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|d| a[d] - b[d])
}
