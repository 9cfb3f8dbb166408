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

use gluey_geom::{Dim, Matrix, Space, Vector, Wrench};

use super::coupling::SurfaceCoupling;
use super::cut_cells::in_space;
use super::shapes::Shapes;
use crate::space::Discretisation;

/// Loads on the nodal velocities and on the pressures at all nodes, and on the bodies.
pub struct StrainLoad<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// On the velocities of all nodes.
    pub velocity: Vec<f64>,
    /// On the pressures of all nodes.
    pub pressure: Vec<f64>,
    /// On the bodies.
    pub wrenches: Vec<Wrench<D>>,
}

/// The load of a strain `E`, a symmetric matrix without trace, on `body_count` bodies.
pub fn load_of_strain<const D: usize>(
    discretisation: &Discretisation<D>,
    surfaces: &SurfaceCoupling<D>,
    viscosity: f64,
    strain: &Matrix<D>,
    body_count: usize,
) -> StrainLoad<D>
where
    Dim<D>: Space<D>,
{
    let shear = discretisation.mesh.shear();
    let shapes = Shapes::<D>::new(shear);
    let mut load = StrainLoad {
        velocity: vec![0.0; discretisation.velocity.node_count() * D],
        pressure: vec![0.0; discretisation.pressure.node_count()],
        wrenches: vec![Wrench::default(); body_count],
    };
    for (place, cut) in surfaces.cut.cells.iter().enumerate() {
        let cell = cut.cell as usize;
        let h = discretisation.cell_size(cell);
        let (stress, area) = (viscosity * h.powi(D as i32 - 2), h.powi(D as i32 - 1));
        let nodes = discretisation.velocity.cell(cell);
        let mut forces = vec![Vector::<D>::zeros(); nodes.len()];
        for ((&body, ball), surface) in cut.bodies.iter().zip(&cut.balls).zip(&cut.moments.surfaces) {
            for (q, at) in shapes.points.iter().enumerate() {
                let from_center: [f64; D] = std::array::from_fn(|d| at[d] - ball.center[d]);
                let arm = in_space(shear, &from_center) * h;
                let motion = strain * arm;
                let normal = Vector::<D>::from_column_slice(&surface.normal[q]);
                // The fluid has to follow -E r.
                let penalty = motion * (surfaces.penalty(place) * surface.area[q] * stress);
                let flux = (motion * normal.transpose() + normal * motion.transpose()) * stress;
                for (force, (shape, slope)) in forces.iter_mut().zip(&shapes.velocity[q]) {
                    *force += flux * slope - penalty * *shape;
                }
                let through = area * motion.dot(&normal);
                let nodes = discretisation.pressure.cell(cell);
                for (&node, shape) in nodes.iter().zip(&shapes.pressure[q]) {
                    load.pressure[node as usize] -= shape * through;
                }
                let wrench = &mut load.wrenches[body as usize];
                wrench.force += penalty;
                wrench.torque += Dim::<D>::moment(&arm, &penalty);
            }
        }
        for (&node, force) in nodes.iter().zip(&forces) {
            (0..D).for_each(|c| load.velocity[node as usize * D + c] += force[c]);
        }
    }
    load
}
