//! Velocities that are rigid inside bodies, zero on the boundary and continuous across hanging nodes.
//!
//! A reduced vector holds the nodal velocities (`D` interleaved components; entries of hanging, boundary and
//! rigid nodes are zero) and, after them, `RIGID` numbers per body: the velocity `U` of its reference point
//! and its spin times its radius, `s w`. [`VelocitySpace::expand`] is the map `T` of `u = T (u_fluid, U, w)`;
//! a rigid node at `r` from the reference point gets `U + w x r`. [`VelocitySpace::reduce`] is its transpose:
//! it turns nodal loads into loads on free nodes, forces and (scaled) torques.

mod rigid;
mod twists;

use gluey_fem::cells;
use gluey_fem::{Constraint, NodeMap};
use gluey_geom::{Dim, Vector};
use gluey_levelset::Body;
use gluey_linalg::Scalar;
use gluey_parallel::Halo;

use super::discretisation::Discretisation;
use rigid::{RigidNode, add_moment, gram_inverses, rigid_matrix, rigid_nodes, rotation_entry};

/// The body, if any, that each node moves with.
pub type SolidNodes = Vec<Option<u32>>;

const NO_BODY: u32 = u32::MAX;
/// Numbers of a rigid motion in any dimension, at most.
const MOST_RIGID: usize = 6;

/// The reduced velocity space of one mesh.
#[derive(Clone, Debug)]
pub struct VelocitySpace<const D: usize> {
    discretisation: Discretisation<D>,
    boundary: Vec<u32>,
    rigid: Vec<RigidNode<D>>,
    /// Body of each node, or [`NO_BODY`].
    body_of: Vec<u32>,
    radius: Vec<f64>,
    /// Inverse of `R^T R` over the rigid nodes of each body, row-major; `None` for a body without enough
    /// nodes.
    fit: Vec<Option<Vec<f64>>>,
    /// Nodes that take their values from others near a surface, where the mesh does not fit the bodies.
    ghosts: Vec<Constraint>,
    is_ghost: Vec<bool>,
    /// Whether bodies are coupled to the fluid through their surfaces: then no node has to be rigid.
    by_surface: bool,
    /// See [`VelocitySpace::hold`]; of the bodies here and of all, empty where none is held.
    held: Vec<bool>,
    held_of_all: Vec<bool>,
    /// Of reduced vectors, and of a square matrix for each twist.
    halos: [Halo; 2],
}

impl<const D: usize> VelocitySpace<D> {
    /// The space in which the nodes named in `solid` move with `bodies`. A body with too few nodes to define
    /// a rigid motion is left out: its nodes stay free, see [`VelocitySpace::is_active`]. On a part of a mesh
    /// all ranks call this, with the bodies near their parts.
    pub fn new<B: Body<D>>(discretisation: &Discretisation<D>, bodies: &[B], solid: &[Option<u32>]) -> Self {
        let halos = discretisation.partition().map(|part| part.halos(solid));
        Self::with_halos(discretisation, bodies, solid, halos.unwrap_or_default())
    }

    fn with_halos<B: Body<D>>(
        discretisation: &Discretisation<D>,
        bodies: &[B],
        solid: &[Option<u32>],
        mut halos: [Halo; 2],
    ) -> Self {
        let nodes = &discretisation.velocity;
        let boundary = (0..nodes.node_count() as u32).filter(|&n| nodes.is_on_boundary(n as usize)).collect();
        let rigid = rigid_nodes(nodes, bodies, solid);
        let own = if halos[0].is_empty() { 0..nodes.node_count() } else { discretisation.own_nodes() };
        let mut space = Self {
            body_of: vec![NO_BODY; nodes.node_count()],
            discretisation: discretisation.clone(),
            boundary,
            radius: bodies.iter().map(|b| b.bounding_radius()).collect(),
            fit: gram_inverses(bodies.len(), &rigid, &own, &mut halos[1]),
            rigid,
            ghosts: Vec::new(),
            is_ghost: vec![false; nodes.node_count()],
            by_surface: false,
            held: Vec::new(),
            held_of_all: Vec::new(),
            halos,
        };
        let fit = &space.fit;
        space.rigid.retain(|r| fit[r.body as usize].is_some());
        space.mark_rigid();
        space
    }

