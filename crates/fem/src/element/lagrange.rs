//! Tensor-product Lagrange elements on the unit cube.
//!
//! Local nodes are numbered with x fastest. Node `i` of degree `k` has the 1D indices
//! `i_d` in `0..=k` and lies at `i_d / k`.

/// Nodes of the Lagrange element of `degree` in `D` dimensions, `(degree+1)^D`.
pub const fn node_count<const D: usize>(degree: usize) -> usize {
    (degree + 1).pow(D as u32)
}

/// The 1D indices of point `i` in a grid with `n` points per direction.
pub fn multi_index<const D: usize>(i: usize, n: usize) -> [usize; D] {
    std::array::from_fn(|d| i / n.pow(d as u32) % n)
}

/// Values of the 1D Lagrange functions of `degree` 1 or 2 at `x` in `[0, 1]`; unused entries are zero.
pub fn values_1d(degree: usize, x: f64) -> [f64; 3] {
    debug_assert!(degree == 1 || degree == 2, "degree {degree}");
    match degree {
        1 => [1.0 - x, x, 0.0],
        _ => [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)],
    }
}

/// Derivatives of the 1D Lagrange functions of `degree` 1 or 2 at `x`.
pub fn derivatives_1d(degree: usize, x: f64) -> [f64; 3] {
    debug_assert!(degree == 1 || degree == 2, "degree {degree}");
    match degree {
        1 => [-1.0, 1.0, 0.0],
        _ => [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0],
    }
}

/// Value of shape function `i` of `degree` at the point `x` of the unit cube.
pub fn value<const D: usize>(degree: usize, i: usize, x: &[f64; D]) -> f64 {
    let index = multi_index::<D>(i, degree + 1);
    (0..D).map(|d| values_1d(degree, x[d])[index[d]]).product()
}

/// Gradient of shape function `i` of `degree` at `x`, with respect to the unit-cube coordinates.
pub fn gradient<const D: usize>(degree: usize, i: usize, x: &[f64; D]) -> [f64; D] {
    let index = multi_index::<D>(i, degree + 1);
    std::array::from_fn(|g| {
        let factor = |d: usize| match d == g {
            true => derivatives_1d(degree, x[d])[index[d]],
            false => values_1d(degree, x[d])[index[d]],
        };
        (0..D).map(factor).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes_form_a_partition_of_unity<const D: usize>() {
        let x = std::array::from_fn(|d| 0.2 + 0.3 * d as f64);
        for degree in [1, 2] {
            let count = node_count::<D>(degree);
            let sum: f64 = (0..count).map(|i| value::<D>(degree, i, &x)).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            for d in 0..D {
                let sum: f64 = (0..count).map(|i| gradient::<D>(degree, i, &x)[d]).sum();
                assert!(sum.abs() < 1e-14);
            }
        }
    }

    #[test]
    fn partition_of_unity() {
        shapes_form_a_partition_of_unity::<2>();
        shapes_form_a_partition_of_unity::<3>();
    }
}
