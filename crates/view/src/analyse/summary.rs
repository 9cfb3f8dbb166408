//! The summary: means with confidence intervals.

use std::fmt;

use gluey::rheology::{Mean, RheologyMeans};
use gluey::shown_to;
use serde::{Serialize, Serializer};

use super::observe::{Distributions, FrameNumbers};

/// Means over the frames behind the transient.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StructureSummary {
    /// Number of particles.
    pub particle_count: usize,
    /// Volume of the particles over that of the box.
    pub fraction: f64,
    /// Number of frames.
    pub frame_count: usize,
    /// Frames left out at the beginning.
    pub skipped: usize,
    /// Names and means; nothing for what no frame has.
    #[serde(serialize_with = "by_name")]
    pub means: Vec<(&'static str, Option<Mean>)>,
    /// Self-diffusivities along each axis beside the shear with their standard errors, over the mean radius
    /// squared, per unit of strain, or of time without shear.
    pub diffusivities: Vec<(f64, f64)>,
    /// Whether these are per unit of strain.
    pub is_sheared: bool,
    /// Of a run that is sheared for ever.
    pub rheology: Option<RheologyMeans>,
}

impl StructureSummary {
    pub(super) fn of<const D: usize>(
        series: &[FrameNumbers<D>],
        skipped: usize,
        distributions: &Distributions<D>,
        rheology: Option<RheologyMeans>,
    ) -> Self {
        let kept = &series[skipped..];
        let mean = |value: &dyn Fn(&FrameNumbers<D>) -> Option<f64>| {
            let values: Vec<f64> = kept.iter().filter_map(value).collect();
            Mean::of(&values)
        };
        let percolates = |axis: usize| mean(&|one| Some(f64::from(u8::from(one.percolates[axis]))));
        let names = ["percolates along x", "percolates along y", "percolates along z"];
        let mut means = vec![
            ("smallest gap / a", mean(&|one| one.gaps.map(|gaps| gaps.smallest))),
            ("1 % gap / a", mean(&|one| one.gaps.map(|gaps| gaps.percentile))),
            ("median gap / a", mean(&|one| one.gaps.map(|gaps| gaps.median))),
            ("contacts per particle", mean(&|one| Some(one.contacts))),
            ("largest cluster", mean(&|one| Some(one.largest_cluster))),
            ("fabric xx - yy", mean(&|one| one.fabric.map(|fabric| fabric[(0, 0)] - fabric[(1, 1)]))),
            ("fabric xy", mean(&|one| one.fabric.map(|fabric| fabric[(0, 1)]))),
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
            rheology,
        }
    }
}

fn by_name<S: Serializer>(means: &[(&'static str, Option<Mean>)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(means.iter().copied())
}

/// A mean; "none" for what no frame has, and for what is 0 in all of them.
fn told(mean: Option<Mean>) -> String {
    match mean {
        Some(mean) if mean.mean != 0.0 || mean.half_width != Some(0.0) => mean.to_string(),
        _ => format!("{:>12}", "none"),
    }
}

impl fmt::Display for StructureSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { particle_count, fraction, frame_count, skipped, .. } = self;
        writeln!(f, "{particle_count} particles at the fraction {fraction:.4}")?;
        writeln!(f, "{frame_count} frames, the first {skipped} left out; intervals hold 95 %")?;
        for (name, mean) in &self.means {
            writeln!(f, "  {name:<22} {}", told(*mean))?;
        }
        let unit = if self.is_sheared { "a^2 |rate|" } else { "a^2 per unit of time" };
        if self.diffusivities.is_empty() {
            writeln!(f, "  {:<22} {}", "self-diffusivity", told(None))?;
        }
        for (axis, (value, deviation)) in ["x", "y", "z"].into_iter().zip(&self.diffusivities) {
            let name = format!("self-diffusivity {axis}");
            let [value, width] = [shown_to(*value, 6), shown_to(2.0 * deviation, 2)];
            writeln!(f, "  {name:<22} {value:>12} +- {width} {unit}")?;
        }
        self.rheology.iter().try_for_each(|rheology| write!(f, "{rheology}"))
    }
}
