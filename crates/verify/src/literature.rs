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
