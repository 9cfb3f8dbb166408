//! First moments of the tractions on the surfaces.

use gluey_geom::{Matrix, Vector};
use gluey_levelset::{Ball, Body};
use rayon::prelude::*;

use super::coupling::SurfaceCoupling;
use super::cut_cells::{CutCell, in_space};
use super::shapes::Shapes;
use crate::space::{Discretisation, VelocitySpace};

/// A field at a point of a cut cell, and the weights there.
struct FieldSample<const D: usize> {
    velocity: Vector<D>,
    /// Twice the strain in the unit cube.
    strain: Matrix<D>,
    pressure: f64,
}

impl<const D: usize> Shapes<D> {
    fn sample(
        &self,
        discretisation: &Discretisation<D>,
        cell: usize,
        point: usize,
        [velocity, pressure]: [&[f64]; 2],
    ) -> FieldSample<D> {
        let mut sample = FieldSample { velocity: Vector::zeros(), strain: Matrix::zeros(), pressure: 0.0 };
        let nodes = discretisation.velocity.cell(cell);
        for (&node, (shape, slope)) in nodes.iter().zip(&self.velocity[point]) {
            let u = Vector::<D>::from_column_slice(&velocity[node as usize * D..][..D]);
            sample.velocity += u * *shape;
            sample.strain += u * slope.transpose();
        }
        sample.strain = sample.strain + sample.strain.transpose();
        let nodes = discretisation.pressure.cell(cell).iter().zip(&self.pressure[point]);
        sample.pressure = nodes.map(|(&node, shape)| shape * pressure[node as usize]).sum();
        sample
    }
}

/// `int_G t r` for the traction `t = sigma n` on each body, `n` out of it, and the arm `r` from its centre,
/// of a nodal field with all constraints fulfilled and the pressures at all nodes, relative to a linear flow
/// with this strain, from the own cells. The traction is the one that balances the forces: with the penalty
/// in it.
pub fn first_moments<const D: usize>(
    surfaces: &SurfaceCoupling<D>,
    space: &VelocitySpace<D>,
    bodies: &[Ball<D>],
    viscosity: f64,
    [velocity, pressure]: [&[f64]; 2],
    undisturbed: &Matrix<D>,
) -> Vec<Matrix<D>> {
    let discretisation = space.discretisation();
    let shear = discretisation.mesh.shear();
    let shapes = Shapes::<D>::new(shear);
    let of_cell = |(index, cut): (usize, &CutCell<D>)| -> Vec<Matrix<D>> {
        let mut moments = vec![Matrix::<D>::zeros(); cut.bodies.len()];
        let cell = cut.cell as usize;
        if !discretisation.is_own(cell) {
            return moments;
        }
        let h = discretisation.cell_size(cell);
        let (stress, area) = (viscosity * h.powi(D as i32 - 2), h.powi(D as i32 - 1));
        for (q, at) in shapes.points.iter().enumerate() {
            let mut sample = shapes.sample(discretisation, cell, q, [velocity, pressure]);
            sample.strain += undisturbed * (2.0 * h);
            let surfaces_of_cell = cut.balls.iter().zip(&cut.moments.surfaces).zip(&mut moments);
            for (&body, ((ball, surface), moment)) in cut.bodies.iter().zip(surfaces_of_cell) {
                let place: [f64; D] = std::array::from_fn(|d| at[d] - ball.center[d]);
                let arm = in_space(shear, &place) * h;
                let motion = space.twist(velocity, body as usize).velocity_at(&arm) - undisturbed * arm;
                let normal = Vector::<D>::from_column_slice(&surface.normal[q]);
                let penalty = surfaces.penalty(index) * surface.area[q];
                let viscous = (sample.velocity - motion) * penalty - sample.strain * normal;
                let traction = viscous * stress + normal * (area * sample.pressure);
                debug_assert!((ball.radius * h - bodies[body as usize].bounding_radius()).abs() < 1e-9);
                *moment += traction * arm.transpose();
            }
        }
        moments
    };
    let cells: Vec<Vec<Matrix<D>>> =
        surfaces.cut.cells.par_iter().enumerate().with_min_len(16).map(of_cell).collect();
    let mut moments = vec![Matrix::<D>::zeros(); bodies.len()];
    for (cut, of_cell) in surfaces.cut.cells.iter().zip(cells) {
        cut.bodies.iter().zip(of_cell).for_each(|(&body, moment)| moments[body as usize] += moment);
    }
    moments
}
