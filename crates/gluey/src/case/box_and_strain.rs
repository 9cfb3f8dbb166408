//! The box as a container of particles, and how far it has been sheared.

use gluey_geom::{Aabb, Vector};
use gluey_suspension::Container;

use super::Case;

impl Case {
    /// The box with its periods, without tilt: axes that are not periodic are walled.
    pub fn container<const D: usize>(&self) -> Container<D> {
        let [lower, upper] = [self.lower(), self.upper()].map(|x| Vector::<D>::from_fn(|d, _| x[d]));
        Container::new(Aabb { lower, upper }, std::array::from_fn(|axis| self.period(axis).is_some()))
    }

    /// Whether the shear is reversed at some time.
    pub fn turns_round(&self) -> bool {
        self.time.reverse_at.is_some() || self.time.strain_amplitude.is_some()
    }

    /// Steps of a cycle of a shear that oscillates.
    pub fn cycle_length(&self) -> Option<usize> {
        Some(4 * self.time.strain_amplitude.map(|amplitude| self.steps_to(amplitude).round() as usize)?)
    }

    /// Whether the shear is reversed in the step that begins after so many steps.
    pub fn is_reversed_after(&self, steps: usize) -> bool {
        self.reversed_steps(steps + 1) > self.reversed_steps(steps)
    }

    /// Shear strain that the undisturbed flow has made after so many steps, less what it took back.
    pub fn strain_after(&self, steps: usize) -> f64 {
        self.shear_rate * self.time.step * (steps as f64 - 2.0 * self.reversed_steps(steps) as f64)
    }

    /// Steps in which the shear makes this strain.
    pub(super) fn steps_to(&self, strain: f64) -> f64 {
        strain / (self.shear_rate.abs() * self.time.step)
    }

    /// Steps of the first so many in which the shear is reversed.
    pub(super) fn reversed_steps(&self, steps: usize) -> usize {
        if let Some(cycle) = self.cycle_length() {
            let (half, rest) = (cycle / 2, steps % cycle);
            return steps / cycle * half + rest.saturating_sub(half / 2).min(half);
        }
        let reversal = self.time.reverse_at.map(|at| (at / self.time.step - 1e-9).ceil() as usize);
        reversal.map_or(0, |reversal| steps.saturating_sub(reversal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(rate: f64, time: &str) -> Case {
        let text = format!(
            "name = \"x\"\ndimension = 2\nshear_rate = {rate}\n[[particles]]\nposition = [0.5, 0.5]\n\
             radius = 0.05\n[time]\nend = 3.0\n{time}\n"
        );
        Case::parse(&text, "x.toml").expect("a good case")
    }

    #[test]
    fn strain_decreases_after_the_reversal() {
        let case = case(2.0, "step = 0.3\nreverse_at = 1.0");
        let strains = [3, 4, 5, 8].map(|steps| case.strain_after(steps));
        let exact = [1.8, 2.4, 1.8, 0.0];
        assert!(strains.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-12), "{strains:?}");
        assert!(!case.is_reversed_after(3) && case.is_reversed_after(4));
        assert!(case.container::<2>().is_walled(0));
    }

    #[test]
    fn an_oscillating_shear_comes_back_in_every_cycle() {
        let case = case(-2.0, "step = 0.25\nstrain_amplitude = 1.0");
        assert_eq!(case.cycle_length(), Some(8));
        let strains: Vec<f64> = (0..=12).map(|steps| case.strain_after(steps)).collect();
        assert_eq!(strains, [0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0]);
        let reversed: Vec<usize> = (0..16).filter(|&steps| case.is_reversed_after(steps)).collect();
        assert_eq!(reversed, [2, 3, 4, 5, 10, 11, 12, 13]);
    }
}
