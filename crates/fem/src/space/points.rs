//! Nodes of cells as points of a picture.

use std::collections::BTreeMap;
use std::ops::Range;

use gluey_geom::Vector;

use super::nodes::NodeMap;
use crate::element::multi_index;
use crate::mesh::TreeMesh;

/// A node of a cell where something is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellPoint<const D: usize> {
    /// The cell.
    pub cell: usize,
    /// The node.
    pub node: usize,
    /// Where the node is as one of this cell.
    pub x: Vector<D>,
    /// Its coordinates in the cell, from 0 to 1.
    pub local: [f64; D],
}

/// The nodes of some cells as points, in the order in which the cells touch them first, and the points of
/// cell after cell in the order of its nodes. Where the box is periodic, the nodes of its far faces become
/// points of their own.
pub fn points_of_cells<const D: usize>(
    mesh: &TreeMesh<D>,
    nodes: &NodeMap<D>,
    cells: Range<usize>,
) -> (Vec<CellPoint<D>>, Vec<u32>) {
    let (mut points, mut of_cells) = (Vec::new(), Vec::new());
    let mut point_of: BTreeMap<(u32, [bool; D]), u32> = BTreeMap::new();
    let degree = nodes.degree();
    for index in cells {
        let cell = &mesh.cells()[index];
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        for (i, &node) in nodes.cell(index).iter().enumerate() {
            let local = multi_index::<D>(i, degree + 1).map(|k| k as f64 / degree as f64);
            let x = lower + Vector::from_fn(|d, _| h * local[d]);
            let wrapped = std::array::from_fn(|d| (x[d] - nodes.point(node as usize)[d]).abs() > 0.25 * h);
            let next = points.len() as u32;
            let point = *point_of.entry((node, wrapped)).or_insert(next);
            if point == next {
                points.push(CellPoint { cell: index, node: node as usize, x, local });
            }
            of_cells.push(point);
        }
    }
    (points, of_cells)
}
