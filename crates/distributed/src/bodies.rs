//! Bodies on a level: which nodes move with them, and the rows of twists that ranks share.
//!
//! A node inside a body takes part in its motion, `u = U + w x r`; in a vector twists follow the velocities
//! of nodes, spins times the radius. A twist belongs to the rank in whose run the centre of the body lies.
//! Ranks with nodes of the body keep a copy, and what they have of its rows is added up by the owner.

use gluey_fem::cells::RigidNode;
use gluey_fem::{Cell, Cuts, ImplicitTree, Part};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::Scalar;
use gluey_parallel::{Communicator, GhostPlan, Ranks, Wanted};
use nalgebra::DMatrix;

use crate::space::Nodes;

/// Stands for no body.
const NO_BODY: u32 = u32::MAX;
/// Numbers of a rigid motion in any dimension, at most.
const MOST_RIGID: usize = 6;
/// Largest condition of the positions of nodes that define a rigid motion.
const WORST_CONDITION: f64 = 1e6;

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
    /// Nodes with a level set of at least this many cells are rigid.
    pub offset: f64,
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

/// The bodies that a rank owns or has nodes of.
pub struct LevelBodies<const D: usize> {
    /// Their numbers among all bodies: owned ones, then others, each in ascending order.
    pub ids: Vec<u32>,
    pub owned: usize,
    /// Nodes that move with bodies, which stand here by their place in `ids`: those that inner cells depend
    /// on, in ascending order.
    pub nodes: Vec<RigidNode<f64, D>>,
    /// Body of each node of the part, or [`NO_BODY`].
    body_of: Vec<u32>,
    /// Inverse of `sum R^T R` over the nodes of each body, row by row; zero for a body that has too few nodes
    /// to be rigid, whose nodes are free.
    fits: Vec<f64>,
    /// Of those in `nodes`.
    pub plan: GhostPlan,
    /// Whether the motion of each is given: zero in vectors.
    is_held: Vec<bool>,
}

