//! Bodies in a linear flow far away, without that flow.
//!
//! In a box that repeats itself everywhere a linear flow `G x` cannot be periodic, but what bodies add to it
//! is: `u = G x + v`. With the strain `E` of `G = E + W` and twists relative to the undisturbed flow at the
//! centre of each body, rigid bodies move the fluid at their surfaces by
//!
//! `v = V + w x r - E r`, `r` from the centre.
//!
//! Since `-div(2 eta E) = 0` there is no other load than this, which Nitsche's terms put on the fluid, on the
//! pressures and, by its reaction, on the bodies.

use gluey_fem::element::node_count;
use gluey_geom::{Dim, Matrix, Vector, Wrench};
use gluey_linalg::vectorised;
use rayon::prelude::*;

use super::coupling::SurfaceCoupling;
use super::cut_cells::in_space;
use super::shapes::Shapes;
use crate::space::Discretisation;
use crate::term::Load;

/// Velocity nodes of a cell, at most.
const MOST_NODES: usize = 27;

/// Adds the load of a strain `E`, a symmetric matrix without trace, from the own cells.
pub fn add_load_of_strain<const D: usize>(
    surfaces: &SurfaceCoupling<D>,
    strain: &Matrix<D>,
    load: &mut Load<D>,
) {
    let (discretisation, viscosity) = (surfaces.discretisation(), surfaces.viscosity);
    let rule = CellRule::<D>::new(discretisation.mesh.shear());
    let of_cell = |place: usize| {
        vectorised(
            #[inline(always)]
            || rule.of_cell(discretisation, surfaces, place, strain),
        )
    };
    let cells = &surfaces.cut.cells;
    let own: Vec<usize> =
        (0..cells.len()).filter(|&place| discretisation.is_own(cells[place].cell as usize)).collect();
    let loads: Vec<CellLoad<D>> = own.par_iter().with_min_len(16).map(|&place| of_cell(place)).collect();
    for (cut, own) in own.iter().map(|&place| &cells[place]).zip(loads) {
        let cell = cut.cell as usize;
        for (i, &node) in discretisation.velocity.cell(cell).iter().enumerate() {
            (0..D).for_each(|c| load.velocity[node as usize * D + c] += viscosity * own.forces[c][i]);
        }
        for (&node, own) in discretisation.pressure.cell(cell).iter().zip(own.pressures) {
            load.pressure[node as usize] += own;
        }
        for (&body, own) in cut.bodies.iter().zip(own.wrenches) {
            let wrench = &mut load.wrenches[body as usize];
            wrench.force += own.force * viscosity;
            wrench.torque += own.torque * viscosity;
        }
    }
}

/// The loads of a cut cell, those of a viscosity of one.
struct CellLoad<const D: usize> {
    /// By component and node.
    forces: [[f64; MOST_NODES]; D],
    pressures: Vec<f64>,
    /// On each body that cuts it.
    wrenches: Vec<Wrench<D>>,
}

/// The points of a cell and the functions there.
struct CellRule<const D: usize> {
    shear: f64,
    shapes: Shapes<D>,
    /// Values and components of the slopes of the velocity functions, point by point.
    values: Vec<[f64; MOST_NODES]>,
    slopes: Vec<[[f64; MOST_NODES]; D]>,
}

impl<const D: usize> CellRule<D> {
    fn new(shear: f64) -> Self {
        let shapes = Shapes::<D>::new(shear);
        let mut values = vec![[0.0; MOST_NODES]; shapes.points.len()];
        let mut slopes = vec![[[0.0; MOST_NODES]; D]; shapes.points.len()];
        for (q, functions) in shapes.velocity.iter().enumerate() {
            for (i, (value, slope)) in functions.iter().enumerate() {
                values[q][i] = *value;
                (0..D).for_each(|d| slopes[q][d][i] = slope[d]);
            }
        }
        Self { shear, shapes, values, slopes }
    }

    #[inline(always)]
    fn of_cell(
        &self,
        discretisation: &Discretisation<D>,
        surfaces: &SurfaceCoupling<D>,
        place: usize,
        strain: &Matrix<D>,
    ) -> CellLoad<D> {
        let cut = &surfaces.cut.cells[place];
        let h = discretisation.cell_size(cut.cell as usize);
        let (stress, area) = (h.powi(D as i32 - 2), h.powi(D as i32 - 1));
        let mut load = CellLoad {
            forces: [[0.0; MOST_NODES]; D],
            pressures: vec![0.0; node_count::<D>(1)],
            wrenches: vec![Wrench::default(); cut.bodies.len()],
        };
        for ((wrench, ball), surface) in load.wrenches.iter_mut().zip(&cut.balls).zip(&cut.moments.surfaces) {
            for (q, at) in self.shapes.points.iter().enumerate() {
                let from_center: [f64; D] = std::array::from_fn(|d| at[d] - ball.center[d]);
                let arm = in_space(self.shear, &from_center) * h;
                let motion = strain * arm;
                let normal = Vector::<D>::from_column_slice(&surface.normal[q]);
                // The fluid has to follow -E r.
                let penalty = motion * (surfaces.penalty(place) * surface.area[q] * stress);
                for (c, forces) in load.forces.iter_mut().enumerate() {
                    add_multiple(-penalty[c], &self.values[q], forces);
                    for (d, slopes) in self.slopes[q].iter().enumerate() {
                        let flux = (motion[c] * normal[d] + normal[c] * motion[d]) * stress;
                        add_multiple(flux, slopes, forces);
                    }
                }
                let through = area * motion.dot(&normal);
                for (sum, shape) in load.pressures.iter_mut().zip(&self.shapes.pressure[q]) {
                    *sum -= shape * through;
                }
                wrench.force += penalty;
                wrench.torque += Dim::<D>::moment(&arm, &penalty);
            }
        }
        load
    }
}

/// `to += factor x`.
#[inline(always)]
fn add_multiple(factor: f64, x: &[f64; MOST_NODES], to: &mut [f64; MOST_NODES]) {
    to.iter_mut().zip(x).for_each(|(to, x)| *to += factor * x);
}
