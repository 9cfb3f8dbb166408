//! The formulations that the book compares.

use gluey_stokes::{FlowParams, Formulation, Heights, Lubrication, PaperParams};

/// A formulation with the settings that a case has by default.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Its name in case files.
    pub name: &'static str,
    /// Whether it is right for films that no cell resolves.
    pub lubricates: bool,
    /// Whether bodies can be held at given twists.
    pub holds_bodies: bool,
    /// The formulation.
    pub formulation: fn() -> Formulation,
}

const PAPER: Method = Method {
    name: "paper",
    lubricates: false,
    holds_bodies: false,
    formulation: || Formulation::Paper(PaperParams::default()),
};

const UNFITTED: Method = Method {
    name: "unfitted",
    lubricates: true,
    holds_bodies: true,
    formulation: || Formulation::Unfitted { lubrication: Lubrication::Deficit },
};

const UNFITTED_BARE: Method = Method {
    name: "unfitted-bare",
    lubricates: false,
    holds_bodies: true,
    formulation: || Formulation::Unfitted { lubrication: Lubrication::None },
};

/// What chapters without thin films compare. Another one is a line here and in [`FILM_METHODS`], and in
/// `IN_SHEARED_BOXES` if it knows them; its limits are lines of `limits.csv`.
pub const METHODS: &[Method] = &[PAPER, UNFITTED];

/// Those of [`METHODS`] that know boxes that are sheared for ever.
pub const IN_SHEARED_BOXES: &[Method] = &[UNFITTED];

/// What chapters with thin films compare.
pub const FILM_METHODS: &[Method] = &[PAPER, UNFITTED, UNFITTED_BARE];

/// Those of these that can hold bodies.
pub fn holding(methods: &'static [Method]) -> impl Iterator<Item = &'static Method> + Clone {
    methods.iter().filter(|method| method.holds_bodies)
}

impl Method {
    /// Parameters of its flows in `D` dimensions, in a fluid of viscosity one, by the usual solver.
    pub fn params<const D: usize>(&self, tolerance: f64) -> FlowParams {
        FlowParams { formulation: (self.formulation)(), tolerance, ..FlowParams::for_dimension(D) }
    }

    /// The thicknesses to which films are widened on cells of this size.
    pub fn heights_of_films<const D: usize>(&self, cell_size: f64) -> Heights {
        match (self.formulation)() {
            Formulation::Unfitted { lubrication } => lubrication.heights::<D>(cell_size),
            _ => Heights::default(),
        }
    }
}
