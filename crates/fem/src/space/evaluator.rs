//! Evaluation of a field of one mesh at the nodes of another over the same box, and of a velocity at a point.

use gluey_geom::{Dim, Twist, Vector};
use rayon::prelude::*;

use super::nodes::NodeMap;
use crate::element::{gradient, multi_index, value, values_1d};
use crate::mesh::{Cell, TreeMesh};

/// A point this near to a face, in the smallest cells of the mesh, lies on it.
const ON_FACE: f64 = 1e-9;

/// Nodes to which one thread transfers at a time.
const SHARE: usize = 4096;

/// Finds the cells of a mesh that hold given points.
pub struct Evaluator<'a, const D: usize> {
    mesh: &'a TreeMesh<D>,
}

impl<'a, const D: usize> Evaluator<'a, D> {
    /// Evaluates fields on `mesh`.
    pub fn new(mesh: &'a TreeMesh<D>) -> Self {
        Self { mesh }
    }

    /// Sets `to[node] = field(point of node)` for pairs of a field and what it becomes, with interleaved
    /// components. Points outside the mesh get zero.
    pub fn transfer(
        &self,
        from_nodes: &NodeMap<D>,
        components: usize,
        to_nodes: &NodeMap<D>,
        fields: &mut [(&[f64], &mut [f64])],
    ) {
        let point = |node| to_nodes.point(node);
        self.transfer_to_points(from_nodes, components, to_nodes.node_count(), point, fields);
    }

    /// The same for a number of points, `to[k] = field(x_k)`.
    pub fn transfer_to_points(
        &self,
        from_nodes: &NodeMap<D>,
        components: usize,
        count: usize,
        point: impl Fn(usize) -> Vector<D> + Sync,
        fields: &mut [(&[f64], &mut [f64])],
    ) {
        let mut parts: Vec<Vec<(&[f64], &mut [f64])>> =
            (0..count.div_ceil(SHARE)).map(|_| Vec::new()).collect();
        for (from, to) in fields {
            let pieces = to.chunks_mut(SHARE * components);
            parts.iter_mut().zip(pieces).for_each(|(part, piece)| part.push((from, piece)));
        }
        parts.par_iter_mut().enumerate().for_each(|(k, fields)| {
            let points = (k * SHARE..((k + 1) * SHARE).min(count)).map(&point);
            self.transfer_share(points, from_nodes, components, fields);
        });
    }

