//! Unknowns around surfaces as a rank sees them: the vectors of its part of the problem, which entries of
//! them it owns, and the plan of the others.

use std::ops::Range;

use gluey_fem::{Cell, Constraint, ImplicitTree, TreeMesh};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::BallTree;
use gluey_linalg::Scalar;
use gluey_parallel::{Communicator, GhostPlan, Halo, Number, Ranks, Wanted};
use gluey_stokes::{Film, Partner, Problem, StokesSystem};

use crate::bodies::{NearBodies, Shared, rigid};
use crate::pressures::SharedPressures;
use crate::space::{LevelSpace, Nodes, wanted_nodes};

/// Cells between the middle of a cell and a surface, at most, if the part is to hold what is around it.
const CELLS_AT_SURFACE: f64 = 3.5;

/// The rank that has the forces of a film: the one whose run holds its middle.
pub fn owner_of_film<const D: usize>(
    tree: &ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    film: &Film<D>,
) -> usize {
    let beyond = if matches!(film.partner, Partner::Wall { .. }) { film.gap } else { 0.0 };
    let mut middle = film.normal * (film.arm(0) + 0.5 * beyond);
    middle[0] -= tree.frame().shear() * middle[1];
    shared.owner_of_point(tree, &(film.center + middle))
}

/// The unknowns.
#[derive(Clone)]
pub struct SurfaceSpace<'a, const D: usize> {
    pub ranks: &'a Ranks,
    pub level: LevelSpace<D>,
    pub pressures: SharedPressures,
    /// Bodies whose twists are owned, by their places among those near the part.
    pub own_bodies: Vec<u32>,
    /// Number of films whose forces are owned: all that are here.
    film_dim: usize,
    body_count: usize,
    /// Of whole vectors, and of their velocities alone.
    plan: GhostPlan,
    velocities: GhostPlan,
    twists: GhostPlan,
    /// Of the velocities in all cells around own ones that are cut.
    around: GhostPlan,
}

