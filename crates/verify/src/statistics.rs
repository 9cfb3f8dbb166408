//! What is said of several measurements of one thing. Of nothing, and of what contains a NaN, it is NaN,
//! which no limit lets pass.

/// The mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The statistic of a measure over positions: that of a stresslet has a sign, the size of a vector has none.
pub fn over_positions(measure: &str, values: &[f64]) -> f64 {
    if measure == "stresslet" { mean(values) } else { rms(values) }
}

/// The standard deviation from the mean; NaN for less than two values.
pub fn scatter(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return f64::NAN;
    }
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

/// The root mean square.
pub fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

/// The largest magnitude.
pub fn largest(values: &[f64]) -> f64 {
    let larger = |largest: f64, value: f64| if value > largest || value.is_nan() { value } else { largest };
    if values.is_empty() { f64::NAN } else { values.iter().map(|value| value.abs()).fold(0.0, larger) }
}

/// Coefficients `c` of the sum of `basis[i][j] c_j` that is closest to `values[i]` in the mean square, and
/// the standard deviation from it; NaN where there are no more values than coefficients.
pub fn fit<const N: usize>(basis: &[[f64; N]], values: &[f64]) -> ([f64; N], f64) {
    if basis.len() != values.len() || values.len() <= N {
        return ([f64::NAN; N], f64::NAN);
    }
    let mut matrix = [[0.0; N]; N];
    let mut c = [0.0; N];
    for (row, value) in basis.iter().zip(values) {
        for i in 0..N {
            c[i] += row[i] * value;
            (0..N).for_each(|j| matrix[i][j] += row[i] * row[j]);
        }
    }
    eliminate(&mut matrix, &mut c);
    let predicted = |row: &[f64; N]| row.iter().zip(&c).map(|(x, c)| x * c).sum::<f64>();
    let squares: f64 = basis.iter().zip(values).map(|(row, value)| (value - predicted(row)).powi(2)).sum();
    (c, (squares / (values.len() - N) as f64).sqrt())
}

/// Solves a symmetric positive definite system in place, by elimination without pivots.
fn eliminate<const N: usize>(matrix: &mut [[f64; N]; N], b: &mut [f64; N]) {
    for k in 0..N {
        for i in k + 1..N {
            let factor = matrix[i][k] / matrix[k][k];
            (k..N).for_each(|j| matrix[i][j] -= factor * matrix[k][j]);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| matrix[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / matrix[k][k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_have_known_statistics() {
        let values = [1.0, -3.0, 2.0];
        assert_eq!(mean(&values), 0.0);
        assert!((scatter(&values) - 7.0f64.sqrt()).abs() < 1e-15);
        assert!((rms(&values) - (14.0f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(largest(&values), 3.0);
    }

    #[test]
    fn nothing_and_what_is_not_a_number_have_none() {
        for values in [&[][..], &[1.0, f64::NAN, 2.0], &[f64::NAN, 1.0, 2.0], &[1.0, 2.0, f64::NAN]] {
            for statistic in [mean, scatter, rms, largest] {
                assert!(statistic(values).is_nan(), "{values:?}");
            }
        }
        assert!(scatter(&[1.0]).is_nan());
        assert!(fit(&[[1.0]], &[2.0]).1.is_nan());
    }

    #[test]
    fn a_line_is_found_and_what_is_off_it_is_scatter() {
        let x = [-1.0, 0.0, 1.0, 2.0];
        let (c, scatter) = fit(&x.map(|x| [1.0, x]), &x.map(|x| 3.0 - 2.0 * x));
        assert!((c[0] - 3.0).abs() < 1e-14 && (c[1] + 2.0).abs() < 1e-14 && scatter < 1e-14);
        let off = [0.1, -0.1, -0.1, 0.1];
        let values: Vec<f64> = x.iter().zip(off).map(|(x, off)| 3.0 - 2.0 * x + off).collect();
        let (c, scatter) = fit(&x.map(|x| [1.0, x]), &values);
        assert!((c[0] - 3.0).abs() < 1e-14 && (scatter - 0.02f64.sqrt()).abs() < 1e-14, "{c:?} {scatter}");
    }
}
