//! Errors of a flow in the fluid, and the stresslet of a body from the boundary data around it.

use gluey_geom::{Aabb, Matrix, Vector};
use gluey_levelset::{Ball, Body, LevelSet};
use gluey_stokes::fem::cut::{BallInCell, CutRules, FlatInCell, POINTS};
use gluey_stokes::fem::element::{gauss_cube, gradient, node_count, value};
use gluey_stokes::{Flat, Flow, Heights, thin_films};
use gluey_testkit::exact::StokesSolution;

/// Errors of a flow in the fluid. Those of the velocity are relative to the exact one.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Of the velocity in the mean square.
    pub velocity: f64,
    /// Of the velocity at the nodes, the largest.
    pub largest: f64,
    /// Of the pressure less its mean in the mean square.
    pub pressure: f64,
    /// The exact pressure less its mean in the mean square.
    pub pressure_scale: f64,
}

/// The errors of `flow`, by a Gauss rule on every cell that leaves out points inside the balls.
pub fn errors<const D: usize>(flow: &Flow<D>, exact: &impl StokesSolution<D>, balls: &[Ball<D>]) -> Errors {
    let rule = gauss_cube::<D>(4);
    let mesh = &flow.discretisation.mesh;
    let (mut du_square, mut u_square) = (0.0, 0.0);
    let (mut weights, mut pressures, mut differences) = (Vec::new(), Vec::new(), Vec::new());
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        for (at, weight) in &rule {
            let x = lower + Vector::from_fn(|d, _| h * at[d]);
            if !is_fluid(&x, balls) {
                continue;
            }
            let (u, p, weight) = (exact.velocity(&x), exact.pressure(&x), weight * h.powi(D as i32));
            du_square += weight * (velocity_at(flow, index, at) - u).norm_squared();
            u_square += weight * u.norm_squared();
            weights.push(weight);
            pressures.push(p);
            differences.push(pressure_at(flow, index, at) - p);
        }
    }
    Errors {
        velocity: (du_square / u_square).sqrt(),
        largest: largest_at_nodes(flow, exact, balls),
        pressure: deviation(&weights, &differences),
        pressure_scale: deviation(&weights, &pressures),
    }
}

/// The weighted root mean square of the values less their mean.
fn deviation(weights: &[f64], values: &[f64]) -> f64 {
    let sum = |f: &dyn Fn(f64) -> f64| weights.iter().zip(values).map(|(w, &x)| w * f(x)).sum::<f64>();
    let total: f64 = weights.iter().sum();
    let mean = sum(&|x| x) / total;
    (sum(&|x| (x - mean).powi(2)) / total).sqrt()
}

fn is_fluid<const D: usize>(x: &Vector<D>, balls: &[Ball<D>]) -> bool {
    balls.iter().all(|ball| ball.value(x) < 0.0)
}

fn largest_at_nodes<const D: usize>(
    flow: &Flow<D>,
    exact: &impl StokesSolution<D>,
    balls: &[Ball<D>],
) -> f64 {
    let nodes = &flow.discretisation.velocity;
    let (mut error, mut largest): (f64, f64) = (0.0, 0.0);
    for n in (0..nodes.node_count()).filter(|&n| is_fluid(&nodes.point(n), balls)) {
        let u = exact.velocity(&nodes.point(n));
        error = error.max((nodal(&flow.velocity, n) - u).norm());
        largest = largest.max(u.norm());
    }
    error / largest
}

fn nodal<const D: usize>(velocity: &[f64], node: usize) -> Vector<D> {
    Vector::from_column_slice(&velocity[node * D..][..D])
}

fn velocity_at<const D: usize>(flow: &Flow<D>, cell: usize, at: &[f64; D]) -> Vector<D> {
    let nodes = flow.discretisation.velocity.cell(cell).iter().enumerate();
    nodes.map(|(i, &n)| nodal::<D>(&flow.velocity, n as usize) * value::<D>(2, i, at)).sum()
}

fn pressure_at<const D: usize>(flow: &Flow<D>, cell: usize, at: &[f64; D]) -> f64 {
    let nodes = flow.discretisation.pressure.cell(cell).iter().enumerate();
    nodes.map(|(i, &n)| flow.pressure[n as usize] * value::<D>(1, i, at)).sum()
}

