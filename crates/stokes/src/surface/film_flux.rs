//! What flows through films that are widened on the mesh.
//!
//! In 2D the same flows through every section of a film. Its mean over the sections is `Q = int grad phi . u`
//! for a `phi` that grows from zero to one along the film. With `phi` among the pressures of the mesh this is
//! what the mesh conserves, and the resistance, a force of `grad phi` on the fluid, is one that pressures
//! balance: nothing is left that stirs the fluid in the film. In 3D fluid goes around, and `Q` is the mean
//! velocity with smooth weights times the thickness.

use std::collections::BTreeMap;
use std::ops::{AddAssign, Mul};

use gluey_fem::Constraint;
use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss, gauss_cube, gradient, node_count, value};
use gluey_geom::{Matrix, Vector};
use gluey_levelset::{Ball, BallTree, Body};
use rayon::prelude::*;

use super::cut_cells::{CellState, CutCells};
use crate::film::{Film, FilmFlow, FilmShape, Heights};
use crate::space::{PressureSpace, VelocitySpace};

/// Points of the rule for the mean thickness of a film.
const RULE: usize = 16;

/// The flows through the films between bodies, which are widened to these heights, in the directions across
/// each; none through those at walls and where the mesh has no fluid in a film.
pub fn flows_through_films<const D: usize>(
    space: &VelocitySpace<D>,
    pressure: &PressureSpace<D>,
    cut: &CutCells<D>,
    bodies: &[Ball<D>],
    films: &[Film<D>],
    heights: &Heights,
) -> Vec<Vec<FilmFlow<D>>> {
    let smallest = space.discretisation().finest_cell_size();
    let regions: Vec<Region<D>> =
        films.iter().map(|film| Region::new(film, bodies, film.height(heights), smallest)).collect();
    let cells = cells_in(space, cut, &regions);
    let fluid = FluidAround {
        space,
        cut,
        velocities: Followers::new(
            space.nodes().node_count(),
            space.nodes().constraints().iter().chain(space.ghosts()),
        ),
        pressures: Followers::new(pressure.dim(), pressure.constraints().iter()),
        rule: CutRule::new(),
    };
    let of_film = |(index, film): (usize, &Film<D>)| {
        if film.partner.is_wall() {
            return Vec::new();
        }
        let (region, cells, tangents) = (&regions[index], &cells[index], film.tangents());
        if D == 2 {
            region.through_sections(&fluid, cells, &tangents)
        } else {
            region.mean(&fluid, cells, &tangents)
        }
    };
    films.par_iter().enumerate().map(of_film).collect()
}

/// The fluid of a mesh around bodies.
struct FluidAround<'a, const D: usize> {
    space: &'a VelocitySpace<D>,
    cut: &'a CutCells<D>,
    velocities: Followers<'a>,
    pressures: Followers<'a>,
    rule: CutRule<D>,
}

/// A region in which the flow through a film is measured.
struct Region<const D: usize> {
    /// A ball around it, whose centre is the middle of the film.
    around: Ball<D>,
    normal: Vector<D>,
    shape: FilmShape,
    reach: f64,
    /// Mean thickness.
    height: f64,
}

impl<const D: usize> Region<D> {
    fn new(film: &Film<D>, bodies: &[Ball<D>], height: f64, smallest: f64) -> Self {
        let shape = film.shape(height);
        // In 2D the potential grows over a cell more than its reach, and is to do so between the flats.
        let edge = shape.edge();
        let reach = if D == 2 { (edge - smallest).max(0.5 * smallest) } else { edge.max(smallest) };
        // Weighted like the squares of the radius, by the middle of each ring.
        let of_point = |(s, part): (f64, f64)| {
            let part = part * weight(s * s) * s.powi(D as i32 - 2);
            Vector::<2>::new(part, part * shape.seen((s * reach).powi(2)))
        };
        let sums: Vector<2> = gauss(RULE).into_iter().map(of_point).sum();
        let lattice = bodies[film.body as usize].lattice();
        let mut middle = film.normal * film.arm(0);
        middle[0] -= lattice.shear() * middle[1];
        let radius = reach.hypot(0.5 * shape.seen(reach * reach));
        let around = Ball::in_lattice(film.center + middle, radius, *lattice);
        Self { around, normal: film.normal, shape, reach, height: sums[1] / sums[0] }
    }

