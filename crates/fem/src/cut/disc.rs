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