/// The integral of the velocity over the fluid around bodies, which repeat where the box is periodic, over
/// the volume of the box. Films between bodies are widened to these heights, as the mesh sees them.
pub fn superficial_velocity<const D: usize>(
    flow: &Flow<D>,
    balls: &[Ball<D>],
    heights: &Heights,
) -> Vector<D> {
    let mesh = &flow.discretisation.mesh;
    let (points, rules) = (gauss_cube::<D>(POINTS), CutRules::new(0.0));
    let flats = flats(balls, mesh.domain(), heights);
    let of_cell = |(index, cell)| {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        let near = balls.iter().zip(&flats).flat_map(|(ball, flats)| {
            let images = in_cell(ball, &lower, h).into_iter();
            images.map(|image| (image, flats.iter().map(|flat| flat.in_cell(&image, h, 0.0)).collect()))
        });
        let near: Vec<(BallInCell<D>, Vec<FlatInCell<D>>)> = near.collect();
        let volume = rules.moments(near.iter().map(|(ball, flats)| (ball, &flats[..]))).volume;
        let sum: Vector<D> =
            points.iter().zip(&volume).map(|((at, _), weight)| velocity_at(flow, index, at) * *weight).sum();
        sum * h.powi(D as i32)
    };
    mesh.cells().iter().enumerate().map(of_cell).sum::<Vector<D>>() / mesh.domain().extent().product()
}

/// The planes that cut each of these bodies flat where films are widened.
fn flats<const D: usize>(balls: &[Ball<D>], domain: &Aabb<D>, heights: &Heights) -> Vec<Vec<Flat<D>>> {
    let mut flats = vec![Vec::new(); balls.len()];
    for film in thin_films(balls, domain, heights) {
        for ((side, distance), sign) in
            film.flats(film.height(heights)).into_iter().enumerate().zip([1.0, -1.0])
        {
            if let Some(body) = film.side(side) {
                flats[body].push(Flat { normal: film.normal * sign, distance });
            }
        }
    }
    flats
}

/// The images of a ball that cut or cover a cell, in its coordinates.
fn in_cell<const D: usize>(ball: &Ball<D>, lower: &Vector<D>, h: f64) -> Vec<BallInCell<D>> {
    let middle = lower + Vector::repeat(0.5 * h);
    let count = 3usize.pow(D as u32);
    let images = (0..count).map(|k| {
        let arm = Vector::<D>::from_fn(|d, _| {
            let step = (k / 3usize.pow(d as u32) % 3) as f64 - 1.0;
            middle[d] - ball.center()[d] + ball.period()[d].map_or(0.0, |period| step * period)
        });
        (arm.map(|x| (x.abs() - 0.5 * h).max(0.0)).norm(), arm)
    });
    let near = images.filter(|(distance, _)| *distance < ball.bounding_radius());
    let in_cell = |(_, arm): (f64, Vector<D>)| BallInCell {
        center: std::array::from_fn(|d| 0.5 - arm[d] / h),
        radius: ball.bounding_radius() / h,
    };
    near.map(in_cell).collect()
}

/// A box of equal cells.
#[derive(Clone, Copy, Debug)]
pub struct Lattice<const D: usize> {
    /// The box.
    pub domain: Aabb<D>,
    /// Cells along each edge.
    pub cells: usize,
}

impl<const D: usize> Lattice<D> {
    /// Edge of a cell.
    pub fn cell_size(&self) -> f64 {
        self.domain.extent()[0] / self.cells as f64
    }

    /// The integral of `f(x, n)` over the boundary with its normal, by Simpson's rule in each cell: exact for
    /// quadratic elements.
    pub fn boundary_integral(&self, f: impl Fn(&Vector<D>, &Vector<D>) -> f64) -> f64 {
        let (along, h) = (2 * self.cells + 1, self.cell_size());
        let weight = |i: usize| match i {
            _ if i == 0 || i + 1 == along => h / 6.0,
            _ if i % 2 == 1 => 2.0 * h / 3.0,
            _ => h / 3.0,
        };
        let mut sum = 0.0;
        for (axis, side) in (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut normal = Vector::<D>::zeros();
            normal[axis] = if side == 0 { -1.0 } else { 1.0 };
            for number in 0..along.pow(D as u32 - 1) {
                let (mut rest, mut total, mut x) = (number, 1.0, self.domain.lower);
                x[axis] = if side == 0 { self.domain.lower[axis] } else { self.domain.upper[axis] };
                for d in (0..D).filter(|&d| d != axis) {
                    let i = rest % along;
                    rest /= along;
                    total *= weight(i);
                    x[d] += 0.5 * h * i as f64;
                }
                sum += total * f(&x, &normal);
            }
        }
        sum
    }

