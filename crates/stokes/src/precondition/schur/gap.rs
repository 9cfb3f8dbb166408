//! Schur complements of the pressures in gaps narrower than a cell.
//!
//! A pressure inside a body that has no outer neighbour to follow (see [`crate::PressureSpace`]) is seen by a
//! few free velocities and by the approach of two bodies, and its Schur complement is up to a thousand times
//! less than its mass. Such pressures come in small clusters. For the pressures `P` of the cells around a
//! cluster and the unknown velocities `V` of all cells that those pressures act on,
//! `S_P = B_PV A_VV^-1 B_PV^T` is the Schur complement with all other velocities at rest, small and dense,
//! and a good estimate since the flow in a gap is local. The bodies' twists belong to `V`: a gap that could
//! not open would hide the lubrication pressure.

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Dim, Space};
use gluey_linalg::{AffineConstraints, SparseMatrix};
use nalgebra::DMatrix;

use crate::error::{SmallMatrix, StokesError};
use crate::operator::StokesSystem;
use crate::space::{ActiveCell, pressure_expansion, velocity_expansion};

/// Larger clusters are left to the mass matrix: their dense matrices would cost more than the iterations they
/// save.
const MOST_VELOCITIES: usize = 1000;
/// Share of the mass that is added to `S_P`, for pressures that act on no velocity.
const SHARE_OF_MASS: f64 = 1e-3;

/// The inverses of `S_P` for all gaps.
pub struct GapInverse {
    blocks: Vec<Block>,
}

/// `S_P^-1` of one gap.
struct Block {
    pressures: Vec<u32>,
    inverse: DMatrix<f64>,
}

impl GapInverse {
    /// For the gaps of `system` where the bodies leave any; `mass` approximates the Schur complement
    /// elsewhere.
    pub fn new<const D: usize>(system: &StokesSystem<D>, mass: &SparseMatrix) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        if system.pressure.poorly_supported().is_empty() {
            return Ok(Self { blocks: Vec::new() });
        }
        let forms = Forms {
            system,
            velocity: velocity_expansion(&system.space),
            pressure: pressure_expansion(&system.pressure),
        };
        let gaps = forms.gaps();
        let in_gaps = gaps.iter().flat_map(|gap| gap.velocities.iter().copied());
        let cells = forms.cells_with(&marked(system.velocity_dim(), in_gaps), Forms::velocities_of);
        let blocks = gaps.into_iter().map(|gap| forms.block(gap, &cells, mass));
        Ok(Self { blocks: blocks.collect::<Result<_, _>>()? })
    }

    /// `z += S_P^-1 r` on the pressures of every gap.
    pub fn add(&self, r: &[f32], z: &mut [f32]) {
        for Block { pressures, inverse } in &self.blocks {
            for (&q, row) in pressures.iter().zip(inverse.row_iter()) {
                let terms = row.iter().zip(pressures).map(|(s, &p)| s * f64::from(r[p as usize]));
                z[q as usize] += terms.sum::<f64>() as f32;
            }
        }
    }
}

/// The pressures of a gap and the velocities that they act on, sorted.
struct Gap {
    pressures: Vec<u32>,
    velocities: Vec<u32>,
}

/// The cells in terms of the unknowns.
struct Forms<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    velocity: AffineConstraints,
    pressure: AffineConstraints,
}

