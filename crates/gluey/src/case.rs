//! A case: everything a run depends on, as read from a TOML file and checked once.
//!
//! ```
//! let text = r#"
//! name = "one-disc"
//! dimension = 2
//! [[particles]]
//! position = [0.5, 0.7]
//! radius = 0.05
//! [time]
//! step = 0.025
//! end = 1.0
//! "#;
//! let case = gluey::Case::parse(text, "one-disc.toml")?;
//! assert_eq!(case.step_count(), 40);
//! # Ok::<(), gluey::CaseError>(())
//! ```

mod box_and_strain;
mod comparable;
mod error;
mod fill;
mod filled;
mod forces;
mod load;
mod mesh;
mod names;
pub(crate) mod neighbours;
mod overrides;
mod particle;
mod particle_problem;
mod particles_file;
mod suggest;
mod suspension;
mod validate;

pub use error::{CaseError, CaseIssue, Key, KeyPart, Problem};
pub use gluey_contact::{ContactLaw as Strategy, GammaUpdate as Memory, SolverKind as ContactSolver};
pub use gluey_motion::Scheme;
pub use mesh::{default_cells_per_radius, default_gap_levels};
pub use names::{
    ArrangementName, Boundary, Formulation, Hydrodynamics, Lubrication, ParticleVelocity, RadiiKind, Solver,
    UnknownName,
};
pub use overrides::{BadOverride, Override};
pub use particle::ParticleSpec;
pub use particle_problem::ParticleProblem;
pub use suspension::{RadiiSpec, SuspensionSpec};

use gluey_contact::{ContactParams, Domain, Wall};
use gluey_geom::{Lattice, Vector};
use gluey_stokes::PaperParams;
use serde::{Deserialize, Serialize};

/// The axis across the shear: the box has walls there.
const WALLED_AXIS: usize = 1;

/// A complete, checked description of one run.
///
/// Lengths and times are in the units of the box and of the shear rate; the viscosity of the fluid is 1. So
/// forces are in units of the viscosity times a length squared over a time; in 2D, where they are those on a
/// unit of depth, times a length over a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Name of the case, used for output files: letters, digits, `-` and `_`.
    pub name: String,
    /// Dimension of space, 2 or 3.
    pub dimension: usize,
    /// The imposed shear rate `gamma_dot`: the undisturbed velocity is `gamma_dot (y - y_mid) e_x`.
    #[serde(default = "one")]
    pub shear_rate: f64,
    /// Weight of the particles per unit of volume (in 2D: area), less that of the fluid: `(rho_s - rho_f) g`,
    /// one coordinate per dimension. Nothing when absent. It is not reversed with the shear.
    #[serde(default)]
    pub gravity: Option<Vec<f64>>,
    /// Name of a reference solution to compare with, see [`crate::reference::NAMES`].
    #[serde(default)]
    pub reference: Option<String>,
    /// The box of fluid.
    #[serde(default)]
    pub domain: DomainSpec,
    /// The particles at time 0. In a case that was read they are there, wherever they came from: a list in
    /// the case, `suspension` or `particles_file`.
    #[serde(default)]
    pub particles: Vec<ParticleSpec>,
    /// Particles to generate instead of a list; absent once they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suspension: Option<SuspensionSpec>,
    /// File of particles instead of a list, from the folder of the case file: comma-separated columns `x`,
    /// `y` (`z` in 3D) and `radius` under a header with these names; absent once it was read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particles_file: Option<String>,
    /// Time stepping.
    pub time: TimeSpec,
    /// Contact.
    #[serde(default)]
    pub contact: ContactSpec,
    /// Flow.
    #[serde(default)]
    pub flow: FlowSpec,
    /// Rheology, in a box that is sheared for ever.
    #[serde(default)]
    pub rheology: RheologySpec,
    /// Seed of the particles that were generated; no key of a case file.
    #[serde(skip)]
    pub seed: Option<u64>,
}

/// Rheology.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RheologySpec {
    /// The stress of the suspension is computed and written every so many steps.
    pub every: usize,
}

impl Default for RheologySpec {
    fn default() -> Self {
        Self { every: 1 }
    }
}

/// The box of fluid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DomainSpec {
    /// Corner with the smallest coordinates; the origin when absent.
    pub lower: Option<Vec<f64>>,
    /// Corner with the largest coordinates; (1, 1[, 1]) when absent.
    pub upper: Option<Vec<f64>>,
    /// Condition on the boundary.
    pub boundary: Boundary,
}

/// Time stepping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeSpec {
    /// Time step `dt > 0`.
    pub step: f64,
    /// End of the run; the last step ends at the first multiple of `step` that is not before it.
    pub end: f64,
    /// Scheme.
    #[serde(default = "second_order")]
    pub scheme: Scheme,
    /// The shear is reversed at the first step that starts at this time or later.
    #[serde(default)]
    pub reverse_at: Option<f64>,
    /// The shear oscillates: at a constant rate the strain goes to this value, to minus this value and back
    /// to 0, again and again. A whole number of steps makes up this strain; four times as many are a cycle.
    #[serde(default)]
    pub strain_amplitude: Option<f64>,
}

/// Contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// The contact law, which keeps particles from overlapping.
    pub strategy: Strategy,
    /// Whether the constraint is linearised again at the end of the step, until gaps are >= 0 to round-off.
    pub exact_gap: bool,
    /// How gamma, the memory of a contact, is integrated: by the scheme that moves the particles
    /// (`consistent`, the default: a contact ends within a step, and encounters are reversible to second
    /// order) or as in the paper, whole steps at a time (`paper`).
    pub memory: Memory,
    /// Floor of gamma (< 0) for rough particles; none when absent.
    pub gamma_min: Option<f64>,
    /// Gap kept by the strategy `velocity-correction`, relative to the mean radius of the pair.
    pub threshold: f64,
    /// How contact forces are solved for: `auto` (a closed form for one contact, Uzawa's method for two, the
    /// active set for more), `uzawa` (the paper's; slow for clusters), `accelerated` or `active-set`. All
    /// give the same velocities.
    pub solver: ContactSolver,
    /// Residual at which contact forces are accepted, relative to the smallest radius (or the largest
    /// displacement in a step, if that is larger): from 1e-15 to 1e-3. It is the overlap that is left.
    pub tolerance: f64,
}

impl ContactSpec {
    /// These parameters as the contact model takes them.
    pub fn params(&self) -> ContactParams {
        ContactParams {
            law: self.strategy,
            exact_gap: self.exact_gap,
            gamma_update: self.memory,
            gamma_min: self.gamma_min,
            threshold: self.threshold,
            solver: self.solver,
            tolerance: self.tolerance,
            ..ContactParams::default()
        }
    }
}

/// Flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlowSpec {
    /// Who predicts the velocities.
    pub hydrodynamics: Hydrodynamics,
    /// How rigidity enters.
    pub formulation: Formulation,
    /// What acts in films that are too thin for the mesh; when absent, `deficit` in `unfitted` and `none`
    /// elsewhere.
    pub lubrication: Option<Lubrication>,
    /// How the equations are solved.
    pub solver: Solver,
    /// Relative tolerance of the residual of a linear solve.
    pub tolerance: f64,
    /// The mesh.
    pub mesh: MeshSpec,
    /// Parameters of the `paper` formulation.
    pub paper: PaperSpec,
    /// Parameters of the `rigid-dofs` formulation.
    #[serde(rename = "rigid-dofs")]
    pub rigid_dofs: RigidDofsSpec,
    /// Parameters of the `pair-mobility` model.
    #[serde(rename = "pair-mobility")]
    pub pair_mobility: PairMobilitySpec,
}

/// The 2^D-tree mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MeshSpec {
    /// The cells at the surfaces have at least this many edges in a radius of the smallest particle; when
    /// absent, what [`default_cells_per_radius`] gives.
    pub cells_per_radius: Option<f64>,
    /// Root cells of the tree along the shortest edge of the box, at least. Cells are halves of halves of
    /// these: with 3 instead of 1 they may have 2/3 of the size.
    pub root_cells: u32,
    /// Cells are at most `2^-coarsest_level` of a root cell.
    pub coarsest_level: u32,
    /// Cells of the finest level kept around each particle, beside those that fill it: coarser ones inside
    /// save little and, in `paper`, where the interior carries strain and multiplier, change velocities.
    pub band: f64,
}

/// Parameters of the `paper` formulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PaperSpec {
    /// Viscosity of the particles over that of the fluid, `r`.
    pub viscosity_ratio: f64,
    /// Uzawa iterations per time step; with 1 the multiplier is never used, which is a penalty method and
    /// called so in reports.
    pub uzawa_steps: usize,
    /// Step of the Uzawa iteration, `0 < rho < 4`.
    pub rho: f64,
    /// Width of the viscosity ramp inside the surface, in cells.
    pub ramp: f64,
    /// How the motion of a particle is taken from the field: `mean`, over the particle, or `center`, the
    /// paper's equation 11.
    pub velocity: ParticleVelocity,
}

/// Parameters of the `rigid-dofs` formulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigidDofsSpec {
    /// A node is rigid where the signed distance (positive inside) is at least this many cells; when absent,
    /// what [`gluey_stokes::default_offset`] gives.
    pub offset: Option<f64>,
    /// Cells in a gap are no larger than this fraction of the local distance between the surfaces; 0 leaves
    /// gaps alone.
    pub gap_fraction: f64,
    /// Levels beyond that of the surfaces that gaps may use; when absent, what
    /// [`default_gap_levels`] gives.
    pub gap_levels: Option<u32>,
}

/// Parameters of the `pair-mobility` model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PairMobilitySpec {
    /// The mobility is evaluated at the gap plus this many radii, to imitate a solver that does not resolve
    /// the film.
    pub gap_offset: f64,
}

impl Default for ContactSpec {
    fn default() -> Self {
        let ContactParams { law: strategy, gamma_min, threshold, solver, tolerance, .. } =
            ContactParams::default();
        Self {
            strategy,
            exact_gap: true,
            memory: Memory::Consistent,
            gamma_min,
            threshold,
            solver,
            tolerance,
        }
    }
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
            rigid_dofs: RigidDofsSpec::default(),
            pair_mobility: PairMobilitySpec::default(),
        }
    }
}

