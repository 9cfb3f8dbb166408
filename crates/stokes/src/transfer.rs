//! Evaluation of a field of one mesh at the nodes of another over the same box.

use gluey_fem::element::{split, values_1d};
use gluey_fem::{Cell, NodeMap, TreeMesh};

/// Finds the cells of a mesh that hold given points.
pub struct Evaluator<'a, const D: usize> {
    mesh: &'a TreeMesh<D>,
}

impl<'a, const D: usize> Evaluator<'a, D> {
    /// Evaluates fields on `mesh`.
    pub fn new(mesh: &'a TreeMesh<D>) -> Self {
        Self { mesh }
    }

    /// Sets `to[node] = field(point of node)` for pairs of a field and what it becomes, with interleaved components. Points
    /// outside the mesh get zero.
    pub fn transfer(
        &self,
        from_nodes: &NodeMap<D>,
        components: usize,
        to_nodes: &NodeMap<D>,
        fields: &mut [(&[f64], &mut [f64])],
    ) {
        let degree = from_nodes.degree();
        for node in 0..to_nodes.node_count() {
            let target = node * components..(node + 1) * components;
            fields.iter_mut().for_each(|(_, to)| to[target.clone()].fill(0.0));
            let Some((cell, x)) = self.locate(to_nodes, node) else { continue };
            let line: [[f64; 3]; D] = std::array::from_fn(|d| values_1d(degree, x[d]));
            for (i, &source) in from_nodes.cell(cell).iter().enumerate() {
                let index = split::<D>(i, degree + 1);
                let weight: f64 = (0..D).map(|d| line[d][index[d]]).product();
                if weight != 0.0 {
                    let source = source as usize * components;
                    for (from, to) in fields.iter_mut() {
                        let values = to[target.clone()].iter_mut().zip(&from[source..]);
                        values.for_each(|(value, from)| *value += weight * from);
                    }
                }
            }
        }
    }

    /// Cell that holds a node of another mesh, with the coordinates in it.
    pub fn locate(&self, nodes: &NodeMap<D>, node: usize) -> Option<(usize, [f64; D])> {
        let finest = self.mesh.max_level();
        let h = self.mesh.size(finest);
        let offset = (nodes.point(node) - self.mesh.domain().lower) / h;
        let coords = std::array::from_fn(|d| {
            let last = (self.mesh.roots()[d] << finest) - 1;
            (offset[d].floor().max(0.0) as u32).min(last)
        });
        let cell = self.mesh.find_covering(&Cell { level: finest, coords })?;
        let found = &self.mesh.cells()[cell];
        let width = f64::from(1u32 << (finest - found.level));
        let x = std::array::from_fn(|d| offset[d] / width - f64::from(found.coords[d]));
        Some((cell, x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::{Aabb, Vector};

    fn quadratics_survive<const D: usize>() {
        let mesh = |at: f64, level: u8| {
            TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], level, |lower, h, l| {
                l < 2 || (lower + Vector::repeat(0.5 * h) - Vector::repeat(at)).norm() <= 1.2 * h
            })
            .unwrap()
        };
        let (a, b) = (mesh(0.3, 5), mesh(0.6, 4));
        let (from, to) = (NodeMap::new(&a, 2), NodeMap::new(&b, 2));
        let f = |x: Vector<D>| (0..D).map(|d| 1.0 + x[d] * (0.4 - x[d])).product::<f64>();
        let field: Vec<f64> = (0..from.node_count()).map(|n| f(from.point(n))).collect();
        let mut moved = vec![0.0; to.node_count()];
        Evaluator::new(&a).transfer(&from, 1, &to, &mut [(&field, &mut moved)]);
        for (n, value) in moved.iter().enumerate() {
            assert!((value - f(to.point(n))).abs() < 1e-12);
        }
    }

    #[test]
    fn a_field_moves_between_meshes() {
        quadratics_survive::<2>();
        quadratics_survive::<3>();
    }
}
