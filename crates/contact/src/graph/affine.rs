//! How far particles move against each other: displacements less their best affine part.
//!
//! In a shear flow displacements grow with the size of the cloud, those of neighbours against each other do not. With
//! `s_i = s_0 + L x_i + r_i`, neighbours move by `|s_j - s_i| <= |L| |x_j - x_i| + |r_i| + |r_j|` against each other.

use gluey_geom::{Matrix, Vector};

/// An affine motion `s_0 + L x`, fitted by least squares.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AffineFit<const D: usize> {
    center: Vector<D>,
    mean: Vector<D>,
    gradient: Matrix<D>,
    /// Bound of `|L|`.
    pub strain: f64,
}

/// Beyond this `|L|` the bound on neighbours is useless.
const LARGEST_STRAIN: f64 = 0.5;

impl<const D: usize> AffineFit<D> {
    /// Fits `displacements` at `positions`; `L` acts on the directions that are `free` of a period only, so that images of
    /// a particle move alike.
    pub(crate) fn new(positions: &[Vector<D>], displacements: &[Vector<D>], free: [bool; D]) -> Self {
        let scale = 1.0 / positions.len().max(1) as f64;
        let center = positions.iter().sum::<Vector<D>>() * scale;
        let mean = displacements.iter().sum::<Vector<D>>() * scale;
        let (mut moments, mut products) = (Matrix::<D>::zeros(), Matrix::<D>::zeros());
        for (x, s) in positions.iter().zip(displacements) {
            let (x, s) = (x - center, s - mean);
            moments += x * x.transpose();
            products += s * x.transpose();
        }
        let mut gradient = Matrix::<D>::zeros();
        // Direction by direction: exact when positions are uncorrelated, and a bound in any case.
        for d in 0..D {
            if free[d] && moments[(d, d)] > 0.0 {
                gradient.set_column(d, &(products.column(d) / moments[(d, d)]));
            }
        }
        let strain = gradient.norm();
        if strain > 0.0 && strain <= LARGEST_STRAIN {
            Self { center, mean, gradient, strain }
        } else {
            Self { center, mean, gradient: Matrix::zeros(), strain: 0.0 }
        }
    }

    /// `|r|`: how far a particle moves besides the affine motion.
    pub(crate) fn rest(&self, position: &Vector<D>, displacement: &Vector<D>) -> f64 {
        (displacement - self.mean - self.gradient * (position - self.center)).norm()
    }
}
