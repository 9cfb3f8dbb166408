//! Aggregation: the unknowns of cells with little fluid are those of their roots.
//!
//! A node that belongs to no fluid or good cell takes the value there of the polynomial on the *root* of its
//! bad cell, the good cell whose centre is nearest to the centroid of the fluid in it:
//! `u_g = sum_j phi_j(x_g) u_j` (Badia, Verdugo and Martin 2018, Comput. Methods Appl. Mech. Eng. 336, 533).

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, node_count, value};
use gluey_fem::{Constraint, NodeMap};
use gluey_geom::Vector;

use super::cut_cells::{CellState, CutCell, CutCells};
use crate::error::StokesError;
use crate::space::Discretisation;

/// Rings of cells in which a root is sought.
const MOST_RINGS: i32 = 6;

/// The roots of cells with little fluid, and what follows for nodes.
#[derive(Clone, Debug)]
pub struct Aggregates {
    /// Root of each cut cell: itself if it is good. Index in the mesh.
    pub roots: Vec<u32>,
    /// Velocity nodes that take their values from roots.
    pub velocity: Vec<Constraint>,
    /// Pressure nodes that do.
    pub pressure: Vec<Constraint>,
}

impl Aggregates {
    /// The aggregates of a mesh.
    ///
    /// # Errors
    /// [`StokesError::NoRoot`] for a cell without any good one around it, [`StokesError::CoarseSurface`]
    /// where hanging nodes meet cut cells.
    ///
    /// At the rim of a part, where its root may be outside, a bad cell is its own.
    pub fn new<const D: usize>(
        discretisation: &Discretisation<D>,
        cut: &CutCells<D>,
    ) -> Result<Self, StokesError> {
        let root = |of: &CutCell<D>| match cut.states[of.cell as usize] {
            CellState::Bad => root(discretisation, cut, of)
                .or_else(|| (!discretisation.is_own(of.cell as usize)).then_some(of.cell))
                .ok_or(StokesError::NoRoot { body: of.bodies[0] as usize, share: of.moments.fraction() }),
            _ => Ok(of.cell),
        };
        let roots = cut.cells.iter().map(root).collect::<Result<Vec<u32>, _>>()?;
        let constraints = |nodes: &NodeMap<D>| constraints(discretisation, nodes, cut, &roots);
        let velocity = constraints(&discretisation.velocity)?;
        let pressure = constraints(&discretisation.pressure)?;
        Ok(Self { velocity, pressure, roots })
    }
}

/// Centroid of the fluid of a cell, in its coordinates.
fn centroid<const D: usize>(of: &CutCell<D>) -> [f64; D] {
    let mut sum = [0.0; D];
    for ((at, _), weight) in gauss_cube::<D>(POINTS).iter().zip(&of.moments.volume) {
        (0..D).for_each(|d| sum[d] += weight * at[d]);
    }
    sum.map(|x| x / of.moments.fraction())
}

/// The cell with unknowns of its own whose centre is nearest to the fluid of a bad one.
fn root<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    of: &CutCell<D>,
) -> Option<u32> {
    let (mesh, nodes) = (&discretisation.mesh, &discretisation.velocity);
    let (cell, target) = (&mesh.cells()[of.cell as usize], centroid(of));
    let is_regular = |cell: usize| nodes.cell(cell).iter().all(|&node| !nodes.is_hanging(node as usize));
    let mut best: Option<(f64, u32)> = None;
    for ring in 1..=MOST_RINGS {
        for offset in ring_offsets::<D>(ring) {
            let found = mesh.neighbour(cell, &offset).and_then(|neighbour| mesh.find(&neighbour));
            let may = |&found: &usize| cut.states[found].has_unknowns() && is_regular(found);
            let Some(found) = found.filter(may) else { continue };
            let distance: f64 = (0..D).map(|d| (0.5 + f64::from(offset[d]) - target[d]).powi(2)).sum();
            if best.is_none_or(|best| distance < best.0 - 1e-12) {
                best = Some((distance, found as u32));
            }
        }
        // Cells of the rings outside have centres farther away than this.
        let beyond = f64::from(ring) + 0.5 - target.iter().map(|x| (x - 0.5).abs()).fold(0.0, f64::max) + 0.5;
        if best.is_some_and(|best| best.0.sqrt() <= beyond) {
            break;
        }
    }
    best.map(|best| best.1)
}

/// Offsets whose largest component is `ring`.
fn ring_offsets<const D: usize>(ring: i32) -> impl Iterator<Item = [i32; D]> {
    let width = (2 * ring + 1) as usize;
    let offset = move |k: usize| std::array::from_fn(|d| (k / width.pow(d as u32) % width) as i32 - ring);
    (0..width.pow(D as u32)).map(offset).filter(move |o: &[i32; D]| o.iter().any(|x| x.abs() == ring))
}

/// The nodes that belong to bad cells only, each with the polynomial of the root of the one with the most
/// fluid.
fn constraints<const D: usize>(
    discretisation: &Discretisation<D>,
    nodes: &NodeMap<D>,
    cut: &CutCells<D>,
    roots: &[u32],
) -> Result<Vec<Constraint>, StokesError> {
    let mut free = vec![false; nodes.node_count()];
    for cell in (0..nodes.cell_count()).filter(|&cell| cut.states[cell].has_unknowns()) {
        nodes.cell(cell).iter().for_each(|&node| free[node as usize] = true);
    }
    // Cut cell of each node that takes its value from a root.
    let mut of = vec![u32::MAX; nodes.node_count()];
    for (k, cell) in cut.cells.iter().enumerate() {
        let bad = cut.states[cell.cell as usize] == CellState::Bad;
        for &node in nodes.cell(cell.cell as usize) {
            let body = cell.bodies[0] as usize;
            if nodes.is_hanging(node as usize) {
                return Err(StokesError::CoarseSurface { body });
            }
            let place = &mut of[node as usize];
            let fluid = |k: u32| cut.cells[k as usize].moments.fraction();
            let takes = bad && !free[node as usize] && !nodes.is_on_boundary(node as usize);
            if takes && (*place == u32::MAX || fluid(*place) < fluid(k as u32)) {
                *place = k as u32;
            }
        }
    }
    let ghosts = (0..of.len()).filter(|&node| of[node] != u32::MAX);
    ghosts.map(|node| constraint(discretisation, nodes, node, roots[of[node] as usize] as usize)).collect()
}

/// The value at a node of the polynomial on a cell.
fn constraint<const D: usize>(
    discretisation: &Discretisation<D>,
    nodes: &NodeMap<D>,
    node: usize,
    root: usize,
) -> Result<Constraint, StokesError> {
    let mesh = &discretisation.mesh;
    let h = discretisation.cell_size(root);
    let arm = nodes.point(node) - (mesh.lower_corner(&mesh.cells()[root]) + Vector::repeat(0.5 * h));
    let at: [f64; D] = std::array::from_fn(|d| {
        let extent = mesh.domain().extent()[d];
        let period = mesh.periodic()[d].then_some(extent);
        0.5 + gluey_levelset::nearest_image(arm[d], period) / h
    });
    let masters = nodes.cell(root).iter().enumerate();
    let weights = masters.map(|(j, &master)| (master, value::<D>(nodes.degree(), j, &at)));
    let masters: Vec<(u32, f64)> = weights.filter(|master| master.1.abs() > 1e-14).collect();
    debug_assert!(nodes.cell(root).len() == node_count::<D>(nodes.degree()));
    Ok(Constraint { node: node as u32, masters })
}
