//! How much of its mass a pressure keeps next to walls and bodies.
//!
//! Where velocities are fixed fewer of them feel a pressure, and oscillations of the size of a cell have a
//! Schur complement far below their mass: a third in the edges of a box, a fifth in its corners, on any mesh.
//! The Schur complement with the diagonal of `A` in place of `A` is cheap and tells most: with
//!
//! `s_q = (B diag(A)^-1 B^T)_qq`, `m_q = M_qq / eta`,
//!
//! the *weight* of a pressure is the ratio `s_q / m_q` over the same ratio away from all walls, where the
//! mesh is uniform. Symmetric scaling of the mass matrix by the weights raises the smallest eigenvalues of
//! `M^-1 S` and leaves the largest (`docs/design/preconditioner.md`). Smooth pressures hardly
//! change: the part of them next to walls is of the order of a cell.
//!
//! In cells in which the viscosity varies `m_q` is the sum of what stands for their masses
//! ([`super::cells`]). It leaves out that what is stiff in one cell holds the nodes of the next and is too
//! large; the diagonal takes a node as held once any cell around it is stiff and is too small. There the
//! weight is the geometric mean of the two, the root of the ratio.

use gluey_fem::{ReferenceMatrices, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_linalg::SparseMatrix;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::cells::PressureMatrices;
use crate::operator::{Elements, StokesSystem, viscous_diagonal};
use crate::space::{Discretisation, VelocitySpace, pressure_expansion};

/// The least weight, for pressures that act on hardly any velocity.
const LEAST_WEIGHT: f64 = 0.05;
/// The least and the largest weight in cells in which the viscosity varies.
const OF_CUT_CELLS: [f64; 2] = [0.25, 2.0];

/// Multiplies row `q` and column `q` of the pressure mass matrix `mass` over the viscosity by the square root
/// of the weight of `q`, for every pressure of `system`.
pub fn scale_by_weights<const D: usize>(
    mass: &mut SparseMatrix,
    elements: &Elements<'_, D>,
    matrices: &PressureMatrices,
) {
    let mut weights = weights(elements, matrices);
    elements.system().pressure.halo().clone().update(&mut weights);
    let roots: Vec<f64> = weights.into_iter().map(f64::sqrt).collect();
    mass.fill_rows(|row, columns, values| {
        for (value, &column) in values.iter_mut().zip(columns) {
            *value *= roots[row] * roots[column as usize];
        }
    });
}

/// The weights of all owned pressures, one for those that are not unknowns. A part lacks what cells far from
/// its own add to pressures at hanging nodes and near surfaces: there weights are a little smaller.
pub fn weights<const D: usize>(elements: &Elements<'_, D>, matrices: &PressureMatrices) -> Vec<f64> {
    let system = elements.system();
    let discretisation = system.discretisation();
    let fixed = fixed_nodes(&system.space);
    let nodes_of = |index: usize| discretisation.velocity.cell(system.cells[index].cell as usize);
    let has_fixed_nodes = |index: usize| nodes_of(index).iter().any(|&n| fixed[n as usize]);
    let is_cut = |index: usize| elements.viscous(index).1.is_some();
    let next_to_fixed = pressures_of(system, has_fixed_nodes);
    let in_cut_cells = pressures_of(system, is_cut);
    let own = discretisation.own_pressure_nodes();
    let is_special = |q: usize| own.contains(&q) && (next_to_fixed[q] || in_cut_cells[q]);
    let special: Vec<bool> = (0..next_to_fixed.len()).map(is_special).collect();
    let mut weights = vec![1.0; special.len()];
    let inside = ratio_inside::<D>();
    for (q, ratio) in ratios(elements, matrices, &fixed, &special) {
        let [least, most] = OF_CUT_CELLS;
        weights[q] = match in_cut_cells[q] {
            true => (ratio / inside).sqrt().clamp(least, most),
            false => (ratio / inside).clamp(LEAST_WEIGHT, 1.0),
        };
    }
    weights
}

/// `s_q / m_q` in the middle of a mesh without bodies: what weights are relative to.
fn ratio_inside<const D: usize>() -> f64 {
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 2).expect("four cells a side");
    let discretisation = Discretisation::new(mesh);
    let system = without_bodies(&discretisation, 1.0);
    let elements = Elements::new(&system, ReferenceMatrices::<D>::VELOCITY);
    let matrices = PressureMatrices::new(&elements, 1.0).expect("no cell is cut");
    let centre = Vector::<D>::repeat(0.5);
    let is_centre = |q: usize| discretisation.pressure.point(q) == centre;
    let centre: Vec<bool> = (0..system.pressure.dim()).map(is_centre).collect();
    let fixed = fixed_nodes(&system.space);
    ratios(&elements, &matrices, &fixed, &centre).first().expect("a uniform mesh has a centre node").1
}

