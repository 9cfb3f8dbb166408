//! Sparse matrices of the Stokes system, for direct solvers.
//!
//! Every nodal unknown is a short linear form in the reduced unknowns (one term for a free node, the masters of a
//! hanging node, the entries of a body's twist for a rigid node, nothing on the boundary), so a cell contributes
//! `C^T K C` to its reduced unknowns.

use std::sync::Arc;

use gluey_fem::Reference;
use gluey_geom::{Dim, Space};
use gluey_linalg::{Pattern, SparseError, SparseMatrix};

use crate::discretisation::Discretisation;
use crate::space::VelocitySpace;
use crate::system::StokesSystem;

/// The fluid of a direct solve is so compressible, relative to its viscosity: enough to make pressures that no
/// velocity sees harmless, too little to matter.
const COMPRESSIBILITY: f64 = 1e-9;

/// Linear forms of nodal unknowns in reduced ones, compressed.
#[derive(Clone, Debug)]
pub struct Expansion {
    starts: Vec<u32>,
    terms: Vec<(u32, f64)>,
}

impl Expansion {
    fn from_rows(rows: &[Vec<(u32, f64)>]) -> Self {
        let mut new = Self { starts: vec![0], terms: Vec::new() };
        for row in rows {
            new.terms.extend_from_slice(row);
            new.starts.push(new.terms.len() as u32);
        }
        new
    }

    /// Terms `(unknown, weight)` of a nodal unknown.
    pub fn of(&self, nodal: usize) -> &[(u32, f64)] {
        &self.terms[self.starts[nodal] as usize..self.starts[nodal + 1] as usize]
    }
}

/// Linear forms of the nodal velocities (`node * D + component`) in the positions of a reduced vector.
pub fn velocity_expansion<const D: usize>(space: &VelocitySpace<D>) -> Expansion
where
    Dim<D>: Space<D>,
{
    let nodes = space.nodes();
    let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); space.full_dim()];
    for node in (0..nodes.node_count()).filter(|&n| space.is_free(n)) {
        for k in node * D..(node + 1) * D {
            rows[k].push((k as u32, 1.0));
        }
    }
    for (node, body, matrix) in space.rigid_rows() {
        let first = space.full_dim() + body as usize * Dim::<D>::RIGID;
        for (c, row) in matrix.chunks_exact(Dim::<D>::RIGID).enumerate() {
            let terms = row.iter().enumerate().filter(|t| *t.1 != 0.0);
            rows[node as usize * D + c] = terms.map(|(k, &w)| ((first + k) as u32, w)).collect();
        }
    }
    for constraint in nodes.constraints() {
        for c in 0..D {
            let mut terms = Vec::new();
            for &(master, weight) in &constraint.masters {
                terms.extend(rows[master as usize * D + c].iter().map(|&(k, w)| (k, w * weight)));
            }
            rows[constraint.node as usize * D + c] = terms;
        }
    }
    Expansion::from_rows(&rows)
}

/// Linear forms of the pressure nodes in the free ones.
pub fn pressure_expansion<const D: usize>(system: &StokesSystem<D>) -> Expansion
where
    Dim<D>: Space<D>,
{
    let pressure = &system.pressure;
    let own = |q: usize| if pressure.is_free(q) { vec![(q as u32, 1.0)] } else { Vec::new() };
    let mut rows: Vec<Vec<(u32, f64)>> = (0..pressure.dim()).map(own).collect();
    for constraint in pressure.constraints() {
        let terms = constraint.masters.iter();
        let terms = terms.flat_map(|&(m, w)| rows[m as usize].iter().map(move |&(q, v)| (q, v * w)));
        rows[constraint.node as usize] = terms.collect();
    }
    Expansion::from_rows(&rows)
}

/// Numbering of the unknowns that a matrix keeps out of all positions of a reduced vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknowns {
    /// Position in the reduced vector of each unknown.
    pub positions: Vec<u32>,
    number: Vec<u32>,
}

impl Unknowns {
    fn new(count: usize, keep: impl Fn(usize) -> bool) -> Self {
        let positions: Vec<u32> = (0..count as u32).filter(|&k| keep(k as usize)).collect();
        let mut number = vec![u32::MAX; count];
        for (i, &k) in positions.iter().enumerate() {
            number[k as usize] = i as u32;
        }
        Self { positions, number }
    }

    /// Gathers the kept entries of a reduced vector.
    pub fn gather(&self, from: &[f64], to: &mut [f64]) {
        for (value, &k) in to.iter_mut().zip(&self.positions) {
            *value = from[k as usize];
        }
    }

