//! How much of its mass a pressure keeps next to walls and bodies.
//!
//! Where velocities are fixed fewer of them see a pressure, and oscillations of the size of a cell have a Schur complement far
//! below their mass: a third in the edges of a box, a fifth in its corners, on any mesh. What the diagonal of `A` makes of it is
//! cheap and tells most: with
//!
//! `s_q = (B diag(A)^-1 B^T)_qq`, `m_q = M_qq / eta`,
//!
//! the *weight* of a pressure is the ratio `s_q / m_q` over the same ratio away from all walls, where the mesh is uniform. It is
//! 0.78 and 0.55 on the sides and in the corners of a square, 0.69, 0.46 and 0.29 on the faces, edges and in the corners of a
//! cube. Symmetric scaling of the mass matrix by the weights takes the smallest eigenvalues of `M^-1 S` from 0.19 to 0.34 (cube, 8
//! cells a side) and leaves the largest at 1.2. Smooth pressures hardly notice: what they have next to walls is of the order of a cell.

use gluey_fem::{Reference, TreeMesh};
use gluey_geom::{Aabb, Dim, Space, Vector};
use gluey_levelset::Ball;
use gluey_linalg::SparseMatrix;

use crate::assembly::pressure_expansion;
use crate::discretisation::Discretisation;
use crate::pressure::WeakPressures;
use crate::space::VelocitySpace;
use crate::system::{ActiveCell, StokesSystem, viscous_diagonal};

/// The least weight, for pressures that hardly any velocity sees.
const LEAST: f64 = 0.05;

/// Multiplies row `q` and column `q` of `mass` by the square root of the weight of `q`, for every pressure of `system`.
pub fn scale_by_weights<const D: usize>(
    mass: &mut SparseMatrix,
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    viscosity: f64,
) where
    Dim<D>: Space<D>,
{
    let roots: Vec<f64> = weights(discretisation, system, viscosity).into_iter().map(f64::sqrt).collect();
    let pattern = mass.pattern().clone();
    for (row, root) in roots.iter().enumerate() {
        let entries = &mut mass.values_mut()[pattern.range(row)];
        for (value, &column) in entries.iter_mut().zip(pattern.columns_of(row)) {
            *value *= root * roots[column as usize];
        }
    }
}

/// The weights of all pressures, one for those that are not unknowns.
fn weights<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    viscosity: f64,
) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let fixed = fixed_nodes(&system.space);
    let near = near_fixed_nodes(discretisation, system, &fixed);
    let mut weights = vec![1.0; near.len()];
    let inside = ratio_inside::<D>();
    for (q, ratio) in ratios(discretisation, system, viscosity, (&fixed, &near)) {
        weights[q] = (ratio / inside).clamp(LEAST, 1.0);
    }
    weights
}

/// `s_q / m_q` in the middle of a mesh without bodies.
fn ratio_inside<const D: usize>() -> f64
where
    Dim<D>: Space<D>,
{
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 2).expect("four cells a side");
    let discretisation = Discretisation::new(mesh);
    let system = without_bodies(&discretisation, 1.0);
    let centre = Vector::<D>::repeat(0.5);
    let is_centre = |q: usize| discretisation.pressure.point(q) == centre;
    let centre: Vec<bool> = (0..system.pressure.dim()).map(is_centre).collect();
    let fixed = fixed_nodes(&system.space);
    ratios(&discretisation, &system, 1.0, (&fixed, &centre)).next().expect("a mesh has a middle").1
}

/// The system on a mesh without the bodies.
pub fn without_bodies<const D: usize>(discretisation: &Discretisation<D>, viscosity: f64) -> StokesSystem<D>
where
    Dim<D>: Space<D>,
{
    let bodies: [Ball<D>; 0] = [];
    let solid = vec![None; discretisation.velocity.node_count()];
    let space = VelocitySpace::new(discretisation.velocity.clone(), &bodies, &solid);
    StokesSystem::new(discretisation, space, viscosity, WeakPressures::Keep, None)
}

/// The nodes whose velocity is that of the boundary or of a body.
fn fixed_nodes<const D: usize>(space: &VelocitySpace<D>) -> Vec<bool>
where
    Dim<D>: Space<D>,
{
    let is_fixed = |n: usize| space.body_of(n).is_some() || space.nodes().is_on_boundary(n);
    (0..space.nodes().node_count()).map(is_fixed).collect()
}

/// The unknown pressures that act on a cell with a fixed node.
fn near_fixed_nodes<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    fixed: &[bool],
) -> Vec<bool>
where
    Dim<D>: Space<D>,
{
    let mut near = vec![false; system.pressure.dim()];
    for cell in &system.cells {
        let cell = cell.cell as usize;
        if discretisation.velocity.cell(cell).iter().any(|&n| fixed[n as usize]) {
            discretisation.pressure.cell(cell).iter().for_each(|&q| near[q as usize] = true);
        }
    }
    for constraint in system.pressure.constraints().iter().rev() {
        let is_near = near[constraint.node as usize];
        constraint.masters.iter().for_each(|m| near[m.0 as usize] |= is_near);
    }
    (0..near.len()).map(|q| near[q] && system.pressure.is_free(q)).collect()
}

