//! Sparse matrices of the Stokes system, for direct solvers.
//!
//! Every nodal unknown is a short linear form in the reduced unknowns (one term for a free node, the masters
//! of a hanging node, the entries of a body's twist for a rigid node, nothing on the boundary), so a cell
//! contributes `C^T K C` to its reduced unknowns. These come in blocks that are coupled alike: the components
//! at a free node, the twist of a body, a pressure.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_geom::Dim;
use gluey_linalg::{
    AffineConstraints, BlockGroups, BlockPattern, DirectSpd, Jagged, Ordering, RefinementParams, SparseError,
    SparseMatrix, Subset, Symbolic,
};

use super::element::{Elements, MatrixSource};
use super::system::StokesSystem;
use crate::error::StokesError;
use crate::space::{VelocitySpace, pressure_expansion, velocity_expansion};
use crate::term::piece_size;

/// The factor of a symmetric positive definite matrix.
pub fn factorised(matrix: &SparseMatrix, ordering: Ordering<'_>) -> Result<DirectSpd, StokesError> {
    let symbolic = Symbolic::new(matrix.pattern().clone(), ordering)?;
    let mut factor = DirectSpd::new(Arc::new(symbolic), RefinementParams::default())?;
    factor.factorise(matrix.values())?;
    Ok(factor)
}

/// A sparse matrix in the kept unknowns.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// The kept unknowns.
    pub unknowns: Subset,
    /// Their couplings.
    pub blocks: BlockPattern,
    /// The matrix.
    pub matrix: SparseMatrix,
}

/// Assembles the whole Stokes matrix `[A, -B^T; -B, 0]`. One pressure is left out, since pressures are
/// defined up to a constant, and one node where velocities are.
pub fn assemble_stokes<const D: usize>(system: &StokesSystem<D>) -> Result<Assembled, SparseError> {
    let discretisation = system.discretisation();
    let split = system.velocity_dim();
    let pinned = (0..system.pressure.dim()).find(|&q| system.pressure.is_free(q));
    let forces = split + system.pressure.dim();
    let loose = loose_node(&system.space);
    let unknowns = Subset::new(system.dim(), |k| match k.checked_sub(split) {
        Some(_) if k >= forces => true,
        Some(q) => system.pressure.is_free(q) && Some(q) != pinned,
        None => keeps_velocity(&system.space, k) && Some(k / D) != loose,
    });
    let velocity = velocity_expansion(&system.space).restricted_to(&unknowns, 0);
    let pressure = pressure_expansion(&system.pressure).restricted_to(&unknowns, split);
    let forms = |cell: usize, local: &mut CellForms| {
        local.set_velocity(&velocity, discretisation.velocity.cell(cell), D);
        discretisation.pressure.cell(cell).iter().for_each(|&q| local.push(pressure.terms(q as usize)));
    };
    let size = ReferenceMatrices::<D>::VELOCITY + ReferenceMatrices::<D>::PRESSURE;
    let rows = rows_of_terms(system, &unknowns);
    assemble(unknowns, forms, &Elements::new(system, size), &rows)
}

/// Assembles the velocity block alone. Where nothing fixes a constant velocity, one node is left out.
pub fn assemble_viscous<const D: usize>(system: &StokesSystem<D>) -> Result<Assembled, SparseError> {
    let elements = Elements::new(system, ReferenceMatrices::<D>::VELOCITY);
    let loose = loose_node(&system.space);
    assemble_viscous_on(&elements, |node| Some(node) != loose)
}

/// A node that is left out where nothing fixes a constant velocity.
fn loose_node<const D: usize>(space: &VelocitySpace<D>) -> Option<usize> {
    let first = || (0..space.nodes().node_count()).find(|&node| space.is_free(node));
    if space.is_anchored() { None } else { first() }
}

