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
mod contact;
mod error;
mod fill;
mod filled;
mod findings;
mod flow;
mod forces;
mod form;
mod given;
mod given_stress;
mod idle;
mod idle_key;
mod key;
mod keys;
mod load;
mod locate;
mod mesh;
mod names;
pub(crate) mod neighbours;
mod output;
mod overrides;
mod particle;
mod particle_problem;
mod particles_file;
mod repulsion;
mod schema;
mod suggest;
mod suspension;
mod validate;

pub use contact::ContactSpec;
pub use error::{CaseError, CaseIssue, CaseProblem, InvalidCase, IssuePlace, Key, KeyPart};
pub use flow::{FlowSpec, MeshSpec, PairMobilitySpec, PaperSpec};
pub use gluey_contact::{GammaUpdate as Memory, SolverKind as ContactSolver};
pub use gluey_motion::Scheme;
pub use idle_key::IdleKey;
pub use keys::CaseKey;
pub use mesh::default_cells_per_radius;
pub use names::{
    ArrangementName, Boundary, Formulation, Hydrodynamics, Lubrication, Metric, OutputKind, ParticleVelocity,
    Precision, RadiiKind, Solver, Strategy, UnknownName,
};
pub use output::{Interval, OutputSpec};
pub use overrides::{BadOverride, Override};
pub use particle::ParticleSpec;
pub use particle_problem::ParticleProblem;
pub use repulsion::RepulsionSpec;
pub use suspension::{RadiiSpec, SuspensionSpec};

use gluey_contact::{Domain, Wall};
use gluey_geom::{Lattice, Particle, Vector};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

/// The axis across the shear: the box has walls there.
const WALLED_AXIS: usize = 1;

/// Counts changes of the layout of case files: what was right under one number is read the same under it.
pub const VERSION: u32 = 1;

/// A complete, checked description of one run.
///
/// Lengths and times are in the units of the box and of the shear rate; the viscosity of the fluid is 1. So
/// forces are in units of the viscosity times a length squared over a time; in 2D, where they are those on a
/// unit of depth, times a length over a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Version of the layout of case files that this one is written in. Unit: none. Default: 1.
    #[serde(default = "present_version")]
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Name of the case, used for output files: letters, digits, `-` and `_`, at most 64 of them.
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: String,
    /// Dimension of space: discs or spheres. Unit: none.
    #[schemars(range(min = 2, max = 3))]
    pub dimension: usize,
    /// The imposed shear rate `gamma_dot`: the undisturbed velocity is `gamma_dot (y - y_mid) e_x`. Unit:
    /// 1/time. Default: 1.
    #[serde(default = "one")]
    pub shear_rate: f64,
    /// Shear stress that drives a box that is sheared for ever, instead of a shear rate: that of fluid,
    /// particles and their repulsion, without contacts. The run counts strain then, in `time.step`,
    /// `time.end` and the column `t`, and velocities are by strain; time and shear rate are written to
    /// `<name>-rheology.csv`. Unit: viscosity/time. Default: none, the rate is given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_stress: Option<f64>,
    /// Weight of the particles per unit of volume (in 2D: area), less that of the fluid: `(rho_s - rho_f) g`,
    /// one coordinate per dimension. It is not reversed with the shear. Unit: viscosity/(length time).
    /// Default: none.
    #[schemars(length(min = 2, max = 3))]
    #[serde(default)]
    pub gravity: Option<Vec<f64>>,
    /// Force per unit of volume on fluid and particles alike, one coordinate per dimension: minus the mean
    /// gradient of the pressure that drives fluid along a periodic axis. It needs a period along each axis
    /// with a component, and walls or particles that are held to stand on. It is not reversed with the shear.
    /// In `unfitted`. Unit: viscosity/(length time). Default: none, but in a box without walls where
    /// particles are held that without which there would be a mean flow.
    #[schemars(length(min = 2, max = 3))]
    #[serde(default)]
    pub body_force: Option<Vec<f64>>,
    /// Name of a reference solution to compare with. Default: none.
    #[schemars(schema_with = "references")]
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
    /// `y` (`z` in 3D) and `radius` under a header with these names; absent once it was read. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particles_file: Option<String>,
    /// Time stepping.
    pub time: TimeSpec,
    /// Contact.
    #[serde(default)]
    pub contact: ContactSpec,
    /// Repulsion of particles, images and walls that decays with the gap `g`: `force exp(-g/range)` between
    /// two particles of the mean radius. Others repel each other in proportion to the harmonic mean of
    /// their radii, in 2D to its root; a wall counts as a particle of infinite radius. Forces below a
    /// millionth of that at contact are left out.
    #[serde(default)]
    pub repulsion: RepulsionSpec,
    /// Flow.
    #[serde(default)]
    pub flow: FlowSpec,
    /// Rheology, in a box that is sheared for ever, whose particles are free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rheology: Option<RheologySpec>,
    /// Streams of frames to write, for ParaView, OVITO and others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputSpec>,
    /// Seed of the particles that were generated; no key of a case file.
    #[serde(skip)]
    pub seed: Option<u64>,
    /// Keys that did nothing for the particles that were generated; no key of a case file.
    #[serde(skip)]
    pub idle_in_suspension: Vec<IdleKey>,
}