impl<const D: usize> LevelBodies<D> {
    /// All ranks call this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        part: &Part<D>,
        velocity: &Nodes<D>,
    ) -> Self {
        let marks = solid_nodes(tree, shared, part, velocity);
        let (ids, owned, wide) = numbered(tree, shared, &marks);
        let number = |id: u32| {
            let (own, others) = ids.split_at(owned);
            own.binary_search(&id).or_else(|_| others.binary_search(&id).map(|k| owned + k))
        };
        let rigid_node = |(node, &id): (usize, &u32)| {
            let ball = shared.bodies.balls().get(id as usize)?;
            let arm = ball.arm(&velocity.map.point(node)) / ball.bounding_radius();
            Some(RigidNode { node: node as u32, body: number(id).ok()? as u32, arm: arm.into() })
        };
        let mut nodes: Vec<RigidNode<f64, D>> = marks.iter().enumerate().filter_map(rigid_node).collect();
        let fits = fits(shared.ranks, &wide, &nodes, &velocity.owned, (ids.len(), owned));
        nodes.retain(|rigid| fits[rigid.body as usize * rigid_square::<D>()] > 0.0);
        let mut body_of = vec![NO_BODY; velocity.map.node_count()];
        nodes.iter().for_each(|rigid| body_of[rigid.node as usize] = rigid.body);
        let needed = velocity.needed(part);
        nodes.retain(|rigid| needed[rigid.node as usize]);
        let mut has_nodes = vec![false; ids.len()];
        nodes.iter().for_each(|rigid| has_nodes[rigid.body as usize] = true);
        let plan = wide.restricted(shared.ranks, |body| has_nodes[body as usize]);
        let is_held = ids.iter().map(|&id| shared.held.get(id as usize) == Some(&true)).collect();
        Self { ids, owned, nodes, body_of, fits, plan, is_held }
    }

    /// The body a node moves with, by its place in `ids`.
    pub fn body_of(&self, node: usize) -> Option<u32> {
        Some(self.body_of[node]).filter(|&body| body != NO_BODY)
    }

    /// Whether the motion of a body is given.
    pub fn is_held(&self, body: usize) -> bool {
        self.is_held[body]
    }

    /// Whether a body has enough nodes on this level to be rigid.
    pub fn is_active(&self, body: usize) -> bool {
        self.fits[body * rigid_square::<D>()] > 0.0
    }

    /// Length of the twists in a vector at all nodes of the part.
    pub fn dim(&self) -> usize {
        self.ids.len() * rigid::<D>()
    }

    /// Length of the owned twists.
    pub fn owned_dim(&self) -> usize {
        self.owned * rigid::<D>()
    }

    /// Whether cells with these nodes move as one body.
    pub fn is_rigid(&self, nodes: &[u32]) -> bool {
        let first = nodes.first().map_or(NO_BODY, |&node| self.body_of[node as usize]);
        first != NO_BODY && nodes.iter().all(|&node| self.body_of[node as usize] == first)
    }

    /// Sets the velocities of rigid nodes from the twists.
    pub fn expand<T: Scalar>(&self, nodal: &mut [T], twists: &[T]) {
        let n = rigid::<D>();
        for rigid in &self.nodes {
            let velocity = velocity_of(rigid, &twists[rigid.body as usize * n..][..n]);
            nodal[rigid.node as usize * D..][..D].copy_from_slice(&velocity);
        }
    }

    /// Moves the loads on rigid nodes to the rows of the twists, which are overwritten.
    pub fn reduce<T: Scalar>(&self, nodal: &mut [T], loads: &mut [T]) {
        let n = rigid::<D>();
        loads.fill(T::ZERO);
        for rigid in &self.nodes {
            let load = &mut nodal[rigid.node as usize * D..][..D];
            add_moment(rigid, load, &mut loads[rigid.body as usize * n..][..n]);
            load.fill(T::ZERO);
        }
    }

    /// From the sums `R^T u` over the nodes of the owned bodies to the twists that are closest to `u`, or
    /// zero where motions are given.
    pub fn fit<T: Scalar>(&self, owned: &mut [T]) {
        let n = rigid::<D>();
        let all = owned.chunks_exact_mut(n).zip(self.fits.chunks_exact(n * n)).zip(&self.is_held);
        for ((sums, inverse), &is_held) in all {
            if is_held {
                sums.fill(T::ZERO);
                continue;
            }
            let before: [f64; MOST_RIGID] =
                std::array::from_fn(|k| sums.get(k).map_or(0.0, |sum| sum.to_f64()));
            for (sum, row) in sums.iter_mut().zip(inverse.chunks_exact(n)) {
                *sum = T::from_f64(row.iter().zip(before).map(|(m, sum)| m * sum).sum());
            }
        }
    }
}

/// Velocity of a node that moves with a body.
pub fn velocity_of<T: Scalar, const D: usize>(rigid: &RigidNode<f64, D>, twist: &[T]) -> [T; D] {
    let mut velocity = [T::ZERO; 4];
    narrow(rigid).set_velocity(twist, &mut velocity);
    std::array::from_fn(|c| velocity[c])
}

/// Adds force and moment of the load on a node.
pub fn add_moment<T: Scalar, const D: usize>(rigid: &RigidNode<f64, D>, load: &[T], sums: &mut [T]) {
    narrow(rigid).add_moment(&std::array::from_fn(|c| load[c]), sums);
}

fn narrow<T: Scalar, const D: usize>(rigid: &RigidNode<f64, D>) -> RigidNode<T, D> {
    RigidNode { node: rigid.node, body: rigid.body, arm: rigid.arm.map(T::from_f64) }
}

/// The `D x RIGID` matrix of a rigid node, row by row.
pub fn rows<const D: usize>(rigid_node: &RigidNode<f64, D>) -> Vec<f64> {
    let n = rigid::<D>();
    let mut rows = vec![0.0; D * n];
    for k in 0..n {
        let mut unit = [0.0; MOST_RIGID];
        unit[k] = 1.0;
        let velocity = velocity_of(rigid_node, &unit[..n]);
        (0..D).for_each(|c| rows[c * n + k] = velocity[c]);
    }
    rows
}

const fn rigid_square<const D: usize>() -> usize {
    rigid::<D>() * rigid::<D>()
}