    /// `velocity` less the uniform expansion that carries the net flux of its interpolation.
    pub fn without_net_flux<'a>(
        &self,
        velocity: impl Fn(&Vector<D>) -> Vector<D> + 'a,
    ) -> impl Fn(&Vector<D>) -> Vector<D> + 'a {
        let flux = self.boundary_integral(|x, n| velocity(x).dot(n));
        let (rate, center) = (flux / (D as f64 * self.domain.extent().product()), self.domain.center());
        move |x| velocity(x) - (x - center) * rate
    }

    /// `S : E` of the body in a flow of viscosity one with this velocity on the boundary: the work of the
    /// reactions there in the flow `E x`, less that without the body, `2 int u.E.n`.
    pub fn stresslet(
        &self,
        flow: &Flow<D>,
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
        strain: &Matrix<D>,
    ) -> f64 {
        let center = self.domain.center();
        let nodes = &flow.discretisation.velocity;
        let test = |node: u32| {
            let x = nodes.point(node as usize);
            if self.is_on_boundary(&x) { strain * (x - center) } else { Vector::zeros() }
        };
        let work = (0..flow.discretisation.mesh.cell_count()).map(|cell| {
            let tests: Vec<Vector<D>> = nodes.cell(cell).iter().map(|&n| test(n)).collect();
            if tests.iter().all(|v| v.amax() == 0.0) { 0.0 } else { virtual_work(flow, cell, &tests) }
        });
        work.sum::<f64>() - 2.0 * self.boundary_integral(|x, n| boundary(x).dot(&(strain * n)))
    }

    fn is_on_boundary(&self, x: &Vector<D>) -> bool {
        let Aabb { lower, upper } = &self.domain;
        (0..D).any(|d| (x[d] - lower[d]).min(upper[d] - x[d]) < 1e-6 * self.cell_size())
    }
}

/// `int 2 eps(u):eps(v) - p div v` over a cell of pure fluid for the field with the nodal values `tests`.
fn virtual_work<const D: usize>(flow: &Flow<D>, cell: usize, tests: &[Vector<D>]) -> f64 {
    let h = flow.discretisation.cell_size(cell);
    let nodes = flow.discretisation.velocity.cell(cell);
    let work = |(at, weight): ([f64; D], f64)| {
        let (mut u, mut v) = (Matrix::<D>::zeros(), Matrix::<D>::zeros());
        for i in 0..node_count::<D>(2) {
            let slope = Vector::<D>::from(gradient::<D>(2, i, &at)).transpose() / h;
            u += nodal::<D>(&flow.velocity, nodes[i] as usize) * slope;
            v += tests[i] * slope;
        }
        weight * h.powi(D as i32) * ((u + u.transpose()).dot(&v) - pressure_at(flow, cell, &at) * v.trace())
    };
    gauss_cube::<D>(3).into_iter().map(work).sum()
}

#[cfg(test)]
mod tests {
    use gluey_stokes::fem::cut::CutMoments;

    use super::*;

    fn lattice<const D: usize>() -> Lattice<D> {
        let corner = Vector::<D>::repeat(1.5);
        Lattice { domain: Aabb { lower: -corner, upper: corner }, cells: 4 }
    }

    /// By the divergence theorem; the fields are quadratic.
    fn boundary_integrals_are_exact<const D: usize>() {
        let lattice = lattice::<D>();
        let volume = 3f64.powi(D as i32);
        let flux = lattice.boundary_integral(|x, n| x.dot(n) + n[0] * x[0] * x[0]);
        assert!((flux - D as f64 * volume).abs() < 1e-12 * volume, "{flux}");
        let rest = lattice.without_net_flux(|x| x * 0.3 + Vector::repeat(1.0));
        let rest = rest(&Vector::repeat(0.7)) - Vector::repeat(1.0);
        assert!(rest.amax() < 1e-12, "the expansion is gone: {rest:?}");
    }

    /// Of a ball across the border, some of whose cells two images cut.
    #[test]
    fn cells_know_all_images_of_a_ball() {
        let ball = Ball::periodic(Vector::<2>::new(0.03, 0.4), 0.48, [Some(1.0); 2]);
        let h = 0.125;
        let cells = (0..64).map(|k| Vector::<2>::new((k % 8) as f64, (k / 8) as f64) * h);
        let fluid: f64 = cells.map(|lower| CutMoments::new(&in_cell(&ball, &lower, h)).fraction()).sum();
        let exact = 1.0 - std::f64::consts::PI * 0.48 * 0.48;
        assert!((fluid * h * h - exact).abs() < 1e-12, "{} {exact}", fluid * h * h);
        // Film to its images are 0.04 thick, widened to 0.1: two flats along each axis.
        let heights = |height| Heights { at_contact: height, largest: height, ..Heights::default() };
        assert_eq!(flats(&[ball], &Aabb::unit(), &heights(0.03))[0].len(), 0);
        let flats = flats(&[ball], &Aabb::unit(), &heights(0.1));
        assert_eq!(flats[0].len(), 4);
        assert!(flats[0].iter().all(|flat| (flat.distance - 0.45).abs() < 1e-12), "{flats:?}");
    }

    #[test]
    fn fluxes_through_the_boundary_are_exact() {
        boundary_integrals_are_exact::<2>();
        boundary_integrals_are_exact::<3>();
    }
}