    /// The mean velocity times the thickness, along each of these directions.
    fn mean(&self, fluid: &FluidAround<'_, D>, cells: &[u32], tangents: &[Vector<D>]) -> Vec<FilmFlow<D>> {
        let (mut volume, mut place) = (0.0, Vector::<D>::zeros());
        let mut of_nodes = BTreeMap::<u32, f64>::new();
        for &cell in cells {
            let mut of_cell = vec![0.0; node_count::<D>(2)];
            fluid.for_each_point(cell, &self.around, |point, arm, part| {
                let part = part * weight(self.across(arm) / (self.reach * self.reach));
                if part == 0.0 {
                    return;
                }
                volume += part;
                place += arm * part;
                of_cell.iter_mut().zip(&point.shapes).for_each(|(sum, shape)| *sum += part * shape);
            });
            fluid.scatter(cell, of_cell, &mut of_nodes);
        }
        if volume <= 0.0 {
            return Vec::new();
        }
        place /= volume;
        let scale = self.height / volume;
        let edge = self.shape.edge().powi(2);
        // The mean over directions of the weighted x^2 is a quarter of the reach.
        let carried = 0.375 * edge - self.reach.powi(2) / 16.0;
        let flow = |t: &Vector<D>| FilmFlow {
            total: t * self.height,
            first: t * place.transpose() * self.height,
            approach: -place.dot(t) / (D - 1) as f64,
            turning: 0.25 * self.height * self.height - carried,
            ..fluid.flow(of_nodes.iter().map(|(&node, part)| (node, t * (part * scale))))
        };
        tangents.iter().map(flow).collect()
    }

    /// The mean over sections along the only direction.
    fn through_sections(
        &self,
        fluid: &FluidAround<'_, D>,
        cells: &[u32],
        tangents: &[Vector<D>],
    ) -> Vec<FilmFlow<D>> {
        let t = &tangents[0];
        let (discretisation, shear) =
            (fluid.space.discretisation(), fluid.space.discretisation().mesh.shear());
        let nodes = &discretisation.pressure;
        let potential = |node: u32| {
            let s = (self.around.arm(&nodes.point(node as usize)).dot(t) / self.reach).clamp(-1.0, 1.0);
            // The integral of the weight, from zero to one.
            0.5 + 0.9375 * (s - 2.0 / 3.0 * s.powi(3) + 0.2 * s.powi(5))
        };
        let (mut total, mut first) = (Vector::<D>::zeros(), Matrix::<D>::zeros());
        let [mut approaching, mut tilting] = [0.0; 2];
        let mut of_nodes = BTreeMap::<u32, Vector<D>>::new();
        for &cell in cells {
            let h = discretisation.cell_size(cell as usize);
            let values: Vec<f64> = nodes
                .cell(cell as usize)
                .iter()
                .map(|&node| fluid.pressures.value(node, &potential))
                .collect();
            let mut of_cell = vec![Vector::<D>::zeros(); node_count::<D>(2)];
            fluid.for_each_point(cell, &self.around, |point, arm, part| {
                let mut slope: Vector<D> =
                    values.iter().zip(&point.slopes).map(|(value, slope)| slope * (*value / h)).sum();
                slope[1] -= shear * slope[0];
                let weights = slope * part;
                total += weights;
                first += weights * arm.transpose();
                // Flows without divergence whose normal velocities are those of flats that approach and tilt.
                let (along, up) = (arm.dot(t), arm.dot(&self.normal));
                let [out, risen] =
                    [t, &self.normal].map(|axis| weights.dot(axis) / self.shape.seen(along * along));
                approaching += out * along - risen * up;
                tilting += 0.5 * out * along * along - risen * along * up;
                of_cell.iter_mut().zip(&point.shapes).for_each(|(sum, shape)| *sum += weights * *shape);
            });
            fluid.scatter(cell, of_cell, &mut of_nodes);
        }
        if total.norm() <= 0.0 {
            return Vec::new();
        }
        let carried = 0.5 * self.shape.edge().powi(2) - tilting;
        let turning = 0.25 * self.height * self.height - carried;
        vec![FilmFlow { total, first, approach: -approaching, turning, ..fluid.flow(of_nodes.into_iter()) }]
    }

    /// The square of the distance from the line of centres.
    fn across(&self, arm: &Vector<D>) -> f64 {
        arm.norm_squared() - arm.dot(&self.normal).powi(2)
    }
}

/// `(1 - s^2)^2`: the weight at `s` of the radius of the region.
fn weight(square: f64) -> f64 {
    (1.0 - square).max(0.0).powi(2)
}

