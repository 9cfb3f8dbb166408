//! Discs in which planes of rays cut a ball, and the rays.

/// A disc in a plane of rays: centre along the rays and across them, radius.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Coordinate of the centre along the rays.
    pub along: f64,
    /// Coordinate of the centre across the rays.
    pub across: f64,
    /// Radius.
    pub radius: f64,
}

/// A ray through a disc.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Its coordinate across.
    pub at: f64,
    /// Half the length of its chord.
    pub half: f64,
    /// Width of the strip it stands for.
    pub weight: f64,
}
