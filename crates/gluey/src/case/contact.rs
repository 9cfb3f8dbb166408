//! What a case says of contact.

use gluey_contact::{
    ContactLaw as Strategy, ContactParams, GammaUpdate as Memory, SolverKind as ContactSolver,
};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use super::names::schema_of_names;

/// Contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// The contact law, which keeps particles from overlapping; `none` leaves that to the flow. Default:
    /// "gluey".
    #[schemars(schema_with = "strategies")]
    pub strategy: Strategy,
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

fn strategies(_: &mut SchemaGenerator) -> Schema {
    schema_of_names(&Strategy::ALL)
}

fn memories(_: &mut SchemaGenerator) -> Schema {
    schema_of_names(&[Memory::Paper, Memory::Consistent])
}

fn solvers(_: &mut SchemaGenerator) -> Schema {
    schema_of_names(&ContactSolver::ALL)
}