impl Default for MeshSpec {
    fn default() -> Self {
        Self { cells_per_radius: None, root_cells: 1, coarsest_level: 3, band: 2.0 }
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

impl Default for RigidDofsSpec {
    fn default() -> Self {
        Self { offset: None, gap_fraction: 1.0, gap_levels: None }
    }
}

impl Case {
    /// Number of time steps.
    pub fn step_count(&self) -> usize {
        let count = self.time.end / self.time.step;
        (count - 1e-9 * count.max(1.0)).ceil() as usize
    }

    /// Mean radius of all particles: the `a` of every "over a".
    pub fn mean_radius(&self) -> f64 {
        self.particles.iter().map(|particle| particle.radius).sum::<f64>() / self.particles.len() as f64
    }

    /// Lower corner of the box, one coordinate per dimension.
    pub fn lower(&self) -> Vec<f64> {
        self.domain.lower.clone().unwrap_or_else(|| vec![0.0; self.dimension])
    }

    /// Upper corner of the box, one coordinate per dimension.
    pub fn upper(&self) -> Vec<f64> {
        self.domain.upper.clone().unwrap_or_else(|| vec![1.0; self.dimension])
    }

    /// Edge lengths of the box.
    pub(crate) fn edges(&self) -> Vec<f64> {
        self.lower().iter().zip(self.upper()).map(|(lower, upper)| upper - lower).collect()
    }

    /// Length of the box along an axis in which the particles see images of each other.
    pub fn period(&self, axis: usize) -> Option<f64> {
        let flows = self.flow.hydrodynamics == Hydrodynamics::Stokes;
        let has_period = match self.domain.boundary {
            Boundary::Couette => false,
            Boundary::Periodic => axis != WALLED_AXIS,
            Boundary::Sheared => true,
        };
        let is_periodic = flows && has_period;
        is_periodic.then(|| self.upper()[axis] - self.lower()[axis])
    }

    /// Whether the box is sheared for ever, with images that slide along each other.
    pub fn is_sheared(&self) -> bool {
        self.flow.hydrodynamics == Hydrodynamics::Stokes && self.domain.boundary == Boundary::Sheared
    }

    /// Whether there is a stress to compute: where the box is sheared, and not at the rate 0.
    pub fn has_rheology(&self) -> bool {
        self.is_sheared() && self.shear_rate != 0.0
    }

    /// Surroundings of the particles: walls below and above (y), which move along themselves, and the
    /// periods. Nothing without a finite-element flow.
    pub(crate) fn surroundings<const D: usize>(&self) -> Domain<D> {
        if self.flow.hydrodynamics != Hydrodynamics::Stokes {
            return Domain::default();
        }
        let bounds = [self.lower(), self.upper()].map(|x| Vector::<D>::from_fn(|d, _| x[d]));
        let inwards = Vector::<D>::from_fn(|d, _| if d == WALLED_AXIS { 1.0 } else { 0.0 });
        let [below, above] = bounds;
        let walls = match self.is_sheared() {
            true => Vec::new(),
            false => vec![Wall::new(&below, &inwards), Wall::new(&above, &-inwards)],
        };
        Domain {
            walls,
            lattice: Lattice::new(std::array::from_fn(|axis| self.period(axis))),
            ..Domain::default()
        }
    }

    /// Name of the output files of this case: case and strategy, and the formulation where it is not the
    /// paper's.
    pub fn file_stem(&self) -> String {
        let stem = format!("{}-{}", self.name, self.contact.strategy);
        match (self.flow.hydrodynamics, self.flow.formulation) {
            (Hydrodynamics::Stokes, Formulation::Paper) | (Hydrodynamics::PairMobility, _) => stem,
            (Hydrodynamics::Stokes, formulation) => format!("{stem}-{formulation}"),
        }
    }

    /// What acts in films that are too thin for the mesh.
    pub fn lubrication(&self) -> Lubrication {
        let flow = &self.flow;
        let default = match (flow.hydrodynamics, flow.formulation) {
            (Hydrodynamics::Stokes, Formulation::Unfitted) => Lubrication::Deficit,
            _ => Lubrication::None,
        };
        flow.lubrication.unwrap_or(default)
    }

    /// Whether `paper` makes a single solve, which leaves its multiplier unused.
    fn is_penalty(&self) -> bool {
        self.flow.formulation == Formulation::Paper && self.flow.paper.uzawa_steps == 1
    }

    /// How the flow is modelled, as reports name it: the formulation, `penalty` for `paper` with a single
    /// Uzawa step, or the analytic model's name.
    pub fn flow_name(&self) -> &'static str {
        match self.flow.hydrodynamics {
            Hydrodynamics::Stokes if self.is_penalty() => "penalty",
            Hydrodynamics::Stokes => self.flow.formulation.name(),
            Hydrodynamics::PairMobility => self.flow.hydrodynamics.name(),
        }
    }
}

fn one() -> f64 {
    1.0
}

fn second_order() -> Scheme {
    Scheme::AdamsBashforth2
}
