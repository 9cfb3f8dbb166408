//! Viscous matrices of cells whose viscosity varies, by quadrature.
//!
//! With `S[(i,a),(j,b)] = sum_q w_q eta_q d_a phi_i(x_q) d_b phi_j(x_q)` the matrix of
//! `int 2 eta eps(u):eps(v)` is `K[(i,a),(j,b)] = S[(i,b),(j,a)] + [a = b] sum_d S[(i,d),(j,d)]`. Points and
//! shape functions are products of those on a line, so the sum over points is taken one direction after the
//! other (Orszag 1980, 10.1016/0021-9991(80)90005-4).

use gluey_fem::ReferenceMatrices;
use gluey_fem::element::{derivatives_1d, gauss, gauss_cube, multi_index, value, values_1d};

/// Shape functions on a line.
const LINE: usize = 3;
/// Pairs of them.
const PAIRS: usize = LINE * LINE;

/// The velocity shape functions at the quadrature points of a cell.
#[derive(Clone, Debug)]
pub struct PointMatrices<const D: usize> {
    /// Points per direction.
    line: usize,
    points: Vec<([f64; D], f64)>,
    /// Values at each point.
    shapes: Vec<Vec<f64>>,
    /// `f_k(x_q) g_l(x_q)` at the points of a line for all pairs `(k, l)`, where `f` are the shape functions
    /// or, in the last two, their slopes, and `g` those or, in the second and the last, their slopes.
    products: [Vec<[f64; PAIRS]>; 4],
    /// The shape functions `(i, j)` whose products [`PointMatrices::sum`] gives one after the other.
    pairs: Vec<(usize, usize)>,
}

/// A flag for the first and the second factor of a product: whether it is a slope.
type Slopes = (bool, bool);

impl<const D: usize> PointMatrices<D> {
    /// Prepares the tensor-product Gauss rule with `line` points per direction.
    pub fn new(line: usize) -> Self {
        let points = gauss_cube::<D>(line);
        let nodes = ReferenceMatrices::<D>::VELOCITY / D;
        let shape = |(x, _): &([f64; D], f64)| (0..nodes).map(|i| value::<D>(2, i, x)).collect();
        let factor = |is_slope: bool, x: f64| if is_slope { derivatives_1d(2, x) } else { values_1d(2, x) };
        let products = |(f, g): Slopes| {
            let at = |x: f64| {
                let (f, g) = (factor(f, x), factor(g, x));
                std::array::from_fn(|pair| f[pair / LINE] * g[pair % LINE])
            };
            gauss(line).iter().map(|point| at(point.0)).collect()
        };
        Self {
            line,
            shapes: points.iter().map(shape).collect(),
            points,
            products: [(false, false), (false, true), (true, false), (true, true)].map(products),
            pairs: pairs::<D>(),
        }
    }

    /// Points per direction.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The points with their weights, and the values of the shape functions there.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&[f64; D], f64, &[f64])> {
        self.points.iter().zip(&self.shapes).map(|((x, weight), shapes)| (x, *weight, shapes.as_slice()))
    }

    /// The matrix `K` for the viscosities `scale * fraction[q]` at the points.
    pub fn matrix(&self, scale: f64, fraction: &[f64]) -> Vec<f64> {
        let n = ReferenceMatrices::<D>::VELOCITY;
        let weighted = self.points.iter().zip(fraction).map(|(point, fraction)| scale * point.1 * fraction);
        let weights: Vec<f64> = weighted.collect();
        let mut matrix = vec![0.0; n * n];
        let mut work = [Vec::new(), Vec::new()];
        for a in 0..D {
            for b in 0..=a {
                let sums = self.sum(&weights, |d| (d == a, d == b), &mut work);
                for (&(i, j), &sum) in self.pairs.iter().zip(sums) {
                    add_strain_product::<D>(i * D, j * D, a, b, sum, &mut matrix);
                }
            }
        }
        matrix
    }

    /// `sum_q weight_q prod_d (f_d g_d)(x_q)` for all pairs of shape functions, in the order of `pairs`.
    fn sum<'a>(
        &self,
        weights: &[f64],
        slopes: impl Fn(usize) -> Slopes,
        work: &'a mut [Vec<f64>; 2],
    ) -> &'a [f64] {
        let [from, to] = work;
        from.clear();
        from.extend_from_slice(weights);
        for d in 0..D {
            let (f, g) = slopes(d);
            let products = &self.products[2 * usize::from(f) + usize::from(g)];
            // Along x first: numbers of pairs come to stand before the points of the directions that are
            // left.
            let inner = PAIRS.pow(d as u32);
            to.clear();
            to.resize(from.len() / self.line * PAIRS, 0.0);
            let blocks = from.chunks_exact(self.line * inner).zip(to.chunks_exact_mut(PAIRS * inner));
            for (from, to) in blocks {
                for (products, from) in products.iter().zip(from.chunks_exact(inner)) {
                    for (product, to) in products.iter().zip(to.chunks_exact_mut(inner)) {
                        to.iter_mut().zip(from).for_each(|(to, from)| *to += product * from);
                    }
                }
            }
            std::mem::swap(from, to);
        }
        from
    }
}

/// See [`PointMatrices`].
fn pairs<const D: usize>() -> Vec<(usize, usize)> {
    let node = |pairs: &[usize; D], along: fn(usize) -> usize| {
        (0..D).rev().fold(0, |node, d| node * LINE + along(pairs[d]))
    };
    let place = |k: usize| {
        let pairs = multi_index::<D>(k, PAIRS);
        (node(&pairs, |pair| pair / LINE), node(&pairs, |pair| pair % LINE))
    };
    (0..PAIRS.pow(D as u32)).map(place).collect()
}

/// Adds what `S[(i,a),(j,b)]` and its mirror image contribute to `K`, for `i` and `j` given by their first
/// rows.
fn add_strain_product<const D: usize>(i: usize, j: usize, a: usize, b: usize, sum: f64, matrix: &mut [f64]) {
    let n = ReferenceMatrices::<D>::VELOCITY;
    matrix[(i + b) * n + j + a] += sum;
    if a != b {
        matrix[(j + a) * n + i + b] += sum;
        return;
    }
    for d in 0..D {
        matrix[(i + d) * n + j + d] += sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_the_sum_over_points<const D: usize>(line: usize) {
        let matrices = PointMatrices::<D>::new(line);
        let fraction: Vec<f64> = (0..line.pow(D as u32)).map(|q| (q as f64).sin().max(0.0)).collect();
        let mut expected = vec![0.0; ReferenceMatrices::<D>::VELOCITY.pow(2)];
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
