//! Resistance of a film below what the mesh resolves.
//!
//! Two surfaces in relative motion drive Reynolds' equation `div(H^3 grad p) / (12 eta) = f x` along the
//! direction `x` of the motion. In the film `f = m`, the rolling: curved surfaces carry fluid into it. The
//! mesh sees flat surfaces for `r < edge`, which carry nothing but tilt with their bodies: there `f = w`, the
//! relative spin. So what it sees is a quadratic form in `w` and `m`.

use std::f64::consts::PI;

use gluey_fem::element::gauss;

/// Points of the rule for what lies outside a flat.
const RULE: usize = 12;
/// Steps from far outside a flat to its edge, and how far out in logarithms of the radius they begin.
const STEPS: usize = 100;
const FAR: f64 = 4.0;
/// Edges nearer than this to the middle, over the width of the film, do not count.
const NEAREST: f64 = 1e-2;

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

/// Resistances for unit viscosity, per unit length in 2D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deficits {
    /// To the relative velocity along the line of centres: force per velocity.
    pub normal: f64,
    /// To that across it.
    pub sliding: f64,
    /// To relative spin and rolling, torque per spin: factors of `w^2`, `2 w m`, `m^2`.
    pub rolling: [f64; 3],
}

impl FilmShape {
    /// What the mesh lacks.
    pub fn deficits<const D: usize>(&self) -> Deficits {
        if self.gap >= self.height {
            return Deficits { normal: 0.0, sliding: 0.0, rolling: [0.0; 3] };
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
                    rolling: [0.0, 0.0, PI * radius * radius * (plain + 1.0)],
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
                    rolling: [0.0, 0.0, 0.6 * PI * radius.powi(3) * (logarithm + 3.0)],
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
            rolling: rolling_of_spheres(t).map(|r| PI * radius.powi(3) * r),
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

    /// `12 (int F^2 H^-3 - (int F H^-3)^2 / int H^-3)` with `F = int f x`, for the film less that which the
    /// mesh sees.
    fn rolling_of_discs(&self, edge: f64, y: f64) -> [f64; 3] {
        let Self { gap, height, radius, .. } = *self;
        let scale = |k: i32| (radius * gap).sqrt() / gap.powi(k);
        let beyond = outside(y);
        let parts = [1, 2, 3].map(|k| scale(k) * beyond[k as usize - 1]);
        let whole = [PI, 0.5 * PI, 0.375 * PI];
        let film = [1, 2, 3].map(|k| scale(k) * whole[k as usize - 1]);
        let form = |[squares, firsts, ones]: [f64; 3]| 12.0 * (squares - firsts * firsts / ones);
        // Beyond the edge F = e + m A H / 2.
        let integrals = |e: f64, m: f64, [one, two, three]: [f64; 3]| {
            let c = 0.5 * m * radius;
            [e * e * three + 2.0 * e * c * two + c * c * one, e * three + c * two, three]
        };
        let lacking = |w: f64, m: f64| {
            let e = 0.5 * (w - m) * edge * edge - 0.5 * m * radius * gap;
            let [squares, firsts, ones] = integrals(e, m, parts);
            let flat = edge / height.powi(3);
            let squares = squares + 0.1 * (w * edge * edge).powi(2) * flat;
            let seen = [squares, firsts + w * edge * edge * flat / 3.0, ones + 2.0 * flat];
            form(integrals(-0.5 * m * radius * gap, m, film)) - form(seen)
        };
        let (spin, rolling) = (lacking(1.0, 0.0), lacking(0.0, 1.0));
        [spin, 0.5 * (lacking(1.0, 1.0) - spin - rolling), rolling]
    }
}

/// The same for spheres over `pi A^3`, with `t` the gap over the height.
///
/// The pressure is `p(r) x / r`. In the film it is `-6/5 m A r / H^2`; on the flat `a r + 3/2 w r^3 / G^3`,
/// and beyond its edge `-6/5 m A r / H^2 + b h` with the decaying solution `h` of Reynolds' equation without
/// `f`. `a` and `b` make pressure and flux continuous; `q = -r h'/h` and `s = int h r^2 dr / (h r^3)` there.
fn rolling_of_spheres(t: f64) -> [f64; 3] {
    let depth = 1.0 - t;
    let (square, cube) = (depth * depth, depth.powi(3));
    let [q, s] = decay(((1.0 - t) / t).sqrt());
    let share = cube / (1.0 + q);
    [
        -share * (3.5 + 0.5 * q) / 4.0,
        0.5 * (-0.3 * square + share * (1.2 - 3.0 * s)),
        0.6 * (-t.ln() - depth) + share * 4.8 * s,
    ]
}

/// `q` and `s` where `r^2 = y^2 A g`, from far away inwards: `dq/d ln y = q^2 - 6 y^2/(1 + y^2) q - 1`,
/// `ds/d ln y = (q - 3) s - 1`.
fn decay(y: f64) -> [f64; 2] {
    let slope = |log: f64, [q, s]: [f64; 2]| {
        let square = (2.0 * log).exp();
        [q * q - 6.0 * square / (1.0 + square) * q - 1.0, (q - 3.0) * s - 1.0]
    };
    let (start, end) = (y.max(1.0).ln() + FAR, y.max(NEAREST).ln());
    let step = (end - start) / STEPS as f64;
    let mut state = [3.0 + 10f64.sqrt(), 0.1f64.sqrt()];
    for k in 0..STEPS {
        let log = start + k as f64 * step;
        let moved = |by: f64, slope: [f64; 2]| [state[0] + by * slope[0], state[1] + by * slope[1]];
        let first = slope(log, state);
        let second = slope(log + 0.5 * step, moved(0.5 * step, first));
        let third = slope(log + 0.5 * step, moved(0.5 * step, second));
        let fourth = slope(log + step, moved(step, third));
        let mean = [0, 1].map(|k| (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k]) / 6.0);
        state = moved(step, mean);
    }
    state
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