impl<'a, const D: usize> SurfaceSpace<'a, D>
where
    Dim<D>: Space<D>,
{
    /// For the problem of the part. All ranks call this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'a, '_, D>,
        level: &LevelSpace<D>,
        (problem, bodies): (&Problem<D>, &NearBodies<D>),
    ) -> Self {
        let (ranks, system) = (shared.ranks, &problem.system);
        let rank = ranks.rank();
        let masters = Masters::new(problem, &level.velocity);
        let needed = masters.needed(level, system);
        let mut plan_of = |needed: &[bool]| {
            let keep = |node: usize| needed[node] && system.space.is_free(node);
            let wanted = wanted_nodes(tree, shared, &level.part, &level.velocity, keep);
            GhostPlan::new(ranks, wanted, level.velocity.finder())
        };
        let nodes = plan_of(&needed);
        let around = plan_of(&masters.around(level, system));
        let twists = twist_plan(ranks, bodies, &bodies_here(level, problem));
        let pressures = SharedPressures::new(tree, shared, level, &system.pressure);
        let nodal = system.space.full_dim();
        let of_velocities = [(&nodes, D, 0), (&twists, rigid::<D>(), nodal)];
        let [nodes_first, twists_after] = of_velocities;
        let plan =
            GhostPlan::joined(&[nodes_first, twists_after, (&pressures.plan, 1, system.velocity_dim())]);
        Self {
            ranks,
            level: level.clone(),
            own_bodies: bodies.owned(rank),
            film_dim: system.row_count(),
            body_count: bodies.ids.len(),
            plan,
            velocities: GhostPlan::joined(&of_velocities),
            twists,
            around,
            pressures,
        }
    }

    /// Length of the owned velocities and twists.
    pub fn velocity_dim(&self) -> usize {
        self.level.velocity.owned.len() * D + self.own_bodies.len() * rigid::<D>()
    }

    /// Length of an owned vector: velocities, twists, pressures, forces of films.
    pub fn dim(&self) -> usize {
        self.velocity_dim() + self.pressure_dim() + self.film_dim
    }

    /// Number of owned pressure nodes.
    pub fn pressure_dim(&self) -> usize {
        self.level.pressure.owned.len()
    }

    /// The parts of an owned vector: velocities with twists, pressures, forces of films.
    pub fn parts<'x, T>(&self, x: &'x [T]) -> [&'x [T]; 3] {
        let (u, rest) = x.split_at(self.velocity_dim());
        let (p, f) = rest.split_at(self.pressure_dim());
        [u, p, f]
    }

    /// The same of one that changes.
    pub fn parts_mut<'x, T>(&self, x: &'x mut [T]) -> [&'x mut [T]; 3] {
        let (u, rest) = x.split_at_mut(self.velocity_dim());
        let (p, f) = rest.split_at_mut(self.pressure_dim());
        [u, p, f]
    }

    /// Entries of whole vectors up to the pressures.
    fn whole_velocity_dim(&self) -> usize {
        self.level.nodal_dim() + self.body_count * rigid::<D>()
    }

    /// Where the owned velocities and twists stand in a whole vector, range by range.
    fn owned_velocities(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let (owned, n) = (&self.level.velocity.owned, rigid::<D>());
        let first = self.level.nodal_dim();
        let twists = self.own_bodies.iter().map(move |&body| first + body as usize * n);
        std::iter::once(owned.start * D..owned.end * D).chain(twists.map(move |at| at..at + n))
    }

    /// Sets the owned velocities and twists of a whole vector.
    pub fn set_velocities<T: Copy>(&self, from: &[T], whole: &mut [T]) {
        let mut rest = from;
        for range in self.owned_velocities() {
            let (own, others) = rest.split_at(range.len());
            whole[range].copy_from_slice(own);
            rest = others;
        }
    }

    /// Copies them out of one.
    pub fn copy_velocities<T: Copy>(&self, whole: &[T], to: &mut [T]) {
        let mut rest = to;
        for range in self.owned_velocities() {
            let (own, others) = rest.split_at_mut(range.len());
            own.copy_from_slice(&whole[range]);
            rest = others;
        }
    }

    /// A whole vector from an owned one: with what other ranks own.
    pub fn spread<T: Scalar + Number>(&mut self, x: &[T], whole: &mut [T]) {
        let [u, p, f] = self.parts(x);
        self.set_velocities(u, whole);
        let first = self.whole_velocity_dim();
        let owned = &self.level.pressure.owned;
        whole[first + owned.start..first + owned.end].copy_from_slice(p);
        let films = whole.len() - f.len();
        whole[films..].copy_from_slice(f);
        self.plan.update::<T, 1>(self.ranks, whole);
    }

    /// An owned vector from sums over own cells, with divergences that sum to zero.
    pub fn gather<T: Scalar + Number>(&mut self, whole: &mut [T], y: &mut [T]) {
        self.plan.accumulate::<T, 1>(self.ranks, whole);
        self.copy_owned(whole, y);
        let [_, p, _] = self.parts_mut(y);
        self.pressures.remove_mean(self.ranks, p);
    }

    /// Velocities and twists from sums over own cells.
    pub fn gather_velocities<T: Scalar + Number>(&mut self, whole: &mut [T], y: &mut [T]) {
        self.velocities.accumulate::<T, 1>(self.ranks, whole);
        self.copy_velocities(whole, y);
    }

    /// Brings the velocities and twists of others to a whole vector, or to its velocities alone.
    pub fn update_velocities(&mut self, whole: &mut [f64]) {
        self.velocities.update::<f64, 1>(self.ranks, whole);
    }

    /// Copies an owned vector out of a whole one.
    pub fn copy_owned<T: Copy>(&self, whole: &[T], x: &mut [T]) {
        let (first, owned) = (self.whole_velocity_dim(), self.level.pressure.owned.clone());
        let films = whole.len() - self.film_dim;
        let [u, p, f] = self.parts_mut(x);
        self.copy_velocities(whole, u);
        p.copy_from_slice(&whole[first + owned.start..first + owned.end]);
        f.copy_from_slice(&whole[films..]);
    }

    /// Brings the velocities of others in all cells around own ones that are cut to a nodal field.
    pub fn update_around(&mut self, field: &mut [f64]) {
        let nodal = self.level.nodal_dim();
        self.around.update::<f64, D>(self.ranks, &mut field[..nodal]);
    }

    /// The halos of reduced velocities and of the blocks of twists.
    pub fn halos(&self) -> [Halo; 2] {
        let size = rigid::<D>() * rigid::<D>();
        let blocks = GhostPlan::joined(&[(&self.twists, size, 0)]);
        let of_blocks = self.own_bodies.iter().map(|&body| body as usize * size..(body as usize + 1) * size);
        [
            Halo::new(self.ranks, self.velocities.clone(), self.owned_velocities().collect()),
            Halo::new(self.ranks, blocks, of_blocks.collect()),
        ]
    }

    /// Ranks that this one sends values to, and the number of those that it gets of nodes.
    pub fn neighbours(&self) -> [usize; 2] {
        [self.plan.neighbour_count(), self.velocities.ghost_count()]
    }
}

