//! Equations of state of hard discs and spheres, to compare with.

/// Value `g(2a)` of the pair correlation of equal hard balls in equilibrium where they touch, at a fraction
/// `phi` of the volume (area): `(1 - phi/2) / (1 - phi)^3` in 3D (Carnahan and Starling 1969,
/// DOI 10.1063/1.1672048), `(1 - 7 phi/16) / (1 - phi)^2` in 2D (Henderson 1975,
/// DOI 10.1080/00268977500102511). Good to 1 % in the fluid.
pub fn contact_value<const D: usize>(phi: f64) -> f64 {
    match D {
        2 => (1.0 - 7.0 / 16.0 * phi) / (1.0 - phi).powi(2),
        _ => (1.0 - 0.5 * phi) / (1.0 - phi).powi(3),
    }
}

/// The structure factor at vanishing wave number of the same fluids, `1 / (d(phi Z)/d phi)` with the
/// compressibility factor `Z = 1 + 2^{D-1} phi g(2a)`.
pub fn compressibility<const D: usize>(phi: f64) -> f64 {
    match D {
        2 => (1.0 - phi).powi(3) / (1.0 + phi + 0.375 * phi * phi - 0.125 * phi.powi(3)),
        _ => (1.0 - phi).powi(4) / ((1.0 + 2.0 * phi).powi(2) + phi.powi(3) * (phi - 4.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const D: usize>() {
        let pressure = |phi: f64| phi * (1.0 + f64::from(1 << (D - 1)) * phi * contact_value::<D>(phi));
        for phi in [0.01, 0.2, 0.45] {
            let slope = (pressure(phi + 1e-6) - pressure(phi - 1e-6)) / 2e-6;
            assert!((slope * compressibility::<D>(phi) - 1.0).abs() < 1e-8, "{D}D, {phi}");
        }
    }

    #[test]
    fn compressibilities_follow_from_contact_values() {
        check::<2>();
        check::<3>();
    }
}
