//! The numbers that are taken from tables.

/// The kind of a number, and so what can be wanted of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberKind {
    /// An order of convergence: the larger the better.
    Order,
    /// An error with a sign: near zero.
    Error,
    /// The size of an error: small.
    Size,
    /// Anything else, such as seconds: has no limit.
    Remark,
}

/// A number that is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// What it is, in words; names it in `limits.csv`.
    pub what: String,
    /// Name of the formulation.
    pub method: &'static str,
    /// What kind of number it is.
    pub kind: NumberKind,
    /// The number.
    pub value: f64,
}

impl Number {
    /// A number of a formulation.
    pub fn new(kind: NumberKind, what: String, method: &'static str, value: f64) -> Self {
        Self { what, method, kind, value }
    }

    /// Mean and scatter of an error over positions.
    pub fn mean_and_scatter(name: &str, method: &'static str, mean: f64, scatter: f64) -> [Self; 2] {
        [
            Self::new(NumberKind::Error, format!("{name}, mean error"), method, mean),
            Self::new(NumberKind::Size, format!("{name}, scatter"), method, scatter),
        ]
    }
}
