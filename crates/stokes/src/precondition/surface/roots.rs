//! The weak modes of all roots and the diagonal of the operator near surfaces, from one batch of roots after
//! another: the matrix on all nodes near surfaces would take more memory than everything else.

use gluey_linalg::{
    BlockGroups, Jagged, LocalTerm, ModesWorkspace, PatchError, Pattern, SymmetricBlockMatrix, weak_modes,
};
use rayon::prelude::*;

use crate::error::StokesError;
use crate::operator::{Elements, MatrixSource};
use crate::precondition::assembly::{NodeForms, for_each_matrix};
use crate::precondition::numbered::NumberedNodes;

/// Roots of a batch. Matrices of cells that two batches share are made twice.
const ROOTS: usize = 512;
/// Least number of roots of a batch whose modes are found by one thread.
const LEAST_SHARE: usize = 16;
/// Nodes in a batch of those that belong to no root.
const NODES: usize = 4096;

/// Some roots and all nodes whose rows are wanted.
struct Batch {
    roots: std::ops::Range<usize>,
    /// Numbers, ascending.
    nodes: Vec<u32>,
}

/// Contributions of cells and pieces to the rows of numbered nodes.
struct Contributions<'a, const D: usize> {
    elements: &'a Elements<'a, D>,
    forms: NodeForms<'a, D>,
    sources: Vec<MatrixSource>,
    /// Those that add to each row, by their places in `sources`.
    of_node: Jagged<u32>,
}

/// A reason why there are none: the first block that is not positive definite, or no matrix.
pub enum ModesError {
    /// A block.
    Patch(PatchError),
    /// No matrix.
    Matrix(StokesError),
}

/// The weak modes of each of `patches`, ascending numbers of nodes, and the diagonal at all numbered nodes.
pub fn modes_and_diagonal<const D: usize>(
    nodes: &NumberedNodes<'_, D>,
    elements: &Elements<'_, D>,
    patches: &Jagged<u32>,
) -> Result<(Vec<Vec<f32>>, Vec<f64>), ModesError> {
    let contributions = Contributions::new(nodes, elements);
    let batches = batches(patches, nodes.nodes.len());
    let workspace = || vec![u32::MAX; nodes.nodes.len()];
    let found: Vec<Result<_, ModesError>> = batches
        .par_iter()
        .map_init(workspace, |place, batch| contributions.of_batch(batch, patches, place))
        .collect();
    // The first error, whichever thread was the first to find one.
    let found: Vec<(Vec<Vec<f32>>, Vec<f64>)> = found.into_iter().collect::<Result<_, _>>()?;
    let mut diagonal = vec![0.0; nodes.nodes.len() * D];
    for (batch, (_, own)) in batches.iter().zip(&found) {
        for (&node, own) in batch.nodes.iter().zip(own.chunks_exact(D)) {
            diagonal[node as usize * D..][..D].copy_from_slice(own);
        }
    }
    Ok((found.into_iter().flat_map(|(modes, _)| modes).collect(), diagonal))
}

/// Batches of all patches, and of the nodes in none.
fn batches(patches: &Jagged<u32>, node_count: usize) -> Vec<Batch> {
    let mut is_in_patch = vec![false; node_count];
    patches.items().iter().for_each(|&node| is_in_patch[node as usize] = true);
    let batch = |first: usize| {
        let roots = first..(first + ROOTS).min(patches.len());
        let mut nodes: Vec<u32> = roots.clone().flat_map(|root| &patches[root]).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        Batch { roots, nodes }
    };
    let rest: Vec<u32> = (0..node_count as u32).filter(|&node| !is_in_patch[node as usize]).collect();
    let without_roots = rest.chunks(NODES).map(|nodes| Batch { roots: 0..0, nodes: nodes.to_vec() });
    (0..patches.len()).step_by(ROOTS).map(batch).chain(without_roots).collect()
}

impl<'a, const D: usize> Contributions<'a, D> {
    fn new(nodes: &'a NumberedNodes<'a, D>, elements: &'a Elements<'a, D>) -> Self {
        let forms = NodeForms::new(nodes, elements.system().space.ghosts());
        let (mut terms, mut sources, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
        for source in elements.viscous_sources() {
            forms.of_cell(source.cell(), &mut terms);
            let rows = terms.chunk_by(|a, b| a.row == b.row).map(|terms| terms[0].row);
            pairs.extend(rows.map(|row| (row, sources.len() as u32)));
            if !terms.is_empty() {
                sources.push(source);
            }
        }
        let of_node = Jagged::grouped(nodes.nodes.len(), pairs.iter().map(|&(row, at)| (row as usize, at)));
        Self { elements, forms, sources, of_node }
    }

    /// The modes of the roots of a batch, and the diagonal at its nodes.
    fn of_batch(
        &self,
        batch: &Batch,
        patches: &Jagged<u32>,
        place: &mut [u32],
    ) -> Result<(Vec<Vec<f32>>, Vec<f64>), ModesError> {
        batch.nodes.iter().zip(0..).for_each(|(&node, k)| place[node as usize] = k);
        let matrix = self.matrix(batch, place);
        let local: Vec<Vec<u32>> = batch
            .roots
            .clone()
            .map(|root| patches[root].iter().map(|&node| place[node as usize]).collect())
            .collect();
        batch.nodes.iter().for_each(|&node| place[node as usize] = u32::MAX);
        let matrix = matrix.map_err(ModesError::Matrix)?;
        let diagonal = matrix.diagonal();
        let modes: Vec<Result<_, ModesError>> = local
            .par_iter()
            .zip(batch.roots.clone())
            .with_min_len(LEAST_SHARE)
            .map_init(ModesWorkspace::default, |work, (nodes, patch)| {
                let modes = weak_modes(&matrix, &diagonal, nodes, work);
                modes.map_err(|source| ModesError::Patch(PatchError { patch, source }))
            })
            .collect();
        Ok((modes.into_iter().collect::<Result<_, _>>()?, diagonal))
    }

    /// The matrix on the nodes of a batch, which are numbered by `place`.
    fn matrix(&self, batch: &Batch, place: &[u32]) -> Result<SymmetricBlockMatrix<D>, StokesError> {
        let mut touching: Vec<u32> =
            batch.nodes.iter().flat_map(|&node| &self.of_node[node as usize]).copied().collect();
        touching.sort_unstable();
        touching.dedup();
        let (mut terms, mut groups) = (Vec::new(), BlockGroups::default());
        for &source in &touching {
            self.terms(self.sources[source as usize], place, &mut terms);
            groups.push(terms.iter().map(|term: &LocalTerm| term.row as usize));
        }
        let groups: Vec<&[usize]> = groups.iter().collect();
        let mut matrix = SymmetricBlockMatrix::zeros(&Pattern::from_groups(batch.nodes.len(), &groups)?);
        let sources: Vec<MatrixSource> =
            touching.iter().map(|&source| self.sources[source as usize]).collect();
        for_each_matrix(self.elements, &sources, |source, dense| {
            self.terms(source, place, &mut terms);
            matrix.add_local(&terms, dense);
        });
        Ok(matrix)
    }

    /// The terms of a source in the rows of a batch.
    fn terms(&self, source: MatrixSource, place: &[u32], terms: &mut Vec<LocalTerm>) {
        self.forms.of_cell(source.cell(), terms);
        terms.retain_mut(|term| {
            term.row = place[term.row as usize];
            term.row != u32::MAX
        });
    }
}
