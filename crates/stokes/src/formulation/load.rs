//! The load of a body force.

use gluey_fem::element::{gauss_cube, value};
use gluey_geom::Vector;

use crate::space::Discretisation;

/// Gauss points per direction for the body force: exact for forces of degree 5, and one order beyond what the
/// elements resolve for others.
const FORCE_POINTS: usize = 4;

/// `b += int f . v` over the cells that are whole, for the nodal velocities `v`.
pub fn add_load<const D: usize>(
    discretisation: &Discretisation<D>,
    is_whole: impl Fn(usize) -> bool,
    force: &dyn Fn(&Vector<D>) -> Vector<D>,
    b: &mut [f64],
) {
    let rule = gauss_cube::<D>(FORCE_POINTS);
    let nodes_per_cell = discretisation.velocity.nodes_per_cell();
    let shapes: Vec<Vec<f64>> =
        rule.iter().map(|(x, _)| (0..nodes_per_cell).map(|i| value::<D>(2, i, x)).collect()).collect();
    let cells = discretisation.mesh.cells().iter().enumerate();
    for (index, cell) in cells.filter(|&(index, _)| is_whole(index)) {
        let (lower, h) = (discretisation.mesh.lower_corner(cell), discretisation.cell_size(index));
        for ((at, weight), shapes) in rule.iter().zip(&shapes) {
            let load = force(&(lower + Vector::from_fn(|d, _| h * at[d]))) * (weight * h.powi(D as i32));
            for (&node, shape) in discretisation.velocity.cell(index).iter().zip(shapes) {
                for (b, load) in b[node as usize * D..][..D].iter_mut().zip(load.iter()) {
                    *b += shape * load;
                }
            }
        }
    }
}