/// Assembles the diagonal block of the velocities at the free nodes for which `keep` holds, and of all
/// twists.
pub fn assemble_viscous_on<const D: usize>(
    elements: &Elements<'_, D>,
    keep: impl Fn(usize) -> bool,
) -> Result<Assembled, SparseError> {
    let system = elements.system();
    let discretisation = system.discretisation();
    let nodal = system.space.full_dim();
    let unknowns = Subset::new(system.velocity_dim(), |k| {
        keeps_velocity(&system.space, k) && (k >= nodal || keep(k / D))
    });
    let velocity = velocity_expansion(&system.space).restricted_to(&unknowns, 0);
    let forms = |cell: usize, local: &mut CellForms| {
        local.set_velocity(&velocity, discretisation.velocity.cell(cell), D);
    };
    assemble(unknowns, forms, elements, &Jagged::default())
}

fn keeps_velocity<const D: usize>(space: &VelocitySpace<D>, k: usize) -> bool {
    match k.checked_sub(space.full_dim()) {
        Some(twist) => {
            let body = twist / Dim::<D>::RIGID;
            !space.is_held(body) && space.is_active(body)
        }
        None => space.is_free(k / D),
    }
}

/// Sums up the matrices of the active cells and of the pieces of terms, whose local unknowns are given by
/// `forms`, and the rows of terms.
fn assemble<const D: usize>(
    unknowns: Subset,
    forms: impl Fn(usize, &mut CellForms),
    elements: &Elements<'_, D>,
    rows: &Jagged<(u32, f64)>,
) -> Result<Assembled, SparseError> {
    let system = elements.system();
    let numbering = KeptBlocks::new(system, &unknowns);
    let (mut local, mut groups) = (CellForms::default(), BlockGroups::default());
    let set_forms = |source: MatrixSource, local: &mut CellForms| match source {
        MatrixSource::Cell { cell, .. } => forms(cell, local),
        MatrixSource::Piece { cell, body, .. } => {
            forms(cell, local);
            local.extend_by_twist(system, &unknowns, body);
        }
    };
    let mut sources = Vec::with_capacity(system.cells.len());
    for source in elements.sources() {
        set_forms(source, &mut local);
        if !local.terms().is_empty() {
            groups.push(local.terms().iter().map(|term| numbering.of[term.0 as usize] as usize));
            sources.push(source);
        }
    }
    for row in rows.iter() {
        groups.push(row.iter().map(|term| numbering.of[term.0 as usize] as usize));
    }
    let mut rows = rows.iter();
    let blocks = BlockPattern::new(numbering.first, groups)?;
    let mut of_cells = Reduction::new(unknowns.len(), elements.size());
    let mut of_pieces = Reduction::new(unknowns.len(), piece_size::<D>());
    let mut sources = sources.into_iter();
    let matrix = blocks.sum(|group, target| {
        let Some(source) = sources.next() else {
            return rows.next().into_iter().for_each(|row| add_row(row, blocks.unknowns_of(group), target));
        };
        set_forms(source, &mut local);
        let reduction = if source.is_piece() { &mut of_pieces } else { &mut of_cells };
        reduction.place(&mut local, blocks.unknowns_of(group));
        if local.is_identity() && !source.is_piece() {
            elements.fill_source(source, target);
        } else {
            elements.fill_source(source, &mut reduction.element);
            reduction.multiply(&local, target);
        }
    });
    Ok(Assembled { unknowns, blocks, matrix })
}

/// The rows of terms in the kept unknowns, each ending with the force itself.
fn rows_of_terms<const D: usize>(system: &StokesSystem<D>, unknowns: &Subset) -> Jagged<(u32, f64)> {
    let mut rows = Jagged::default();
    let forces = system.dim() - system.row_count()..;
    for (row, force) in system.rows().zip(forces).filter_map(|(row, k)| Some((row, unknowns.number(k)?))) {
        let kept = row.iter().filter_map(|&(k, w)| Some((unknowns.number(k as usize)? as u32, w)));
        rows.push(kept.chain([(force as u32, -1.0)]));
    }
    rows
}

