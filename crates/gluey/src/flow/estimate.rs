//! How large the mesh of a case will be, before it is built.
//!
//! Every level of the tree refines the cells that meet a ball a little larger than each particle. A ball of
//! radius `R h` at a random place meets on average (Steiner 1840, on parallel bodies)
//!
//! `pi R^2 + 4 R + 1` squares or `4/3 pi R^3 + 3 pi R^2 + 6 R + 1` cubes of edge `h`,
//!
//! and no more than fill the box. The mesh that is built has 0.6 to 1.6 times as many cells
//! (`tests/physics/estimate.rs`: the shipped cases, and sixty at random).

use std::f64::consts::PI;

use gluey_motion::Configuration;
use gluey_stokes::{Discretisation, Refinement};

use super::{FlowError, refinement, stokes_flow};
use crate::case::{Case, Formulation, Hydrodynamics, Solver};

/// Unknowns per cell: nodes of velocities and pressures, hanging ones included. A uniform mesh has 9 and 25.
const UNKNOWNS_PER_CELL: [f64; 2] = [11.0, 29.0];
/// The program and its tables; unit: bytes.
const PROGRAM: f64 = 16e6;
/// The same of a process that shares a case over MPI.
const PROGRAM_OF_RANK: f64 = 24e6;
/// What an unknown takes there; unit: bytes.
const OF_RANK: f64 = 800.0;
/// Layers of cells around its own whose cuts a process of `unfitted` holds, as a cube of its cells would
/// have.
const LAYERS_AT_SURFACES: f64 = 6.0;
/// What a cell that a surface cuts takes in `unfitted`: its moments, its matrix and its part of the
/// penalties; unit: bytes.
const CUT_CELL: [f64; 2] = [40e3, 55e3];
/// A cell is refined, too, where one of its children's size that touches it meets a ball: as many do as meet
/// a ball this much larger (squares of twice the edge: `pi R^2 + 8 R + 4`). Unit: cells.
const TOUCHING: f64 = 0.7;

/// Expected size of the first mesh of a case, and of its solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshEstimate {
    /// Cells.
    pub cell_count: f64,
    /// Unknowns: velocity and pressure nodes.
    pub unknown_count: f64,
    /// Memory of a run; unit: bytes.
    pub bytes: f64,
}

impl MeshEstimate {
    /// The estimate for a checked case; `None` if its flow has no mesh. Takes as long as looking at each
    /// particle once per level.
    pub fn of(case: &Case) -> Option<Self> {
        Self::of_rank(case, 1)
    }

    /// The same where several processes share the case: `bytes` are those of one of them.
    pub fn of_rank(case: &Case, ranks: usize) -> Option<Self> {
        if case.flow.hydrodynamics != Hydrodynamics::Stokes {
            return None;
        }
        let tree = Tree::of(case)?;
        let cell_count = tree.cell_count(case);
        let unknown_count = cell_count * UNKNOWNS_PER_CELL[case.dimension - 2];
        let bytes = match ranks {
            0 | 1 => memory(case, &tree, cell_count, unknown_count),
            _ => memory_of_rank(case, &tree, cell_count, unknown_count, ranks as f64),
        };
        Some(Self { cell_count, unknown_count, bytes })
    }
}

/// Size of the first mesh of a case, which is built for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSize {
    /// Cells.
    pub cell_count: usize,
    /// Velocity and pressure unknowns, as reports count them.
    pub dof_count: usize,
    /// Memory that a run is expected to take; unit: bytes.
    pub bytes: f64,
}

impl MeshSize {
    /// The size for a checked case; `None` if its flow has no mesh.
    ///
    /// # Errors
    /// [`FlowError`] if the box cannot be meshed.
    pub fn of(case: &Case) -> Result<Option<Self>, FlowError> {
        let Some(tree) = Tree::of(case).filter(|_| case.flow.hydrodynamics == Hydrodynamics::Stokes) else {
            return Ok(None);
        };
        let (cell_count, dof_count) = match case.dimension {
            2 => counts::<2>(case)?,
            _ => counts::<3>(case)?,
        };
        let bytes = memory(case, &tree, cell_count as f64, dof_count as f64);
        Ok(Some(Self { cell_count, dof_count, bytes }))
    }
}

/// Cells and unknowns of the first mesh.
fn counts<const D: usize>(case: &Case) -> Result<(usize, usize), FlowError> {
    let suspension = stokes_flow::<D>(case)?.suspension;
    let balls = suspension.balls(&Configuration::at(0.0, &case.start()));
    let discretisation = Discretisation::new(suspension.mesh(&balls)?);
    Ok((discretisation.mesh.cell_count(), discretisation.dof_count()))
}

/// The tree of a case as far as it matters here.
struct Tree {
    dimension: i32,
    root_count: f64,
    root_size: f64,
    refinement: Refinement,
}

impl Tree {
    fn of(case: &Case) -> Option<Self> {
        let roots = case.root_cells()?;
        Some(Self {
            dimension: case.dimension as i32,
            root_count: roots.iter().map(|&count| f64::from(count)).product(),
            root_size: case.root_size()?,
            refinement: refinement(case, case.surface_level()?),
        })
    }

