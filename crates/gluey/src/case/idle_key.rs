//! What is told of a key that does nothing.

/// A key that is set to something else than its default and does nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdleKey {
    /// The key, with its tables: `flow.paper.rho`.
    pub key: String,
    /// What makes it idle, as a case says it: `flow.formulation = "unfitted"`.
    pub why: String,
}
