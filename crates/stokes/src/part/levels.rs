//! The levels of the cycle on the velocities, as a rank has them: its part of each, with the bodies near it.

use gluey_fem::{Cell, Cuts, ImplicitTree, Part};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Ranks};

use crate::precondition::velocity::{RELAXED_DIMENSIONS, RELAXED_RINGS, coarsest_level};
use crate::space::{
    Discretisation, PartBodies, PartNodes, Partition, finest_levels, owner_of_point, solid_nodes,
};

/// Cells between a part and the bodies that it has to know: a film with one of them may reach into it.
const MARGIN: f64 = 3.0;

/// Sizes of what one rank holds of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelSizes {
    /// Its own cells.
    pub cells: usize,
    /// Cells around them.
    pub ghost_cells: usize,
    /// Velocity nodes that it owns.
    pub nodes: usize,
    /// Velocity nodes of other ranks on which its cells depend.
    pub ghost_nodes: usize,
    /// Bodies whose twists it owns.
    pub bodies: usize,
    /// Bodies of other ranks that its cells have nodes of.
    pub ghost_bodies: usize,
    /// Ranks that it sends velocities to.
    pub neighbours: usize,
}

/// Cells around its own that a part of a level holds.
pub struct GhostLayer<'a, const D: usize> {
    /// How many rings of cells around its own.
    pub rings: usize,
    /// By which cells all but the first of them spread.
    pub spreads: &'a dyn Fn(&Cell<D>) -> bool,
}

/// The parts of a rank of the levels of the cycle, coarsest first, the finest with what is around. All ranks
/// call this.
pub fn levels<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    ranks: &Ranks,
    cuts: &Cuts,
    bodies: &BallTree<'_, D>,
    around: &GhostLayer<'_, D>,
) -> Vec<Discretisation<D>> {
    let depths = coarsest_level(tree.frame().roots()).min(tree.max_level())..=tree.max_level();
    depths.map(|depth| part_of_level(tree, ranks, cuts, bodies, depth, around)).collect()
}

/// The part of one level with what the rank knows of the others. All ranks call this.
fn part_of_level<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    ranks: &Ranks,
    cuts: &Cuts,
    bodies: &BallTree<'_, D>,
    depth: u8,
    around: &GhostLayer<'_, D>,
) -> Discretisation<D> {
    let rank = ranks.rank();
    let coarsest = coarsest_level(tree.frame().roots()).min(tree.max_level());
    let own = cuts.of(rank);
    // Rank zero holds all of the coarsest level: what it lacks are ghosts.
    let inner = if depth == coarsest && rank == 0 { 0..tree.end() } else { own.clone() };
    let near_bodies = GhostLayer { rings: 1 + RELAXED_RINGS, spreads: &|_: &Cell<D>| true };
    let coarse = (D <= RELAXED_DIMENSIONS).then_some(&near_bodies);
    let part = match if depth == tree.max_level() { Some(around) } else { coarse } {
        None => Part::new(tree, depth, &own, &inner),
        Some(around) => Part::widened(tree, depth, [&own, &inner], around.rings, around.spreads),
    };
    let nodes = [2, 1].map(|degree| {
        PartNodes::new(&part, degree, |point| cuts.owner(tree.first_touching(depth, degree as u32, point)))
    });
    let finest = finest_of_whole(tree, &part, &nodes[0]);
    let bodies = bodies_near(tree, cuts, bodies, &part);
    Discretisation::of_part(Partition::new(ranks, cuts, part, nodes, finest, bodies))
}

/// The bodies near a part.
fn bodies_near<const D: usize>(
    tree: &ImplicitTree<'_, D>,
    cuts: &Cuts,
    all: &BallTree<'_, D>,
    part: &Part<D>,
) -> PartBodies {
    let mesh = &part.mesh;
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
    let center = |id: u32| all.balls()[id as usize].center();
    let owners = ids.iter().map(|&id| owner_of_point(tree.frame(), cuts, center(id))).collect();
    PartBodies { ids, owners, all: is_near.len() }
}

/// Level of the smallest cell at each velocity node. Around nodes of inner cells all cells are there; at
/// others the tree is asked.
fn finest_of_whole<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    part: &Part<D>,
    nodes: &PartNodes<D>,
) -> Vec<u8> {
    let (mesh, map) = (&part.mesh, &nodes.map);
    let mut finest = finest_levels(mesh, map);
    let mut is_surrounded = vec![false; map.node_count()];
    map.cells(part.inner()).iter().for_each(|&node| is_surrounded[node as usize] = true);
    for node in (0..map.node_count()).filter(|&node| !is_surrounded[node]) {
        finest[node] = tree.finest_touching(mesh.max_level(), 2, map.lattice_point(node));
    }
    finest
}

/// What the rank holds of a level around these bodies.
pub fn sizes<const D: usize>(mesh: &Discretisation<D>, balls: &[Ball<D>]) -> LevelSizes {
    let partition = mesh.partition().expect("the mesh is a part");
    let mut is_ghost = vec![false; partition.bodies.ids.len()];
    let solid = solid_nodes(mesh, &mesh.near(balls), 0.0);
    let needed = solid.into_iter().zip(&partition.needed).filter(|of| *of.1);
    needed.filter_map(|of| of.0).for_each(|body| is_ghost[body as usize] = true);
    partition.own_bodies().for_each(|body| is_ghost[body] = false);
    let cells = partition.part.own().len();
    LevelSizes {
        cells,
        ghost_cells: mesh.mesh.cell_count() - cells,
        nodes: partition.velocity.owned.len(),
        ghost_nodes: partition.ghosts.ghost_count(),
        bodies: partition.own_bodies().count(),
        ghost_bodies: is_ghost.into_iter().filter(|is_ghost| *is_ghost).count(),
        neighbours: partition.ghosts.neighbour_count(),
    }
}
