//! What the penalised solid needs beside the rigid levels.

mod block;
mod cycle;
mod node_matrix;
mod numbered;
mod patches;
mod prolongation;
mod smoother;

pub use block::SolidBlock;