    /// The space around bodies that are coupled to the fluid through their surfaces: nodes without fluid
    /// around them, named in `solid`, move with their bodies, and `ghosts` take their values from others.
    pub fn around_surfaces<B: Body<D>>(
        discretisation: &Discretisation<D>,
        bodies: &[B],
        solid: &[Option<u32>],
        ghosts: Vec<Constraint>,
    ) -> Self {
        let mut space = Self::with_halos(discretisation, bodies, solid, <[Halo; 2]>::default());
        space.rigid = rigid_nodes(space.nodes(), bodies, solid);
        space.mark_rigid();
        ghosts.iter().for_each(|ghost| space.is_ghost[ghost.node as usize] = true);
        Self { ghosts, by_surface: true, ..space }
    }

    fn mark_rigid(&mut self) {
        for r in &self.rigid {
            self.body_of[r.node as usize] = r.body;
        }
    }

    /// Nodes that take their values from others near a surface.
    pub fn ghosts(&self) -> &[Constraint] {
        &self.ghosts
    }

    /// Whether bodies are coupled to the fluid through their surfaces.
    pub fn is_by_surface(&self) -> bool {
        self.by_surface
    }

    /// The nodes.
    pub fn nodes(&self) -> &NodeMap<D> {
        &self.discretisation.velocity
    }

    /// The mesh with its nodes.
    pub fn discretisation(&self) -> &Discretisation<D> {
        &self.discretisation
    }

    /// The halo of reduced vectors: nothing on one rank, and around surfaces.
    pub fn halo(&self) -> &Halo {
        &self.halos[0]
    }

    /// The halo of a square matrix for each twist, row by row.
    pub fn halo_of_twist_blocks(&self) -> &Halo {
        &self.halos[1]
    }

    /// The same unknowns as those of one rank, where this one holds the whole mesh.
    pub fn whole(&self) -> Option<Self> {
        let is_whole = self.discretisation.partition().is_none_or(|part| part.is_whole);
        let alone = || Self {
            discretisation: self.discretisation.alone(),
            halos: Default::default(),
            ..self.clone()
        };
        is_whole.then(alone)
    }

    /// Brings the marks of owned nodes to the ghosts of free ones, and takes those of all others away:
    /// nothing on one rank.
    pub fn share_marks(&self, marks: &mut [bool]) {
        if self.halos[0].is_empty() {
            return;
        }
        let (mut halo, mut numbers) = (self.halos[0].clone(), self.numbers(marks));
        halo.clear(&mut numbers);
        halo.update(&mut numbers);
        marks.iter_mut().zip(numbers.chunks_exact(D)).for_each(|(mark, numbers)| *mark = numbers[0] > 0.0);
    }

    /// Marks the free nodes that any rank has marked: nothing on one rank.
    pub fn join_marks(&self, marks: &mut [bool]) {
        if self.halos[0].is_empty() {
            return;
        }
        let (mut halo, mut numbers) = (self.halos[0].clone(), self.numbers(marks));
        halo.sum(&mut numbers);
        marks.iter_mut().zip(numbers.chunks_exact(D)).for_each(|(mark, numbers)| *mark |= numbers[0] > 0.0);
    }

    /// Reduced velocities whose first component is one at marked nodes.
    fn numbers(&self, marks: &[bool]) -> Vec<f32> {
        let mut numbers = vec![0f32; self.dim()];
        let first = numbers.chunks_exact_mut(D).zip(marks);
        first.for_each(|(numbers, &is_marked)| numbers[0] = f32::from(u8::from(is_marked)));
        numbers
    }