    /// The same at some points, whose values are all of what fields become.
    fn transfer_share(
        &self,
        points: impl Iterator<Item = Vector<D>>,
        from_nodes: &NodeMap<D>,
        components: usize,
        fields: &mut [(&[f64], &mut [f64])],
    ) {
        let degree = from_nodes.degree();
        for (place, point) in points.enumerate() {
            let target = place * components..(place + 1) * components;
            fields.iter_mut().for_each(|(_, to)| to[target.clone()].fill(0.0));
            let Some((cell, x)) = self.locate(&point) else { continue };
            let line: [[f64; 3]; D] = std::array::from_fn(|d| values_1d(degree, x[d]));
            for (i, &source) in from_nodes.cell(cell).iter().enumerate() {
                let index = multi_index::<D>(i, degree + 1);
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

    /// Cell that holds a point of the box, with the coordinates of the point in it.
    pub fn locate(&self, point: &Vector<D>) -> Option<(usize, [f64; D])> {
        let (lattice, offset) = self.lattice_cell(point);
        let cell = self.mesh.find_covering(&lattice)?;
        let found = &self.mesh.cells()[cell];
        let width = f64::from(1u32 << (lattice.level - found.level));
        let x = std::array::from_fn(|d| offset[d] / width - f64::from(found.coords[d]));
        Some((cell, x))
    }

    /// Cell of the finest lattice that holds a point of the box, be it a cell of the mesh or not, and the
    /// coordinates of the point in such cells.
    pub fn lattice_cell(&self, point: &Vector<D>) -> (Cell<D>, Vector<D>) {
        let level = self.mesh.max_level();
        let offset = (point - self.mesh.domain().lower) / self.mesh.size(level);
        let coords = std::array::from_fn(|d| {
            let last = (self.mesh.roots()[d] << level) - 1;
            (offset[d].floor().max(0.0) as u32).min(last)
        });
        (Cell { level, coords }, offset)
    }

    /// Velocity and half the vorticity of a nodal velocity field at a point. The gradient jumps between
    /// cells: at a face, an edge or a corner it is the mean over the `2^D` orthants around the point. A point
    /// outside the mesh stands for the nearest one of the box.
    pub fn motion_at(&self, nodes: &NodeMap<D>, velocity: &[f64], point: &Vector<D>) -> Twist<D> {
        let mut twist = Twist::default();
        let share = 0.5f64.powi(D as i32);
        for (cell, x) in (0..1 << D).filter_map(|orthant| self.locate_in_orthant(point, orthant)) {
            let h = self.mesh.size(self.mesh.cells()[cell].level);
            for (i, &node) in nodes.cell(cell).iter().enumerate() {
                let u = Vector::<D>::from_column_slice(&velocity[node as usize * D..][..D]);
                let slope = Vector::from(gradient::<D>(nodes.degree(), i, &x)) / h;
                twist.velocity += u * (share * value::<D>(nodes.degree(), i, &x));
                twist.spin += Dim::<D>::moment(&slope, &u) * (0.5 * share);
            }
        }
        twist
    }

    /// The cell that holds a point and what lies next to it in one of the orthants around it (bit `d` is set
    /// for larger coordinates along axis `d`), with the coordinates of the point in it.
    fn locate_in_orthant(&self, point: &Vector<D>, orthant: usize) -> Option<(usize, [f64; D])> {
        let finest = self.mesh.max_level();
        let offset = (point - self.mesh.domain().lower) / self.mesh.size(finest);
        let count = self.mesh.roots().map(|roots| i64::from(roots) << finest);
        let (mut coords, mut within) = ([0; D], [0.0; D]);
        for d in 0..D {
            let is_periodic = self.mesh.periodic()[d];
            let at = if is_periodic { offset[d] } else { offset[d].clamp(0.0, count[d] as f64) };
            let face = at.round();
            let along = match (at - face).abs() <= ON_FACE {
                true => face as i64 - i64::from(orthant >> d & 1 == 0),
                false => at.floor() as i64,
            };
            let inside = if is_periodic { along.rem_euclid(count[d]) } else { along.clamp(0, count[d] - 1) };
            coords[d] = inside as u32;
            within[d] = if is_periodic { at + (inside - along) as f64 } else { at };
        }
        let cell = self.mesh.find_covering(&Cell { level: finest, coords })?;
        let found = &self.mesh.cells()[cell];
        let width = f64::from(1u32 << (finest - found.level));
        Some((cell, std::array::from_fn(|d| within[d] / width - f64::from(found.coords[d]))))
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

    /// Cells of two sizes, with the border between them at 0.5, in a box of which the first axis is periodic.
    fn two_sizes<const D: usize>() -> (TreeMesh<D>, NodeMap<D>) {
        let periodic = std::array::from_fn(|d| d == 0);
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], periodic, 4, |lower, _, level| {
            level < 2 || lower.iter().all(|&x| x < 0.5)
        })
        .unwrap();
        let nodes = NodeMap::new(&mesh, 2);
        (mesh, nodes)
    }

    fn motion_at<const D: usize>(u: impl Fn(&Vector<D>) -> Vector<D>, x: Vector<D>) -> Twist<D> {
        let (mesh, nodes) = two_sizes::<D>();
        let field: Vec<f64> = (0..nodes.node_count()).flat_map(|n| u(&nodes.point(n)).data.0[0]).collect();
        Evaluator::new(&mesh).motion_at(&nodes, &field, &x)
    }

    /// In `u = A x + b` and `u = x_1^2 e_0` the velocity is `u` and the spin half the vorticity: inside
    /// cells, on faces, at corners, where sizes change, on the walls. The first axis has no part in it, so
    /// that points may lie beyond it.
    fn linear_and_quadratic_fields_are_exact<const D: usize>() {
        let y = |x: &Vector<D>| Vector::<D>::from_fn(|d, _| if d == 0 { 0.0 } else { x[d] });
        let matrix = gluey_geom::Matrix::<D>::from_fn(|i, j| 0.3 + 0.9 * i as f64 - 0.7 * j as f64);
        let linear = |x: &Vector<D>| matrix * y(x) + Vector::repeat(0.2);
        let quadratic = |x: &Vector<D>| Vector::<D>::from_fn(|d, _| if d == 0 { x[1] * x[1] } else { 0.0 });
        let half_curl = |column: &dyn Fn(usize) -> Vector<D>| {
            let axis = |k: usize| Vector::<D>::from_fn(|d, _| if d == k { 1.0 } else { 0.0 });
            let terms = (1..D).map(|k| Dim::<D>::moment(&axis(k), &column(k)) * 0.5);
            terms.fold(Dim::<D>::zero_spin(), |sum, term| sum + term)
        };
        for at in [0.03, 0.25, 0.3, 0.5, 0.75, 0.9, 1.0] {
            for along in [at, 0.5, 0.0, at + 1.0, at - 3.0] {
                let x = Vector::<D>::from_fn(|d, _| if d == 0 { along } else { at });
                let (a, b) = (motion_at(linear, x), motion_at(quadratic, x));
                let spin = half_curl(&|k| matrix.column(k).into_owned());
                let slope =
                    |k: usize| quadratic(&Vector::repeat(1.0)) * (if k == 1 { 2.0 * at } else { 0.0 });
                let turn = half_curl(&slope);
                let off = |found: &Twist<D>, u: Vector<D>, spin: gluey_geom::Spin<D>| {
                    (0..Dim::<D>::ROT)
                        .fold((found.velocity - u).amax(), |e, k| e.max((found.spin[k] - spin[k]).abs()))
                };
                assert!(off(&a, linear(&x), spin) < 1e-12, "{a:?} at {x:?}");
                assert!(off(&b, quadratic(&x), turn) < 1e-12, "{b:?} at {x:?}");
            }
        }
    }

    #[test]
    fn the_motion_at_a_point_is_exact_in_fields_the_elements_hold() {
        linear_and_quadratic_fields_are_exact::<2>();
        linear_and_quadratic_fields_are_exact::<3>();
    }

    /// Half the vorticity of `|y - 1/2| e_x` is `-1/2` above and `1/2` below: which it is at the border must
    /// not depend on the order of the cells.
    #[test]
    fn where_the_gradient_jumps_the_spin_is_the_mean_of_all_sides() {
        let roof = |x: &Vector<2>| Vector::<2>::new((x[1] - 0.5).abs(), 0.0);
        let spin = |y: f64| motion_at(roof, Vector::<2>::new(0.3, y)).spin[0];
        assert!((spin(0.4) - 0.5).abs() < 1e-12 && (spin(0.6) + 0.5).abs() < 1e-12);
        assert!([0.5, 0.5 + 1e-15, 0.5 - 1e-15].iter().all(|&y| spin(y).abs() < 1e-12));
    }

    /// The nearest point of the box answers for one beyond its walls.
    #[test]
    fn beyond_the_walls_the_field_ends() {
        let shear = |x: &Vector<2>| Vector::<2>::new(x[1], 0.0);
        assert!((motion_at(shear, Vector::<2>::new(0.3, 1.4)).velocity[0] - 1.0).abs() < 1e-12);
        assert!(motion_at(shear, Vector::<2>::new(0.3, -0.4)).velocity[0].abs() < 1e-12);
    }

    #[test]
    fn a_field_moves_between_meshes() {
        quadratics_survive::<2>();
        quadratics_survive::<3>();
    }
}
