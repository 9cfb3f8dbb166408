//! How far particles move against each other: displacements less their best affine part.
//!
//! In a shear flow displacements grow with the size of the cloud, those of neighbours against each other do
//! not. With `s_i = s_0 + L x_i + r_i`, neighbours move by `|s_j - s_i| <= |L| |x_j - x_i| + |r_i| + |r_j|`
//! against each other.
//!
//! Images move with the lattice: `L` is 0 along the directions that have a period, but for the shear of a
//! lattice whose images slide. With it `|s_j - s_i|` is bounded for images as it is for particles.

use gluey_geom::{Matrix, Vector};

/// Known part of an affine motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownMotion<const D: usize> {
    /// Directions without a period.
    pub free: [bool; D],
    /// Shear strain of the lattice: displacement of images along `x` per unit of `y`.
    pub shear: f64,
}

impl<const D: usize> KnownMotion<D> {
    /// `L` of the lattice.
    fn gradient(&self) -> Matrix<D> {
        Matrix::from_fn(|i, j| if (i, j) == (0, 1) { self.shear } else { 0.0 })
    }
}

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
    /// Fits `displacements` at `positions`: besides the motion of the `frame`, `L` is fitted on the
    /// directions that are free.
    pub(crate) fn new(positions: &[Vector<D>], displacements: &[Vector<D>], frame: &KnownMotion<D>) -> Self {
        Self::completed(positions, displacements, frame, |_| {})
    }

    /// The same where others hold some of the particles: `complete` makes sums over those here sums over
    /// all.
    pub(crate) fn completed(
        positions: &[Vector<D>],
        displacements: &[Vector<D>],
        frame: &KnownMotion<D>,
        complete: impl Fn(&mut [f64]),
    ) -> Self {
        let sliding = frame.gradient();
        let mut sums = [positions.iter().sum::<Vector<D>>(), displacements.iter().sum::<Vector<D>>()];
        let mut count = [positions.len() as f64];
        complete(&mut count);
        sums.iter_mut().for_each(|sum| complete(sum.as_mut_slice()));
        let [center, mean] = sums.map(|sum| sum * (1.0 / count[0].max(1.0)));
        let (mut moments, mut products) = (Matrix::<D>::zeros(), Matrix::<D>::zeros());
        for (x, s) in positions.iter().zip(displacements) {
            let x = x - center;
            let s = s - mean - sliding * x;
            moments += x * x.transpose();
            products += s * x.transpose();
        }
        complete(moments.as_mut_slice());
        complete(products.as_mut_slice());
        let fitted = regression(moments, products, frame.free);
        let is_useful = fitted.norm() > 0.0 && fitted.norm() <= LARGEST_STRAIN;
        let gradient = if is_useful { fitted + sliding } else { sliding };
        Self { center, mean, gradient, strain: gradient.norm() }
    }

    /// `|r|`: how far a particle moves besides the affine motion.
    pub(crate) fn rest(&self, position: &Vector<D>, displacement: &Vector<D>) -> f64 {
        (displacement - self.mean - self.gradient * (position - self.center)).norm()
    }
}

/// Directions whose spread is a smaller part of the largest are left out.
const FLAT: f64 = 1e-10;

/// `L` with `L moments = products`, by Gaussian elimination; columns of directions that are not `free`, or in
/// which the positions do not spread independently of the others, are 0.
fn regression<const D: usize>(mut moments: Matrix<D>, mut products: Matrix<D>, free: [bool; D]) -> Matrix<D> {
    let smallest = FLAT * moments.diagonal().max();
    let mut usable = [false; D];
    for d in (0..D).filter(|&d| free[d]) {
        usable[d] = moments[(d, d)] > smallest;
        for e in (0..D).filter(|&e| usable[d] && e > d && free[e]) {
            let factor = moments[(d, e)] / moments[(d, d)];
            for k in 0..D {
                let (moment, product) = (moments[(k, d)], products[(k, d)]);
                moments[(k, e)] -= factor * moment;
                products[(k, e)] -= factor * product;
            }
        }
    }
    let mut gradient = Matrix::<D>::zeros();
    for d in (0..D).rev().filter(|&d| usable[d]) {
        for row in 0..D {
            let known: f64 = (d + 1..D).map(|e| gradient[(row, e)] * moments[(e, d)]).sum();
            gradient[(row, d)] = (products[(row, d)] - known) / moments[(d, d)];
        }
    }
    gradient
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn affine_motions_leave_no_rest() {
        let gradient = Matrix::<3>::new(0.01, 0.3, -0.1, 0.05, 0.0, 0.02, -0.1, 0.2, 0.03);
        // A cloud that is itself sheared, so that its coordinates are correlated.
        let shear = Matrix::<3>::new(1.0, 2.0, 0.3, 0.0, 1.0, -0.7, 0.0, 0.0, 1.0);
        let point =
            |i: usize| shear * Vector::<3>::from_fn(|d, _| (i as f64 * [0.7548, 0.5698, 0.4301][d]).fract());
        let positions: Vec<_> = (0..100).map(point).collect();
        let moves: Vec<_> =
            positions.iter().map(|x| gradient * x + Vector::<3>::new(3.0, 2.0, 1.0)).collect();
        let fit = AffineFit::new(&positions, &moves, &KnownMotion { free: [true; 3], shear: 0.0 });
        assert!((fit.gradient - gradient).norm() < 1e-12 && fit.strain >= gradient.norm() - 1e-12);
        assert!(positions.iter().zip(&moves).all(|(x, s)| fit.rest(x, s) < 1e-12));
        let flat: Vec<_> = positions.iter().map(|x| Vector::<3>::new(x.x, 0.0, x.z)).collect();
        let moves: Vec<_> = flat.iter().map(|x| gradient * x).collect();
        let fit = AffineFit::new(&flat, &moves, &KnownMotion { free: [true, true, false], shear: 0.0 });
        assert_eq!((fit.gradient.column(1).norm(), fit.gradient.column(2).norm()), (0.0, 0.0));
    }

    #[test]
    fn particles_that_move_with_a_sheared_lattice_leave_no_rest() {
        let gradient = Matrix::<3>::new(0.0, 0.7, 0.1, 0.0, 0.0, 0.02, 0.0, 0.0, 0.03);
        let point = |i: usize| Vector::<3>::from_fn(|d, _| (i as f64 * [0.7548, 0.5698, 0.4301][d]).fract());
        let positions: Vec<_> = (0..100).map(point).collect();
        let moves: Vec<_> = positions.iter().map(|x| gradient * x).collect();
        let fit = AffineFit::new(&positions, &moves, &KnownMotion { free: [false, false, true], shear: 0.7 });
        assert!((fit.gradient - gradient).norm() < 1e-12 && fit.strain >= 0.7);
        assert!(positions.iter().zip(&moves).all(|(x, s)| fit.rest(x, s) < 1e-12));
    }
}
