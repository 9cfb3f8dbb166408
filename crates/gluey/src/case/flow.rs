//! What a case says of the flow.

use gluey_stokes::PaperParams;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::names::{Formulation, Hydrodynamics, Lubrication, ParticleVelocity, Solver};

/// Flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FlowSpec {
    /// Who predicts the velocities. Default: "stokes".
    pub hydrodynamics: Hydrodynamics,
    /// How rigidity enters. Default: "unfitted".
    pub formulation: Formulation,
    /// What acts in films that are too thin for the mesh. Default: "deficit" in `unfitted`, "none"
    /// elsewhere.
    pub lubrication: Option<Lubrication>,
    /// How the equations are solved. Default: "auto".
    pub solver: Solver,
    /// Tolerance of a linear solve. Unit: the first residual. Default: 1e-6.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 0.1))]
    pub tolerance: f64,
    /// The mesh.
    pub mesh: MeshSpec,
    /// Parameters of the `paper` formulation.
    pub paper: PaperSpec,
    /// Parameters of the `pair-mobility` model.
    #[serde(rename = "pair-mobility")]
    pub pair_mobility: PairMobilitySpec,
}

/// The 2^D-tree mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MeshSpec {
    /// The cells at the surfaces have at least this many edges in a radius of the smallest particle. Unit:
    /// cells. Default: 6.4 in 2D, 3.2 in 3D.
    #[schemars(range(min = 1))]
    pub cells_per_radius: Option<f64>,
    /// Root cells of the tree along the shortest edge of the box, at least. Cells are halves of halves of
    /// these: with 3 instead of 1 they may have 2/3 of the size. Unit: cells. Default: in 2D 1; in 3D, where
    /// `coarsest_level` is not given either, what of 1, 3 and 5 makes the largest cells that
    /// `cells_per_radius` allows, up to 125 root cells in the box.
    #[schemars(range(min = 1, max = 16))]
    pub root_cells: Option<u32>,
    /// Cells are at most `2^-coarsest_level` of a root cell; at most the level of the cells at the surfaces.
    /// Unit: levels. Default: 3, where 3 or 5 root cells are chosen 1, or the level of the cells at the
    /// surfaces where that is less.
    #[schemars(range(max = 18))]
    pub coarsest_level: Option<u32>,
    /// Cells of the finest level kept around each particle, beside those that fill it: coarser ones inside
    /// save little and, in `paper`, where the interior carries strain and multiplier, change velocities.
    /// Cells that touch one with a surface in it are as fine whatever this is. Unit: cells. Default: 2.
    #[schemars(range(min = 0, max = 1000))]
    pub band: f64,
}

/// Parameters of the `paper` formulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PaperSpec {
    /// Viscosity of the particles, `r`. Unit: that of the fluid. Default: 100.
    #[schemars(extend("exclusiveMinimum" = 1))]
    pub viscosity_ratio: f64,
    /// Uzawa iterations per time step; with 1 the multiplier is never used, which is a penalty method and
    /// called so in reports. Unit: iterations. Default: 2.
    #[schemars(range(min = 1))]
    pub uzawa_steps: usize,
    /// Step of the Uzawa iteration. Unit: none. Default: 1.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 4))]
    pub rho: f64,
    /// Width of the viscosity ramp inside the surface. Unit: cells. Default: 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub ramp: f64,
    /// How the motion of a particle is taken from the field: `mean`, over the particle, or `center`, the
    /// paper's equation 11. Default: "mean".
    pub velocity: ParticleVelocity,
}

/// Parameters of the `pair-mobility` model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PairMobilitySpec {
    /// The mobility is evaluated at the gap plus this, to imitate a solver that does not resolve the film.
    /// Unit: radii. Default: 0.
    #[schemars(range(min = 0))]
    pub gap_offset: f64,
}

impl Default for FlowSpec {
    fn default() -> Self {
        Self {
            hydrodynamics: Hydrodynamics::default(),
            formulation: Formulation::default(),
            lubrication: None,
            solver: Solver::default(),
            tolerance: 1e-6,
            mesh: MeshSpec::default(),
            paper: PaperSpec::default(),
            pair_mobility: PairMobilitySpec::default(),
        }
    }
}

impl Default for MeshSpec {
    fn default() -> Self {
        Self { cells_per_radius: None, root_cells: None, coarsest_level: None, band: 2.0 }
    }
}

impl Default for PaperSpec {
    fn default() -> Self {
        let PaperParams { viscosity_ratio, uzawa_steps, rho, ramp, .. } = PaperParams::default();
        Self { viscosity_ratio, uzawa_steps, rho, ramp, velocity: ParticleVelocity::Mean }
    }
}

impl PaperSpec {
    /// These parameters as the solver takes them.
    pub fn params(&self) -> PaperParams {
        PaperParams {
            viscosity_ratio: self.viscosity_ratio,
            ramp: self.ramp,
            rho: self.rho,
            uzawa_steps: self.uzawa_steps,
            particle_velocity: match self.velocity {
                ParticleVelocity::Mean => gluey_stokes::ParticleVelocity::WeightedMean,
                ParticleVelocity::Center => gluey_stokes::ParticleVelocity::Center,
            },
            ..PaperParams::default()
        }
    }
}
