//! Which cells bodies cut, and the moments of those.

use gluey_fem::cut::{BallInCell, CutMoments};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::Jagged;
use rayon::prelude::*;

use crate::space::Discretisation;

/// A cut cell with at least this share of fluid needs no other to be stable.
const GOOD_SHARE: f64 = 0.3;
/// A cell with no more fluid than this is solid: what is left is rounding.
const LEAST_SHARE: f64 = 1e-12;

/// What bodies leave of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellState {
    /// No body cuts it.
    Fluid,
    /// Cut, with unknowns of its own.
    Good,
    /// Cut, with so little fluid that its unknowns are those of another cell.
    Bad,
    /// No fluid at all.
    Solid,
}

impl CellState {
    /// Whether the nodes of the cell are unknowns.
    pub fn has_unknowns(self) -> bool {
        matches!(self, Self::Fluid | Self::Good)
    }
}

/// A cut cell.
#[derive(Clone, Debug)]
pub struct CutCell<const D: usize> {
    /// Index in the mesh.
    pub cell: u32,
    /// The bodies that cut it, ascending.
    pub bodies: Vec<u32>,
    /// The bodies in the coordinates of the cell.
    pub balls: Vec<BallInCell<D>>,
    /// Integrals over the fluid and the surfaces.
    pub moments: CutMoments<D>,
}

/// The cut cells of a mesh.
#[derive(Clone, Debug)]
pub struct CutCells<const D: usize> {
    /// State of every cell.
    pub states: Vec<CellState>,
    /// The body around or nearest to each solid cell.
    pub solid_body: Vec<(u32, u32)>,
    /// The cut cells, in the order of the mesh.
    pub cells: Vec<CutCell<D>>,
    /// Place of each cell of the mesh in `cells`, or `u32::MAX`.
    pub place: Vec<u32>,
}

/// The bodies near a cell, which is solid if one of them covers it.
enum Near<const D: usize> {
    None,
    Covered(u32),
    Cut(Vec<u32>, Vec<BallInCell<D>>),
}

impl<const D: usize> CutCells<D> {
    /// The cells of a mesh that these bodies cut.
    pub fn new(discretisation: &Discretisation<D>, bodies: &[Ball<D>]) -> Self {
        let tree = BallTree::new(bodies);
        let count = discretisation.mesh.cell_count();
        let examined: Vec<(CellState, Option<u32>, Option<CutCell<D>>)> = (0..count)
            .into_par_iter()
            .with_min_len(64)
            .map(|cell| examine(discretisation, &tree, cell))
            .collect();
        let mut new = Self {
            states: Vec::with_capacity(count),
            solid_body: Vec::new(),
            cells: Vec::new(),
            place: vec![u32::MAX; count],
        };
        for (cell, (state, body, cut)) in examined.into_iter().enumerate() {
            new.states.push(state);
            new.solid_body.extend(body.map(|body| (cell as u32, body)));
            if let Some(cut) = cut {
                new.place[cell] = new.cells.len() as u32;
                new.cells.push(cut);
            }
        }
        new
    }

    /// The cut cell with this index in the mesh.
    pub fn cut(&self, cell: usize) -> Option<&CutCell<D>> {
        self.cells.get(self.place[cell] as usize)
    }

    /// Cells and bodies of all pieces, a piece for each body that cuts a cell: place of the cut cell, place
    /// of the body in it.
    pub fn pieces(&self) -> Jagged<(u32, u32)> {
        let of = |(k, cell): (usize, &CutCell<D>)| (0..cell.bodies.len()).map(move |s| (k as u32, s as u32));
        self.cells.iter().enumerate().map(of).collect()
    }
}

fn examine<const D: usize>(
    discretisation: &Discretisation<D>,
    tree: &BallTree<'_, D>,
    cell: usize,
) -> (CellState, Option<u32>, Option<CutCell<D>>) {
    match near(discretisation, tree, cell) {
        Near::None => (CellState::Fluid, None, None),
        Near::Covered(body) => (CellState::Solid, Some(body), None),
        Near::Cut(bodies, balls) => {
            let moments = CutMoments::new(&balls);
            let state = match moments.fraction() {
                share if share <= LEAST_SHARE => return (CellState::Solid, Some(bodies[0]), None),
                share if share < GOOD_SHARE => CellState::Bad,
                _ => CellState::Good,
            };
            (state, None, Some(CutCell { cell: cell as u32, bodies, balls, moments }))
        }
    }
}

/// Bodies that cut a cell. One that only touches it does not.
fn near<const D: usize>(discretisation: &Discretisation<D>, tree: &BallTree<'_, D>, cell: usize) -> Near<D> {
    let h = discretisation.cell_size(cell);
    let lower = discretisation.mesh.lower_corner(&discretisation.mesh.cells()[cell]);
    let center = lower + Vector::repeat(0.5 * h);
    let (mut covering, mut cutting) = (None, Vec::new());
    tree.any_within(&center, 0.5 * h * (D as f64).sqrt(), |body| {
        let ball = &tree.balls()[body];
        let arm = ball.arm(&center);
        let farthest = arm.map(|x| x.abs() + 0.5 * h).norm();
        let nearest = arm.map(|x| (x.abs() - 0.5 * h).max(0.0)).norm();
        if farthest <= ball.bounding_radius() {
            covering = Some(body as u32);
        } else if nearest < ball.bounding_radius() {
            let at = BallInCell {
                center: std::array::from_fn(|d| 0.5 - arm[d] / h),
                radius: ball.bounding_radius() / h,
            };
            cutting.push((body as u32, at));
        }
        covering.is_some()
    });
    cutting.sort_unstable_by_key(|cut| cut.0);
    match covering {
        Some(body) => Near::Covered(body),
        None if cutting.is_empty() => Near::None,
        None => {
            let (bodies, balls) = cutting.into_iter().unzip();
            Near::Cut(bodies, balls)
        }
    }
}
