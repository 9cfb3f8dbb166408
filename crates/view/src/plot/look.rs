//! How particles are shown: from where, in which colours.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::str::FromStr;

use gluey::output::xyz::XyzFrame;
use gluey_geom::Vector;
use gluey_suspension::for_each_pair;

use super::error::PlotError;
use super::figure::named;
use super::told::told;

/// Smallest gap that has a colour of its own, in mean radii.
const SMALLEST_GAP: f64 = 1e-4;

/// The direction from which spheres are seen, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// About the vertical `y`: from 0, in front (at the positive end of `z`), to 90, on the right (of `x`).
    pub azimuth: f64,
    /// Over the horizontal plane, from -90 to 90.
    pub elevation: f64,
}

impl Default for Viewpoint {
    /// From the right and above.
    fn default() -> Self {
        Self { azimuth: 31.5, elevation: 20.0 }
    }
}

impl FromStr for Viewpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || "expected two angles in degrees, such as 30,20: around the vertical and above".to_owned();
        let (azimuth, elevation) = text.split_once(',').ok_or_else(wrong)?;
        let angle = |text: &str| text.trim().parse().ok().filter(|angle: &f64| angle.is_finite());
        match (angle(azimuth), angle(elevation)) {
            (Some(azimuth), Some(elevation)) if elevation.abs() <= 90.0 => Ok(Self { azimuth, elevation }),
            (Some(_), Some(_)) => Err("the second angle must be from -90 to 90".to_owned()),
            _ => Err(wrong()),
        }
    }
}

impl Viewpoint {
    /// Across, up and towards the reader; a plane is seen from the front.
    pub(super) fn turned<const D: usize>(self, x: &Vector<D>) -> [f64; 3] {
        if D == 2 {
            return [x[0], x[1], 0.0];
        }
        let (yaw, pitch) = (-self.azimuth.to_radians(), self.elevation.to_radians());
        let pitch = pitch.clamp(-FRAC_PI_2, FRAC_PI_2);
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (yaw.sin_cos(), pitch.sin_cos());
        let across = cos_yaw * x[0] + sin_yaw * x[2];
        let back = cos_yaw * x[2] - sin_yaw * x[0];
        [across, cos_pitch * x[1] - sin_pitch * back, sin_pitch * x[1] + cos_pitch * back]
    }
}

named! {
    /// What the colours of particles tell.
    #[derive(Default)]
    Coloring {
        /// How fast the centre moves.
        #[default]
        Speed = "speed",
        /// How fast it turns.
        Spin = "spin",
        /// The smallest gap to another particle, on a logarithmic scale.
        Gap = "gap",
        /// The sum of the forces of its contacts, over `6 pi eta`.
        ContactForce = "contact-force",
    }
}

/// The meaning of lines between centres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lines {
    /// Gaps up to this, in mean radii.
    Near(f64),
    /// Contacts: as thick as their normal force, dashed where surfaces slip.
    Forces,
}

impl FromStr for Lines {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("force", _) => Ok(Self::Forces),
            (_, Ok(reach)) if (0.0..=10.0).contains(&reach) => Ok(Self::Near(reach)),
            _ => Err("must be a number from 0 to 10 (mean radii), or force".to_owned()),
        }
    }
}

/// The look of particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// From where, in 3D.
    pub viewpoint: Viewpoint,
    /// What colours tell.
    pub coloring: Coloring,
    /// Lines that join the centres of particles.
    pub network: Option<Lines>,
}

impl Look {
    /// The number behind the colour of each particle: from 0 on, or for gaps from 0 (none) to 1 (a mean
    /// radius).
    pub(super) fn measures<const D: usize>(&self, frame: &XyzFrame<D>) -> Vec<f64> {
        match self.coloring {
            Coloring::ContactForce => {
                frame.contact_forces.iter().flatten().map(|force| force.norm()).collect()
            }
            Coloring::Speed => frame.velocities.iter().map(|velocity| velocity.norm()).collect(),
            Coloring::Spin => {
                frame.spins.iter().map(|spin| spin.iter().map(|x| x * x).sum::<f64>().sqrt()).collect()
            }
            Coloring::Gap => {
                let mut gaps = vec![1.0_f64; frame.radii.len()];
                for ([first, second], _, gap) in near_pairs(frame, 1.0) {
                    gaps[first] = gaps[first].min(gap);
                    gaps[second] = gaps[second].min(gap);
                }
                gaps.iter().map(|gap| 1.0 - gap.max(SMALLEST_GAP).log10() / SMALLEST_GAP.log10()).collect()
            }
        }
    }

