//! Errors of packings.

use gluey_contact::ContactError;

use super::Arrangement;

/// A reason why particles could not be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PackingError {
    /// A parameter outside its range.
    #[error("{name} = {value}: it must be {wanted}")]
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is right.
        wanted: &'static str,
    },
    /// More than random arrangements hold.
    #[error(
        "a volume fraction of {fraction:.4} ({with_gaps:.4} with the gaps to keep) is too high: random \
         arrangements are made up to {most}"
    )]
    TooDense {
        /// The fraction asked for.
        fraction: f64,
        /// That of particles enlarged by half the smallest gap.
        with_gaps: f64,
        /// The largest such fraction.
        most: f64,
    },
    /// A lattice whose particles would overlap, or be nearer than the smallest gap.
    #[error(
        "a volume fraction of {fraction:.4} is too high for the arrangement `{arrangement}` in this box: \
         the most is {most:.4}"
    )]
    LatticeTooDense {
        /// The lattice.
        arrangement: Arrangement,
        /// The fraction asked for.
        fraction: f64,
        /// The fraction at which the smallest gap is reached.
        most: f64,
    },
    /// Too many or too few particles for a lattice in this box.
    #[error("{count} particles make no `{arrangement}` lattice in this box: {} do", numbers(.fitting))]
    NoLattice {
        /// The lattice.
        arrangement: Arrangement,
        /// The number asked for.
        count: usize,
        /// The nearest numbers that fit, below and above.
        fitting: Vec<usize>,
    },
    /// An arrangement of another dimension.
    #[error("the arrangement `{arrangement}` is not one in {dimension}D")]
    OtherDimension {
        /// The arrangement.
        arrangement: Arrangement,
        /// The dimension of the box.
        dimension: usize,
    },
    /// A particle that would meet images of itself, or of a neighbour twice.
    #[error(
        "a particle of radius {radius} is too large for the edge {edge} of the box along {}: at least four \
         radii are needed, so more particles or a lower fraction",
        axis_name(*.axis)
    )]
    ParticleTooLarge {
        /// Radius of the largest particle.
        radius: f64,
        /// Edge of the box.
        edge: f64,
        /// The axis.
        axis: usize,
    },
    /// The box is tilted; arrangements start in boxes that are not.
    #[error("the box has a tilt of {tilt}: particles are placed in boxes without one")]
    Tilted {
        /// The tilt.
        tilt: f64,
    },
    /// Overlaps of random particles could not be removed.
    #[error(
        "overlaps could not be removed at {reached} of the radii, {overlap:e} radii are left: the fraction is \
         too high for this box"
    )]
    Crowded {
        /// Radii that were reached, relative to those wanted.
        reached: f64,
        /// The largest overlap that is left, relative to the smallest radius.
        overlap: f64,
    },
    /// Overlaps could not be removed.
    #[error("overlaps could not be removed at {reached} of the radii: the fraction is too high for this box")]
    NotSettled {
        /// Radii that were reached, relative to those wanted.
        reached: f64,
        /// Where the contact model stopped.
        #[source]
        source: ContactError,
    },
}

fn axis_name(axis: usize) -> char {
    ['x', 'y', 'z'][axis.min(2)]
}

fn numbers(fitting: &[usize]) -> String {
    let numbers: Vec<String> = fitting.iter().map(usize::to_string).collect();
    numbers.join(" or ")
}