impl<const D: usize> FluidAround<'_, D> {
    /// Calls `visit` with the points of the rule in a cell, their places from the centre of a ball, and the
    /// volume of the fluid that belongs to them.
    fn for_each_point(
        &self,
        cell: u32,
        around: &Ball<D>,
        mut visit: impl FnMut(&CutPoint<D>, &Vector<D>, f64),
    ) {
        let discretisation = self.space.discretisation();
        let mesh = &discretisation.mesh;
        let cell = cell as usize;
        let (lower, h) = (mesh.lower_corner(&mesh.cells()[cell]), discretisation.cell_size(cell));
        let shares = self.cut.cut(cell).map(|cut| &cut.moments.volume);
        // The image that is nearest to the cell.
        let center = around.arm(&(lower + Vector::repeat(0.5 * h)));
        for (q, point) in self.rule.0.iter().enumerate() {
            let share = shares.map_or(point.weight, |shares| shares[q]);
            let mut beside = point.at.add_scalar(-0.5) * h;
            beside[0] += mesh.shear() * beside[1];
            visit(point, &(center + beside), share * h.powi(D as i32));
        }
    }

    /// Adds the weights at the nodes of a cell to those of the nodes that these follow.
    fn scatter<T>(&self, cell: u32, of_cell: Vec<T>, of_nodes: &mut BTreeMap<u32, T>)
    where
        T: Copy + AddAssign + Mul<f64, Output = T>,
    {
        let nodes = self.space.discretisation().velocity.cell(cell as usize);
        for (&node, weight) in nodes.iter().zip(of_cell) {
            self.velocities.add(node, weight, of_nodes);
        }
    }

    /// A flow of these weights and nothing else.
    fn flow(&self, weights: impl Iterator<Item = (u32, Vector<D>)>) -> FilmFlow<D> {
        let is_on_boundary = |weight: &(u32, _)| self.space.nodes().is_on_boundary(weight.0 as usize);
        let (boundary, nodes) = weights.partition(is_on_boundary);
        let (total, first) = (Vector::zeros(), Matrix::zeros());
        FilmFlow { nodes, boundary, total, first, approach: 0.0, turning: 0.0 }
    }
}

/// The cells with fluid in each region, ascending.
fn cells_in<const D: usize>(
    space: &VelocitySpace<D>,
    cut: &CutCells<D>,
    regions: &[Region<D>],
) -> Vec<Vec<u32>> {
    let discretisation = space.discretisation();
    let mesh = &discretisation.mesh;
    let around: Vec<Ball<D>> = regions.iter().map(|region| region.around).collect();
    let tree = BallTree::new(&around);
    let has_fluid = |cell: &usize| cut.states[*cell] != CellState::Solid;
    let of_cell = |cell: usize| {
        let h = discretisation.cell_size(cell);
        let center = mesh.lower_corner(&mesh.cells()[cell]) + Vector::repeat(0.5 * h);
        let mut found = Vec::new();
        let half = mesh.half_diagonal(h);
        tree.any_within(&center, half, |region| {
            let Region { around, normal, height, .. } = &regions[region];
            if around.arm(&center).dot(normal).abs() <= 0.5 * height + half {
                found.push((region, cell as u32));
            }
            false
        });
        found
    };
    let cells = (0..cut.states.len()).into_par_iter().with_min_len(256).filter(has_fluid);
    let found: Vec<Vec<(usize, u32)>> = cells.map(of_cell).collect();
    let mut of_regions = vec![Vec::new(); regions.len()];
    found.into_iter().flatten().for_each(|(region, cell)| of_regions[region].push(cell));
    of_regions
}

/// A point of the rule in cut cells.
struct CutPoint<const D: usize> {
    at: Vector<D>,
    /// Its weight in whole cells.
    weight: f64,
    /// Values of the velocity functions.
    shapes: Vec<f64>,
    /// Gradients of the pressure functions.
    slopes: Vec<Vector<D>>,
}

/// The points of cut cells.
struct CutRule<const D: usize>(Vec<CutPoint<D>>);

impl<const D: usize> CutRule<D> {
    fn new() -> Self {
        let point = |(at, weight): ([f64; D], f64)| CutPoint {
            at: Vector::from(at),
            weight,
            shapes: (0..node_count::<D>(2)).map(|i| value::<D>(2, i, &at)).collect(),
            slopes: (0..node_count::<D>(1)).map(|i| Vector::from(gradient::<D>(1, i, &at))).collect(),
        };
        Self(gauss_cube::<D>(POINTS).into_iter().map(point).collect())
    }
}

/// Nodes that follow others.
struct Followers<'a> {
    followers: Vec<&'a Constraint>,
    /// Place of each node in these, or `u32::MAX`.
    place: Vec<u32>,
}

impl<'a> Followers<'a> {
    fn new(node_count: usize, followers: impl Iterator<Item = &'a Constraint>) -> Self {
        let followers: Vec<&Constraint> = followers.collect();
        let mut place = vec![u32::MAX; node_count];
        followers.iter().zip(0..).for_each(|(follower, k)| place[follower.node as usize] = k);
        Self { followers, place }
    }

