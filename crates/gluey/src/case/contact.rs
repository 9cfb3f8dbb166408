//! What a case says of contact.

use gluey_contact::{
    ContactLaw, ContactParams, FlowContactParams, Friction, GammaUpdate as Memory, NormalLaw,
    SolverKind as ContactSolver,
};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use super::names::{Metric, Strategy, schema_of_names};

/// Change of the forces of gluey contacts by another flow at which they are those of the step: what is wrong
/// with a force stays in the memory.
const GLUEY_TOLERANCE: f64 = 1e-3;

/// Contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// The contact law, which keeps particles from overlapping; `none` leaves that to the flow. Forces of
    /// `rough` contacts act in the flow, those of the others correct velocities after it. Default: "gluey".
    pub strategy: Strategy,
    /// How contact forces move particles: `flow` (they act in the flow of the step, which is solved again
    /// until they agree with it) or `drag` (each particle feels its own Stokes drag, after the flow: the
    /// paper's). Default: "flow" for `rough`, "drag" for the others.
    pub metric: Option<Metric>,
    /// Smallest gap of `rough` surfaces. Unit: mean radius of the pair. Default: 0.005.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 0.5))]
    pub roughness: f64,
    /// Coefficient of friction between `rough` surfaces; 0 for none, `inf` for surfaces that never slip.
    /// Unit: none. Default: 0.5.
    #[schemars(range(min = 0))]
    pub friction: f64,
    /// Normal force below which a contact of `rough` surfaces is without friction. Unit: 6 pi viscosity a^2
    /// times the shear rate with the mean radius a; where the shear stress is given, viscosity length^2/time.
    /// Default: 0.
    #[schemars(range(min = 0))]
    pub friction_load: f64,
    /// Change of contact forces that act in the flow over their size, by their power, at which a step needs
    /// no other flow with them. Unit: none. Default: 0.05, for `gluey`, which remembers forces, 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 1))]
    pub flow_tolerance: Option<f64>,
    /// Whether the constraint is linearised again at the end of the step, until gaps are >= 0 to round-off.
    /// Default: true.
    pub exact_gap: bool,
    /// How gamma, the memory of a contact, is integrated: by the scheme that moves the particles
    /// (`consistent`: a contact ends within a step, and encounters are reversible to second order) or as in
    /// the paper, whole steps at a time (`paper`). Default: "consistent".
    #[schemars(schema_with = "memories")]
    pub memory: Memory,
    /// Floor of gamma for rough particles: however long they were pressed together, they part after this
    /// impulse. Unit: length^2. Default: none.
    #[schemars(extend("exclusiveMaximum" = 0))]
    pub gamma_min: Option<f64>,
    /// Gap kept by the strategy `velocity-correction`. Unit: mean radius of the pair. Default: 1e-4.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
    pub threshold: f64,
    /// How contact forces are solved for: `auto` (a closed form for one contact, Uzawa's method for two, the
    /// active set for more), `uzawa` (the paper's; slow for clusters), `accelerated` or `active-set`. All
    /// give the same velocities. Default: "auto".
    #[schemars(schema_with = "solvers")]
    pub solver: ContactSolver,
    /// Residual at which contact forces are accepted, which is the overlap that is left. Unit: smallest
    /// radius, or the largest displacement in a step if that is larger. Default: 1e-13.
    #[schemars(range(min = 1e-15, max = 1e-3))]
    pub tolerance: f64,
}

impl ContactSpec {
    /// The change of forces at which a step needs no other flow, by the strategy unless the case says it.
    pub fn flow_tolerance(&self) -> f64 {
        let usual = match self.strategy {
            Strategy::Gluey => GLUEY_TOLERANCE,
            _ => FlowContactParams::FLOW_TOLERANCE,
        };
        self.flow_tolerance.unwrap_or(usual)
    }

    /// Whether the forces of contacts act in the flow, by the strategy unless the case says so.
    pub fn metric(&self) -> Metric {
        let usual = if self.strategy == Strategy::Rough { Metric::Flow } else { Metric::Drag };
        self.metric.unwrap_or(usual)
    }

    /// These parameters as the model of contacts in the flow takes them, where a critical load of one is
    /// this; `None` where contacts correct velocities after the flow.
    pub fn in_flow(&self, unit_of_load: f64) -> Option<FlowContactParams> {
        let (law, friction) = match self.strategy.law() {
            None => {
                let load = self.friction_load * unit_of_load;
                let friction = Friction { coefficient: self.friction, load };
                (NormalLaw::Rough { roughness: self.roughness }, friction)
            }
            Some(_) => (NormalLaw::Smooth(self.params()), Friction::default()),
        };
        let params = FlowContactParams { law, friction, ..FlowContactParams::default() };
        (self.metric() == Metric::Flow).then_some(params)
    }

    /// These parameters as the contact model takes them.
    pub fn params(&self) -> ContactParams {
        ContactParams {
            law: self.strategy.law().unwrap_or(ContactLaw::None),
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

impl Default for ContactSpec {
    fn default() -> Self {
        let ContactParams { gamma_min, threshold, solver, tolerance, .. } = ContactParams::default();
        Self {
            strategy: Strategy::default(),
            metric: None,
            roughness: FlowContactParams::ROUGHNESS,
            friction: FlowContactParams::FRICTION,
            friction_load: 0.0,
            flow_tolerance: None,
            exact_gap: true,
            memory: Memory::Consistent,
            gamma_min,
            threshold,
            solver,
            tolerance,
        }
    }
}

fn memories(_: &mut SchemaGenerator) -> Schema {
    schema_of_names(&[Memory::Paper, Memory::Consistent])
}

fn solvers(_: &mut SchemaGenerator) -> Schema {
    schema_of_names(&ContactSolver::ALL)
}
