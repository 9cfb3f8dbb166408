//! What is known of suspensions of equal hard spheres, as functions of the fraction of the volume that they
//! fill.

/// Settling of a simple cubic lattice of small spheres: `K = 1 - 1.7601 phi^(1/3)` (Hasimoto 1959,
/// 10.1017/S0022112059000222).
pub const HASIMOTO: f64 = 1.7601;

/// Relative viscosity of hard spheres in equilibrium at high frequency (Riest, Eckert, Richtering and
/// Naegele 2015, 10.1039/C4SM02816A).
pub fn viscosity_of_spheres(phi: f64) -> f64 {
    let s = phi * (1.0 + 0.95 * phi - 2.15 * phi * phi);
    1.0 + 2.5 * phi * (1.0 + s) / (1.0 - phi * (1.0 + s))
}

/// Relative viscosity `(1 + 1.25 phi / (1 - phi/most))^2` (Eilers 1941, 10.1007/BF01503023).
pub fn eilers_viscosity(phi: f64, most: f64) -> f64 {
    (1.0 + 1.25 * phi / (1.0 - phi / most)).powi(2)
}

/// Relative viscosity `(1 - phi/most)^-2` (Maron and Pierce 1956, 10.1016/0095-8522(56)90023-X).
pub fn maron_pierce_viscosity(phi: f64, most: f64) -> f64 {
    (1.0 - phi / most).powi(-2)
}

/// Relative viscosity of real spheres, `exp(-2.34 phi) / (1 - phi/0.62)^3` (Zarraga, Hill and Leighton 2000,
/// 10.1122/1.551083).
pub fn zarraga_viscosity(phi: f64) -> f64 {
    (-2.34 * phi).exp() / (1.0 - phi / 0.62).powi(3)
}

/// Relative viscosity of real spheres, `1 + 2.5 phi / (1 - phi/most) + mu q` with `most = 0.585`,
/// `q = (phi / (most - phi))^2` and `mu = 0.32 + 0.38 / (1 + 0.005 q)` (Boyer, Guazzelli and Pouliquen 2011,
/// 10.1103/PhysRevLett.107.188301).
pub fn boyer_viscosity(phi: f64) -> f64 {
    let most = 0.585;
    let square = (phi / (most - phi)).powi(2);
    1.0 + 2.5 * phi / (1.0 - phi / most) + (0.32 + 0.38 / (1.0 + 0.005 * square)) * square
}

/// Velocity of hard spheres in equilibrium that begin to settle, over that of a single sphere: a polynomial
/// through results of simulations for fractions up to 0.5.
pub fn settling_of_spheres(phi: f64) -> f64 {
    1.0 - 6.5464 * phi * (1.0 - phi * (3.348 - phi * (7.426 - phi * (10.034 - phi * 5.882))))
}

/// What a periodic box of `count` spheres lacks of the settling velocity (Ladd 1990, 10.1063/1.458830), with
/// `S(0)` of Carnahan and Starling.
pub fn settling_lost_in_box(phi: f64, count: usize) -> f64 {
    let compressibility = (1.0 - phi).powi(4) / (1.0 + phi * (4.0 + phi * (4.0 - phi * (4.0 - phi))));
    HASIMOTO * compressibility * (phi / count as f64).cbrt() / viscosity_of_spheres(phi)
}
