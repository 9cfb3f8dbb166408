//! An estimate of the largest eigenvalue of a symmetric positive semidefinite operator.

use super::{DelassusOperator, dot};

/// Power iterations made: enough to come within a few per cent, and a step length may be off by nearly two.
const ITERATION_COUNT: usize = 20;

/// Logarithm of a number of contacts that one of those who share a problem hardly has.
const CONTACTS_OF_A_PLACE: usize = 20;

/// Rayleigh quotient after some power iterations: a lower bound of `||A||`, exact for one contact. `x` and
/// `y` are vectors to work on.
pub fn largest_eigenvalue(operator: &mut dyn DelassusOperator, x: &mut [f64], y: &mut [f64]) -> f64 {
    // Signs and sizes that no regular packing has, so that the start is not orthogonal to the answer.
    let first = operator.place().unwrap_or(0) << CONTACTS_OF_A_PLACE;
    for (k, x) in (first..).zip(x.iter_mut()) {
        *x = (k as f64 * 0.618_033_988_749_894_9).fract() - 0.3;
    }
    let mut quotient = 0.0;
    for _ in 0..ITERATION_COUNT {
        operator.apply(x, y);
        let mut products = [dot(x, y), dot(x, x), dot(y, y)];
        operator.complete(&mut products, &mut []);
        quotient = products[0] / products[1];
        let norm = products[2].sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            break;
        }
        for (x, y) in x.iter_mut().zip(&*y) {
            *x = y / norm;
        }
    }
    quotient
}