impl<const D: usize> Forms<'_, D>
where
    Dim<D>: Space<D>,
{
    /// The gaps whose matrices are small enough.
    fn gaps(&self) -> Vec<Gap> {
        let clusters = self.clusters();
        let in_clusters = marked(self.system.pressure.dim(), clusters.iter().flatten().copied());
        let cells = self.cells_with(&in_clusters, Self::pressures_of);
        let gap = |pressures: Vec<u32>| {
            let acting = cells_of(&cells, &pressures);
            let velocities =
                acting.into_iter().flat_map(|cell| self.velocities_of(&self.system.cells[cell as usize]));
            Gap { velocities: sorted(velocities), pressures }
        };
        clusters.into_iter().map(gap).filter(|gap| gap.velocities.len() <= MOST_VELOCITIES).collect()
    }

    /// The pressures of the cells with a poorly supported one; cells that share any are in one cluster.
    fn clusters(&self) -> Vec<Vec<u32>> {
        let poor =
            marked(self.system.pressure.dim(), self.system.pressure.poorly_supported().iter().copied());
        let mut parents: Vec<u32> = (0..poor.len() as u32).collect();
        let mut members = Vec::new();
        for cell in self.system.cells.iter().filter(|cell| self.is_fluid(cell)) {
            let pressures = sorted(self.pressures_of(cell));
            if pressures.iter().any(|&q| poor[q as usize]) {
                pressures.windows(2).for_each(|pair| join(&mut parents, pair[0], pair[1]));
                members.extend(pressures);
            }
        }
        let members = sorted(members.into_iter());
        let mut rooted: Vec<(u32, u32)> = members.into_iter().map(|q| (root(&mut parents, q), q)).collect();
        rooted.sort_unstable();
        rooted.chunk_by(|a, b| a.0 == b.0).map(|cluster| cluster.iter().map(|q| q.1).collect()).collect()
    }

    /// The wanted unknowns with the cells that have them among theirs, sorted.
    fn cells_with<'b, I: Iterator<Item = u32>>(
        &'b self,
        wanted: &[bool],
        unknowns: impl Fn(&'b Self, &'b ActiveCell) -> I,
    ) -> Vec<(u32, u32)> {
        let mut all = Vec::new();
        for (index, cell) in self.system.cells.iter().enumerate() {
            let wanted = unknowns(self, cell).filter(|&k| wanted[k as usize]);
            all.extend(wanted.map(|k| (k, index as u32)));
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    fn block(&self, gap: Gap, cells: &[(u32, u32)], mass: &SparseMatrix) -> Result<Block, StokesError> {
        let (n, m) = (gap.velocities.len(), gap.pressures.len());
        let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, m));
        let reference = self.system.discretisation().reference();
        for cell in cells_of(cells, &gap.velocities) {
            let cell = &self.system.cells[cell as usize];
            self.add_cell(cell, &reference, &gap, &mut a, &mut b);
        }
        let pressures = gap.pressures;
        let failed = |matrix| StokesError::GapPressures {
            matrix,
            place: self.system.discretisation().pressure.point(pressures[0] as usize).data.0[0].to_vec(),
            pressures: m,
            velocities: n,
        };
        let viscous = a.cholesky().ok_or_else(|| failed(SmallMatrix::Stiffness))?;
        let share = DMatrix::from_fn(m, m, |i, j| mass.get(pressures[i] as usize, pressures[j] as usize));
        let schur = b.transpose() * viscous.solve(&b) + SHARE_OF_MASS * share;
        let inverse = schur.cholesky().ok_or_else(|| failed(SmallMatrix::Schur))?.inverse();
        Ok(Block { pressures, inverse })
    }

    /// Adds the matrices of a cell to those between the unknowns of a gap.
    fn add_cell(
        &self,
        cell: &ActiveCell,
        reference: &ReferenceMatrices<D>,
        Gap { pressures, velocities }: &Gap,
        a: &mut DMatrix<f64>,
        b: &mut DMatrix<f64>,
    ) {
        let n = ReferenceMatrices::<D>::VELOCITY;
        let forms: Vec<_> = self.nodal(cell).map(|k| placed(self.velocity.terms(k), velocities)).collect();
        for (i, row) in forms.iter().enumerate().filter(|form| !form.1.is_empty()) {
            for (j, column) in forms.iter().enumerate() {
                add(a, row, column, cell.viscous * reference.viscous[i * n + j]);
            }
        }
        for (q, &node) in self.system.discretisation().pressure.cell(cell.cell as usize).iter().enumerate() {
            let column = placed(self.pressure.terms(node as usize), pressures);
            for (j, row) in forms.iter().enumerate() {
                add(b, row, &column, cell.divergence * reference.divergence[q * n + j]);
            }
        }
    }

    /// Nodal velocities of a cell.
    fn nodal(&self, cell: &ActiveCell) -> impl Iterator<Item = usize> {
        let nodes = self.system.discretisation().velocity.cell(cell.cell as usize).iter();
        nodes.flat_map(|&node| node as usize * D..(node as usize + 1) * D)
    }

    fn velocities_of(&self, cell: &ActiveCell) -> impl Iterator<Item = u32> {
        self.nodal(cell).flat_map(|k| self.velocity.terms(k)).map(|term| term.0)
    }

    fn pressures_of(&self, cell: &ActiveCell) -> impl Iterator<Item = u32> {
        let nodes = self.system.discretisation().pressure.cell(cell.cell as usize).iter();
        nodes.flat_map(|&q| self.pressure.terms(q as usize)).map(|term| term.0)
    }

    fn is_fluid(&self, cell: &ActiveCell) -> bool {
        let nodes = self.system.discretisation().velocity.cell(cell.cell as usize);
        nodes.iter().any(|&n| self.system.space.body_of(n as usize).is_none())
    }
}

