//! Nodal unknowns as linear forms in the reduced ones: one term for a free node, the masters of a hanging
//! node, the entries of a body's twist for a rigid node, nothing on the boundary.

use gluey_geom::Dim;
use gluey_linalg::AffineConstraints;

use super::pressure::PressureSpace;
use super::velocity::VelocitySpace;

/// Linear forms of the nodal velocities (`node * D + component`) in the positions of a reduced vector.
pub fn velocity_expansion<const D: usize>(space: &VelocitySpace<D>) -> AffineConstraints {
    let nodes = space.nodes();
    let mut expansion = AffineConstraints::zeros(space.full_dim(), space.dim());
    for node in (0..nodes.node_count()).filter(|&n| space.is_free(n)) {
        for k in node * D..(node + 1) * D {
            expansion.set(k, [(k as u32, 1.0)]);
        }
    }
    for (node, body, matrix) in space.rigid_rows() {
        let first = space.full_dim() + body as usize * Dim::<D>::RIGID;
        for (c, row) in matrix.chunks_exact(Dim::<D>::RIGID).enumerate() {
            let terms = row.iter().enumerate().filter(|t| *t.1 != 0.0);
            expansion.set(node as usize * D + c, terms.map(|(k, &w)| ((first + k) as u32, w)));
        }
    }
    for constraint in nodes.constraints() {
        for c in 0..D {
            let masters = constraint.masters.iter().map(|&(m, w)| (m as usize * D + c, w));
            expansion.set_combination(constraint.node as usize * D + c, masters);
        }
    }
    for ghost in space.ghosts() {
        for c in 0..D {
            let masters = ghost.masters.iter().map(|&(m, w)| (m as usize * D + c, w));
            expansion.set_combination(ghost.node as usize * D + c, masters);
        }
    }
    expansion
}

/// Linear forms of the pressure nodes in the free ones.
pub fn pressure_expansion<const D: usize>(pressure: &PressureSpace<D>) -> AffineConstraints {
    let mut expansion = AffineConstraints::zeros(pressure.dim(), pressure.dim());
    for q in (0..pressure.dim()).filter(|&q| pressure.is_free(q)) {
        expansion.set(q, [(q as u32, 1.0)]);
    }
    for constraint in pressure.constraints() {
        let masters = constraint.masters.iter().map(|&(m, w)| (m as usize, w));
        expansion.set_combination(constraint.node as usize, masters);
    }
    expansion
}
