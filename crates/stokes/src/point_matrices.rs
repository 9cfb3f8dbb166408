//! Viscous matrices of cells whose viscosity varies, by quadrature.
//!
//! With the slopes `G[q, (i, a)] = d_a phi_i(x_q)` and `S = sum_q w_q eta_q G_q^T G_q` the matrix of
//! `int 2 eta eps(u):eps(v)` is `K[(i,a),(j,b)] = S[(i,b),(j,a)] + [a = b] sum_d S[(i,d),(j,d)]`.

use gluey_fem::Reference;
use gluey_fem::element::{gauss_cube, gradient, value};

/// Points that are summed in one pass over a row.
const AT_ONCE: usize = 4;

/// The velocity shape functions at the quadrature points of a cell.
#[derive(Clone, Debug)]
pub struct PointMatrices<const D: usize> {
    /// Points a direction.
    line: usize,
    points: Vec<([f64; D], f64)>,
    /// Slopes at each point, one by one.
    slopes: Vec<f64>,
    /// Values at each point.
    shapes: Vec<Vec<f64>>,
}

impl<const D: usize> PointMatrices<D> {
    /// Prepares the tensor-product Gauss rule with `points` points a direction.
    pub fn new(line: usize) -> Self {
        let points = gauss_cube::<D>(line);
        let nodes = Reference::<D>::VELOCITY / D;
        let shape = |(x, _): &([f64; D], f64)| (0..nodes).map(|i| value::<D>(2, i, x)).collect();
        let slopes =
            |(x, _): &([f64; D], f64)| (0..nodes).flat_map(|i| gradient::<D>(2, i, x)).collect::<Vec<_>>();
        Self {
            line,
            slopes: points.iter().flat_map(slopes).collect(),
            shapes: points.iter().map(shape).collect(),
            points,
        }
    }

    /// Points a direction.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The points with their weights, and the values of the shape functions there.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&[f64; D], f64, &[f64])> {
        self.points.iter().zip(&self.shapes).map(|((x, weight), shapes)| (x, *weight, shapes.as_slice()))
    }

    /// The matrix `K` for the viscosities `scale * fraction[q]` at the points.
    pub fn matrix(&self, scale: f64, fraction: &[f64]) -> Vec<f64> {
        let n = Reference::<D>::VELOCITY;
        let mut products = vec![0.0; n * n];
        let mut terms: Vec<(f64, &[f64])> = self
            .points
            .iter()
            .zip(fraction)
            .zip(self.slopes.chunks_exact(n))
            .filter(|((_, fraction), _)| **fraction > 0.0)
            .map(|((point, fraction), slopes)| (scale * point.1 * fraction, slopes))
            .collect();
        terms.resize(terms.len().next_multiple_of(AT_ONCE), (0.0, &self.slopes[..n]));
        for (row, sums) in products.chunks_exact_mut(n).enumerate() {
            let sums = &mut sums[..(row / D + 1) * D];
            for [a, b, c, d] in terms.as_chunks::<AT_ONCE>().0 {
                let factors = [a, b, c, d].map(|(factor, slopes)| factor * slopes[row]);
                let slopes = a.1.iter().zip(b.1).zip(c.1.iter().zip(d.1));
                for (sum, ((a, b), (c, d))) in sums.iter_mut().zip(slopes) {
                    *sum += (factors[0] * a + factors[1] * b) + (factors[2] * c + factors[3] * d);
                }
            }
        }
        strain_products::<D>(&products)
    }
}

/// From the lower blocks of `S` to `K`.
fn strain_products<const D: usize>(products: &[f64]) -> Vec<f64> {
    let n = Reference::<D>::VELOCITY;
    let mut matrix = vec![0.0; n * n];
    for i in (0..n).step_by(D) {
        for j in (0..=i).step_by(D) {
            let trace: f64 = (0..D).map(|d| products[(i + d) * n + j + d]).sum();
            for a in 0..D {
                for b in 0..D {
                    let value = products[(i + b) * n + j + a] + if a == b { trace } else { 0.0 };
                    matrix[(i + a) * n + j + b] = value;
                    matrix[(j + b) * n + i + a] = value;
                }
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_the_sum_over_points<const D: usize>(line: usize) {
        let matrices = PointMatrices::<D>::new(line);
        let fraction: Vec<f64> = (0..line.pow(D as u32)).map(|q| (q as f64).sin().max(0.0)).collect();
        let mut expected = vec![0.0; Reference::<D>::VELOCITY.pow(2)];
        for ((x, weight), fraction) in gauss_cube::<D>(line).iter().zip(&fraction) {
            gluey_fem::add_viscous(x, 7.0 * weight * fraction, &mut expected);
        }
        let found = matrices.matrix(7.0, &fraction);
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_matrix_is_the_sum_over_points() {
        for line in [1, 3, 4] {
            is_the_sum_over_points::<2>(line);
            is_the_sum_over_points::<3>(line);
        }
    }
}
