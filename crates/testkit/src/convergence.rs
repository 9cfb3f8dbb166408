//! Orders of convergence from errors on a sequence of meshes.

/// The slope of `log(error)` over `log(h)` by least squares.
///
/// NaN, which fails every comparison, unless there are two or more different `h` and all numbers are positive
/// and finite.
pub fn convergence_order(hs: &[f64], errors: &[f64]) -> f64 {
    let usable = |x: &f64| *x > 0.0 && x.is_finite();
    if hs.len() != errors.len() || !hs.iter().chain(errors).all(usable) {
        return f64::NAN;
    }
    let points: Vec<(f64, f64)> = hs.iter().zip(errors).map(|(h, e)| (h.ln(), e.ln())).collect();
    let count = points.len() as f64;
    let mean_x = points.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|p| p.1).sum::<f64>() / count;
    let covariance: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let variance: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    if variance > 0.0 { covariance / variance } else { f64::NAN }
}

/// The order between each mesh and the next.
pub fn convergence_orders(hs: &[f64], errors: &[f64]) -> Vec<f64> {
    hs.windows(2).zip(errors.windows(2)).map(|(h, e)| convergence_order(h, e)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_have_their_exponent() {
        let hs = [0.2, 0.1, 0.05, 0.02];
        let errors = hs.map(|h: f64| 7.0 * h.powf(2.5));
        assert!((convergence_order(&hs, &errors) - 2.5).abs() < 1e-12);
        let orders = convergence_orders(&hs, &errors);
        assert_eq!(orders.len(), 3);
        assert!(orders.iter().all(|order| (order - 2.5).abs() < 1e-12));
    }

    #[test]
    fn useless_data_have_no_order() {
        for (hs, errors) in [
            (&[0.1][..], &[1.0][..]),
            (&[0.1, 0.1], &[1.0, 2.0]),
            (&[0.1, 0.2], &[0.0, 1.0]),
            (&[0.1, 0.2], &[f64::NAN, 1.0]),
            (&[0.1, 0.2], &[1.0]),
            (&[], &[]),
        ] {
            assert!(convergence_order(hs, errors).is_nan());
        }
    }
}
