//! What flows through a film, as velocities on the mesh have it.

use gluey_geom::Vector;

/// The flow through a film between two bodies: a linear form of nodal velocities.
///
/// Through every section of the film flows the same but for what its motion carries, so that a mean with
/// smooth weights over a region across the whole film is `Q`, the flow per width relative to the mean of the
/// two surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFlow<const D: usize> {
    /// Nodes with the weights of their velocities in the mean velocity of the fluid; none hangs.
    pub nodes: Vec<(u32, f64)>,
    /// Those of them on the boundary.
    pub boundary: Vec<(u32, f64)>,
    /// The mean place of the fluid, from the middle of the film.
    pub middle: Vector<D>,
    /// Mean thickness of the film.
    pub height: f64,
    /// Radius of the region.
    pub reach: f64,
    /// Where the flats end.
    pub edge: f64,
}

/// `(1 - s^2)^2`: the weight at `s` of the radius of the region.
pub fn weight(square: f64) -> f64 {
    (1.0 - square).max(0.0).powi(2)
}

impl<const D: usize> FilmFlow<D> {
    /// `Q` less the mean flow relative to what the two bodies, continued to the middle of the film, would
    /// carry, over the relative spin: the surfaces move otherwise than that by half the thickness times their
    /// spins, and a film whose flats tilt carries more through its middle than through its edge.
    pub fn turning(&self) -> f64 {
        let (edge, reach) = (self.edge * self.edge, self.reach * self.reach);
        // The mean over directions of x^2, weighted: a seventh of the reach in 2D, a quarter in 3D.
        let carried = if D == 2 { 0.5 * edge - reach / 14.0 } else { 0.375 * edge - reach / 16.0 };
        0.25 * self.height * self.height - carried
    }
}