/// Rheology.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RheologySpec {
    /// The stress of the suspension is computed and written every so many steps. Unit: steps. Default: 1.
    #[schemars(range(min = 1))]
    pub every: usize,
}

impl Default for RheologySpec {
    fn default() -> Self {
        Self { every: 1 }
    }
}

/// The box of fluid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DomainSpec {
    /// Corner with the smallest coordinates. Unit: length. Default: the origin.
    #[schemars(length(min = 2, max = 3))]
    pub lower: Option<Vec<f64>>,
    /// Corner with the largest coordinates. Unit: length. Default: (1, 1), in 3D (1, 1, 1).
    #[schemars(length(min = 2, max = 3))]
    pub upper: Option<Vec<f64>>,
    /// Condition on the boundary. Default: "couette".
    pub boundary: Boundary,
}

/// Time stepping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeSpec {
    /// Time step `dt`. Unit: time.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step: f64,
    /// End of the run; the last step ends at the first multiple of `step` that is not before it. Unit: time.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub end: f64,
    /// Scheme that moves the particles: of first or of second order. Default: "adams-bashforth-2".
    #[serde(default = "second_order")]
    #[schemars(schema_with = "schemes")]
    pub scheme: Scheme,
    /// A step in which films cannot be kept open, because particles move too far in it, is done in two
    /// halves, these in halves again, and so on up to so many times: to a 256th by default. Rows stay where
    /// they are. 0: such a step ends the run. Unit: none. Default: 8.
    #[serde(default = "default_halvings")]
    #[schemars(range(max = 20))]
    pub halvings: u32,
    /// Error that the time scheme may make in a part of a step, in positions over radii, in root mean square
    /// over the particles, as estimated from how velocities bend. Steps are done in two halves, these in
    /// halves again, `halvings` times at most, until it is no larger; rows stay where they are. Steps that
    /// turn out to have a larger one are counted. Unit: none. Default: none, steps are done in one part.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
    /// The shear is reversed at the first step that starts at this time or later. Unit: time. Default: never.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reverse_at: Option<f64>,
    /// The shear oscillates: at a constant rate the strain goes to this value, to minus this value and back
    /// to 0, again and again. A whole number of steps makes up this strain; four times as many are a cycle.
    /// Unit: none. Default: none, it does not oscillate.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub strain_amplitude: Option<f64>,
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

    /// The particles of a checked case at time 0.
    pub(crate) fn start<const D: usize>(&self) -> Vec<Particle<D>> {
        let position = |coordinates: &[f64]| Vector::<D>::from_fn(|axis, _| coordinates[axis]);
        self.particles.iter().map(|spec| Particle::new(position(&spec.position), spec.radius)).collect()
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

    /// Whether there is a stress to compute: where the box is sheared, not at the rate 0, and all particles
    /// are free. What acts on others from outside is no stress of the suspension.
    pub fn has_rheology(&self) -> bool {
        self.is_sheared() && self.shear_rate != 0.0 && !self.gives_motions()
    }

    /// Steps from one at which the stress is computed to the next.
    pub fn stress_every(&self) -> usize {
        self.rheology.clone().unwrap_or_default().every
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

    /// Velocity along itself of a wall of the surroundings in the shear of the case.
    pub(crate) fn velocity_of_wall<const D: usize>(&self, wall: &Wall<D>) -> Vector<D> {
        let middle = 0.5 * (self.lower()[WALLED_AXIS] + self.upper()[WALLED_AXIS]);
        let height = wall.normal[WALLED_AXIS] * wall.offset - middle;
        Vector::from_fn(|d, _| if d == 0 { self.shear_rate * height } else { 0.0 })
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

fn default_halvings() -> u32 {
    8
}

fn second_order() -> Scheme {
    Scheme::AdamsBashforth2
}

fn present_version() -> u32 {
    VERSION
}

fn schemes(_: &mut SchemaGenerator) -> Schema {
    names::schema_of_names(&[Scheme::Euler, Scheme::AdamsBashforth2])
}

fn references(_: &mut SchemaGenerator) -> Schema {
    names::schema_of_names(crate::reference::NAMES)
}
