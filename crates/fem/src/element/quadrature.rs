//! Gauss quadrature on the unit cube. Points are numbered with x fastest.

use super::lagrange::multi_index;

/// Gauss-Legendre points and weights on `[0, 1]` with `n` points (exact to degree `2n-1`).
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n).map(|i| gauss_point(n, i)).collect()
}

fn gauss_point(n: usize, i: usize) -> (f64, f64) {
    let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
    let mut slope = 1.0;
    for _ in 0..100 {
        let (p, dp) = legendre(n, x);
        slope = dp;
        let dx = p / dp;
        x -= dx;
        if dx.abs() < 1e-16 {
            break;
        }
    }
    (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
}

/// Legendre polynomial of degree `n` and its derivative at `x`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut p0, mut p1) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
    }
    (p1, n as f64 * (x * p1 - p0) / (x * x - 1.0))
}

/// Points and weights of the tensor-product Gauss rule with `n` points per direction on the unit cube.
pub fn gauss_cube<const D: usize>(n: usize) -> Vec<([f64; D], f64)> {
    let line = gauss(n);
    (0..n.pow(D as u32))
        .map(|q| {
            let index = multi_index::<D>(q, n);
            let weight = (0..D).map(|d| line[index[d]].1).product();
            (std::array::from_fn(|d| line[index[d]].0), weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_integrates_polynomials_exactly() {
        for n in 1..=10 {
            for degree in 0..2 * n {
                let sum: f64 = gauss(n).iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!((sum - 1.0 / (degree as f64 + 1.0)).abs() < 1e-14, "{n} {degree}");
            }
        }
    }
}
