//! What cases come to: their motion, gaps and stresses beside exact answers, references and each other. One
//! binary, since every binary would link the whole of gluey anew.

mod accuracy;
mod boxes;
mod cases;
mod clusters;
mod estimate;
mod films;
mod halving;
mod held;
mod many;
#[path = "../support/program.rs"]
mod program;
mod repulsion;
mod rough;
#[path = "../support/runs.rs"]
mod runs;
mod shear_stress;
mod sheared;
mod step_tolerance;
mod strategies;
mod surroundings;
mod suspension;
mod units;
