//! Sections of balls with planes of rays, and the rays.

/// The section of a ball with a plane of rays: the points `across + widths[1] rho sin(t)` across the rays and
/// `along + lean rho sin(t) + widths[0] rho cos(t)` along them. A disc where cells are cubes.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Coordinate of the centre along the rays.
    pub along: f64,
    /// Coordinate of the centre across the rays.
    pub across: f64,
    /// Radius `rho` of the section, in which it is round.
    pub radius: f64,
    /// Widths along and across the rays in coordinates of the cell, for one of the round section.
    pub widths: [f64; 2],
    /// How far along the rays their middle moves for one across the round section.
    pub lean: f64,
}

/// A ray through a disc.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Its coordinate across.
    pub at: f64,
    /// The middle of its chord.
    pub middle: f64,
    /// Half the length of its chord.
    pub half: f64,
    /// Width of the strip it stands for.
    pub weight: f64,
}

impl Disc {
    /// The ray through the disc at an angle, for a part of the angle.
    #[inline]
    pub fn ray(&self, (sin, cos): (f64, f64), weight: f64) -> Ray {
        let Self { along, across, radius, widths, lean } = self;
        Ray {
            at: across + widths[1] * radius * sin,
            middle: along + lean * radius * sin,
            half: widths[0] * radius * cos,
            weight: weight * widths[1] * radius * cos,
        }
    }

    /// The ray with this coordinate across, if it meets the disc.
    pub fn ray_at(&self, at: f64) -> Option<Ray> {
        let sin = (at - self.across) / (self.widths[1] * self.radius);
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        // Exactly where it was wanted: a flat may lie there.
        (sin.abs() < 1.0).then(|| Ray { at, ..self.ray((sin, cos), 0.0) })
    }
}
