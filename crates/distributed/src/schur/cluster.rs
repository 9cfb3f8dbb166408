//! Clusters of pressures in gaps: what they are called, what is in them, and their matrices.

use std::collections::BTreeMap;
use std::ops::AddAssign;

use gluey_parallel::{Communicator, Number, route};
use gluey_stokes::SmallMatrix;
use nalgebra::DMatrix;

/// Larger clusters are left to the mass matrix.
const MOST_VELOCITIES: usize = 1000;
/// Share of the mass that is added to `S_P`, for pressures that act on no velocity.
const SHARE_OF_MASS: f64 = 1e-3;

/// The least key of the pressures of a cluster, and who owns that pressure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Label {
    pub key: u64,
    pub owner: u64,
}

pub const UNLABELLED: Label = Label { key: u64::MAX, owner: u64::MAX };

impl Default for Label {
    fn default() -> Self {
        UNLABELLED
    }
}

/// What adds up is the least.
impl AddAssign for Label {
    fn add_assign(&mut self, other: Self) {
        *self = other.min(*self);
    }
}

impl Number for Label {
    const SIZE: usize = 2 * u64::SIZE;

    fn write(self, bytes: &mut [u8]) {
        self.key.write(&mut bytes[..u64::SIZE]);
        self.owner.write(&mut bytes[u64::SIZE..]);
    }

    fn read(bytes: &[u8]) -> Self {
        Self { key: u64::read(&bytes[..u64::SIZE]), owner: u64::read(&bytes[u64::SIZE..]) }
    }
}

/// A place in the matrices of a cluster.
pub type Place = (Label, u32);

/// Stands for no pressure of a cluster.
pub const NOWHERE: Place = (UNLABELLED, u32::MAX);

/// A cluster as the rank knows it that it belongs to.
#[derive(Default)]
pub struct Cluster {
    /// Names of the unknown velocities, and who owns them.
    pub velocities: Vec<[u64; 3]>,
    /// Keys of the pressures, and who owns them.
    pub pressures: Vec<[u64; 2]>,
}

/// Kinds of records.
pub const VELOCITY: u64 = 0;
pub const PRESSURE: u64 = 1;
pub const MASS: u64 = 2;

impl Cluster {
    /// The clusters of this rank that are small enough, by key.
    pub fn gathered(ranks: &dyn Communicator, members: Vec<(usize, [u64; 5])>) -> BTreeMap<u64, Self> {
        let mut clusters: BTreeMap<u64, Self> = BTreeMap::new();
        let mut received = route(ranks, members);
        received.sort_unstable();
        received.dedup();
        for [cluster, kind, name, component, owner] in received {
            let cluster = clusters.entry(cluster).or_default();
            match kind {
                VELOCITY => cluster.velocities.push([name, component, owner]),
                _ => cluster.pressures.push([name, owner]),
            }
        }
        clusters.retain(|_, cluster| cluster.velocities.len() <= MOST_VELOCITIES);
        clusters
    }

    /// `S_P^-1` from the entries that ranks sent.
    pub fn inverse(&self, key: u64, entries: &[[u64; 3]]) -> Result<DMatrix<f64>, SmallMatrix> {
        let (n, m) = (self.velocities.len(), self.pressures.len());
        let (mut a, mut b, mut mass) = (DMatrix::zeros(n, n), DMatrix::zeros(n, m), DMatrix::zeros(m, m));
        for &[_, at, value] in entries.iter().filter(|entry| entry[0] == key) {
            let (kind, row, column) = unpacked(at);
            let matrix = match kind {
                VELOCITY => &mut a,
                PRESSURE => &mut b,
                _ => &mut mass,
            };
            matrix[(row, column)] += f64::from_bits(value);
        }
        let viscous = a.cholesky().ok_or(SmallMatrix::Stiffness)?;
        let schur = b.transpose() * viscous.solve(&b) + SHARE_OF_MASS * mass;
        Ok(schur.cholesky().ok_or(SmallMatrix::Schur)?.inverse())
    }
}

/// Kind, row and column in one number.
pub fn packed(kind: u64, row: u32, column: u32) -> u64 {
    kind << 60 | u64::from(row) << 30 | u64::from(column)
}

fn unpacked(at: u64) -> (u64, usize, usize) {
    const MASK: u64 = (1 << 30) - 1;
    (at >> 60, (at >> 30 & MASK) as usize, (at & MASK) as usize)
}

/// The least label of each group, and of all groups that hang together, for all their members.
pub fn spread(groups: &[Vec<usize>], labels: &mut [Label]) {
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for group in groups {
            let least = group.iter().map(|&q| labels[q]).min().unwrap_or(UNLABELLED);
            for &q in group {
                has_changed |= labels[q] != least;
                labels[q] = least;
            }
        }
    }
}
