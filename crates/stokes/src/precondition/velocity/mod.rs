//! One V-cycle on the velocity block, on levels whose bodies are eliminated.

mod coarse;
mod cycle;
mod hierarchy;
mod level;
mod near_bodies;
mod suspension;

pub use cycle::{LevelPlan, VCycle};
pub use hierarchy::{Hierarchy, coarsest_level};
pub use level::{LEVEL_SWEEP, Smoothing, cell_lambda_max};
pub use near_bodies::{RELAXED_DIMENSIONS, RELAXED_RINGS};
pub use suspension::relative_viscosity;

/// Factor by which the bound of the largest eigenvalue is raised for hanging nodes and twists, whose
/// diagonals are not sums over cells: they add little.
const SAFETY: f64 = 1.05;