    fn of(&self, node: u32) -> Option<&[(u32, f64)]> {
        self.followers.get(self.place[node as usize] as usize).map(|follower| &follower.masters[..])
    }

    /// Adds a weight of a node to those of the nodes that it follows.
    fn add<T>(&self, node: u32, weight: T, sums: &mut BTreeMap<u32, T>)
    where
        T: Copy + AddAssign + Mul<f64, Output = T>,
    {
        match self.of(node) {
            None => {
                sums.entry(node).and_modify(|sum| *sum += weight).or_insert(weight);
            }
            Some(masters) => {
                masters.iter().for_each(|&(master, share)| self.add(master, weight * share, sums));
            }
        }
    }

    /// The value at a node of a function that is given at the nodes that follow no other.
    fn value(&self, node: u32, function: &impl Fn(u32) -> f64) -> f64 {
        match self.of(node) {
            None => function(node),
            Some(masters) => {
                masters.iter().map(|&(master, share)| share * self.value(master, function)).sum()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Dim, Twist};

    use super::*;
    use crate::film::{FilmCoupling, Lubrication, thin_films};
    use crate::formulation::{Formulation, Problem};
    use crate::space::Discretisation;
    use crate::term::{Product, Scratch};

    /// Fluid and bodies that move as one lose nothing in films, whatever cells these cut.
    fn moving_as_one_is_free<const D: usize>() {
        let n = Vector::<D>::from_fn(|d, _| [0.7, -0.4, 0.5][d]).normalize();
        let (middle, radius) = (Vector::<D>::from_fn(|d, _| 0.5 + 0.01 * d as f64), 0.2);
        let bodies = [-1.0, 1.0].map(|side| Ball::new(middle + n * (side * (radius + 0.01)), radius));
        let level = if D == 2 { 5 } else { 4 };
        let mesh = TreeMesh::<D>::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
        let discretisation = Discretisation::new(mesh);
        let method = Formulation::Unfitted { lubrication: Lubrication::Deficit }.method().unwrap();
        let problem = Problem::on(&discretisation, &bodies, 1.0, method.as_ref()).unwrap();
        let space = &problem.system.space;
        let heights = Lubrication::Deficit.heights::<D>(discretisation.finest_cell_size());
        let films = thin_films(&bodies, &Aabb::unit(), &heights);
        let surfaces = problem.system.surfaces().unwrap();
        let pressure = &problem.system.pressure;
        let flows = flows_through_films(space, pressure, &surfaces.cut, &bodies, &films, &heights);
        assert_eq!(flows[0].len(), D - 1);
        let flow = &flows[0][0];
        let sum: Vector<D> = flow.nodes.iter().map(|node| node.1).sum();
        assert!((sum - flow.total).norm() < 1e-12 * flow.total.norm(), "{sum}");
        let height = films[0].height(&heights);
        let along = flow.total.dot(&films[0].tangents()[0]) / height;
        assert!((along - 1.0).abs() < 0.35, "{along}");
        assert!(flow.approach.abs() < 0.2 * discretisation.finest_cell_size(), "{}", flow.approach);
        let coupling = FilmCoupling::new(space, films, flows, &heights, 1.0);
        let mut spin = Dim::<D>::zero_spin();
        (0..Dim::<D>::ROT).for_each(|k| spin[k] = 0.3 - 0.5 * k as f64);
        let velocity = |x: &Vector<D>| Vector::repeat(0.4) + Dim::<D>::cross_spin(&spin, x);
        let mut x = vec![0.0; space.dim()];
        for node in 0..space.nodes().node_count() {
            x[node * D..][..D].copy_from_slice(velocity(&space.nodes().point(node)).as_slice());
        }
        let still = x.clone();
        for (body, ball) in bodies.iter().enumerate() {
            space.set_twist(&mut x, body, &Twist { velocity: velocity(ball.center()), spin });
        }
        let size = |x: &[f64]| {
            let (mut z, at_rest) = (vec![0.0; coupling.dim()], vec![0.0; coupling.dim()]);
            let y = [&mut *vec![0.0; space.dim()], &mut [], &mut z];
            coupling.add([x, &[], &at_rest], y, &mut Scratch::<f64>::default());
            z.iter().map(|z| z.abs()).fold(0.0, f64::max)
        };
        assert!(size(&x) < 1e-11 * size(&still), "{} {}", size(&x), size(&still));
    }

    #[test]
    fn fluid_and_bodies_that_move_as_one_have_no_force() {
        moving_as_one_is_free::<2>();
        moving_as_one_is_free::<3>();
    }
}
