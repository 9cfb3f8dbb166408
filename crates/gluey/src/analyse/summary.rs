//! The summary: means with confidence intervals.

use std::fmt;

use gluey_geom::{Dim, Space};
use gluey_suspension::statistics::Estimate;

use super::observe::{Distributions, Instant};
use crate::shown::shown_to;

/// Means over the frames behind the transient.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Number of particles.
    pub particle_count: usize,
    /// Volume of the particles over that of the box.
    pub fraction: f64,
    /// Number of frames.
    pub frame_count: usize,
    /// Frames left out at the beginning.
    pub skipped: usize,
    /// Names and means; nothing for fewer than two frames.
    pub means: Vec<(&'static str, Option<Estimate>)>,
    /// Self-diffusivities along each axis beside the shear with their standard errors, over the mean radius
    /// squared, per unit of strain, or of time without shear.
    pub diffusivities: Vec<(f64, f64)>,
    /// Whether these are per unit of strain.
    pub is_sheared: bool,
}

impl Summary {
    pub(super) fn of<const D: usize>(
        series: &[Instant<D>],
        skipped: usize,
        distributions: &Distributions<D>,
    ) -> Self
    where
        Dim<D>: Space<D>,
    {
        let kept = &series[skipped..];
        let mean = |value: &dyn Fn(&Instant<D>) -> Option<f64>| {
            let values: Vec<f64> = kept.iter().filter_map(value).collect();
            Estimate::of(&values)
        };
        let percolates = |axis: usize| mean(&|one| Some(f64::from(u8::from(one.percolates[axis]))));
        let names = ["percolates along x", "percolates along y", "percolates along z"];
        let mut means = vec![
            ("smallest gap / a", mean(&|one| one.gaps.map(|gaps| gaps.smallest))),
            ("1 % gap / a", mean(&|one| one.gaps.map(|gaps| gaps.percentile))),
            ("median gap / a", mean(&|one| one.gaps.map(|gaps| gaps.median))),
            ("contacts per particle", mean(&|one| Some(one.contacts))),
            ("largest cluster", mean(&|one| Some(one.largest_cluster))),
            ("fabric xx - yy", mean(&|one| Some(one.fabric[(0, 0)] - one.fabric[(1, 1)]))),
            ("fabric xy", mean(&|one| Some(one.fabric[(0, 1)]))),
        ];
        means.extend((0..D).map(|axis| (names[axis], percolates(axis))));
        let is_sheared = distributions.rate != 0.0;
        let unit = distributions.a.powi(2) * if is_sheared { distributions.rate.abs() } else { 1.0 };
        let diffusivities = distributions.diffusivity().into_iter().flatten();
        Self {
            particle_count: distributions.particle_count,
            fraction: distributions.fraction,
            frame_count: series.len(),
            skipped,
            means,
            diffusivities: diffusivities.map(|d| (d.value / unit, d.standard_error / unit)).collect(),
            is_sheared,
        }
    }
}

fn number(value: f64) -> String {
    format!("{:>12}", shown_to(value, 6))
}

fn error(value: f64) -> String {
    shown_to(value, 2)
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { particle_count, fraction, frame_count, skipped, .. } = self;
        writeln!(f, "{particle_count} particles at the fraction {fraction:.4}")?;
        writeln!(f, "{frame_count} frames, the first {skipped} left out; intervals hold 95 %")?;
        for (name, estimate) in &self.means {
            if let Some(Estimate { mean, half_width, is_resolved, .. }) = estimate {
                let remark = if *is_resolved { "" } else { "   (too short a series for this interval)" };
                writeln!(f, "  {name:<22} {} +- {}{remark}", number(*mean), error(*half_width))?;
            }
        }
        let unit = if self.is_sheared { "a^2 |rate|" } else { "a^2 per unit of time" };
        for (axis, (value, deviation)) in ["x", "y", "z"].into_iter().zip(&self.diffusivities) {
            let name = format!("self-diffusivity {axis}");
            writeln!(f, "  {name:<22} {} +- {} {unit}", number(*value), error(2.0 * deviation))?;
        }
        Ok(())
    }
}