/// Adds the row of a force and its transpose to the matrix of these unknowns.
fn add_row(row: &[(u32, f64)], unknowns: impl Iterator<Item = usize>, target: &mut [f64]) {
    let unknowns: Vec<usize> = unknowns.collect();
    let Some((&(force, own), terms)) = row.split_last() else { return };
    let place = |unknown: u32| unknowns.iter().position(|&k| k == unknown as usize);
    let Some(force) = place(force) else { return };
    target[force * unknowns.len() + force] += own;
    for (unknown, weight) in terms.iter().filter_map(|&(k, weight)| Some((place(k)?, weight))) {
        target[force * unknowns.len() + unknown] += weight;
        target[unknown * unknowns.len() + force] += weight;
    }
}

/// Blocks of the kept unknowns.
struct KeptBlocks {
    /// Block of each unknown.
    of: Vec<u32>,
    /// First unknown of each block, and the number of unknowns.
    first: Vec<u32>,
}

impl KeptBlocks {
    fn new<const D: usize>(system: &StokesSystem<D>, unknowns: &Subset) -> Self {
        let (nodal, split) = (system.space.full_dim(), system.velocity_dim());
        let starts_block = |k: usize| match k {
            k if k < nodal => k % D == 0,
            k if k < split => (k - nodal) % Dim::<D>::RIGID == 0,
            _ => true,
        };
        let mut new = Self { of: Vec::with_capacity(unknowns.len()), first: Vec::new() };
        for (unknown, &k) in unknowns.positions().iter().enumerate() {
            if starts_block(k as usize) {
                new.first.push(unknown as u32);
            }
            new.of.push(new.first.len() as u32 - 1);
        }
        new.first.push(unknowns.len() as u32);
        new
    }
}

/// The linear forms of a cell's local unknowns, in a row.
#[derive(Default)]
struct CellForms {
    forms: Jagged<(u32, f64)>,
    /// The local unknown that each term belongs to.
    locals: Vec<u32>,
}

impl CellForms {
    /// The forms of the velocities at `nodes`, and no others.
    fn set_velocity(&mut self, velocity: &AffineConstraints, nodes: &[u32], component_count: usize) {
        self.forms.clear();
        self.locals.clear();
        for &node in nodes {
            let first = node as usize * component_count;
            (first..first + component_count).for_each(|k| self.push(velocity.terms(k)));
        }
    }

    /// Adds the twist of a body to the forms of a cell, whose pressures count as zero if they have none.
    fn extend_by_twist<const D: usize>(&mut self, system: &StokesSystem<D>, unknowns: &Subset, body: usize) {
        let nodal = ReferenceMatrices::<D>::VELOCITY + ReferenceMatrices::<D>::PRESSURE;
        while self.forms.len() < nodal {
            self.push(&[]);
        }
        let first = system.space.full_dim() + body * Dim::<D>::RIGID;
        for k in first..first + Dim::<D>::RIGID {
            let number = unknowns.number(k).map(|number| (number as u32, 1.0));
            self.push(number.as_slice());
        }
    }

    fn push(&mut self, form: &[(u32, f64)]) {
        self.locals.resize(self.locals.len() + form.len(), self.forms.len() as u32);
        self.forms.push(form.iter().copied());
    }

    /// Unknown and weight of all terms.
    fn terms(&self) -> &[(u32, f64)] {
        self.forms.items()
    }

    /// Whether each form is the unknown in its place.
    fn is_identity(&self) -> bool {
        self.forms.iter().zip(0..).all(|(form, k)| *form == [(k, 1.0)])
    }
}

/// Workspace of `C^T K C`.
struct Reduction {
    /// Place of each unknown among those of the cell at hand.
    place: Vec<u32>,
    /// Number of unknowns of the cell.
    count: usize,
    /// `K`.
    element: Vec<f64>,
    /// Number of rows of `K`.
    size: usize,
    /// A row of `K C`.
    row: Vec<f64>,
}

impl Reduction {
    fn new(dim: usize, size: usize) -> Self {
        Self { place: vec![0; dim], count: 0, element: vec![0.0; size * size], size, row: Vec::new() }
    }

    /// Turns the unknowns in `forms` into places among those of the cell.
    fn place(&mut self, forms: &mut CellForms, unknowns: impl Iterator<Item = usize>) {
        self.count = 0;
        for unknown in unknowns {
            self.place[unknown] = self.count as u32;
            self.count += 1;
        }
        for term in forms.forms.items_mut() {
            term.0 = self.place[term.0 as usize];
        }
    }

