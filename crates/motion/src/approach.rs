//! Two equal spheres that equal and opposite forces push along their line of centres.

/// Gaps below which the mobility is proportional to the gap, in radii.
const NEAR: f64 = 1e-6;

/// Velocity of each of two equal spheres in a fluid at rest, over that which its force would give it alone:
/// `U = m(xi) F / (6 pi eta a)`, with the gap `xi` in radii; 0 at contact and where they overlap.
///
/// Like a sphere and a free surface (Brenner 1961, DOI 10.1016/0009-2509(61)80035-3):
/// `1/m = 4/3 sinh A sum_n n (n+1) / ((2n-1)(2n+3)) [(4 cosh^2 (n+1/2)A + (2n+1)^2 sinh^2 A) /
/// (2 sinh (2n+1)A - (2n+1) sinh 2A) - 1]`, `cosh A = 1 + xi/2`.
///
/// ```
/// // Far apart each sees the other as a point force.
/// let m = gluey_motion::approach_mobility(998.0);
/// assert!((m - (1.0 - 1.5e-3)).abs() < 1e-8);
/// ```
pub fn approach_mobility(gap: f64) -> f64 {
    if gap < NEAR {
        return gap.max(0.0) / NEAR * series(NEAR).recip();
    }
    series(gap).recip()
}

/// The resistance by Brenner's series, to rounding.
fn series(gap: f64) -> f64 {
    let half = 0.5 * gap;
    let sinh = (half * (half + 2.0)).sqrt();
    // acosh(1 + x) without the cancellation in 1 + x.
    let angle = (half + sinh).ln_1p();
    let double = 2.0 * sinh * (1.0 + half);
    let mut sum = 0.0;
    for n in 1.. {
        let n = f64::from(n);
        let odd = 2.0 * n + 1.0;
        let x = odd * angle;
        // 4 cosh^2 x/2 = 2 + 2 cosh x; the 1 is taken away under the fraction line.
        let numerator = 2.0 + 2.0 * (-x).exp() + odd * (odd * sinh * sinh + double);
        let term = n * (n + 1.0) / ((odd - 2.0) * (odd + 2.0)) * numerator / (2.0 * x.sinh() - odd * double);
        sum += term;
        if term <= 1e-17 * sum {
            break;
        }
    }
    4.0 / 3.0 * sinh * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The method of reflections (Batchelor 1976, DOI 10.1017/S0022112076001663).
    #[test]
    fn far_apart_reflections_are_few() {
        for (r, most) in [(10.0f64, 1e-5), (40.0, 3e-9)] {
            let reflections = 1.0 - 1.5 / r + r.powi(-3) - 3.75 * r.powi(-4);
            let miss = (approach_mobility(r - 2.0) - reflections).abs();
            println!("r = {r}: {miss:e}");
            assert!(miss < most, "{r}: {miss:e}");
        }
    }

    /// Lubrication (Jeffrey and Onishi 1984, DOI 10.1017/S0022112084000355): `1/m = 1/(2 xi) + 9/20 ln(1/xi)
    /// + 1.3456`.
    #[test]
    fn near_contact_the_film_resists() {
        for gap in [1e-5, 1e-4, 1e-3f64] {
            let film = 0.5 / gap - 0.45 * gap.ln() + 1.3456;
            let miss = approach_mobility(gap).recip() - film;
            println!("{gap:e}: {miss:e}");
            assert!(miss.abs() < 2e-5 - 0.1 * gap * gap.ln(), "{gap:e}: {miss:e}");
        }
        let [above, below] = [1.0, 1.0 - 1e-12].map(|x| approach_mobility(NEAR * x));
        assert!((above / below - 1.0).abs() < 1e-9);
        assert_eq!([0.0, -0.5].map(approach_mobility), [0.0; 2]);
    }
}