    /// Whether anything fixes a constant velocity: a wall, or bodies that are held.
    pub fn is_anchored(&self) -> bool {
        let holds_nodes = || self.rigid.iter().any(|r| self.is_held(r.body as usize));
        let holds = self.holds_any() && (self.by_surface || holds_nodes());
        holds || self.discretisation.mesh.periodic().contains(&false)
    }

    /// Number of bodies, active or not.
    pub fn body_count(&self) -> usize {
        self.fit.len()
    }

    /// Whether the body has enough nodes on this mesh to be rigid.
    pub fn is_active(&self, body: usize) -> bool {
        self.by_surface || self.fit[body].is_some()
    }

    /// Length of a reduced vector.
    pub fn dim(&self) -> usize {
        self.full_dim() + self.body_count() * Dim::<D>::RIGID
    }

    /// Length of the nodal part.
    pub fn full_dim(&self) -> usize {
        self.nodes().node_count() * D
    }

    /// Radius of a body.
    pub fn radius(&self, body: usize) -> f64 {
        self.radius[body]
    }

    /// The body a node moves with.
    pub fn body_of(&self, node: usize) -> Option<u32> {
        Some(self.body_of[node]).filter(|&body| body != NO_BODY)
    }

    /// Whether the velocity of a node is an unknown of its own.
    pub fn is_free(&self, node: usize) -> bool {
        let follows = self.is_ghost[node] || self.nodes().is_hanging(node);
        self.body_of[node] == NO_BODY && !self.nodes().is_on_boundary(node) && !follows
    }