    /// Edge of the cells of a level.
    fn size(&self, level: i32) -> f64 {
        self.root_size * 0.5f64.powi(level)
    }

    /// Leaves: the roots, and for each refined cell its children less itself.
    fn cell_count(&self, case: &Case) -> f64 {
        let surface = i32::from(self.refinement.surface);
        let refined: f64 = (0..surface).map(|level| self.near_surfaces(case, level)).sum();
        self.root_count + refined * (2f64.powi(self.dimension) - 1.0)
    }

    /// Leaves inside particles, which have the size of those at the surfaces.
    fn cells_inside(&self, case: &Case) -> f64 {
        let size = self.size(i32::from(self.refinement.surface));
        let ball = if self.dimension == 2 { PI } else { 4.0 / 3.0 * PI };
        case.particles.iter().map(|particle| ball * (particle.radius / size).powi(self.dimension)).sum()
    }

    /// Leaves that surfaces cut: a circle of radius `R h` meets about `8 R` squares, a sphere `6 pi R^2 + 2`
    /// cubes (what a ball meets less what lies inside it).
    fn cells_cut(&self, case: &Case) -> f64 {
        let size = self.size(i32::from(self.refinement.surface));
        let met = |radius: f64| match self.dimension {
            2 => 8.0 * radius,
            _ => 6.0 * PI * radius * radius + 2.0,
        };
        case.particles.iter().map(|particle| met(particle.radius / size)).sum()
    }

    /// Refined cells of a level above that of the surfaces.
    fn near_surfaces(&self, case: &Case, level: i32) -> f64 {
        let most = self.root_count * 2f64.powi(self.dimension * level);
        if level < i32::from(self.refinement.coarsest) {
            return most;
        }
        let size = self.size(level);
        let finest = i32::from(self.refinement.surface) - 1;
        // Neighbouring leaves differ by one level: the balls of the finest refined level, with a cell more
        // for every level above.
        let balance = self.refinement.band * 0.5 * self.size(finest) + (size - self.size(finest));
        let beyond = (self.refinement.band * 0.5 * size).max(balance).max(TOUCHING * size);
        let met = |radius: f64| cells_met(self.dimension, (radius + beyond) / size);
        case.particles.iter().map(|particle| met(particle.radius)).sum::<f64>().min(most)
    }
}

/// Cells that a ball meets on average, whose radius is so many cells.
fn cells_met(dimension: i32, radius: f64) -> f64 {
    match dimension {
        2 => PI * radius * radius + 4.0 * radius + 1.0,
        _ => 4.0 / 3.0 * PI * radius.powi(3) + 3.0 * PI * radius * radius + 6.0 * radius + 1.0,
    }
}

/// Memory that a run with so many cells and unknowns takes, in bytes (measured: see `docs/robustness.md`).
fn memory(case: &Case, tree: &Tree, cell_count: f64, unknown_count: f64) -> f64 {
    let of_cuts = match case.flow.formulation {
        Formulation::Unfitted => CUT_CELL[case.dimension - 2] * tree.cells_cut(case),
        Formulation::Paper => 0.0,
    };
    PROGRAM + of_cuts + memory_of_solver(case, tree, cell_count, unknown_count)
}

/// Memory of one of the processes that share a case, in bytes (measured: see `docs/ranks.md`). Each holds
/// its cells and those around them, in layers like those of a cube of them: one, or as many as surfaces need.
fn memory_of_rank(case: &Case, tree: &Tree, cell_count: f64, unknown_count: f64, ranks: f64) -> f64 {
    let side = (cell_count / ranks).powf(1.0 / case.dimension as f64);
    let with_layers = |count: f64| (1.0 + 2.0 * count / side).powi(case.dimension as i32).min(ranks);
    let of_unknowns = |bytes: f64| PROGRAM_OF_RANK + bytes * unknown_count / ranks * with_layers(1.0);
    let of_cuts = CUT_CELL[case.dimension - 2] * tree.cells_cut(case) / ranks;
    of_unknowns(OF_RANK) + of_cuts * with_layers(LAYERS_AT_SURFACES)
}

fn memory_of_solver(case: &Case, tree: &Tree, cell_count: f64, unknown_count: f64) -> f64 {
    let direct = match case.flow.solver {
        Solver::Direct => true,
        Solver::Multigrid => false,
        Solver::Auto => case.dimension == 2,
    };
    let formulation = case.flow.formulation;
    if direct {
        // The nodes inside rigid particles are eliminated.
        let inside = if formulation == Formulation::Paper { 0.0 } else { tree.cells_inside(case) };
        let solved = (unknown_count * (1.0 - inside / cell_count)).max(1e3);
        let per_unknown = match formulation {
            Formulation::Unfitted => 290.0,
            Formulation::Paper => 310.0,
        };
        return match case.dimension {
            2 => solved * per_unknown * solved.log2(),
            _ => solved * 450.0 * solved.cbrt(),
        };
    }
    let per_unknown = match (case.dimension, formulation) {
        (_, Formulation::Unfitted) => 800.0,
        (2, Formulation::Paper) => 2400.0,
        (_, Formulation::Paper) => 1400.0,
    };
    per_unknown * unknown_count
}
