//! Displacements beside those of the affine flow, and self-diffusion.

use std::ops::RangeInclusive;

use gluey_geom::Vector;

/// Groups of particles that are fitted apart, for the error of the diffusivity.
const GROUP_COUNT: usize = 10;

/// Positions at equal intervals, less what simple shear has moved them.
///
/// Shear `dx = (y - y0) dg` moves a particle by the strain between two configurations times the mean of its
/// heights in them; the rest is summed up.
#[derive(Clone, Debug)]
pub struct Displacements<const D: usize> {
    rest_height: f64,
    /// Strain and positions of the last configuration.
    last: Option<(f64, Vec<Vector<D>>)>,
    /// Sums of displacements beside the shear, of each configuration and particle.
    frames: Vec<Vec<Vector<D>>>,
}

/// Self-diffusivity along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffusivity {
    /// `1/2 d<dx^2>/dt`, per unit of the time that lags are counted in.
    pub value: f64,
    /// Its standard error, from groups of particles fitted apart.
    pub standard_error: f64,
}

impl<const D: usize> Displacements<D> {
    /// None yet; the shear is at rest at `y = rest_height`.
    pub fn new(rest_height: f64) -> Self {
        Self { rest_height, last: None, frames: Vec::new() }
    }

    /// Adds a configuration at a shear strain. Positions are continuous in time, not wrapped; always of the
    /// same particles.
    pub fn push(&mut self, strain: f64, positions: &[Vector<D>]) {
        let frame = match (&self.last, self.frames.last()) {
            (Some((before, from)), Some(sums)) => {
                let by = |((to, from), sum): ((&Vector<D>, &Vector<D>), &Vector<D>)| {
                    let mut moved = to - from;
                    moved[0] -= (strain - before) * (0.5 * (to[1] + from[1]) - self.rest_height);
                    sum + moved
                };
                positions.iter().zip(from).zip(sums).map(by).collect()
            }
            _ => vec![Vector::zeros(); positions.len()],
        };
        self.frames.push(frame);
        self.last = Some((strain, positions.to_vec()));
    }

    /// Number of configurations.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// Mean squares of the displacements along each axis within `lag` intervals, over all particles and all
    /// beginnings; `None` for a longer time than was seen.
    pub fn mean_square(&self, lag: usize) -> Option<Vector<D>> {
        let count = self.frames.last().map_or(0, Vec::len);
        self.mean_square_of(lag, 0, 1).filter(|_| count > 0)
    }

    /// The same over every `step`-th particle from `first` on.
    fn mean_square_of(&self, lag: usize, first: usize, step: usize) -> Option<Vector<D>> {
        let (mut sum, mut count) = (Vector::zeros(), 0);
        for (from, to) in self.frames.iter().zip(self.frames.get(lag..)?) {
            for (from, to) in from.iter().zip(to).skip(first).step_by(step) {
                sum += (to - from).map(|x| x * x);
                count += 1;
            }
        }
        (count > 0).then(|| sum / f64::from(count))
    }

    /// Self-diffusivities along each axis: half the slope of the line that fits the mean squares best over
    /// the lags, which are multiples of the time `interval`. `None` for fewer than two lags, longer ones than
    /// were seen, or one particle, of which there are no groups to tell an error by.
    pub fn diffusivity(&self, lags: RangeInclusive<usize>, interval: f64) -> Option<[Diffusivity; D]> {
        let particles = self.frames.last()?.len();
        let slopes = |first: usize, step: usize| -> Option<Vector<D>> {
            let squares: Option<Vec<_>> =
                lags.clone().map(|lag| Some((lag as f64, self.mean_square_of(lag, first, step)?))).collect();
            Some(slope(&squares?)? / (2.0 * interval))
        };
        let groups = GROUP_COUNT.min(particles);
        if groups < 2 {
            return None;
        }
        let parts: Option<Vec<_>> = (0..groups).map(|group| slopes(group, groups)).collect();
        let (whole, parts) = (slopes(0, 1)?, parts?);
        Some(std::array::from_fn(|d| {
            let values: Vec<f64> = parts.iter().map(|part| part[d]).collect();
            // Groups are independent but for the flow that they share.
            Diffusivity { value: whole[d], standard_error: spread(&values) }
        }))
    }
}

/// Standard error of the mean of independent values, of which there are two at least.
fn spread(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count * (count - 1.0))).sqrt()
}

/// Slope of the line that fits best.
fn slope<const D: usize>(points: &[(f64, Vector<D>)]) -> Option<Vector<D>> {
    let count = points.len() as f64;
    let mean = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let width: f64 = points.iter().map(|(x, _)| (x - mean).powi(2)).sum();
    (width > 0.0).then(|| points.iter().map(|(x, y)| y * (x - mean)).sum::<Vector<D>>() / width)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn affine_motion_is_no_displacement() {
        let mut displacements = Displacements::<3>::new(0.5);
        for frame in 0..5 {
            let strain = 0.1 * f64::from(frame);
            let at = |y: f64| Vector::<3>::new(3.0 + strain * (y - 0.5), y, 1.0);
            displacements.push(strain, &[at(0.2), at(2.0)]);
        }
        assert!(displacements.mean_square(4).expect("frames").norm() < 1e-28);
        assert_eq!(displacements.mean_square(5), None);
    }

    #[test]
    fn one_particle_has_no_diffusivity() {
        let mut displacements = Displacements::<2>::new(0.0);
        (0..9).for_each(|frame| displacements.push(0.0, &[Vector::repeat(f64::from(frame))]));
        assert_eq!(displacements.diffusivity(1..=4, 1.0), None);
        assert!(displacements.mean_square(4).is_some());
    }

    /// Steps at random of the variance `s^2` diffuse with `s^2 / (2 interval)`, also in shear.
    #[test]
    fn random_walks_diffuse() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut displacements = Displacements::<2>::new(0.0);
        let mut positions = vec![Vector::<2>::zeros(); 400];
        for frame in 0..100 {
            displacements.push(0.1 * f64::from(frame), &positions);
            for x in &mut positions {
                let step = Vector::<2>::from_fn(|d, _| [1.0, 2.0][d] * random.random_range(-0.5..0.5));
                // The shear of the interval, at the mean of the heights.
                x[0] += 0.1 * (x[1] + 0.5 * step[1]);
                *x += step;
            }
        }
        let [x, y] = displacements.diffusivity(1..=10, 0.5).expect("frames");
        for (found, exact) in [(x, 1.0 / 12.0), (y, 4.0 / 12.0)] {
            assert!((found.value - exact).abs() < 4.0 * found.standard_error, "{found:?} {exact}");
            assert!(found.standard_error < 0.05 * exact, "{found:?}");
        }
    }
}
