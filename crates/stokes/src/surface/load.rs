//! A force per unit of volume on the fluid of cut cells and on the bodies.
//!
//! A force on a body is an integral over its surface with the normal `n`, flats and all: for the arm `r` from
//! the centre `c`, the field `r int_0^1 s^(D-1) f(c + s r) ds` has the divergence `f`.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss, gauss_cube, node_count, value};
use gluey_geom::{Dim, Vector, Wrench};

use super::cut_cells::{CutCell, CutCells, in_space};
use crate::space::Discretisation;
use crate::term::Force;

/// Gauss points on the way from the centre of a body to its surface.
const RAY_POINTS: usize = 4;

/// `b += int f . v` over the fluid of the own cut cells for the nodal velocities `v`.
pub fn add_load_of_cut_cells<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    force: Force<'_, D>,
    b: &mut [f64],
) {
    let points = gauss_cube::<D>(POINTS);
    let shapes_at = |x: &[f64; D]| (0..node_count::<D>(2)).map(|i| value::<D>(2, i, x)).collect();
    let shapes: Vec<Vec<f64>> = points.iter().map(|point| shapes_at(&point.0)).collect();
    for of in cut.cells.iter().filter(|of| discretisation.is_own(of.cell as usize)) {
        let cell = of.cell as usize;
        let (lower, h) = place(discretisation, of);
        for (((at, _), weight), shapes) in points.iter().zip(&of.moments.volume).zip(&shapes) {
            let load = force(&(lower + Vector::from(*at) * h)) * (weight * h.powi(D as i32));
            for (&node, shape) in discretisation.velocity.cell(cell).iter().zip(shapes) {
                (0..D).for_each(|c| b[node as usize * D + c] += shape * load[c]);
            }
        }
    }
}

/// Force and torque of `f` on each body as the mesh sees it, a body in a widened film without its caps; the
/// share of own cells.
pub fn forces_on_bodies<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    force: Force<'_, D>,
    body_count: usize,
) -> Vec<Wrench<D>> {
    let (points, ray) = (gauss_cube::<D>(POINTS), gauss(RAY_POINTS));
    let in_box = |x: Vector<D>| force(&wrapped(discretisation, x));
    let mut wrenches = vec![Wrench::default(); body_count];
    for of in cut.cells.iter().filter(|of| discretisation.is_own(of.cell as usize)) {
        let (lower, h) = place(discretisation, of);
        for ((&body, ball), surface) in of.bodies.iter().zip(&of.balls).zip(&of.moments.surfaces) {
            let center = lower + Vector::from(ball.center) * h;
            for ((at, _), normal) in points.iter().zip(&surface.normal) {
                let place: [f64; D] = std::array::from_fn(|d| at[d] - ball.center[d]);
                let arm = in_space(discretisation.mesh.shear(), &place) * h;
                // The normal of the moments points into the body.
                let flux = -arm.dot(&Vector::from(*normal)) * h.powi(D as i32 - 1);
                let sum = along_ray(&ray, &arm, |arm| in_box(center + arm));
                let wrench = &mut wrenches[body as usize];
                wrench.force += sum.force * flux;
                wrench.torque += sum.torque * flux;
            }
        }
    }
    wrenches
}

/// Lower corner and edge length of a cell.
fn place<const D: usize>(discretisation: &Discretisation<D>, of: &CutCell<D>) -> (Vector<D>, f64) {
    let (mesh, cell) = (&discretisation.mesh, of.cell as usize);
    (mesh.lower_corner(&mesh.cells()[cell]), discretisation.cell_size(cell))
}

/// `int_0^1 s^(D-1) f(s r) ds` and the same of its moment.
fn along_ray<const D: usize>(
    rule: &[(f64, f64)],
    arm: &Vector<D>,
    force: impl Fn(Vector<D>) -> Vector<D>,
) -> Wrench<D> {
    let mut sum = Wrench::default();
    for &(s, weight) in rule {
        let arm = arm * s;
        let force = force(arm) * (weight * s.powi(D as i32 - 1));
        sum.force += force;
        sum.torque += Dim::<D>::moment(&arm, &force);
    }
    sum
}

/// The point in the box, for one beyond a periodic border.
fn wrapped<const D: usize>(discretisation: &Discretisation<D>, x: Vector<D>) -> Vector<D> {
    let (mesh, lower) = (&discretisation.mesh, discretisation.mesh.domain().lower);
    let extent = mesh.domain().extent();
    Vector::from_fn(|d, _| match mesh.periodic()[d] {
        true => lower[d] + (x[d] - lower[d]).rem_euclid(extent[d]),
        false => x[d],
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use gluey_fem::TreeMesh;
    use gluey_geom::Aabb;
    use gluey_levelset::Ball;

    use super::*;
    use crate::surface::Flats;

    /// For `f = x_0^2 e_0 + w x r` the force is `|B| (c_0^2 + a^2 / (D + 2))`, the torque `|B| w a^2` times
    /// 1/2 in 2D and 2/5 in 3D.
    fn integrals_over_bodies<const D: usize>(volume: f64, gyration: f64) {
        let (radius, center) = (0.23, Vector::<D>::from_fn(|d, _| [0.47, 0.52, 0.55][d]));
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 3).unwrap();
        let discretisation = Discretisation::new(mesh);
        let cut = CutCells::new(&discretisation, &[Ball::new(center, radius)], &Flats::none(1));
        let mut spin = Dim::<D>::zero_spin();
        (0..Dim::<D>::ROT).for_each(|k| spin[k] = 0.7 + k as f64);
        let force = |x: &Vector<D>| {
            let mut f = Dim::<D>::cross_spin(&spin, &(x - center));
            f[0] += x[0] * x[0];
            f
        };
        let found = forces_on_bodies(&discretisation, &cut, &force, 1)[0];
        let volume = volume * radius.powi(D as i32);
        let mut exact = Vector::zeros();
        exact[0] = volume * (center[0].powi(2) + radius.powi(2) / (D + 2) as f64);
        assert!((found.force - exact).norm() < 1e-9 * volume, "{D}D: {:?} {exact:?}", found.force);
        let missing = found.torque - spin * (volume * gyration * radius.powi(2));
        assert!(
            Dim::<D>::spin_slice(&missing).iter().all(|t| t.abs() < 1e-9 * volume * radius),
            "{D}D: {missing:?}"
        );
    }

    #[test]
    fn forces_and_torques_on_bodies_are_as_exact_as_the_moments() {
        integrals_over_bodies::<2>(PI, 0.5);
        integrals_over_bodies::<3>(4.0 / 3.0 * PI, 0.4);
    }
}
