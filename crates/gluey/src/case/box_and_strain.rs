//! The box as a container of particles, and how far it has been sheared.

use gluey_geom::{Aabb, Vector};
use gluey_suspension::Container;

use super::Case;

impl Case {
    /// The box with its periods, without tilt: axes that are not periodic are walled.
    pub(crate) fn container<const D: usize>(&self) -> Container<D> {
        let [lower, upper] = [self.lower(), self.upper()].map(|x| Vector::<D>::from_fn(|d, _| x[d]));
        Container::new(Aabb { lower, upper }, std::array::from_fn(|axis| self.period(axis).is_some()))
    }

    /// Shear strain that the undisturbed flow has made at this time: less again after the reversal, which is
    /// at the first step that starts at `time.reverse_at` or later.
    pub fn strain_at(&self, time: f64) -> f64 {
        let step = self.time.step;
        let reversal = self.time.reverse_at.map_or(f64::INFINITY, |at| (at / step - 1e-9).ceil() * step);
        self.shear_rate * if time <= reversal { time } else { 2.0 * reversal - time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strain_decreases_after_the_reversal() {
        let text = "name = \"x\"\ndimension = 2\nshear_rate = 2.0\n[[particles]]\nposition = [0.5, 0.5]\n\
                    radius = 0.05\n[time]\nstep = 0.3\nend = 3.0\nreverse_at = 1.0\n";
        let case = Case::parse(text, "x.toml").expect("a good case");
        let strains = [0.9, 1.2, 1.5, 2.4].map(|time| case.strain_at(time));
        let exact = [1.8, 2.4, 1.8, 0.0];
        assert!(strains.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-12), "{strains:?}");
        assert!(case.container::<2>().is_walled(0));
    }
}
