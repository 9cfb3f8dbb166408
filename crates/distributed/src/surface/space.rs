//! The halos of the vectors of a rank's part of the problem around surfaces.

use gluey_fem::{Cell, Constraint, ImplicitTree, TreeMesh};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::BallTree;
use gluey_parallel::{GhostPlan, Halo};
use gluey_stokes::{Film, Partner, PressureSpace, Problem, StokesSystem};

use crate::bodies::{Shared, rigid};
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

/// The halos of the vectors of a part's problem.
pub struct PartHalos {
    /// Of vectors, of their velocities and of pressures.
    pub of_system: [Halo; 3],
    /// Of a square matrix for each twist.
    pub of_twist_blocks: Halo,
    /// Of nodal velocities in all cells around own ones that are cut.
    pub around: Halo,
}

impl PartHalos {
    /// For the problem of the part. All ranks call this.
    pub fn new<const D: usize>(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        level: &LevelSpace<D>,
        problem: &Problem<D>,
    ) -> Self
    where
        Dim<D>: Space<D>,
    {
        let (ranks, system, n) = (shared.ranks, &problem.system, rigid::<D>());
        let masters = Masters::new(problem, &level.velocity);
        let mut plan_of = |needed: &[bool]| {
            let keep = |node: usize| needed[node] && system.space.is_free(node);
            let wanted = wanted_nodes(tree, shared, &level.part, &level.velocity, keep);
            GhostPlan::new(ranks, wanted, level.velocity.finder())
        };
        let nodes = plan_of(&masters.needed(level, system));
        let around = plan_of(&masters.around(level, system));
        let here = bodies_here(level, problem);
        let partition = problem.discretisation().partition().expect("the mesh is a part");
        let twists = partition.twists(&here);
        let pressures = pressure_plan(tree, shared, level, &system.pressure);
        let (first_twist, first_pressure) = (system.space.full_dim(), system.velocity_dim());
        let films = system.dim() - system.row_count()..system.dim();
        let own_nodes = level.velocity.owned.start * D..level.velocity.owned.end * D;
        let own_pressures = level.pressure.owned.clone();
        let own_twists = |first: usize, width: usize| {
            partition.own_bodies().map(move |body| first + body * width..first + (body + 1) * width)
        };
        let own_velocities: Vec<_> =
            std::iter::once(own_nodes.clone()).chain(own_twists(first_twist, n)).collect();
        let shifted = first_pressure + own_pressures.start..first_pressure + own_pressures.end;
        let own = own_velocities.iter().cloned().chain([shifted, films]).collect();
        let of_velocities = [(&nodes, D, 0), (&twists, n, first_twist)];
        let of_all = [of_velocities[0], of_velocities[1], (&pressures, 1, first_pressure)];
        Self {
            of_system: [
                Halo::new(ranks, GhostPlan::joined(&of_all), own),
                Halo::new(ranks, GhostPlan::joined(&of_velocities), own_velocities),
                Halo::new(ranks, pressures.clone(), vec![own_pressures]),
            ],
            of_twist_blocks: Halo::new(
                ranks,
                GhostPlan::joined(&[(&twists, n * n, 0)]),
                own_twists(0, n * n).collect(),
            ),
            around: Halo::new(ranks, GhostPlan::joined(&[(&around, D, 0)]), vec![own_nodes]),
        }
    }

    /// Ranks that this one sends values to, and the number of nodes whose values it gets.
    pub fn neighbours<const D: usize>(&self) -> [usize; 2] {
        [self.of_system[0].counts()[1], self.of_system[1].counts()[0] / D]
    }
}

/// The plan of the unknown pressures of other ranks on which own cells depend, by themselves or by those that
/// follow from them.
fn pressure_plan<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    level: &LevelSpace<D>,
    pressure: &PressureSpace<D>,
) -> GhostPlan
where
    Dim<D>: Space<D>,
{
    let nodes = &*level.pressure;
    let mut needed = vec![false; nodes.map.node_count()];
    for &node in nodes.map.cells(level.part.own()) {
        nodes.regular(node).for_each(|(node, _)| needed[node as usize] = true);
    }
    let rows = pressure.constraints().iter().filter(|row| !nodes.map.is_hanging(row.node as usize));
    let masters: Vec<u32> =
        rows.filter(|row| needed[row.node as usize]).flat_map(|row| &row.masters).map(|m| m.0).collect();
    masters.into_iter().for_each(|master| needed[master as usize] = true);
    let keep = |node: usize| needed[node] && pressure.is_free(node);
    let wanted = wanted_nodes(tree, shared, &level.part, nodes, keep);
    GhostPlan::new(shared.ranks, wanted, nodes.finder())
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