    /// Checks that frames, which were read from files such as `path`, tell what colours are to show.
    pub(super) fn check<const D: usize>(&self, frames: &[XyzFrame<D>], path: &Path) -> Result<(), PlotError> {
        let is_told = |frame: &XyzFrame<D>| frame.contact_forces.is_some();
        match self.coloring != Coloring::ContactForce || frames.iter().all(is_told) {
            true => Ok(()),
            false => Err(PlotError::NoContactForces { path: path.to_owned() }),
        }
    }

    /// The end of the scale of colours, where it does not follow from the numbers.
    pub(super) fn end(&self) -> Option<f64> {
        (self.coloring == Coloring::Gap).then_some(1.0)
    }

    /// Name of what colours tell, and what stands at the ends of their bar.
    pub(super) fn legend(&self, most: f64, is_flat: bool) -> [String; 3] {
        match self.coloring {
            Coloring::Speed => ["speed (length / time)".to_owned(), "0".to_owned(), told(most)],
            Coloring::Spin => ["spin (1 / time)".to_owned(), "0".to_owned(), told(most)],
            // In 2D its unit is another one where contacts act in the flow.
            Coloring::ContactForce => {
                let unit = if is_flat { "" } else { " (length^{2} / time)" };
                [format!("contact force / 6π*η*{unit}"), "0".to_owned(), told(most)]
            }
            Coloring::Gap => {
                ["smallest gap / *a*".to_owned(), "≤ 10^{\u{2212}4}".to_owned(), "≥ 1".to_owned()]
            }
        }
    }
}

/// Two particles, the way from the first to the image of the second, and their gap in mean radii, where it is
/// at most `reach`.
pub(super) fn near_pairs<const D: usize>(
    frame: &XyzFrame<D>,
    reach: f64,
) -> Vec<([usize; 2], Vector<D>, f64)> {
    let radii = &frame.radii;
    let mean = radii.iter().sum::<f64>() / radii.len().max(1) as f64;
    let range = 2.0 * radii.iter().copied().fold(0.0, f64::max) + reach * mean;
    let mut pairs = Vec::new();
    for_each_pair(&frame.container, &frame.positions, range, |pair| {
        let gap = (pair.arm.norm() - radii[pair.first] - radii[pair.second]) / mean;
        if gap <= reach {
            pairs.push(([pair.first, pair.second], pair.arm, gap));
        }
    });
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewpoints_are_read() {
        assert_eq!("30,-20".parse(), Ok(Viewpoint { azimuth: 30.0, elevation: -20.0 }));
        for wrong in ["30", "30,", "a,b", "0,91", "inf,0"] {
            assert!(wrong.parse::<Viewpoint>().is_err(), "{wrong}");
        }
    }

    /// In front is z, on the right x, above y.
    #[test]
    fn viewpoints_look_from_where_they_say() {
        let axes = [Vector::<3>::x(), Vector::<3>::y(), Vector::<3>::z()];
        for (azimuth, elevation, nearest) in [(0.0, 0.0, 2), (90.0, 0.0, 0), (0.0, 90.0, 1), (30.0, 20.0, 2)]
        {
            let depths = axes.map(|axis| Viewpoint { azimuth, elevation }.turned(&axis)[2]);
            let deepest = (0..3).max_by(|a, b| depths[*a].total_cmp(&depths[*b]));
            assert_eq!(deepest, Some(nearest), "{depths:?}");
            let length = depths.iter().map(|depth| depth * depth).sum::<f64>();
            assert!((length - 1.0).abs() < 1e-12, "a rotation: {depths:?}");
        }
    }
}
