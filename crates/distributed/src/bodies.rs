//! The bodies as a rank knows them: all of them, and those near its part of a level. The twist of a body
//! belongs to the rank in whose run its centre lies.

use gluey_fem::{Cell, Cuts, ImplicitTree, Part};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::Ranks;

/// Cells between a part and the bodies that it has to know: a film with one of them may reach into it.
const MARGIN: f64 = 3.0;

/// Numbers of a rigid motion.
pub const fn rigid<const D: usize>() -> usize {
    D + D * (D - 1) / 2
}

/// What all ranks know: each other, where the order of cells is cut, the bodies.
#[derive(Clone, Copy)]
pub struct Shared<'a, 'b, const D: usize> {
    pub cuts: &'b Cuts,
    pub ranks: &'a Ranks,
    pub bodies: &'b BallTree<'b, D>,
    /// Which bodies have motions that are given; no entries where all are free.
    pub held: &'b [bool],
}

impl<const D: usize> Shared<'_, '_, D> {
    /// The rank whose run holds the centre of a body.
    pub fn owner(&self, tree: &ImplicitTree<'_, D>, body: &Ball<D>) -> usize {
        self.owner_of_point(tree, body.center())
    }

    /// The rank whose run holds a point, or what is nearest to it in the box.
    pub fn owner_of_point(&self, tree: &ImplicitTree<'_, D>, point: &Vector<D>) -> usize {
        let (frame, level) = (tree.frame(), tree.max_level());
        let (arm, h) = (point - frame.domain().lower, frame.size(level));
        let coords = std::array::from_fn(|d| {
            let count = i64::from(frame.roots()[d]) << level;
            let cell = (arm[d] / h).floor() as i64;
            let wrapped = if frame.periodic()[d] { cell.rem_euclid(count) } else { cell };
            wrapped.clamp(0, count - 1) as u32
        });
        self.cuts.owner(tree.key(&Cell { level, coords }))
    }
}

/// The bodies near the part of a rank.
pub struct NearBodies<const D: usize> {
    /// Their numbers among all bodies, ascending.
    pub ids: Vec<u32>,
    pub balls: Vec<Ball<D>>,
    /// The ranks that own their twists.
    pub owners: Vec<usize>,
}

impl<const D: usize> NearBodies<D> {
    pub fn new(tree: &ImplicitTree<'_, D>, shared: &Shared<'_, '_, D>, part: &Part<D>) -> Self {
        let (mesh, all) = (&part.mesh, shared.bodies);
        let mut is_near = vec![false; all.balls().len()];
        for cell in mesh.cells() {
            let h = mesh.size(cell.level);
            let center = mesh.lower_corner(cell) + Vector::repeat(0.5 * h);
            all.any_within(&center, mesh.half_diagonal(h) + MARGIN * h, |body| {
                is_near[body] = true;
                false
            });
        }
        let ids: Vec<u32> = (0..is_near.len() as u32).filter(|&id| is_near[id as usize]).collect();
        let balls: Vec<Ball<D>> = ids.iter().map(|&id| all.balls()[id as usize]).collect();
        let owners = balls.iter().map(|ball| shared.owner(tree, ball)).collect();
        Self { ids, balls, owners }
    }

    /// The bodies whose twists belong to this rank, by their places.
    pub fn owned(&self, rank: usize) -> Vec<u32> {
        (0..self.ids.len() as u32).filter(|&place| self.owners[place as usize] == rank).collect()
    }
}