/// The system on a mesh without the bodies.
pub fn without_bodies<const D: usize>(discretisation: &Discretisation<D>, viscosity: f64) -> StokesSystem<D> {
    let bodies: [Ball<D>; 0] = [];
    let solid = vec![None; discretisation.velocity.node_count()];
    let space = VelocitySpace::new(discretisation, &bodies, &solid);
    StokesSystem::new(space, viscosity)
}

/// The nodes whose velocity is that of the boundary or of a body.
fn fixed_nodes<const D: usize>(space: &VelocitySpace<D>) -> Vec<bool> {
    let is_fixed = |n: usize| space.body_of(n).is_some() || space.nodes().is_on_boundary(n);
    (0..space.nodes().node_count()).into_par_iter().map(is_fixed).collect()
}

/// The unknown pressures that act on an active cell for whose index `is_meant` holds.
fn pressures_of<const D: usize>(
    system: &StokesSystem<D>,
    is_meant: impl Fn(usize) -> bool + Sync,
) -> Vec<bool> {
    let discretisation = system.discretisation();
    let mut meant = vec![false; system.pressure.dim()];
    let cells: Vec<usize> =
        (0..system.cells.len()).into_par_iter().filter(|&index| is_meant(index)).collect();
    for index in cells {
        let nodes = discretisation.pressure.cell(system.cells[index].cell as usize);
        nodes.iter().for_each(|&q| meant[q as usize] = true);
    }
    for constraint in system.pressure.constraints().iter().rev() {
        let is_meant = meant[constraint.node as usize];
        constraint.masters.iter().for_each(|m| meant[m.0 as usize] |= is_meant);
    }
    (0..meant.len()).map(|q| meant[q] && system.pressure.is_free(q)).collect()
}

/// `s_q / m_q` for the unknown pressures in `special`. Hanging nodes count as nodes of their own.
fn ratios<const D: usize>(
    elements: &Elements<'_, D>,
    matrices: &PressureMatrices,
    fixed: &[bool],
    special: &[bool],
) -> Vec<(usize, f64)> {
    let system = elements.system();
    let discretisation = system.discretisation();
    let n = ReferenceMatrices::<D>::VELOCITY;
    let m = ReferenceMatrices::<D>::PRESSURE;
    let reference = discretisation.reference();
    let around = corners_of(system, special);
    let diagonal = diagonal_near(elements, &around);
    let ratio = |row: &mut DivergenceRow<D>, (q, around): (usize, &Vec<Corner>)| {
        let mut mass = 0.0;
        for &(index, corner, weight) in around {
            let (scale, matrix) = matrices.of(index);
            mass += weight * weight * scale * matrix[corner * m + corner];
            let cell = &system.cells[index];
            let divergence = reference.divergence[corner * n..][..n].as_chunks::<D>().0;
            let nodes = discretisation.velocity.cell(cell.cell as usize);
            for (&node, divergence) in nodes.iter().zip(divergence).filter(|term| !fixed[*term.0 as usize]) {
                row.add(node, divergence.map(|b| weight * cell.divergence * b));
            }
        }
        (q, row.take_sum(&diagonal) / mass)
    };
    let around = around.par_iter().enumerate().filter(|(_, around)| !around.is_empty());
    around.map_init(DivergenceRow::default, ratio).collect()
}

/// A corner of an active cell: index of the cell, corner, and the weight with which a pressure acts there.
type Corner = (usize, usize, f64);