    /// Scatters into a reduced vector, zero elsewhere.
    pub fn scatter(&self, from: &[f64], to: &mut [f64]) {
        to.fill(0.0);
        for (value, &k) in from.iter().zip(&self.positions) {
            to[k as usize] = *value;
        }
    }
}

/// One cell's reduced unknowns and its matrix in them.
struct Contribution {
    unknowns: Vec<usize>,
    matrix: Vec<f64>,
}

/// A sparse matrix in the kept unknowns.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// The kept unknowns.
    pub unknowns: Unknowns,
    /// The matrix.
    pub matrix: SparseMatrix,
}

/// Assembles the whole Stokes matrix `[A, -B^T; -B, 0]`. One pressure is left out, since pressures are defined up to a
/// constant.
pub fn assemble_stokes<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
) -> Result<Assembled, SparseError>
where
    Dim<D>: Space<D>,
{
    let (n, m) = (Reference::<D>::VELOCITY, Reference::<D>::PRESSURE);
    let velocity = velocity_expansion(&system.space);
    let pressure = pressure_expansion(system);
    let split = system.velocity_dim();
    let pinned = (0..system.pressure.dim()).find(|&q| system.pressure.is_free(q));
    let total = split + system.pressure.dim();
    let unknowns = Unknowns::new(total, |k| match k.checked_sub(split) {
        Some(q) => system.pressure.is_free(q) && Some(q) != pinned,
        None => keeps_velocity(&system.space, k),
    });
    let local = local_matrices(discretisation, system, true);
    let contributions: Vec<Contribution> = system
        .cells
        .iter()
        .zip(local)
        .map(|(cell, matrix)| {
            let cell = cell.cell as usize;
            let u = discretisation.velocity.cell(cell).iter();
            let u = u.flat_map(|&v| (0..D).map(move |c| v as usize * D + c)).map(|k| velocity.of(k));
            let mut terms: Vec<Vec<(u32, f64)>> = u.map(<[_]>::to_vec).collect();
            let p = discretisation.pressure.cell(cell).iter().map(|&q| pressure.of(q as usize));
            terms.extend(p.map(|t| t.iter().map(|&(q, w)| (q + split as u32, w)).collect()));
            contribution(&terms, &matrix, n + m, &unknowns)
        })
        .collect();
    collect(unknowns, &contributions)
}

/// Assembles the velocity block alone.
pub fn assemble_viscous<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
) -> Result<Assembled, SparseError>
where
    Dim<D>: Space<D>,
{
    let velocity = velocity_expansion(&system.space);
    let unknowns = Unknowns::new(system.velocity_dim(), |k| keeps_velocity(&system.space, k));
    let n = Reference::<D>::VELOCITY;
    let local = local_matrices(discretisation, system, false);
    let contributions: Vec<Contribution> = system
        .cells
        .iter()
        .zip(local)
        .map(|(cell, matrix)| {
            let u = discretisation.velocity.cell(cell.cell as usize).iter();
            let u = u.flat_map(|&v| (0..D).map(move |c| v as usize * D + c)).map(|k| velocity.of(k));
            let terms: Vec<Vec<(u32, f64)>> = u.map(<[_]>::to_vec).collect();
            contribution(&terms, &matrix, n, &unknowns)
        })
        .collect();
    collect(unknowns, &contributions)
}

fn keeps_velocity<const D: usize>(space: &VelocitySpace<D>, k: usize) -> bool
where
    Dim<D>: Space<D>,
{
    match k.checked_sub(space.full_dim()) {
        Some(twist) => space.is_active(twist / Dim::<D>::RIGID),
        None => space.is_free(k / D),
    }
}