/// `s_q / m_q` for the unknown pressures in `special`. Hanging nodes count as nodes of their own.
fn ratios<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    viscosity: f64,
    (fixed, special): (&[bool], &[bool]),
) -> impl Iterator<Item = (usize, f64)>
where
    Dim<D>: Space<D>,
{
    let n = Reference::<D>::VELOCITY;
    let m = Reference::<D>::PRESSURE;
    let reference = Reference::<D>::new();
    let mut row = Row::<D>::new(viscous_diagonal(discretisation, &system.cells));
    let around = corners_of(discretisation, system, special);
    around.into_iter().enumerate().filter(|(_, around)| !around.is_empty()).map(move |(q, around)| {
        let mut mass = 0.0;
        for (cell, corner, weight) in around {
            mass += weight * weight * cell.volume * reference.pressure_mass[corner * m + corner];
            let divergence = reference.divergence[corner * n..][..n].as_chunks::<D>().0;
            let nodes = discretisation.velocity.cell(cell.cell as usize);
            for (&node, divergence) in nodes.iter().zip(divergence).filter(|term| !fixed[*term.0 as usize]) {
                row.add(node, divergence.map(|b| weight * cell.divergence * b));
            }
        }
        (q, row.take_sum() * viscosity / mass)
    })
}

/// The corners of active cells on which each special pressure acts: cell, corner and weight.
fn corners_of<'a, const D: usize>(
    discretisation: &Discretisation<D>,
    system: &'a StokesSystem<D>,
    special: &[bool],
) -> Vec<Vec<(&'a ActiveCell, usize, f64)>>
where
    Dim<D>: Space<D>,
{
    let pressure = pressure_expansion(system);
    let mut around = vec![Vec::new(); special.len()];
    for cell in &system.cells {
        for (corner, &node) in discretisation.pressure.cell(cell.cell as usize).iter().enumerate() {
            for &(q, weight) in pressure.of(node as usize).iter().filter(|term| special[term.0 as usize]) {
                around[q as usize].push((cell, corner, weight));
            }
        }
    }
    around
}

/// A row of `B` in nodal velocities, zero between two uses, and the diagonal of `A`.
struct Row<const D: usize> {
    values: Vec<[f64; D]>,
    nodes: Vec<u32>,
    diagonal: Vec<f64>,
}

impl<const D: usize> Row<D> {
    fn new(diagonal: Vec<f64>) -> Self {
        Self { values: vec![[0.0; D]; diagonal.len() / D], nodes: Vec::new(), diagonal }
    }

    fn add(&mut self, node: u32, divergence: [f64; D]) {
        self.nodes.push(node);
        self.values[node as usize].iter_mut().zip(divergence).for_each(|(value, b)| *value += b);
    }

    /// The sum of `b_k^2 / a_k` over the row.
    fn take_sum(&mut self) -> f64 {
        let mut sum = 0.0;
        for node in self.nodes.drain(..) {
            let values = std::mem::replace(&mut self.values[node as usize], [0.0; D]);
            let diagonal = &self.diagonal[node as usize * D..][..D];
            sum += values.iter().zip(diagonal).map(|(b, a)| b * b / a).sum::<f64>();
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::solid_nodes;

    /// Weights by the number of walls a node lies on.
    fn weights_of_a_box<const D: usize>() -> Vec<Vec<f64>>
    where
        Dim<D>: Space<D>,
    {
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 3).unwrap();
        let discretisation = Discretisation::new(mesh);
        let system = without_bodies(&discretisation, 2.5);
        let mut by_walls = vec![Vec::new(); D + 1];
        for (q, weight) in weights(&discretisation, &system, 2.5).into_iter().enumerate() {
            let point = discretisation.pressure.point(q);
            by_walls[point.iter().filter(|&&x| x == 0.0 || x == 1.0).count()].push(weight);
        }
        by_walls
    }

    /// From the matrices of a square and a cube, assembled and multiplied elsewhere.
    #[test]
    fn walls_edges_and_corners_have_the_weights_of_dense_matrices() {
        let range = |weights: &[f64]| {
            weights.iter().fold((f64::MAX, 0.0f64), |(low, high), &w| (low.min(w), high.max(w)))
        };
        let close = |(low, high): (f64, f64), want: (f64, f64)| {
            assert!((low - want.0).abs() < 1e-3 && (high - want.1).abs() < 1e-3, "{low} {high} {want:?}");
        };
        let square = weights_of_a_box::<2>();
        close(range(&square[0]), (0.960, 1.0));
        close(range(&square[1]), (0.766, 0.777));
        close(range(&square[2]), (0.554, 0.554));
        let cube = weights_of_a_box::<3>();
        close(range(&cube[0]), (0.957, 1.0));
        close(range(&cube[1]), (0.677, 0.693));
        close(range(&cube[2]), (0.453, 0.457));
        close(range(&cube[3]), (0.292, 0.292));
    }

    /// Without walls in two directions, and with a ball and hanging nodes.
    fn weights_are_less_near_bodies_only<const D: usize>()
    where
        Dim<D>: Space<D>,
    {
        let ball = Ball::new(Vector::<D>::repeat(0.5), 0.15);
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [true; D], 4, |lower, h, level| {
            let centre: Vector<D> = lower.add_scalar(0.5 * h);
            level < 3 || ((centre - Vector::repeat(0.5)).norm() - 0.15).abs() < h
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        assert!(!discretisation.pressure.constraints().is_empty());
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, &[ball], 0.0);
        let space = VelocitySpace::new(discretisation.velocity.clone(), &[ball], &solid);
        let system = StokesSystem::new(&discretisation, space, 1.0, WeakPressures::Keep, None);
        let weights = weights(&discretisation, &system, 1.0);
        let mut least = 1.0f64;
        for (q, &weight) in weights.iter().enumerate() {
            assert!((LEAST..=1.0).contains(&weight));
            let distance = (discretisation.pressure.point(q) - Vector::repeat(0.5)).norm();
            assert!(distance < 0.4 || weight == 1.0, "{weight} at {distance}");
            least = least.min(weight);
        }
        assert!(least < 0.5, "{least}");
    }

    #[test]
    fn a_body_takes_velocities_from_the_pressures_around_it() {
        weights_are_less_near_bodies_only::<2>();
        weights_are_less_near_bodies_only::<3>();
    }
}
