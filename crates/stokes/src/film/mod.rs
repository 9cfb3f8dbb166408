//! Films between bodies, and between bodies and walls, that are thinner than what a mesh resolves.
//!
//! A film of thickness `g` in the middle has the profile `H(r) = g + r^2 / A`, with `2/A = 1/a + 1/b` for
//! radii `a` and `b` (`1/b = 0` at a wall). Where it is thinner than a height `G` of about a cell
//! ([`Lubrication::heights`]) both bodies are cut flat there (`crate::surface`), so that the mesh sees the
//! profile `max(G, H)` and resolves it at any gap. Removing solid lowers every resistance, so what the mesh
//! then lacks, the *deficit*, is never negative; lubrication theory gives it (`deficit`), as a force
//! between the two surfaces that is proportional to their relative motion and implicit in their velocities
//! ([`FilmCoupling`]).

mod coupling;
mod deficit;
mod flux;
mod mobility;
mod near;
mod network;

pub use coupling::{FilmCoupling, FilmForce};
pub use deficit::FilmShape;
pub use flux::FilmFlow;
pub use mobility::NearMobility;
pub use near::{Film, Heights, Partner, films, thin_films};
pub use network::{FilmCorrection, FilmNetwork, FilmRow, SharedTwists};

/// Treatment of films between bodies that are too thin for the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lubrication {
    /// None. In 2D the mesh sees them as they are, and too weak where they are thinner than a tenth of a
    /// cell. In 3D it sees those between bodies no thinner than 0.6 cells: on coarse levels, where bodies
    /// have no film between them, corrections would be too large by the ratio of the film's resistance to
    /// theirs.
    None,
    /// The mesh sees them widened to about a cell; lubrication theory gives the resistance that is missing.
    Deficit,
}

impl Lubrication {
    /// The thicknesses to which films are widened in `D` dimensions on cells of this size.
    pub fn heights<const D: usize>(self, cell_size: f64) -> Heights {
        let [at_contact, per_gap, largest, at_walls] = match self {
            Self::Deficit if D == 3 => [0.55, 0.8, 1.25, 0.4],
            Self::Deficit => [1.3, 0.0, 1.3, 0.4],
            Self::None if D == 3 => [0.6, 0.0, 0.6, 0.0],
            Self::None => [0.0; 4],
        };
        Heights {
            at_contact: at_contact * cell_size,
            per_gap,
            largest: largest * cell_size,
            at_walls: at_walls * cell_size,
        }
    }
}
