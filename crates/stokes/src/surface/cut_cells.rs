//! Which cells bodies cut, and the moments of those.

use gluey_fem::cut::{BallInCell, CutMoments, FlatInCell};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::Jagged;
use rayon::prelude::*;

use super::flats::Flats;
use crate::space::Discretisation;

/// A cut cell with at least this share of fluid needs no other to be stable.
const GOOD_SHARE: f64 = 0.3;
/// A cell with no more fluid than this is solid: what is left is rounding.
const LEAST_SHARE: f64 = 1e-12;
/// A cell with no more of a surface than this, in units of its faces, does not touch it.
const LEAST_AREA: f64 = 1e-12;

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
    Cut(Vec<Cutting<D>>),
}

/// A body that cuts a cell, in the coordinates of the cell.
struct Cutting<const D: usize> {
    body: u32,
    ball: BallInCell<D>,
    flats: Vec<FlatInCell<D>>,
}

impl<const D: usize> CutCells<D> {
    /// The cells of a mesh that these bodies cut, which are cut flat themselves.
    pub fn new(discretisation: &Discretisation<D>, bodies: &[Ball<D>], flats: &Flats<D>) -> Self {
        debug_assert_eq!(bodies.len(), flats.body_count());
        let tree = BallTree::new(bodies);
        let count = discretisation.mesh.cell_count();
        let examined: Vec<(CellState, Option<u32>, Option<CutCell<D>>)> = (0..count)
            .into_par_iter()
            .with_min_len(64)
            .map(|cell| examine(discretisation, (&tree, flats), cell))
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
    bodies: (&BallTree<'_, D>, &Flats<D>),
    cell: usize,
) -> (CellState, Option<u32>, Option<CutCell<D>>) {
    match near(discretisation, bodies, cell) {
        Near::None => (CellState::Fluid, None, None),
        Near::Covered(body) => (CellState::Solid, Some(body), None),
        Near::Cut(cutting) => {
            let moments = CutMoments::truncated(cutting.iter().map(|cut| (&cut.ball, &cut.flats[..])));
            let state = match moments.fraction() {
                share if share <= LEAST_SHARE => return (CellState::Solid, Some(cutting[0].body), None),
                share if share < GOOD_SHARE => CellState::Bad,
                _ => CellState::Good,
            };
            let cut = with_surfaces(cell as u32, cutting, moments);
            if cut.bodies.is_empty() { (CellState::Fluid, None, None) } else { (state, None, Some(cut)) }
        }
    }
}

/// The cut cell, without bodies whose flats have taken away what would have cut it.
fn with_surfaces<const D: usize>(cell: u32, cutting: Vec<Cutting<D>>, moments: CutMoments<D>) -> CutCell<D> {
    let count = cutting.len();
    let volume = moments.volume;
    let mut new = CutCell {
        cell,
        bodies: Vec::with_capacity(count),
        balls: Vec::with_capacity(count),
        moments: CutMoments { volume, surfaces: Vec::with_capacity(count) },
    };
    for (cut, surface) in cutting.into_iter().zip(moments.surfaces) {
        if cut.flats.is_empty() || surface.area.iter().sum::<f64>() > LEAST_AREA {
            new.bodies.push(cut.body);
            new.balls.push(cut.ball);
            new.moments.surfaces.push(surface);
        }
    }
    new
}

/// Bodies that cut a cell. One that only touches it does not, unless a flat of it is a face of the cell.
fn near<const D: usize>(
    discretisation: &Discretisation<D>,
    (tree, flats): (&BallTree<'_, D>, &Flats<D>),
    cell: usize,
) -> Near<D> {
    let h = discretisation.cell_size(cell);
    let lower = discretisation.mesh.lower_corner(&discretisation.mesh.cells()[cell]);
    let center = lower + Vector::repeat(0.5 * h);
    let (mut covering, mut cutting) = (None, Vec::new());
    tree.any_within(&center, 0.5 * h * (D as f64).sqrt(), |body| {
        let ball = &tree.balls()[body];
        let arm = ball.arm(&center);
        let farthest = arm.map(|x| x.abs() + 0.5 * h).norm();
        let nearest = arm.map(|x| (x.abs() - 0.5 * h).max(0.0)).norm();
        let at = BallInCell {
            center: std::array::from_fn(|d| 0.5 - arm[d] / h),
            radius: ball.bounding_radius() / h,
        };
        let in_cell = flats.of(body).iter().map(|flat| flat.in_cell(&at, h));
        let flats: Vec<FlatInCell<D>> =
            in_cell.filter(|flat| !flat.leaves_cell() && !flat.leaves_ball(&at)).collect();
        if farthest <= ball.bounding_radius() && flats.is_empty() {
            covering = Some(body as u32);
        } else if nearest < ball.bounding_radius() && !flats.iter().any(FlatInCell::takes_cell) {
            cutting.push(Cutting { body: body as u32, ball: at, flats });
        }
        covering.is_some()
    });
    cutting.sort_unstable_by_key(|cut| cut.body);
    match covering {
        Some(body) => Near::Covered(body),
        None if cutting.is_empty() => Near::None,
        None => Near::Cut(cutting),
    }
}