fn sorted(unknowns: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut unknowns: Vec<u32> = unknowns.collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    unknowns
}

fn marked(count: usize, unknowns: impl Iterator<Item = u32>) -> Vec<bool> {
    let mut marked = vec![false; count];
    unknowns.for_each(|k| marked[k as usize] = true);
    marked
}

/// The cells of some unknowns in a sorted list of unknowns with their cells.
fn cells_of(all: &[(u32, u32)], unknowns: &[u32]) -> Vec<u32> {
    let cells = |&k: &u32| {
        let start = all.partition_point(|pair| pair.0 < k);
        all[start..].iter().take_while(move |pair| pair.0 == k).map(|pair| pair.1)
    };
    sorted(unknowns.iter().flat_map(cells))
}

/// The representative of the set that `k` belongs to; on the way there sets become flatter.
fn root(parents: &mut [u32], mut k: u32) -> u32 {
    while parents[k as usize] != k {
        let above = parents[parents[k as usize] as usize];
        parents[k as usize] = above;
        k = above;
    }
    k
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

/// The terms of a linear form in the given unknowns, by their places.
fn placed(form: &[(u32, f64)], unknowns: &[u32]) -> Vec<(usize, f64)> {
    form.iter().filter_map(|&(k, w)| unknowns.binary_search(&k).ok().map(|place| (place, w))).collect()
}

fn add(matrix: &mut DMatrix<f64>, rows: &[(usize, f64)], columns: &[(usize, f64)], value: f64) {
    for &(i, v) in rows {
        for &(j, w) in columns {
            matrix[(i, j)] += v * w * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{CutCellPressures, Discretisation, VelocitySpace, solid_nodes};
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;

    /// A disc whose poorly supported pressures are all kept, in a fluid of viscosity of any sign.
    fn disc(viscosity: f64) -> StokesSystem<2> {
        let disc = Ball::new(Vector::<2>::repeat(0.47), 0.2);
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; 2], [false; 2], 3).unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, &[disc], -0.1);
        let space = VelocitySpace::new(&discretisation, &[disc], &solid);
        StokesSystem::new(space, viscosity, CutCellPressures::Keep)
    }

    #[test]
    fn a_gap_whose_matrix_is_not_positive_is_named() {
        let no_mass = |system: &StokesSystem<2>| {
            SparseMatrix::from_triplets(system.pressure.dim(), system.pressure.dim(), &[]).unwrap()
        };
        let good = disc(1.0);
        assert!(!good.pressure.poorly_supported().is_empty());
        assert!(GapInverse::new(&good, &no_mass(&good)).is_ok());
        let bad = disc(-1.0);
        let refused = GapInverse::new(&bad, &no_mass(&bad)).err().unwrap();
        let stiffness = SmallMatrix::Stiffness;
        assert!(matches!(&refused, StokesError::GapPressures { matrix, .. } if *matrix == stiffness));
        let text = refused.to_string();
        assert!(
            text.starts_with("the stiffness of the gap at [0.") && text.contains("pressures and"),
            "{text}"
        );
    }
}
