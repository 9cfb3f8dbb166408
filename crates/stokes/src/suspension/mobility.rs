//! The mobility of the particles of a configuration that contact forces are sought in.

use gluey_motion::Configuration;

use super::Suspension;
use crate::error::StokesError;
use crate::film::{self, Lubrication, NearMobility};

/// Without corrections films resist like those of this thickness at least, in cells: in 3D they are widened
/// to it, in 2D the mesh has too little of thinner ones.
const THINNEST_SEEN: [f64; 2] = [0.1, 0.6];

impl<const D: usize> Suspension<D> {
    /// Edge of the cells at surfaces.
    fn cell_size(&self) -> f64 {
        let edge = self.domain.extent()[0] / f64::from(self.roots[0]);
        edge / f64::from(self.refinement.surface).exp2()
    }

    /// The mobility of particles in a fluid of this viscosity with the films between near ones, no thinner
    /// than the flow has them.
    ///
    /// # Errors
    /// Those of a direct solver.
    pub fn near_mobility(
        &self,
        configuration: &Configuration<'_, D>,
        viscosity: f64,
    ) -> Result<NearMobility<D>, StokesError> {
        let is_held = self.given.iter().map(Option::is_some).collect();
        let largest = self.radii.iter().copied().fold(0.0, f64::max);
        let thinnest = match self.lubrication {
            Lubrication::Deficit => 0.0,
            Lubrication::None => THINNEST_SEEN[D - 2] * self.cell_size(),
        };
        let mut films = film::films(&self.balls(configuration), &self.domain, largest);
        films.iter_mut().for_each(|film| film.gap = film.gap.max(thinnest));
        let named = films.into_iter().filter(|film| !film.is_across_flow());
        let named: Vec<_> = named.map(|film| (self.pair(configuration, &film), film)).collect();
        Ok(NearMobility::new(self.radii.clone(), is_held, viscosity, &named)?)
    }
}
