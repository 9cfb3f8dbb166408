//! What flows through films that are widened on the mesh.

use std::collections::BTreeMap;

use gluey_fem::Constraint;
use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss, gauss_cube, node_count, value};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::{Ball, BallTree, Body};
use rayon::prelude::*;

use super::cut_cells::{CellState, CutCells};
use crate::film::{Film, FilmFlow, Heights, weight};
use crate::space::VelocitySpace;

/// Points of the rule for the mean thickness of a film.
const RULE: usize = 16;

/// The flows through the films between bodies, which are widened to these heights; none through those at
/// walls and where the mesh has no fluid in a film.
pub fn flows_through_films<const D: usize>(
    space: &VelocitySpace<D>,
    cut: &CutCells<D>,
    bodies: &[Ball<D>],
    films: &[Film<D>],
    heights: &Heights,
) -> Vec<Option<FilmFlow<D>>>
where
    Dim<D>: Space<D>,
{
    let smallest = space.discretisation().finest_cell_size();
    let regions: Vec<Region<D>> =
        films.iter().map(|film| Region::new(film, bodies, film.height(heights), smallest)).collect();
    let cells = cells_in(space, cut, &regions);
    let masters = Masters::new(space);
    let rule = Rule::new();
    let flow = |(index, film): (usize, &Film<D>)| {
        (!film.partner.is_wall()).then(|| regions[index].flow(space, cut, &cells[index], &masters, &rule))?
    };
    films.par_iter().enumerate().map(flow).collect()
}

/// Where the flow through a film is measured.
struct Region<const D: usize> {
    /// A ball around it, whose centre is the middle of the film.
    around: Ball<D>,
    normal: Vector<D>,
    reach: f64,
    edge: f64,
    height: f64,
}

impl<const D: usize> Region<D>
where
    Dim<D>: Space<D>,
{
    fn new(film: &Film<D>, bodies: &[Ball<D>], height: f64, smallest: f64) -> Self {
        let shape = film.shape(height);
        let edge = shape.edge();
        let reach = edge.max(smallest);
        // Weighted like the squares of the radius, by the middle of each ring.
        let thickness = |r: f64| height.max(shape.gap + r * r / shape.radius);
        let of_point = |(s, part): (f64, f64)| {
            let part = part * weight(s * s) * s.powi(D as i32 - 2);
            Vector::<2>::new(part, part * thickness(s * reach))
        };
        let sums: Vector<2> = gauss(RULE).into_iter().map(of_point).sum();
        let lattice = bodies[film.body as usize].lattice();
        let mut middle = film.normal * film.arm(0);
        middle[0] -= lattice.shear() * middle[1];
        let radius = reach.hypot(0.5 * thickness(reach));
        let around = Ball::in_lattice(film.center + middle, radius, *lattice);
        Self { around, normal: film.normal, reach, edge, height: sums[1] / sums[0] }
    }

    /// The flow through these cells.
    fn flow(
        &self,
        space: &VelocitySpace<D>,
        cut: &CutCells<D>,
        cells: &[u32],
        masters: &Masters<'_>,
        rule: &Rule<D>,
    ) -> Option<FilmFlow<D>> {
        let discretisation = space.discretisation();
        let mesh = &discretisation.mesh;
        let (mut volume, mut place) = (0.0, Vector::<D>::zeros());
        let mut of_nodes = BTreeMap::new();
        for &cell in cells {
            let cell = cell as usize;
            let (lower, h) = (mesh.lower_corner(&mesh.cells()[cell]), discretisation.cell_size(cell));
            let shares = cut.cut(cell).map(|cut| &cut.moments.volume);
            for (q, (at, whole, shapes)) in rule.0.iter().enumerate() {
                let arm = self.around.arm(&(lower + Vector::from(*at) * h));
                let height = arm.dot(&self.normal);
                let across = arm.norm_squared() - height * height;
                let share = shares.map_or(*whole, |shares| shares[q]);
                let part = share * h.powi(D as i32) * weight(across / (self.reach * self.reach));
                if part == 0.0 {
                    continue;
                }
                volume += part;
                place += arm * part;
                for (&node, shape) in discretisation.velocity.cell(cell).iter().zip(shapes) {
                    masters.add(node, part * shape, &mut of_nodes);
                }
            }
        }
        if volume <= 0.0 {
            return None;
        }
        let scaled = of_nodes.into_iter().map(|(node, part): (u32, f64)| (node, part / volume));
        let (boundary, nodes) = scaled.partition(|&(node, _)| space.nodes().is_on_boundary(node as usize));
        let Self { reach, edge, height, .. } = *self;
        Some(FilmFlow { nodes, boundary, middle: place / volume, height, reach, edge })
    }
}

/// The cells with fluid in each region, ascending.
fn cells_in<const D: usize>(
    space: &VelocitySpace<D>,
    cut: &CutCells<D>,
    regions: &[Region<D>],
) -> Vec<Vec<u32>>
where
    Dim<D>: Space<D>,
{
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

/// The points of cut cells with their weights in whole ones and the values of the velocity functions.
struct Rule<const D: usize>(Vec<([f64; D], f64, Vec<f64>)>);

impl<const D: usize> Rule<D> {
    fn new() -> Self {
        let shapes = |x: &[f64; D]| (0..node_count::<D>(2)).map(|i| value::<D>(2, i, x)).collect();
        Self(gauss_cube::<D>(POINTS).into_iter().map(|(x, weight)| (x, weight, shapes(&x))).collect())
    }
}

/// Nodes that follow others.
struct Masters<'a> {
    hanging: &'a [Constraint],
    ghosts: &'a [Constraint],
    /// Place of each node in the hanging ones, then in the ghosts, or `u32::MAX`.
    place: Vec<u32>,
}

impl<'a> Masters<'a> {
    fn new<const D: usize>(space: &'a VelocitySpace<D>) -> Self
    where
        Dim<D>: Space<D>,
    {
        let (hanging, ghosts) = (space.nodes().constraints(), space.ghosts());
        let mut place = vec![u32::MAX; space.nodes().node_count()];
        for (k, follower) in hanging.iter().chain(ghosts).enumerate() {
            place[follower.node as usize] = k as u32;
        }
        Self { hanging, ghosts, place }
    }

    /// Adds a part of the velocity of a node to those of the nodes that it follows.
    fn add(&self, node: u32, part: f64, sums: &mut BTreeMap<u32, f64>) {
        let place = self.place[node as usize] as usize;
        let follower =
            self.hanging.get(place).or_else(|| self.ghosts.get(place.checked_sub(self.hanging.len())?));
        match follower {
            None => *sums.entry(node).or_default() += part,
            Some(follower) => {
                follower.masters.iter().for_each(|&(master, weight)| self.add(master, part * weight, sums));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Twist};

    use super::*;
    use crate::film::{FilmCoupling, Lubrication, thin_films};
    use crate::formulation::{Formulation, Problem};
    use crate::space::Discretisation;

    /// Fluid and bodies that move as one lose nothing in films, whatever cells these cut.
    fn moving_as_one_is_free<const D: usize>()
    where
        Dim<D>: Space<D>,
    {
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
        let surfaces = problem.system.surfaces.as_ref().unwrap();
        let flows = flows_through_films(space, &surfaces.cut, &bodies, &films, &heights);
        let flow = flows[0].as_ref().unwrap();
        let sum: f64 = flow.nodes.iter().map(|node| node.1).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        assert!(flow.middle.norm() < 0.1 * discretisation.finest_cell_size(), "{:?}", flow.middle);
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
            coupling.add([x, &at_rest], [&mut vec![0.0; space.dim()], &mut z]);
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
