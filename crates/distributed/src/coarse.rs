//! The coarsest level: gathered to rank zero, solved there by a factor, and sent back.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_linalg::{
    DirectError, DirectSpd, Ordering, Preconditioner, RefinementParams, SparseMatrix, Subset, Symbolic,
};

use crate::bodies::{rigid, rows};
use crate::space::LevelSpace;

/// The viscous matrix of a level that lies whole in this rank, and its factor.
pub struct CoarseFactor {
    factor: DirectSpd,
    unknowns: Subset,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl CoarseFactor {
    /// Where nothing fixes a constant velocity one node is left out, as in the serial solver.
    pub fn new<const D: usize>(space: &LevelSpace<D>, viscosity: f64) -> Result<Self, DirectError> {
        let (nodal, nodes) = (space.nodal_dim(), space.velocity.map.node_count());
        let is_on_wall = |node| space.velocity.map.is_on_boundary(node);
        let is_fixed = space.bodies.holds_nodes() || (0..nodes).any(is_on_wall);
        let loose = if is_fixed { None } else { (0..nodes).find(|&node| space.is_free(node)) };
        let unknowns = Subset::new(space.dim(), |k| match k.checked_sub(nodal) {
            Some(twist) => {
                let body = twist / rigid::<D>();
                space.bodies.is_active(body) && !space.bodies.is_held(body)
            }
            None => space.is_free(k / D) && Some(k / D) != loose,
        });
        let dim = unknowns.len();
        let matrix = SparseMatrix::from_triplets(dim, dim, &triplets(space, &unknowns, viscosity))?;
        let symbolic = Symbolic::new(matrix.pattern().clone(), Ordering::Amd)?;
        let mut factor = DirectSpd::new(Arc::new(symbolic), RefinementParams::default())?;
        factor.factorise(matrix.values())?;
        Ok(Self { factor, unknowns, b: vec![0.0; dim], x: vec![0.0; dim] })
    }

    /// `x = A^-1 b`.
    pub fn solve(&mut self, b: &[f32], x: &mut [f32]) {
        for (value, &k) in self.b.iter_mut().zip(self.unknowns.positions()) {
            *value = f64::from(b[k as usize]);
        }
        self.factor.apply(&self.b, &mut self.x);
        x.fill(0.0);
        for (value, &k) in self.x.iter().zip(self.unknowns.positions()) {
            x[k as usize] = *value as f32;
        }
    }
}

/// A term of a nodal velocity: its unknown, and the factor.
pub type Term = (u32, f64);

/// The velocity of a node in the unknowns: for each component its terms.
pub fn forms<const D: usize>(space: &LevelSpace<D>, node: u32) -> [Vec<Term>; D] {
    let mut forms: [Vec<Term>; D] = std::array::from_fn(|_| Vec::new());
    let (bodies, n) = (&space.bodies, rigid::<D>());
    for (node, weight) in space.velocity.regular(node) {
        if let Ok(place) = bodies.nodes.binary_search_by_key(&node, |rigid| rigid.node) {
            let rigid = &bodies.nodes[place];
            let first = space.nodal_dim() + rigid.body as usize * n;
            for (c, row) in rows(rigid).chunks_exact(n).enumerate() {
                let terms = row.iter().enumerate().filter(|term| *term.1 != 0.0);
                forms[c].extend(terms.map(|(k, entry)| ((first + k) as u32, weight * entry)));
            }
        } else if space.is_free(node as usize) {
            (0..D).for_each(|c| forms[c].push(((node as usize * D + c) as u32, weight)));
        }
    }
    forms
}

fn triplets<const D: usize>(
    space: &LevelSpace<D>,
    unknowns: &Subset,
    viscosity: f64,
) -> Vec<(usize, usize, f64)> {
    let (n, viscous) = (ReferenceMatrices::<D>::VELOCITY, space.reference().viscous);
    let (mesh, map) = (&space.part.mesh, &space.velocity.map);
    let number = |k: u32| unknowns.number(k as usize);
    let mut triplets = Vec::new();
    for cell in (0..mesh.cell_count()).filter(|&cell| !space.bodies.is_rigid(map.cell(cell))) {
        let scale = viscosity * mesh.size(mesh.cells()[cell].level).powi(D as i32 - 2);
        let forms: Vec<Vec<Term>> = map.cell(cell).iter().flat_map(|&node| forms(space, node)).collect();
        for (row, left) in forms.iter().enumerate() {
            for (column, right) in forms.iter().enumerate() {
                let entry = scale * viscous[row * n + column];
                let pairs = left.iter().flat_map(|l| right.iter().map(move |r| (l, r)));
                triplets
                    .extend(pairs.filter_map(|(l, r)| Some((number(l.0)?, number(r.0)?, entry * l.1 * r.1))));
            }
        }
    }
    triplets
}
