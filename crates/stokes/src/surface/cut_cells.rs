//! Which cells bodies cut, and the moments of those.

use gluey_fem::cut::{BallInCell, CutMoments, CutRules, FlatInCell};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::Jagged;
use rayon::prelude::*;

use super::flats::Flats;
use crate::space::Discretisation;

/// A cut cell with at least this share of fluid needs no other to be stable. Less than half the thickness of
/// the thinnest slab between two bodies in cells ([`Heights`](crate::film::Heights)): one of two cells that
/// share it is good.
const GOOD_SHARE: f64 = 0.25;
/// A cell with no more fluid than this is solid: what is left is rounding.
const LEAST_SHARE: f64 = 1e-12;
/// A cell with no more of a surface than this, in units of its faces, does not touch it.
const LEAST_AREA: f64 = 1e-12;

/// The share of a cell that bodies leave to the fluid.
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
        let rules = CutRules::new(discretisation.mesh.shear());
        let examined: Vec<(CellState, Option<u32>, Option<CutCell<D>>)> = (0..count)
            .into_par_iter()
            .with_min_len(64)
            .map(|cell| examine(discretisation, &tree, flats, &rules, cell))
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
    flats: &Flats<D>,
    rules: &CutRules<D>,
    cell: usize,
) -> (CellState, Option<u32>, Option<CutCell<D>>) {
    match near(discretisation, tree, flats, cell) {
        Near::None => (CellState::Fluid, None, None),
        Near::Covered(body) => (CellState::Solid, Some(body), None),
        Near::Cut(cutting) => {
            let moments = rules.moments(cutting.iter().map(|cut| (&cut.ball, &cut.flats[..])));
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
        if surface.area.iter().sum::<f64>() > LEAST_AREA {
            new.bodies.push(cut.body);
            new.balls.push(cut.ball);
            new.moments.surfaces.push(surface);
        }
    }
    new
}

/// A displacement in a cell, in units of its edge: in its coordinates.
pub fn in_cell<const D: usize>(shear: f64, arm: &Vector<D>) -> Vector<D> {
    let mut place = *arm;
    place[0] -= shear * arm[1];
    place
}

/// A displacement in coordinates of a cell: in space, in units of its edge.
pub fn in_space<const D: usize>(shear: f64, place: &[f64; D]) -> Vector<D> {
    let mut arm = Vector::from(*place);
    arm[0] += shear * place[1];
    arm
}

/// The least and the largest distance of the points of a cell of edge
/// `h` from one that its centre is at `arm` from. The least may be that of a box around a sheared cell.
fn distances<const D: usize>(arm: &Vector<D>, h: f64, shear: f64) -> [f64; 2] {
    let half = Vector::<D>::from_fn(|d, _| 0.5 * h * if d == 0 { 1.0 + shear.abs() } else { 1.0 });
    let nearest = Vector::<D>::from_fn(|d, _| (arm[d].abs() - half[d]).max(0.0)).norm();
    let corner = |k: usize| -> f64 {
        let side = std::array::from_fn(|d| if k >> d & 1 == 1 { 0.5 * h } else { -0.5 * h });
        (arm + in_space(shear, &side)).norm()
    };
    [nearest, (0..1 << D).map(corner).fold(0.0, f64::max)]
}

/// Bodies that cut a cell. One that only touches it does not, unless a flat of it is a face of the cell.
fn near<const D: usize>(
    discretisation: &Discretisation<D>,
    tree: &BallTree<'_, D>,
    flats: &Flats<D>,
    cell: usize,
) -> Near<D> {
    let (mesh, h) = (&discretisation.mesh, discretisation.cell_size(cell));
    let shear = mesh.shear();
    let center = mesh.lower_corner(&mesh.cells()[cell]) + Vector::repeat(0.5 * h);
    let (mut covering, mut cutting) = (None, Vec::new());
    tree.any_within(&center, mesh.half_diagonal(h), |body| {
        let ball = &tree.balls()[body];
        ball.for_each_image(&center, mesh.half_diagonal(h), |arm| {
            let [nearest, farthest] = distances(arm, h, shear);
            let in_cell = in_cell(shear, &(arm / h));
            let at = BallInCell {
                center: std::array::from_fn(|d| 0.5 - in_cell[d]),
                radius: ball.bounding_radius() / h,
            };
            let in_cell = flats.of(body).iter().map(|flat| flat.in_cell(&at, h, shear));
            let flats: Vec<FlatInCell<D>> = in_cell.filter(|flat| !flat.leaves(&at, shear)).collect();
            if farthest <= ball.bounding_radius() && flats.is_empty() {
                covering = Some(body as u32);
            } else if nearest < ball.bounding_radius() && !flats.iter().any(|flat| flat.takes(&at, shear)) {
                cutting.push(Cutting { body: body as u32, ball: at, flats });
            }
        });
        covering.is_some()
    });
    // Images of one body keep their order.
    cutting.sort_by_key(|cut| cut.body);
    match covering {
        Some(body) => Near::Covered(body),
        None if cutting.is_empty() => Near::None,
        None => Near::Cut(cutting),
    }
}
