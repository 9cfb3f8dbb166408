//! Polynomials of degree 4 on the unit interval: sums are taken with Legendre's, which make products cheap,
//! and given for the Lagrange polynomials of the Gauss points.

use crate::element::gauss;

/// Gauss points per direction: their polynomials have degree 4 in each coordinate.
pub const POINTS: usize = 5;

/// A number for every polynomial.
pub type Line = [f64; POINTS];

/// Legendre polynomials of degrees 0 to 4 at `x` in the unit interval.
#[inline(always)]
pub fn legendre(x: f64) -> Line {
    let s = 2.0 * x - 1.0;
    let square = s * s;
    [1.0, s, 1.5 * square - 0.5, s * (2.5 * square - 1.5), (4.375 * square - 3.75) * square + 0.375]
}

/// Their integrals from zero to `x`, `int P_k = (P_(k+1) - P_(k-1)) / (2 (2 k + 1))`.
#[inline(always)]
pub fn integrals(x: f64) -> Line {
    let s = 2.0 * x - 1.0;
    let square = s * s;
    let [_, _, p2, p3, p4] = legendre(x);
    let p5 = s * ((7.875 * square - 8.75) * square + 1.875);
    [x, (p2 - 1.0) / 6.0, (p3 - s) / 10.0, (p4 - p2) / 14.0, (p5 - p3) / 18.0]
}

/// Lagrange polynomials `l_i` of the Gauss points `x_j`.
pub struct Polynomials {
    /// Coefficients `c_ik` of `l_i = sum_k c_ik P_k`.
    pub coefficients: [Line; POINTS],
    /// `l_i'(x_j)`.
    pub slopes: [Line; POINTS],
    /// `x_j l_i'(x_j)`.
    pub arms: [Line; POINTS],
    /// `l_i(0)` and `l_i(1)`.
    pub ends: [Line; 2],
}

impl Polynomials {
    /// The tables.
    pub fn new() -> Self {
        let rule = gauss(POINTS);
        let degree = |k: usize| (2 * k + 1) as f64;
        // Products of two of them are integrated exactly.
        let coefficients: [Line; POINTS] = std::array::from_fn(|i| {
            let (x, weight) = rule[i];
            let values = legendre(x);
            std::array::from_fn(|k| degree(k) * weight * values[k])
        });
        let of_legendre =
            |i: usize, values: &Line| -> f64 { coefficients[i].iter().zip(values).map(|(c, p)| c * p).sum() };
        let slope = |i: usize, j: usize| of_legendre(i, &slopes(rule[j].0));
        Self {
            slopes: std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j))),
            arms: std::array::from_fn(|i| std::array::from_fn(|j| rule[j].0 * slope(i, j))),
            ends: [0.0, 1.0].map(|x| std::array::from_fn(|i| of_legendre(i, &legendre(x)))),
            coefficients,
        }
    }

    /// From sums for Legendre polynomials to those for `l_i`, along lines of a block `stride` apart.
    pub fn convert(&self, block: &mut [f64], stride: usize) {
        for start in (0..block.len()).filter(|k| (k / stride).is_multiple_of(POINTS)) {
            let old: Line = std::array::from_fn(|k| block[start + k * stride]);
            for (i, row) in self.coefficients.iter().enumerate() {
                block[start + i * stride] = row.iter().zip(&old).map(|(c, p)| c * p).sum();
            }
        }
    }
}

/// Derivatives of the Legendre polynomials.
fn slopes(x: f64) -> Line {
    let s = 2.0 * x - 1.0;
    [0.0, 2.0, 6.0 * s, 15.0 * s * s - 3.0, s * (35.0 * s * s - 15.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_those_of_lagrange_polynomials() {
        let rule = gauss(POINTS);
        let of = Polynomials::new();
        for i in 0..POINTS {
            let others = || (0..POINTS).filter(move |&j| j != i);
            let scale = others().map(|j| rule[i].0 - rule[j].0).product::<f64>();
            let value = |x: f64| others().map(|j| x - rule[j].0).product::<f64>() / scale;
            let slope = |x: f64| {
                let without =
                    |k: usize| others().filter(move |&j| j != k).map(|j| x - rule[j].0).product::<f64>();
                others().map(without).sum::<f64>() / scale
            };
            for (k, x) in [0.0, 1.0].into_iter().enumerate() {
                assert!((of.ends[k][i] - value(x)).abs() < 1e-13);
            }
            for (j, &(x, _)) in rule.iter().enumerate() {
                assert!((of.slopes[i][j] - slope(x)).abs() < 1e-12);
                assert!((of.arms[i][j] - x * slope(x)).abs() < 1e-12);
            }
            let mut block = integrals(0.3);
            of.convert(&mut block, 1);
            let exact: f64 = rule.iter().map(|&(x, w)| 0.3 * w * value(0.3 * x)).sum();
            assert!((block[i] - exact).abs() < 1e-14, "{i} {} {exact}", block[i]);
        }
    }
}