/// The corners of active cells on which each special pressure acts.
fn corners_of<const D: usize>(system: &StokesSystem<D>, special: &[bool]) -> Vec<Vec<Corner>> {
    let discretisation = system.discretisation();
    let pressure = pressure_expansion(&system.pressure);
    let corners = |index: usize| discretisation.pressure.cell(system.cells[index].cell as usize);
    let specials = |node: u32| pressure.terms(node as usize).iter().filter(|term| special[term.0 as usize]);
    let has_special = |index: &usize| corners(*index).iter().any(|&node| specials(node).next().is_some());
    let cells: Vec<usize> = (0..system.cells.len()).into_par_iter().filter(has_special).collect();
    let mut around = vec![Vec::new(); special.len()];
    for index in cells {
        for (corner, &node) in corners(index).iter().enumerate() {
            specials(node).for_each(|&(q, weight)| around[q as usize].push((index, corner, weight)));
        }
    }
    around
}

/// The diagonal of `A` at the nodes of these cells; elsewhere it may lack terms.
fn diagonal_near<const D: usize>(elements: &Elements<'_, D>, corners: &[Vec<Corner>]) -> Vec<f64> {
    let discretisation = elements.system().discretisation();
    let nodes_of = |index: usize| discretisation.velocity.cell(elements.cells()[index].cell as usize);
    let mut is_near = vec![false; discretisation.velocity.node_count()];
    for &(index, ..) in corners.iter().flatten() {
        nodes_of(index).iter().for_each(|&node| is_near[node as usize] = true);
    }
    let touches = |index: &usize| nodes_of(*index).iter().any(|&node| is_near[node as usize]);
    let cells: Vec<usize> = (0..elements.cells().len()).into_par_iter().filter(touches).collect();
    let cells = cells.into_iter().map(|index| {
        let (scale, own) = elements.viscous(index);
        (&elements.cells()[index], scale, own)
    });
    viscous_diagonal(discretisation, cells)
}

/// A row of `B` in nodal velocities, empty between two uses.
#[derive(Default)]
struct DivergenceRow<const D: usize> {
    place: FxHashMap<u32, usize>,
    terms: Vec<(u32, [f64; D])>,
}

impl<const D: usize> DivergenceRow<D> {
    fn add(&mut self, node: u32, divergence: [f64; D]) {
        let place = *self.place.entry(node).or_insert(self.terms.len());
        match self.terms.get_mut(place) {
            Some((_, values)) => values.iter_mut().zip(divergence).for_each(|(value, b)| *value += b),
            None => self.terms.push((node, divergence)),
        }
    }

    /// The sum of `b_k^2 / a_k` over the row, with `a` the diagonal of `A`.
    fn take_sum(&mut self, diagonal: &[f64]) -> f64 {
        self.place.clear();
        let mut sum = 0.0;
        for (node, values) in self.terms.drain(..) {
            let diagonal = &diagonal[node as usize * D..][..D];
            sum += values.iter().zip(diagonal).map(|(b, a)| b * b / a).sum::<f64>();
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::solid_nodes;

    /// The weights of a system whose fluid has this viscosity.
    fn weights_in<const D: usize>(system: &StokesSystem<D>, viscosity: f64) -> Vec<f64> {
        let elements = Elements::new(system, ReferenceMatrices::<D>::VELOCITY);
        let matrices = PressureMatrices::new(&elements, viscosity).unwrap();
        weights(&elements, &matrices)
    }

    /// Weights by the number of walls a node lies on.
    fn weights_of_a_box<const D: usize>() -> Vec<Vec<f64>> {
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 3).unwrap();
        let discretisation = Discretisation::new(mesh);
        let system = without_bodies(&discretisation, 2.5);
        let mut by_walls = vec![Vec::new(); D + 1];
        for (q, weight) in weights_in(&system, 2.5).into_iter().enumerate() {
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
    fn weights_are_less_near_bodies_only<const D: usize>() {
        let ball = Ball::new(Vector::<D>::repeat(0.5), 0.15);
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [true; D], 4, |lower, h, level| {
            let centre: Vector<D> = lower.add_scalar(0.5 * h);
            level < 3 || ((centre - Vector::repeat(0.5)).norm() - 0.15).abs() < h
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        assert!(!discretisation.pressure.constraints().is_empty());
        let solid = solid_nodes(&discretisation, &[ball], 0.0);
        let space = VelocitySpace::new(&discretisation, &[ball], &solid);
        let system = StokesSystem::new(space, 1.0);
        let weights = weights_in(&system, 1.0);
        let mut least = 1.0f64;
        for (q, &weight) in weights.iter().enumerate() {
            assert!((LEAST_WEIGHT..=1.0).contains(&weight));
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