    /// `u = T x` in place: sets the nodal velocities of rigid and hanging nodes; those of the boundary stay
    /// as they are.
    pub fn expand<T: Scalar>(&self, x: &mut [T]) {
        let (nodal, twists) = x.split_at_mut(self.full_dim());
        for r in &self.rigid {
            let twist = &twists[r.body as usize * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
            let target = &mut nodal[r.node as usize * D..][..D];
            for (c, value) in target.iter_mut().enumerate() {
                *value = twist[c] + rotation_entry(&r.arm, c, &twist[D..]);
            }
        }
        self.nodes().distribute(D, T::from_f64, nodal);
        for ghost in &self.ghosts {
            let mut sum = [T::ZERO; D];
            for &(master, weight) in &ghost.masters {
                let from = &nodal[master as usize * D..][..D];
                (0..D).for_each(|c| sum[c] += T::from_f64(weight) * from[c]);
            }
            nodal[ghost.node as usize * D..][..D].copy_from_slice(&sum);
        }
    }

    /// Adds the rigid motions of a reduced vector to the velocities `u` of the rigid nodes, as exact as these
    /// are.
    pub fn add_rigid_motions<S: Scalar, T: Scalar>(&self, x: &[S], u: &mut [T]) {
        let twists = &x[self.full_dim()..];
        for r in &self.rigid {
            let entries = &twists[r.body as usize * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
            let twist: [T; MOST_RIGID] =
                std::array::from_fn(|k| T::from_f64(entries.get(k).map_or(0.0, |entry| entry.to_f64())));
            for (c, value) in u[r.node as usize * D..][..D].iter_mut().enumerate() {
                *value += twist[c] + rotation_entry(&r.arm, c, &twist[D..]);
            }
        }
    }

    /// `x = T^T f` in place: nodal loads become loads on the unknowns; all other nodal entries are set to
    /// zero.
    pub fn reduce<T: Scalar>(&self, f: &mut [T]) {
        let (nodal, loads) = f.split_at_mut(self.full_dim());
        loads.fill(T::ZERO);
        for ghost in &self.ghosts {
            let load: [T; D] =
                std::array::from_fn(|c| std::mem::replace(&mut nodal[ghost.node as usize * D + c], T::ZERO));
            for &(master, weight) in &ghost.masters {
                let to = &mut nodal[master as usize * D..][..D];
                (0..D).for_each(|c| to[c] += T::from_f64(weight) * load[c]);
            }
        }
        self.nodes().condense(D, T::from_f64, nodal);
        for r in &self.rigid {
            let load = &mut loads[r.body as usize * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
            let source = &mut nodal[r.node as usize * D..][..D];
            add_moment(&r.arm, source, load);
            source.fill(T::ZERO);
        }
        for &node in &self.boundary {
            nodal[node as usize * D..][..D].fill(T::ZERO);
        }
    }

    /// Appends the load of a force on a node that neither hangs nor is a ghost, as entries of a reduced
    /// vector; none on the boundary.
    pub fn push_load(&self, node: usize, force: &Vector<D>, entries: &mut Vec<(u32, f64)>) {
        if self.is_free(node) {
            return entries.extend((0..D).map(|c| ((node * D + c) as u32, force[c])));
        }
        let Ok(place) = self.rigid.binary_search_by_key(&(node as u32), |r| r.node) else { return };
        let RigidNode { body, arm, .. } = &self.rigid[place];
        let mut load = [0.0; MOST_RIGID];
        add_moment(arm, force.as_slice(), &mut load[..Dim::<D>::RIGID]);
        let first = self.full_dim() + *body as usize * Dim::<D>::RIGID;
        entries.extend((0..Dim::<D>::RIGID).map(|k| ((first + k) as u32, load[k])));
    }

    /// Replaces the nodal velocities of the rigid nodes by the twists closest to them in the least-squares
    /// sense, and clears hanging and boundary nodes and ghosts: from any nodal field to a reduced vector.
    pub fn project<T: Scalar>(&self, x: &mut [T]) {
        self.begin_projection(x);
        self.end_projection(x);
    }

    /// The first half of [`VelocitySpace::project`], on owned nodes, before sums over ranks.
    pub fn begin_projection<T: Scalar>(&self, x: &mut [T]) {
        for constraint in self.nodes().constraints().iter().chain(&self.ghosts) {
            x[constraint.node as usize * D..][..D].fill(T::ZERO);
        }
        self.reduce(x);
    }

    /// The second half of [`VelocitySpace::project`].
    pub fn end_projection<T: Scalar>(&self, x: &mut [T]) {
        self.solve_grams(&mut x[self.full_dim()..]);
    }

    /// The transpose of [`VelocitySpace::project`] for fields without load on hanging nodes: spreads the load
    /// on twists over the rigid nodes.
    pub fn spread<T: Scalar>(&self, f: &mut [T]) {
        let (nodal, loads) = f.split_at_mut(self.full_dim());
        self.solve_grams(loads);
        for r in &self.rigid {
            let twist = &loads[r.body as usize * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
            for (c, value) in nodal[r.node as usize * D..][..D].iter_mut().enumerate() {
                *value = twist[c] + rotation_entry(&r.arm, c, &twist[D..]);
            }
        }
    }

    /// The velocity of a rigid node as a linear form of its body's entries: `(body, rows)`, one row of
    /// `RIGID` coefficients per component.
    pub fn rigid_rows(&self) -> impl Iterator<Item = (u32, u32, Vec<f64>)> + '_ {
        self.rigid.iter().map(|r| (r.node, r.body, rigid_matrix(&r.arm)))
    }

    /// The rigid nodes, for the operators.
    pub fn ties(&self) -> Vec<cells::RigidNode<f64, D>> {
        let tie = |r: &RigidNode<D>| cells::RigidNode {
            node: r.node,
            body: r.body,
            arm: std::array::from_fn(|d| r.arm[d]),
        };
        self.rigid.iter().map(tie).collect()
    }

    fn solve_grams<T: Scalar>(&self, loads: &mut [T]) {
        let n = Dim::<D>::RIGID;
        for (body, (load, inverse)) in loads.chunks_exact_mut(n).zip(&self.fit).enumerate() {
            if self.is_held(body) {
                load.fill(T::ZERO);
                continue;
            }
            let old: [f64; MOST_RIGID] = std::array::from_fn(|k| if k < n { load[k].to_f64() } else { 0.0 });
            for (i, value) in load.iter_mut().enumerate() {
                let row = |m: &Vec<f64>| (0..n).map(|j| m[i * n + j] * old[j]).sum::<f64>();
                *value = T::from_f64(inverse.as_ref().map_or(0.0, row));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_fem::TreeMesh;
    use gluey_geom::Aabb;
    use gluey_levelset::{Ball, nearest};

    pub(super) fn space<const D: usize>() -> VelocitySpace<D> {
        let (discretisation, balls, solid) = around_two_balls();
        VelocitySpace::new(&discretisation, &balls, &solid)
    }

    fn around_two_balls<const D: usize>() -> (Discretisation<D>, [Ball<D>; 2], SolidNodes) {
        let balls = [0.3, 0.7].map(|x| Ball::new(Vector::<D>::repeat(x), 0.2));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, h, level| {
            level < 3 || (0..D).all(|d| lower[d] < 0.55 && lower[d] + h > 0.05)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        let nodes = &discretisation.velocity;
        let solid: SolidNodes = (0..nodes.node_count())
            .map(|n| nearest(&balls, &nodes.point(n)).filter(|b| b.1 >= 0.0).map(|b| b.0 as u32))
            .collect();
        (discretisation, balls, solid)
    }

    /// A field that fulfils all constraints is that of the reduced vector it projects to, ghosts or not.
    fn projection_keeps_admissible_fields<const D: usize>() {
        let (discretisation, balls, solid) = around_two_balls::<D>();
        let plain = space::<D>();
        let free: Vec<u32> =
            (0..plain.nodes().node_count()).filter(|&n| plain.is_free(n)).map(|n| n as u32).collect();
        let ghost = Constraint { node: free[3], masters: vec![(free[0], 2.0), (free[7], -0.5)] };
        let space = VelocitySpace::around_surfaces(&discretisation, &balls, &solid, vec![ghost]);
        let mut field: Vec<f64> = (0..space.dim()).map(|i| (0.7 * i as f64).sin()).collect();
        space.project(&mut field);
        space.expand(&mut field);
        let mut again = field.clone();
        space.project(&mut again);
        space.expand(&mut again);
        let error = field.iter().zip(&again).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-12, "{D}D: {error}");
    }

    #[test]
    fn admissible_fields_survive_projection() {
        projection_keeps_admissible_fields::<2>();
        projection_keeps_admissible_fields::<3>();
    }

    fn maps_are_adjoint<const D: usize>() {
        let space = space::<D>();
        assert!((0..2).all(|b| space.is_active(b)));
        let wave = |k: f64| (0..space.dim()).map(|i| (k * i as f64).sin()).collect::<Vec<f64>>();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut x = wave(0.7);
        space.reduce(&mut x);
        let mut full = x.clone();
        space.expand(&mut full);
        let mut load = wave(1.1);
        load[space.full_dim()..].fill(0.0);
        let mut reduced = load.clone();
        space.reduce(&mut reduced);
        let nodal = space.full_dim();
        assert!((dot(&full[..nodal], &load[..nodal]) - dot(&x, &reduced)).abs() < 1e-9);
        let mut back = full.clone();
        space.project(&mut back);
        assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
        let mut field = wave(0.3);
        for c in space.nodes().constraints() {
            field[c.node as usize * D..][..D].fill(0.0);
        }
        field[nodal..].fill(0.0);
        let mut projected = field.clone();
        space.project(&mut projected);
        let mut spread = x.clone();
        space.spread(&mut spread);
        assert!((dot(&projected, &x) - dot(&field[..nodal], &spread[..nodal])).abs() < 1e-9);
    }

    #[test]
    fn reduction_is_the_transpose_of_expansion() {
        maps_are_adjoint::<2>();
        maps_are_adjoint::<3>();
    }
}
