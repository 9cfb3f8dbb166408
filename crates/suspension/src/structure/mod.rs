//! How particles are arranged and how they move relative to the flow: correlations, contacts, profiles,
//! self-diffusion. All costs are proportional to the number of particles, at a given range or number of bins.

mod angular;
mod displacement;
mod fluid;
mod gaps;
mod network;
mod profile;
mod radial;
mod wave;

pub use angular::AngularDistribution;
pub use displacement::{Diffusivity, Displacements};
pub use fluid::{compressibility, contact_value};
pub use gaps::GapStatistics;
pub use network::ProximityNetwork;
pub use profile::{Profile, Slab};
pub use radial::{RadialBin, RadialDistribution};
pub use wave::{StructureFactor, WaveBin};
