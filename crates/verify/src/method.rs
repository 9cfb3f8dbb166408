//! The formulations that the book compares.

use gluey_stokes::{CutCellPressures, FlowParams, Formulation, Heights, Lubrication, PaperParams};

/// A formulation with the settings that a case has by default.
#[derive(Debug)]
pub struct Method {
    /// Its name in case files.
    pub name: &'static str,
    /// Whether cells in narrow films are smaller by default in 2D.
    pub refines_films: bool,
    /// Whether it is right for films that no cell resolves.
    pub lubricates: bool,
    /// Whether bodies can be held at given twists.
    pub holds_bodies: bool,
    /// The formulation in a number of dimensions.
    pub formulation: fn(usize) -> Formulation,
}

/// All of them. Another one is a line here; its limits are lines of `limits.csv`.
pub const FILM_METHODS: &[Method] = &[
    Method {
        name: "rigid-dofs",
        refines_films: true,
        lubricates: false,
        holds_bodies: true,
        formulation: |d| Formulation::RigidDofs {
            offset: gluey_stokes::default_offset(d),
            cut_cell_pressures: CutCellPressures::Aggregate,
        },
    },
    Method {
        name: "paper",
        refines_films: false,
        lubricates: false,
        holds_bodies: false,
        formulation: |_| Formulation::Paper(PaperParams::default()),
    },
    Method {
        name: "unfitted",
        refines_films: false,
        lubricates: true,
        holds_bodies: true,
        formulation: |_| Formulation::Unfitted { lubrication: Lubrication::Deficit },
    },
    Method {
        name: "unfitted-bare",
        refines_films: false,
        lubricates: false,
        holds_bodies: true,
        formulation: |_| Formulation::Unfitted { lubrication: Lubrication::None },
    },
];

/// Those that differ in more than thin films: what chapters without any compare.
pub const METHODS: &[Method] = FILM_METHODS.split_at(3).0;

impl Method {
    /// Parameters of its flows in `D` dimensions, in a fluid of viscosity one, by the usual solver.
    pub fn params<const D: usize>(&self, tolerance: f64) -> FlowParams {
        FlowParams { formulation: (self.formulation)(D), tolerance, ..FlowParams::for_dimension(D) }
    }

    /// The thicknesses to which films are widened on cells of this size.
    pub fn heights_of_films<const D: usize>(&self, cell_size: f64) -> Heights {
        match (self.formulation)(D) {
            Formulation::Unfitted { lubrication } => lubrication.heights::<D>(cell_size),
            _ => Heights::default(),
        }
    }
}
