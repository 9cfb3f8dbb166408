//! The levels of the cycle on the velocities, as a rank has them: its part of each, with the bodies near it.

use gluey_fem::{Cell, ImplicitTree};
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, GhostPlan, Halo};
use gluey_stokes::part::{
    self, Hierarchy, LevelPlan, RELAXED_DIMENSIONS, RELAXED_RINGS, Smoothing, VCycle, coarse_offset,
    coarsest_level,
};
use gluey_stokes::{Discretisation, Partition, VelocitySpace, solid_nodes};

use crate::bodies::{NearBodies, Shared, rigid};
use crate::flow::{FlowError, LevelSizes};
use crate::space::{GhostLayer, LevelSpace, wanted_nodes};

/// The levels of a rank.
pub struct Levels<const D: usize>
where
    Dim<D>: Space<D>,
{
    pub cycle: VCycle<D>,
    /// Its part of the finest one.
    pub finest: LevelSpace<D>,
    pub discretisation: Discretisation<D>,
    pub bodies: NearBodies<D>,
    /// Coarsest first.
    pub sizes: Vec<LevelSizes>,
}

/// The part of one level.
struct PartOfLevel<const D: usize> {
    level: LevelSpace<D>,
    discretisation: Discretisation<D>,
    bodies: NearBodies<D>,
}

impl<const D: usize> Levels<D>
where
    Dim<D>: Space<D>,
{
    /// Under smoothers of the finest level, for which its part is to hold more. All ranks call this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        viscosity: f64,
        around: &GhostLayer<'_, D>,
    ) -> Result<Self, FlowError> {
        let depths = coarsest_level(tree.frame().roots()).min(tree.max_level())..=tree.max_level();
        let mut parts: Vec<_> = depths.map(|depth| PartOfLevel::new(tree, shared, depth, around)).collect();
        let plans: Vec<_> = parts
            .iter()
            .zip((0..parts.len()).rev())
            .map(|(part, above)| LevelPlan {
                space: part.space(shared.held),
                smoothing: (above > 0).then(Smoothing::of_eliminated),
            })
            .collect();
        let sizes = parts.iter().zip(&plans).map(|(part, plan)| sizes(&part.level, &plan.space)).collect();
        let meshes: Vec<_> = parts.iter().map(|part| part.discretisation.clone()).collect();
        let hierarchy = Hierarchy::of_parts(meshes);
        let cycle = VCycle::new(hierarchy, plans, None, viscosity).map_err(FlowError::agreed)?;
        let PartOfLevel { level: finest, discretisation, bodies } = parts.swap_remove(parts.len() - 1);
        Ok(Self { cycle, finest, discretisation, bodies, sizes })
    }
}

impl<const D: usize> PartOfLevel<D>
where
    Dim<D>: Space<D>,
{
    /// All ranks call this.
    fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'_, '_, D>,
        depth: u8,
        around: &GhostLayer<'_, D>,
    ) -> Self {
        let coarsest = coarsest_level(tree.frame().roots()).min(tree.max_level());
        // Rank zero holds all of the coarsest level: what it lacks are ghosts.
        let all = (depth == coarsest && shared.ranks.rank() == 0).then(|| 0..tree.end());
        let near_bodies = GhostLayer { rings: 1 + RELAXED_RINGS, spreads: &|_: &Cell<D>| true };
        let coarse = (D <= RELAXED_DIMENSIONS).then_some(&near_bodies);
        let around = if depth == tree.max_level() { Some(around) } else { coarse };
        let level = LevelSpace::new(tree, depth, shared, all, around);
        let bodies = NearBodies::new(tree, shared, &level.part);
        let discretisation = discretised(tree, shared, &level, &bodies);
        Self { level, discretisation, bodies }
    }

    /// The velocities of the part, of whose bodies some are held. All ranks call this.
    fn space(&self, held: &[bool]) -> VelocitySpace<D> {
        let Self { discretisation, bodies: NearBodies { balls, ids, .. }, .. } = self;
        let solid = solid_nodes(discretisation, balls, coarse_offset());
        let mut space = VelocitySpace::new(discretisation, balls, &solid);
        let held: Vec<bool> = ids.iter().map(|&id| held.get(id as usize) == Some(&true)).collect();
        space.hold(&held);
        space
    }
}

/// The part of a level with what the rank knows of the others. All ranks call this.
fn discretised<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    level: &LevelSpace<D>,
    bodies: &NearBodies<D>,
) -> Discretisation<D> {
    let LevelSpace { part, velocity, pressure, chunks } = level;
    let needed = velocity.needed(part);
    let wanted = wanted_nodes(tree, shared, part, velocity, |node| needed[node]);
    let needed_pressures = pressure.needed(part);
    let of_pressures = wanted_nodes(tree, shared, part, pressure, |node| needed_pressures[node]);
    let of_pressures = GhostPlan::new(shared.ranks, of_pressures, pressure.finder());
    let own = [velocity.owned.len() as u64, pressure.owned.len() as u64];
    let counts = shared.ranks.all_gather(&own);
    let counts = counts.as_chunks::<2>().0;
    let before = |k: usize| counts[..shared.ranks.rank()].iter().map(|of| of[k] as usize).sum();
    let partition = Partition {
        ranks: shared.ranks.clone(),
        part: (**part).clone(),
        nodes: velocity.owned.clone(),
        ghosts: GhostPlan::new(shared.ranks, wanted, velocity.finder()),
        node_counts: [counts.iter().map(|of| of[0] as usize).sum(), before(0)],
        pressures_before: before(1),
        needed,
        pressure_nodes: pressure.owned.clone(),
        pressures: Halo::new(shared.ranks, of_pressures, vec![pressure.owned.clone()]),
        finest: finest_levels(tree, level),
        bodies: bodies.ids.clone(),
        owners: bodies.owners.clone(),
        is_whole: shared.ranks.rank() == 0 && part.inner().len() == part.mesh.cell_count(),
    };
    let nodes = [velocity.map.clone(), pressure.map.clone()];
    Discretisation::of_part(part.mesh.clone(), nodes, chunks.clone(), partition)
}

/// Level of the smallest cell at each velocity node. GhostLayer nodes of inner cells all cells are there; at
/// others the tree is asked.
fn finest_levels<const D: usize>(tree: &mut ImplicitTree<'_, D>, level: &LevelSpace<D>) -> Vec<u8> {
    let (mesh, map) = (&level.part.mesh, &level.velocity.map);
    let mut finest = part::finest_levels(mesh, map);
    let mut is_surrounded = vec![false; map.node_count()];
    map.cells(level.part.inner()).iter().for_each(|&node| is_surrounded[node as usize] = true);
    for node in (0..map.node_count()).filter(|&node| !is_surrounded[node]) {
        finest[node] = tree.finest_touching(mesh.max_level(), 2, map.lattice_point(node));
    }
    finest
}

fn sizes<const D: usize>(level: &LevelSpace<D>, space: &VelocitySpace<D>) -> LevelSizes
where
    Dim<D>: Space<D>,
{
    let (cells, [ghosts, neighbours]) = (level.part.own().len(), space.halo().counts());
    let partition = space.discretisation().partition();
    let ghost_nodes = partition.map_or(0, |part| part.ghosts.ghost_count());
    LevelSizes {
        cells,
        ghost_cells: level.part.mesh.cell_count() - cells,
        nodes: level.velocity.owned.len(),
        ghost_nodes,
        bodies: partition.map_or(0, |part| part.own_bodies().count()),
        ghost_bodies: (ghosts - ghost_nodes * D) / rigid::<D>(),
        neighbours,
    }
}
