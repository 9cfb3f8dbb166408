//! Schur complements of the pressures in gaps narrower than a cell.
//!
//! A pressure inside a body that has no outer neighbour to follow (see [`crate::pressure`]) is seen by a few free velocities
//! and by the approach of two bodies, and its Schur complement is up to a thousand times less than its mass. Such pressures
//! come in small clusters. For the pressures `P` of the cells around a cluster and the unknown velocities `V` of all cells
//! that those pressures act on, `S_P = B_PV A_VV^-1 B_PV^T` is the Schur complement with all other velocities at rest, small
//! and dense, and a good estimate since the flow in a gap is local. The bodies' twists belong to `V`: a gap that could not
//! open would hide the lubrication pressure.

use gluey_fem::Reference;
use gluey_geom::{Dim, Space};
use gluey_linalg::SparseMatrix;
use nalgebra::DMatrix;

use crate::assembly::{Expansion, pressure_expansion, velocity_expansion};
use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::system::{ActiveCell, StokesSystem};

/// Larger clusters are left to the mass matrix: their dense matrices would cost more than the iterations they save.
const MOST_VELOCITIES: usize = 1000;
/// Share of the mass that is added to `S_P`, for pressures that no velocity sees.
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
    /// For the gaps of `system` where the bodies leave any; `mass` approximates the Schur complement elsewhere.
    pub fn new<const D: usize>(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        mass: &SparseMatrix,
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        if system.pressure.weak().is_empty() {
            return Ok(Self { blocks: Vec::new() });
        }
        let forms = Forms {
            discretisation,
            system,
            velocity: velocity_expansion(&system.space),
            pressure: pressure_expansion(system),
        };
        let blocks = forms.clusters().into_iter().filter_map(|p| forms.block(p, mass).transpose());
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

/// The cells in terms of the unknowns.
struct Forms<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    discretisation: &'a Discretisation<D>,
    system: &'a StokesSystem<D>,
    velocity: Expansion,
    pressure: Expansion,
}

impl<const D: usize> Forms<'_, D>
where
    Dim<D>: Space<D>,
{
    /// The pressures of the cells with a weak one; cells that share any are in one cluster.
    fn clusters(&self) -> Vec<Vec<u32>> {
        let weak = self.system.pressure.weak();
        let mut clusters: Vec<Vec<u32>> = Vec::new();
        for cell in &self.system.cells {
            let pressures = self.pressures(cell);
            if !self.is_fluid(cell) || !meet(&pressures, weak) {
                continue;
            }
            let (mut joined, apart): (Vec<_>, Vec<_>) =
                clusters.into_iter().partition(|cluster| meet(cluster, &pressures));
            joined.push(pressures);
            clusters = apart;
            clusters.push(sorted(joined.into_iter().flatten()));
        }
        clusters
    }

    fn block(&self, pressures: Vec<u32>, mass: &SparseMatrix) -> Result<Option<Block>, StokesError> {
        let acting = self.system.cells.iter().filter(|cell| meet(&self.pressures(cell), &pressures));
        let velocities = sorted(acting.flat_map(|cell| self.velocities(cell)));
        let (n, m) = (velocities.len(), pressures.len());
        if n > MOST_VELOCITIES {
            return Ok(None);
        }
        let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, m));
        let reference = Reference::<D>::new();
        for cell in self.system.cells.iter().filter(|cell| meet(&self.velocities(cell), &velocities)) {
            self.add_cell(cell, &reference, (&velocities, &pressures), (&mut a, &mut b));
        }
        let without =
            |what| StokesError::Smoother { level: 0, reason: format!("pressures in a gap: {what}") };
        let viscous = a.cholesky().ok_or_else(|| without("a velocity without stiffness"))?;
        let share = DMatrix::from_fn(m, m, |i, j| mass.get(pressures[i] as usize, pressures[j] as usize));
        let schur = b.transpose() * viscous.solve(&b) + SHARE_OF_MASS * share;
        let inverse = schur.cholesky().ok_or_else(|| without("no positive Schur complement"))?.inverse();
        Ok(Some(Block { pressures, inverse }))
    }

    /// Adds the matrices of a cell to those between the given unknowns.
    fn add_cell(
        &self,
        cell: &ActiveCell,
        reference: &Reference<D>,
        (velocities, pressures): (&[u32], &[u32]),
        (a, b): (&mut DMatrix<f64>, &mut DMatrix<f64>),
    ) {
        let n = Reference::<D>::VELOCITY;
        let forms: Vec<_> = self.nodal(cell).map(|k| placed(self.velocity.of(k), velocities)).collect();
        for (i, row) in forms.iter().enumerate().filter(|form| !form.1.is_empty()) {
            for (j, column) in forms.iter().enumerate() {
                add(a, row, column, cell.viscous * reference.viscous[i * n + j]);
            }
        }
        for (q, &node) in self.discretisation.pressure.cell(cell.cell as usize).iter().enumerate() {
            let column = placed(self.pressure.of(node as usize), pressures);
            for (j, row) in forms.iter().enumerate() {
                add(b, row, &column, cell.divergence * reference.divergence[q * n + j]);
            }
        }
    }

    /// Nodal velocities of a cell.
    fn nodal(&self, cell: &ActiveCell) -> impl Iterator<Item = usize> {
        let nodes = self.discretisation.velocity.cell(cell.cell as usize).iter();
        nodes.flat_map(|&node| node as usize * D..(node as usize + 1) * D)
    }

    fn velocities(&self, cell: &ActiveCell) -> Vec<u32> {
        sorted(self.nodal(cell).flat_map(|k| self.velocity.of(k)).map(|term| term.0))
    }

    fn pressures(&self, cell: &ActiveCell) -> Vec<u32> {
        let nodes = self.discretisation.pressure.cell(cell.cell as usize).iter();
        sorted(nodes.flat_map(|&q| self.pressure.of(q as usize)).map(|term| term.0))
    }

    fn is_fluid(&self, cell: &ActiveCell) -> bool {
        let nodes = self.discretisation.velocity.cell(cell.cell as usize);
        nodes.iter().any(|&n| self.system.space.body_of(n as usize).is_none())
    }
}

fn sorted(unknowns: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut unknowns: Vec<u32> = unknowns.collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    unknowns
}

/// Whether two sorted lists have an entry in common.
fn meet(a: &[u32], b: &[u32]) -> bool {
    let (few, many) = if a.len() < b.len() { (a, b) } else { (b, a) };
    few.iter().any(|k| many.binary_search(k).is_ok())
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
