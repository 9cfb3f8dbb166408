//! The line of JSON.

use serde::Serialize;

use crate::cases::BenchCase;
use crate::options::FormulationName;

/// A measurement. What the system does not tell is `null`.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The case.
    pub case: BenchCase,
    /// The formulation.
    pub formulation: FormulationName,
    /// Cells per side of the finest level.
    pub n: u64,
    /// Whether the mesh is refined towards the particles only.
    pub adaptive: bool,
    /// Tolerance, relative to the initial residual.
    #[serde(rename = "tol")]
    pub tolerance: f64,
    /// Viscosity of the particles over that of the fluid in `paper`; `null` in `unfitted`.
    pub contrast: Option<f64>,
    /// Threads.
    pub threads: usize,
    /// Velocity and pressure unknowns of the mesh, eliminated or not.
    pub dofs: usize,
    /// Cells of the mesh.
    pub cells: usize,
    /// Levels of the multigrid.
    pub levels: usize,
    /// Mesh, nodes, solid, operator, levels: wall seconds.
    pub setup_s: f64,
    /// The same in CPU seconds.
    pub setup_cpu_s: Option<f64>,
    /// From a zero guess to the tolerance: wall seconds.
    pub solve_s: f64,
    /// The same in CPU seconds of all threads.
    pub solve_cpu_s: Option<f64>,
    /// Krylov iterations.
    pub iterations: usize,
    /// Applications of the operator on the finest mesh, see [`gluey_stokes::SolveReport`].
    pub fine_operator_applications: f64,
    /// `|b - A x| / |b|`, computed anew in `f64`.
    pub residual_rel: f64,
    /// Unknowns over CPU seconds of the solve.
    pub dofs_per_s: Option<f64>,
    /// Unknowns over CPU seconds of one application of the operator in `f64`.
    pub operator_dofs_per_s: Option<f64>,
    /// Largest resident memory up to the end of the solve, in 1e6 bytes.
    pub peak_rss_mb: Option<f64>,
    /// Memory bandwidth of `a = b + s c`, in 1e9 bytes a second.
    pub triad_gb_s: f64,
    /// `dofs_per_s / triad_gb_s`: unknowns solved in the time the triad moves 1e9 bytes.
    pub dofs_per_triad_gb: Option<f64>,
    /// Velocity of each particle.
    pub velocities: Vec<Vec<f64>>,
    /// Spin of each particle: one number in 2D, three in 3D.
    pub spins: Vec<Vec<f64>>,
}