/// What nodes take their values from.
struct Masters<'p, const D: usize> {
    nodes: &'p Nodes<D>,
    ghosts: &'p [Constraint],
    /// The constraint of each node among these, or none.
    ghost_of: Vec<u32>,
}

impl<'p, const D: usize> Masters<'p, D>
where
    Dim<D>: Space<D>,
{
    fn new(problem: &'p Problem<D>, nodes: &'p Nodes<D>) -> Self {
        let ghosts = problem.system.space.ghosts();
        let mut ghost_of = vec![u32::MAX; nodes.map.node_count()];
        ghosts.iter().zip(0..).for_each(|(ghost, k)| ghost_of[ghost.node as usize] = k);
        Self { nodes, ghosts, ghost_of }
    }

    fn mark(&self, cell: usize, marked: &mut [bool]) {
        for &node in self.nodes.map.cell(cell) {
            for (node, _) in self.nodes.regular(node) {
                marked[node as usize] = true;
                let ghost = self.ghosts.get(self.ghost_of[node as usize] as usize);
                let masters = ghost.into_iter().flat_map(|ghost| &ghost.masters);
                masters.for_each(|master| marked[master.0 as usize] = true);
            }
        }
    }

    /// The nodes that own cells and own films depend on.
    fn needed(&self, level: &LevelSpace<D>, system: &StokesSystem<D>) -> Vec<bool> {
        let mut needed = vec![false; self.nodes.map.node_count()];
        level.part.own().for_each(|cell| self.mark(cell, &mut needed));
        for (k, _) in system.rows().flatten() {
            if let Some(needed) = needed.get_mut(*k as usize / D) {
                *needed = true;
            }
        }
        needed
    }

    /// The nodes that own cut cells and those around them depend on.
    fn around(&self, level: &LevelSpace<D>, system: &StokesSystem<D>) -> Vec<bool> {
        let mesh = &level.part.mesh;
        let mut needed = vec![false; self.nodes.map.node_count()];
        let offset = |k: usize| std::array::from_fn(|d| (k / 3usize.pow(d as u32) % 3) as i32 - 1);
        for own in system.own_cut_cells() {
            let near = (0..3usize.pow(D as u32)).filter_map(|k| {
                mesh.neighbour(&mesh.cells()[own], &offset(k)).and_then(|cell| mesh.find(&cell))
            });
            near.for_each(|cell| self.mark(cell, &mut needed));
        }
        needed
    }
}

/// The bodies near the part whose motions own cells or own films depend on, those around own nodes included.
fn bodies_here<const D: usize>(level: &LevelSpace<D>, problem: &Problem<D>) -> Vec<bool>
where
    Dim<D>: Space<D>,
{
    let mut here = problem.system.bodies_here();
    for &node in level.velocity.map.cells(level.part.own()) {
        if let Some(body) = problem.system.space.body_of(node as usize) {
            here[body as usize] = true;
        }
    }
    here
}

/// The plan of the twists of other ranks' bodies, by their places among those near the part.
fn twist_plan<const D: usize>(ranks: &Ranks, bodies: &NearBodies<D>, here: &[bool]) -> GhostPlan {
    let rank = ranks.rank();
    let ghost = |place: &usize| here[*place] && bodies.owners[*place] != rank;
    let wanted = (0..bodies.ids.len()).filter(ghost).map(|place| Wanted {
        owner: bodies.owners[place],
        key: u64::from(bodies.ids[place]),
        place: place as u32,
    });
    let find = |key: u64| bodies.ids.binary_search(&(key as u32)).ok().map(|place| place as u32);
    GhostPlan::new(ranks, wanted.collect(), find)
}

/// Whether the part is to hold what is around a cell: whether a surface is near it.
pub fn is_near_surface<const D: usize>(
    frame: &TreeMesh<D>,
    bodies: &BallTree<'_, D>,
    cell: &Cell<D>,
) -> bool {
    let h = frame.size(cell.level);
    let center: Vector<D> = frame.lower_corner(cell) + Vector::repeat(0.5 * h);
    let reach = CELLS_AT_SURFACE * h;
    bodies.nearest_within(&center, reach).is_some_and(|nearest| nearest.1 <= reach)
}
