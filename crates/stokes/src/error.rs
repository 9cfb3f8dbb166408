//! Why a flow could not be computed.

use gluey_fem::MeshError;
use gluey_linalg::{BadDiagonal, BlockError, DirectError, KrylovError, SparseError};

/// Failure of a Stokes solve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StokesError {
    /// What goes wrong in the part of another rank.
    #[error("{message} (on rank {rank})")]
    Elsewhere {
        /// Which rank, the first of them.
        rank: usize,
        /// What it says.
        message: String,
    },
    /// The mesh cannot be built.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A body is too small for the mesh.
    #[error(
        "body {} has a radius of {:.3} cells ({radius}, cells of size {cell_size}) and too few nodes: refine the mesh to \
         cells smaller than the radius",
        body + 1, radius / cell_size
    )]
    Unresolved {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Radius of the body.
        radius: f64,
        /// Size of the finest cells.
        cell_size: f64,
    },
    /// No quadrature point of the penalised solid belongs to a body, or so few that they fix no rotation: its
    /// motion is unknown.
    #[cfg(feature = "paper")]
    #[error(
        "body {} with a radius of {:.3} cells ({radius}, cells of size {cell_size}) has no solid from which to tell its \
         motion: refine the mesh, or move it out of the body that covers it",
        body + 1, radius / cell_size
    )]
    NoSolid {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Radius of the body.
        radius: f64,
        /// Size of the finest cells.
        cell_size: f64,
    },
    /// No cell with enough fluid is near a cell with too little for unknowns of its own.
    #[error(
        "a cell at body {} has a share of fluid of {share:.1e} and no cell with more around it: refine the mesh, or \
         move the bodies that enclose it apart",
        body + 1
    )]
    NoRoot {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Share of fluid in the cell.
        share: f64,
    },
    /// The strain energy of the fluid in a cell and those that follow it is not positive.
    #[error(
        "the fluid in cell {cell} at body {} has no positive strain energy: do bodies overlap by more than rounding?",
        body + 1
    )]
    NoPenalty {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Index of the cell in the mesh.
        cell: usize,
    },
    /// The velocity block lacks positivity in a cell, whatever its penalty.
    #[error(
        "the penalty of cell {cell} at body {} was raised {rounds} times, and its surface still takes {share:.2} of the \
         strain energy around it: refine the mesh",
        body + 1
    )]
    WeakSurface {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Index of the cell in the mesh.
        cell: usize,
        /// What the tractions on the surface take, over the strain energy around the cell.
        share: f64,
        /// How often the penalty was raised.
        rounds: usize,
    },
    /// Cells of different sizes meet at a surface.
    #[error("the surface of body {} meets cells of different sizes: refine the mesh around it", body + 1)]
    CoarseSurface {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
    },
    /// Bodies need one entry each.
    #[error("{found} {what} for {bodies} bodies: give one for each")]
    Count {
        /// What was given.
        what: &'static str,
        /// How many.
        found: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// The formulation of rigidity cannot answer this.
    #[error("{what} are not available in this formulation of rigidity; `unfitted` has them")]
    Unsupported {
        /// What was asked for.
        what: &'static str,
    },
    /// Walls drive a flow that has none.
    #[error("the box has no wall whose velocity could drive a flow")]
    NoWall,
    /// A parameter is out of range.
    #[error("{name} = {value}: {wanted}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Value of the parameter.
        value: f64,
        /// Range of right values.
        wanted: &'static str,
    },
    /// A matrix could not be assembled.
    #[error(transparent)]
    Assembly(#[from] SparseError),
    /// The matrix of a cell is not positive definite.
    #[error(transparent)]
    Cell(#[from] BlockError),
    /// The direct solver failed.
    #[error(transparent)]
    Direct(#[from] DirectError),
    /// The Krylov method failed; the error holds the residual history.
    #[error(transparent)]
    Krylov(#[from] KrylovError),
    /// A level of the multigrid has an unknown without stiffness.
    #[error("level {level} of the multigrid cannot be smoothed: {source}")]
    Smoother {
        /// Level, 0 is the coarsest.
        level: usize,
        /// Cause.
        source: DiagonalError,
    },
    /// The fluid around a penalised solid cannot be smoothed.
    #[cfg(feature = "paper")]
    #[error("the fluid around the solid cannot be smoothed: {0}")]
    AroundSolid(#[source] DiagonalError),
    /// The mesh around a surface has an unknown without stiffness.
    #[error("the mesh around the surfaces cannot be smoothed: {0}")]
    AtSurface(#[source] DiagonalError),
    /// The operator on the nodes of a cell at a surface is not positive definite, whatever the penalty.
    #[error("the mesh cannot be smoothed in the cell around {center:?} at body {}: {source}; refine the mesh", body + 1)]
    SurfaceBlock {
        /// Centre of the cell, in the box.
        center: Vec<f64>,
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Cause.
        source: BlockError,
    },
    /// The penalised operator on the nodes of a cell is not positive definite.
    #[cfg(feature = "paper")]
    #[error("the solid cannot be smoothed cell by cell: {0}")]
    SolidPatch(#[source] BlockError),
    /// The matrix that approximates the Schur complement has a bad diagonal.
    #[error("the mass of the pressures: {0}")]
    PressureMass(#[source] BadDiagonal),
    /// The Schur complement of the pressures as large as the box cannot be inverted.
    #[error("the {matrix} of the {pressures} pressures of a mesh of {cells} cells is not positive definite")]
    BoxPressures {
        /// The matrix that is not positive definite.
        matrix: SmallMatrix,
        /// Number of rows.
        pressures: usize,
        /// Cells of the coarsest mesh.
        cells: usize,
    },
    /// A solve was asked for before the solver was prepared.
    #[error("the solver was not prepared for this system")]
    NotPrepared,
}

impl StokesError {
    /// The same with other numbers of the bodies, where some of them were numbered by themselves.
    #[must_use]
    pub fn with_bodies(mut self, number: impl Fn(usize) -> usize) -> Self {
        match &mut self {
            Self::Unresolved { body, .. }
            | Self::NoRoot { body, .. }
            | Self::NoPenalty { body, .. }
            | Self::WeakSurface { body, .. }
            | Self::CoarseSurface { body }
            | Self::AtSurface(DiagonalError::Body { body, .. })
            | Self::Smoother { source: DiagonalError::Body { body, .. }, .. }
            | Self::SurfaceBlock { body, .. } => *body = number(*body),
            #[cfg(feature = "paper")]
            Self::NoSolid { body, .. } => *body = number(*body),
            _ => {}
        }
        self
    }
}

/// A part of the diagonal of an operator that has no inverse.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DiagonalError {
    /// An entry is not positive.
    #[error("the diagonal entry of node {node} is {value:e}")]
    Node {
        /// The node.
        node: usize,
        /// The entry.
        value: f64,
    },
    /// The resistance of a body is not positive definite.
    #[error("the resistance of body {}: {source}", body + 1)]
    Body {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Cause.
        source: BlockError,
    },
}

/// A small dense matrix of some pressures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmallMatrix {
    /// Schur complement.
    Schur,
    /// Approximation of the Schur complement that is used elsewhere.
    Mass,
}

impl std::fmt::Display for SmallMatrix {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Schur => "Schur complement",
            Self::Mass => "mass",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The errors of other crates say all themselves; a box says what of it is wrong.
    #[test]
    fn messages_pass_on_causes() {
        let pivot = BlockError::NotPositiveDefinite { pivot: 4, value: -1e-3 };
        assert_eq!(StokesError::Cell(pivot).to_string(), pivot.to_string());
        let entry = SparseError::TooLarge { entry_count: 7 };
        assert_eq!(StokesError::from(entry).to_string(), entry.to_string());
        let error = StokesError::BoxPressures { matrix: SmallMatrix::Schur, pressures: 25, cells: 16 };
        let text = error.to_string();
        assert!(text.contains("Schur complement of the 25 pressures of a mesh of 16 cells"), "{text}");
        assert!(StokesError::NotPrepared.to_string().contains("not prepared"));
    }

    /// People count bodies from one, and think of radii in cells.
    #[test]
    fn messages_name_bodies_and_numbers() {
        let (body, radius, cell_size) = (2, 0.05, 0.125);
        for error in [
            StokesError::Unresolved { body, radius, cell_size },
            #[cfg(feature = "paper")]
            StokesError::NoSolid { body, radius, cell_size },
        ] {
            let text = error.to_string();
            assert!(text.contains("body 3") && text.contains("0.400 cells"), "{text}");
        }
        let source =
            DiagonalError::Body { body, source: BlockError::NotPositiveDefinite { pivot: 4, value: -1e-3 } };
        let block = BlockError::NotPositiveDefinite { pivot: 7, value: -0.8 };
        let text = StokesError::SurfaceBlock { center: vec![0.25, 0.5], body, source: block }.to_string();
        let parts = ["[0.25, 0.5]", "body 3", "pivot 7", "-8e-1", "refine"];
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
        let text = StokesError::Smoother { level: 5, source }.to_string();
        assert!(["level 5", "body 3", "pivot 4", "-1e-3"].iter().all(|part| text.contains(part)), "{text}");
    }
}
