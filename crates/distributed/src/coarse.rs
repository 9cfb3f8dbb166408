//! The coarsest level: gathered to rank zero, solved there by a factor, and sent back.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_linalg::{
    DirectError, DirectSpd, Ordering, Preconditioner, RefinementParams, SparseMatrix, Symbolic,
};

use crate::space::LevelSpace;

/// The viscous matrix of a level that lies whole in this rank, and its factor.
pub struct CoarseFactor {
    factor: DirectSpd,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl CoarseFactor {
    /// Nodes without an unknown have the identity.
    pub fn new<const D: usize>(space: &LevelSpace<D>, viscosity: f64) -> Result<Self, DirectError> {
        let dim = space.velocity.map.node_count() * D;
        let matrix = SparseMatrix::from_triplets(dim, dim, &triplets(space, viscosity))?;
        let symbolic = Symbolic::new(matrix.pattern().clone(), Ordering::Amd)?;
        let mut factor = DirectSpd::new(Arc::new(symbolic), RefinementParams::default())?;
        factor.factorise(matrix.values())?;
        Ok(Self { factor, b: vec![0.0; dim], x: vec![0.0; dim] })
    }

    /// `x = A^-1 b`.
    pub fn solve(&mut self, b: &[f32], x: &mut [f32]) {
        self.b.iter_mut().zip(b).for_each(|(wide, &b)| *wide = f64::from(b));
        self.factor.apply(&self.b, &mut self.x);
        x.iter_mut().zip(&self.x).for_each(|(x, &wide)| *x = wide as f32);
    }
}

fn triplets<const D: usize>(space: &LevelSpace<D>, viscosity: f64) -> Vec<(usize, usize, f64)> {
    let nodes = &space.velocity;
    let (n, viscous) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::new().viscous);
    let is_free = |node: u32| nodes.is_free(node as usize);
    let fixed = (0..nodes.map.node_count()).filter(|&node| !nodes.is_free(node));
    let mut triplets: Vec<_> =
        fixed.flat_map(|node| (0..D).map(move |c| (node * D + c, node * D + c, 1.0))).collect();
    let mesh = &space.part.mesh;
    for cell in 0..mesh.cell_count() {
        let scale = viscosity * mesh.size(mesh.cells()[cell].level).powi(D as i32 - 2);
        let expanded: Vec<(usize, u32, f64)> = (nodes.map.cell(cell).iter().enumerate())
            .flat_map(|(i, &node)| nodes.regular(node).map(move |(master, w)| (i, master, w)))
            .filter(|&(_, master, _)| is_free(master))
            .collect();
        for &(i, row, left) in &expanded {
            for &(j, column, right) in &expanded {
                for (a, b) in (0..D * D).map(|k| (k / D, k % D)) {
                    let entry = scale * left * right * viscous[(i * D + a) * n + j * D + b];
                    triplets.push((row as usize * D + a, column as usize * D + b, entry));
                }
            }
        }
    }
    triplets
}