/// The body that each node of the part moves with, by its number among all: the one whose level set is
/// largest there, if it is at least `offset h` for the size `h` of the smallest cell at the node.
fn solid_nodes<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    part: &Part<D>,
    velocity: &Nodes<D>,
) -> Vec<u32> {
    let (mesh, map) = (&part.mesh, &velocity.map);
    let mut finest = vec![0; map.node_count()];
    for (index, cell) in mesh.cells().iter().enumerate() {
        map.cell(index).iter().for_each(|&n| finest[n as usize] = cell.level.max(finest[n as usize]));
    }
    // Of the others the part may lack the smallest cell.
    let mut is_surrounded = vec![false; map.node_count()];
    map.cells(part.inner()).iter().for_each(|&node| is_surrounded[node as usize] = true);
    let mut at = |node: usize| {
        if map.is_on_boundary(node) || map.is_hanging(node) {
            return None;
        }
        let point: Vector<D> = map.point(node);
        let reach = |level: u8| -shared.offset * mesh.size(level);
        let farthest = if is_surrounded[node] { reach(finest[node]) } else { reach(finest[node]).max(0.0) };
        let found = shared.bodies.nearest_within(&point, farthest)?;
        if is_surrounded[node] {
            return Some(found.0 as u32);
        }
        let level = tree.finest_touching(mesh.max_level(), 2, map.lattice_point(node));
        shared.bodies.nearest_within(&point, reach(level)).map(|found| found.0 as u32)
    };
    (0..map.node_count()).map(|node| at(node).unwrap_or(NO_BODY)).collect()
}

/// The bodies that this rank owns or that are marked, the number of the former, and the plan of the others.
fn numbered<const D: usize>(
    tree: &ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    marks: &[u32],
) -> (Vec<u32>, usize, GhostPlan) {
    let owners: Vec<usize> = shared.bodies.balls().iter().map(|ball| shared.owner(tree, ball)).collect();
    let rank = shared.ranks.rank();
    let mut others: Vec<u32> =
        marks.iter().copied().filter(|&id| id != NO_BODY && owners[id as usize] != rank).collect();
    others.sort_unstable();
    others.dedup();
    let own = (0..owners.len() as u32).filter(|&id| owners[id as usize] == rank);
    let mut ids: Vec<u32> = own.collect();
    let owned = ids.len();
    let ghost = |(k, &id): (usize, &u32)| Wanted {
        owner: owners[id as usize],
        key: u64::from(id),
        place: (owned + k) as u32,
    };
    let wanted = others.iter().enumerate().map(ghost).collect();
    let plan = GhostPlan::new(shared.ranks, wanted, |key| {
        ids.binary_search(&(key as u32)).ok().map(|place| place as u32)
    });
    ids.extend(others);
    (ids, owned, plan)
}

/// Inverses of `sum R^T R`, at owners and ghosts.
fn fits<const D: usize>(
    ranks: &Ranks,
    plan: &GhostPlan,
    nodes: &[RigidNode<f64, D>],
    owned_nodes: &std::ops::Range<usize>,
    (count, owned): (usize, usize),
) -> Vec<f64> {
    let (n, size) = (rigid::<D>(), rigid_square::<D>());
    let mut grams = vec![0.0; count * size];
    for rigid in nodes.iter().filter(|rigid| owned_nodes.contains(&(rigid.node as usize))) {
        let rows = rows(rigid);
        let gram = &mut grams[rigid.body as usize * size..][..size];
        for row in rows.chunks_exact(n) {
            (0..size).for_each(|k| gram[k] += row[k / n] * row[k % n]);
        }
    }
    let mut plan = GhostPlan::joined(&[(plan, size, 0)]);
    plan.accumulate::<f64, 1>(ranks, &mut grams);
    for gram in grams[..owned * size].chunks_exact_mut(size) {
        let inverse = inverse_of_gram(n, gram);
        gram.copy_from_slice(&inverse.unwrap_or_else(|| vec![0.0; size]));
    }
    plan.update::<f64, 1>(ranks, &mut grams);
    grams
}

/// Inverse of a symmetric matrix whose conditioning tells whether the nodes define a rigid motion.
fn inverse_of_gram(n: usize, gram: &[f64]) -> Option<Vec<f64>> {
    let matrix = DMatrix::from_row_slice(n, n, gram);
    let eigen = matrix.clone().symmetric_eigen().eigenvalues;
    let (least, most) = (eigen.min(), eigen.max());
    if !(least > 0.0 && most / least < WORST_CONDITION) {
        return None;
    }
    matrix.cholesky().map(|factor| factor.inverse().as_slice().to_vec())
}
