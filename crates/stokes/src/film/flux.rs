//! What flows through a film, as velocities on the mesh have it.

use gluey_geom::{Dim, Matrix, Spin, Vector};

/// The flow through a film between two bodies in one direction across it: a linear form of nodal velocities,
/// and of the motions of the bodies.
///
/// Through every section of the film flows the same but for what its motion carries, so that a mean over
/// sections is `Q`, the flow per width relative to the mean of the two surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFlow<const D: usize> {
    /// Nodes with the weights `w` of their velocities in the flow; none hangs.
    pub nodes: Vec<(u32, Vector<D>)>,
    /// Those of them on the boundary.
    pub boundary: Vec<(u32, Vector<D>)>,
    /// `int w`: the flow of a velocity of one.
    pub total: Vector<D>,
    /// `int w x^T` with `x` from the middle of the film: the flow of the velocity `G x` is `G : int w x^T`.
    pub first: Matrix<D>,
    /// What a speed of approach of one adds to `Q`: it carries fluid through all sections but the middle one.
    pub approach: f64,
    /// What relative spin of one adds: the surfaces move otherwise than the bodies would, continued to the
    /// middle of the film, by half the thickness times their spins, and a film whose flats tilt carries more
    /// through its middle than through its edge.
    pub turning: f64,
}

impl<const D: usize> FilmFlow<D> {
    /// The flow of a spin of one, per axis, about a point from which the middle of the film is at `arm`.
    pub fn of_spin(&self, arm: &Vector<D>) -> Spin<D> {
        let about_middle = (0..D).map(|d| {
            let mut axis = Vector::zeros();
            axis[d] = 1.0;
            Dim::<D>::moment(&axis, &self.first.column(d).into_owned())
        });
        about_middle.fold(Dim::<D>::moment(arm, &self.total), |sum, part| sum + part)
    }
}