    /// Adds `C^T K C` to `target`.
    fn multiply(&mut self, forms: &CellForms, target: &mut [f64]) {
        self.row.resize(self.count, 0.0);
        for (rows, values) in forms.forms.iter().zip(self.element.chunks_exact(self.size)) {
            if rows.is_empty() {
                continue;
            }
            self.row.fill(0.0);
            for (&(column, weight), &local) in forms.terms().iter().zip(&forms.locals) {
                self.row[column as usize] += weight * values[local as usize];
            }
            for &(r, weight) in rows {
                let target = &mut target[r as usize * self.count..][..self.count];
                target.iter_mut().zip(&self.row).for_each(|(t, v)| *t += weight * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::system::SystemOperator;
    use crate::space::{Discretisation, solid_nodes};
    use crate::term::{Product, Scratch, Term};
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;
    use gluey_linalg::{LinOp, Scalar};

    /// A term that ties velocities by a force of its own.
    #[derive(Debug)]
    struct Tie([(u32, f64); 2]);

    impl<X: Scalar, T> Product<X, T> for Tie {
        fn add(&self, [x, _, g]: [&[X]; 3], [y, _, z]: [&mut [X]; 3], _: &mut Scratch<T>) {
            for (k, weight) in self.0 {
                z[0] += X::from_f64(weight * x[k as usize].to_f64());
                y[k as usize] += X::from_f64(weight * g[0].to_f64());
            }
            z[0] += X::from_f64(-g[0].to_f64());
        }
    }

    impl<const D: usize> Term<D> for Tie {
        fn row_count(&self) -> usize {
            1
        }

        fn row(&self, _: usize) -> &[(u32, f64)] {
            &self.0
        }
    }

    /// Two bodies whose cells touch, on a mesh with hanging nodes, and a term of which no other code knows.
    fn assembled_and_matrix_free_agree<const D: usize>() {
        let balls = [0.32, 0.6].map(|x| Ball::new(Vector::<D>::repeat(x), 0.14 * (D as f64).sqrt()));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, h, level| {
            level < 3 || (0..D).all(|d| lower[d] < 0.5 && lower[d] + h > 0.1)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation, &balls, 0.0);
        let space = VelocitySpace::new(&discretisation, &balls, &solid);
        let free: Vec<usize> = (0..space.nodes().node_count()).filter(|&node| space.is_free(node)).collect();
        let tie = Tie([(free[2] as u32 * D as u32, 0.7), (space.full_dim() as u32, -0.4)]);
        let mut system = StokesSystem::new(space, 1.5);
        system.terms.push(Arc::new(tie));
        let assembled = assemble_stokes(&system).unwrap();
        let unknowns = &assembled.unknowns;
        let x: Vec<f64> = (0..unknowns.len()).map(|i| (0.37 * i as f64).sin()).collect();
        let mut y = vec![0.0; x.len()];
        assembled.matrix.multiply(&x, &mut y);
        let (mut full, mut image) = (vec![0.0; system.dim()], vec![0.0; system.dim()]);
        unknowns.scatter(&x, &mut full);
        SystemOperator::new(&system).apply(&full, &mut image);
        let mut gathered = vec![0.0; x.len()];
        unknowns.gather(&image, &mut gathered);
        // The operator makes its divergences sum to zero, so they may differ by one number.
        let pressures = system.velocity_dim()..system.dim() - 1;
        let is_pressure = |i: usize| pressures.contains(&(unknowns.positions()[i] as usize));
        let first = (0..y.len()).find(|&i| is_pressure(i)).unwrap();
        let shift = y[first] - gathered[first];
        for i in 0..y.len() {
            let expected = gathered[i] + if is_pressure(i) { shift } else { 0.0 };
            assert!((y[i] - expected).abs() < 1e-10, "{i}: {} {expected}", y[i]);
        }
    }

    #[test]
    fn the_assembled_matrix_is_the_operator() {
        assembled_and_matrix_free_agree::<2>();
        assembled_and_matrix_free_agree::<3>();
    }
}