/// Element matrices of the active cells: the viscous one, or the whole saddle.
fn local_matrices<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    saddle: bool,
) -> Vec<Vec<f64>>
where
    Dim<D>: Space<D>,
{
    let reference = Reference::<D>::new();
    let (n, m) = (Reference::<D>::VELOCITY, Reference::<D>::PRESSURE);
    let size = if saddle { n + m } else { n };
    let mut slot = vec![usize::MAX; discretisation.mesh.cell_count()];
    let mut matrices = Vec::with_capacity(system.cells.len());
    for (k, cell) in system.cells.iter().enumerate() {
        let viscosity = cell.viscous * (cell.volume / cell.divergence).powi(2) / cell.volume;
        slot[cell.cell as usize] = k;
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            for j in 0..n {
                matrix[i * size + j] = cell.viscous * reference.viscous[i * n + j];
            }
        }
        for q in 0..size - n {
            for r in 0..m {
                matrix[(n + q) * size + n + r] =
                    -COMPRESSIBILITY * cell.volume / viscosity * reference.pressure_mass[q * m + r];
            }
            for j in 0..n {
                let value = -cell.divergence * reference.divergence[q * n + j];
                matrix[(n + q) * size + j] = value;
                matrix[j * size + n + q] = value;
            }
        }
        matrices.push(matrix);
    }
    if let Some(penalty) = &system.penalty {
        penalty.stress.for_each_cell(|cell, scale, own| {
            let matrix = &mut matrices[slot[cell as usize]];
            for i in 0..n {
                for j in 0..n {
                    let k = own.map_or(reference.viscous[i * n + j], |own| own[i * n + j]);
                    matrix[i * size + j] += penalty.factor * scale * k;
                }
            }
        });
    }
    matrices
}

/// `C^T K C` for a cell whose local unknowns are the given linear forms.
fn contribution(terms: &[Vec<(u32, f64)>], matrix: &[f64], size: usize, unknowns: &Unknowns) -> Contribution {
    let mut group: Vec<usize> = Vec::with_capacity(size);
    let mut forms: Vec<Vec<(usize, f64)>> = Vec::with_capacity(size);
    for form in terms {
        let mut kept = Vec::with_capacity(form.len());
        for &(k, w) in form {
            let number = unknowns.number[k as usize] as usize;
            if number == u32::MAX as usize {
                continue;
            }
            let place = group.iter().position(|&g| g == number).unwrap_or_else(|| {
                group.push(number);
                group.len() - 1
            });
            kept.push((place, w));
        }
        forms.push(kept);
    }
    let count = group.len();
    let mut reduced = vec![0.0; count * count];
    for (i, rows) in forms.iter().enumerate() {
        for &(r, wr) in rows {
            for (j, columns) in forms.iter().enumerate() {
                let value = wr * matrix[i * size + j];
                for &(c, wc) in columns {
                    reduced[r * count + c] += value * wc;
                }
            }
        }
    }
    Contribution { unknowns: group, matrix: reduced }
}

fn collect(unknowns: Unknowns, contributions: &[Contribution]) -> Result<Assembled, SparseError> {
    let groups: Vec<&[usize]> = contributions.iter().map(|c| c.unknowns.as_slice()).collect();
    let pattern = Pattern::from_groups(unknowns.positions.len(), &groups)?;
    let mut matrix = SparseMatrix::zeros(Arc::new(pattern));
    for c in contributions {
        matrix.add_block(&c.unknowns, &c.matrix)?;
    }
    Ok(Assembled { unknowns, matrix })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::solid_nodes;
    use crate::pressure::WeakPressures;
    use crate::system::SystemOperator;
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;
    use gluey_linalg::LinOp;

    /// Two bodies whose cells touch, on a mesh with hanging nodes.
    fn assembled_and_matrix_free_agree<const D: usize>()
    where
        Dim<D>: Space<D>,
    {
        let balls = [0.32, 0.6].map(|x| Ball::new(Vector::<D>::repeat(x), 0.14 * (D as f64).sqrt()));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, h, level| {
            level < 3 || (0..D).all(|d| lower[d] < 0.5 && lower[d] + h > 0.1)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, &balls, 0.0);
        let space = VelocitySpace::new(discretisation.velocity.clone(), &balls, &solid);
        let system = StokesSystem::new(&discretisation, space, 1.5, WeakPressures::Aggregate, None);
        let assembled = assemble_stokes(&discretisation, &system).unwrap();
        let unknowns = &assembled.unknowns;
        let x: Vec<f64> = (0..unknowns.positions.len()).map(|i| (0.37 * i as f64).sin()).collect();
        let mut y = vec![0.0; x.len()];
        assembled.matrix.multiply(&x, &mut y);
        let (mut full, mut image) = (vec![0.0; system.dim()], vec![0.0; system.dim()]);
        unknowns.scatter(&x, &mut full);
        SystemOperator::new(&system).apply(&full, &mut image);
        let mut gathered = vec![0.0; x.len()];
        unknowns.gather(&image, &mut gathered);
        for i in 0..y.len() {
            assert!((y[i] - gathered[i]).abs() < 1e-10, "{i}: {} {}", y[i], gathered[i]);
        }
    }

    #[test]
    fn the_assembled_matrix_is_the_operator() {
        assembled_and_matrix_free_agree::<2>();
        assembled_and_matrix_free_agree::<3>();
    }
}
