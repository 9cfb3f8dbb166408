//! Resistance of a film below what the mesh resolves.

use std::f64::consts::PI;

use gluey_fem::element::gauss;

/// Points of the rule for what lies outside a flat.
const RULE: usize = 12;

/// A film of thickness `gap` that the mesh sees as one of thickness `height`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmShape {
    /// Thickness in the middle.
    pub gap: f64,
    /// Thickness from which on the mesh sees it as it is.
    pub height: f64,
    /// `A` of the profile `gap + r^2 / A`.
    pub radius: f64,
    /// Coefficient of the logarithm in the normal resistance of spheres, over `6 pi mu A`.
    pub logarithm: f64,
}

/// Resistances for unit viscosity, per unit length in 2D: to the relative velocity along the line of centres
/// and across it, and to rolling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deficits {
    /// Force per velocity.
    pub normal: f64,
    /// Force per velocity.
    pub sliding: f64,
    /// Torque per relative spin.
    pub rolling: f64,
}

impl Deficits {
    /// That to a mode of [`super::FilmCoupling`].
    pub fn of_mode<const D: usize>(&self, mode: usize) -> f64 {
        match mode {
            0 => self.normal,
            mode if mode < D => self.sliding,
            _ => self.rolling,
        }
    }
}

impl FilmShape {
    /// What the mesh lacks.
    pub fn deficits<const D: usize>(&self) -> Deficits {
        if self.gap >= self.height {
            return Deficits { normal: 0.0, sliding: 0.0, rolling: 0.0 };
        }
        match D {
            2 => self.of_discs(),
            _ => self.of_spheres(),
        }
    }

    /// What the mesh has, about.
    pub fn resolved<const D: usize>(&self) -> Deficits {
        let Self { gap, height, radius, .. } = *self;
        match D {
            2 => {
                let xi = height.max(gap) / radius;
                let [plain, cubic] = [1.0 / xi.sqrt(), xi.powf(-1.5)];
                Deficits {
                    normal: 1.5 * PI * (cubic + 1.7 * plain),
                    sliding: PI * plain + 2.2,
                    rolling: PI * radius * radius * (plain + 1.0),
                }
            }
            _ => {
                let t = (gap / height).min(1.0);
                let xi = height.max(gap) / radius;
                let squeezed = 0.25 * (3.0 - 3.0 * t + t * t) / xi;
                let logarithm = (1.0 + 1.0 / xi).ln();
                Deficits {
                    normal: 6.0 * PI * radius * (squeezed + 0.5 + 0.225 * logarithm),
                    sliding: PI * radius * (logarithm + 3.0),
                    rolling: 0.6 * PI * radius.powi(3) * (logarithm + 3.0),
                }
            }
        }
    }

    fn of_spheres(&self) -> Deficits {
        let Self { gap, height, radius, logarithm } = *self;
        let t = gap / height;
        let first = -t.ln() - (1.0 - t);
        let third = first - 0.5 * (1.0 - t).powi(2);
        Deficits {
            normal: 6.0 * PI * radius * (0.25 * radius / gap * (1.0 - t).powi(3) + logarithm * third),
            sliding: PI * radius * first,
            rolling: 0.6 * PI * radius.powi(3) * first,
        }
    }

    fn of_discs(&self) -> Deficits {
        let Self { gap, height, radius, .. } = *self;
        // The film is thinner than `height` for |x| < edge.
        let edge = (radius * (height - gap)).sqrt();
        let y = ((height - gap) / gap).sqrt();
        let bell = y / (1.0 + y * y);
        let squeezed = (y.atan() + bell) / 8.0 - 0.25 * bell / (1.0 + y * y);
        let plain = (radius / gap).sqrt() * y.atan() - edge / height;
        let cubic = (radius / gap).powf(1.5) * squeezed - edge.powi(3) / (3.0 * height.powi(3));
        Deficits {
            normal: 24.0 * cubic + 3.0 * 1.725 * plain,
            sliding: 2.0 * plain,
            rolling: self.rolling_of_discs(edge, y),
        }
    }

    /// `12 (A/2)^2 (I_1 - I_2^2 / I_3)` with `I_k = int H^-k dx`, for the film less that which the mesh sees.
    fn rolling_of_discs(&self, edge: f64, y: f64) -> f64 {
        let Self { gap, height, radius, .. } = *self;
        let whole = [PI, 0.5 * PI, 0.375 * PI];
        let outside = outside(y);
        let scale = |k: i32| (radius * gap).sqrt() / gap.powi(k);
        let film = |parts: [f64; 3]| [1, 2, 3].map(|k| scale(k) * parts[k as usize - 1]);
        let seen = film(outside);
        let seen = [1, 2, 3].map(|k| seen[k as usize - 1] + 2.0 * edge / height.powi(k));
        let resistance = |i: [f64; 3]| 3.0 * radius * radius * (i[0] - i[1] * i[1] / i[2]);
        resistance(film(whole)) - resistance(seen)
    }
}

/// `2 int_y^inf (1 + s^2)^-k ds` for `k` from 1 to 3.
fn outside(y: f64) -> [f64; 3] {
    if y < 1.0 {
        let bell = y / (1.0 + y * y);
        let second = y.atan() + bell;
        let third = 0.75 * second + 0.5 * bell / (1.0 + y * y);
        return [PI - 2.0 * y.atan(), 0.5 * PI - second, 0.375 * PI - third];
    }
    // With s = 1 / u.
    [1, 2, 3].map(|k| {
        let terms = gauss(RULE).into_iter().map(|(t, weight)| {
            let u = t / y;
            2.0 * weight / y * u.powi(2 * k - 2) / (1.0 + u * u).powi(k)
        });
        terms.sum::<f64>()
    })
}

#[cfg(test)]
mod tests;
