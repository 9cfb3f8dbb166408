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
/// A resistance to the flow through a film that is not larger, over that of the mesh, is none.
const SMALLEST: f64 = 1e-9;

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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deficits {
    /// To the relative velocity along the line of centres: force per velocity.
    pub normal: f64,
    /// To that across it.
    pub sliding: f64,
    /// To relative spin and rolling, torque per spin: factors of `w^2`, `2 w m`, `m^2`. With what flows
    /// through the film where `through` is zero, for the flow that has the least power.
    pub rolling: [f64; 3],
    /// To what flows through the film, force per volume per time and width: factor of `(Q + k m)^2`.
    pub through: f64,
    /// The area `k` in that.
    pub carried: f64,
}

impl FilmShape {
    /// What the mesh lacks.
    pub fn deficits<const D: usize>(&self) -> Deficits {
        if self.gap >= self.height {
            return Deficits::default();
        }
        match D {
            2 => self.of_discs(),
            _ => self.of_spheres(),
        }
    }

    /// The same where what flows through the film is a variable of its own: the flow `Q` through the edge of
    /// the flats relative to them.
    ///
    /// Conservation makes the flow what it is inside, so that neither the form of the mesh nor that of the
    /// film knows what is outside. `Q + k m` stands alone; that the flats tilt with `w` where the film rolls
    /// with `m` counts only in what is left.
    pub fn deficits_with_flow<const D: usize>(&self) -> Deficits {
        if self.gap >= self.height {
            return Deficits::default();
        }
        let edge = self.edge();
        // Over `scale edge^(2k)`, of `Q^2`, `2 Q m` and `m^2`.
        let (scale, [flow, cross, moving], flat, beyond) = match D {
            2 => (24.0 * edge, self.through_discs(), [1.0, 1.0 / 3.0, 2.0 / 15.0], self.beyond_parabola()),
            _ => (
                12.0 * PI * edge.powi(2),
                through_spheres(self.gap / self.height),
                [1.0, 0.25, 7.0 / 96.0],
                0.0,
            ),
        };
        let scale = scale / self.height.powi(3);
        let lacking = [flow - flat[0], cross - flat[1]];
        let ratio = if lacking[0] > SMALLEST { lacking[1] / lacking[0] } else { 0.0 };
        let square = edge.powi(2);
        let rolling = scale * square * square;
        Deficits {
            rolling: [-rolling * flat[2], 0.0, rolling * (moving - ratio * lacking[1])],
            through: scale * lacking[0] + beyond,
            carried: ratio * square,
            ..self.deficits::<D>()
        }
    }

    /// Thickness that the mesh sees where the distance from the line of centres has this square.
    pub fn seen(&self, square: f64) -> f64 {
        self.height.max(self.gap + square / self.radius)
    }

    /// Where the film has the thickness `height`.
    pub fn edge(&self) -> f64 {
        (self.radius * (self.height - self.gap)).max(0.0).sqrt()
    }

    /// `int H^-3 ((1 - x^2) / 2)^k dx` over the half inside the edge, which is at one, for `k` from 0 to 2,
    /// with `height` one.
    fn through_discs(&self) -> [f64; 3] {
        let t = self.gap / self.height;
        let y = ((1.0 - t) / t).sqrt();
        // H = t (1 + s^2) with x = s / y.
        let inside = inside(y);
        let [one, two, three] = [1, 2, 3].map(|k| inside[k as usize - 1] / (y * t.powi(k)));
        // 1 - x^2 = (1 - H) / (1 - t).
        let depth = 0.5 / (1.0 - t);
        [three, depth * (three - two), depth * depth * (three - 2.0 * two + one)]
    }

    /// What the next order of lubrication theory adds to the resistance of a film of equal discs to the flow
    /// through it: surfaces bend away from parabolas, which takes `-3/4 x^4 / (A^3 H^4)` from `1 / H^3`, and
    /// pressures vary across a film that widens, which adds `6/5 x^2 / (A^2 H^3)` (Van Dyke 1987, Slow
    /// variations in continuum mechanics, section 4). Of the whole film it is 0.275 `gap / A`.
    fn beyond_parabola(&self) -> f64 {
        let Self { gap, height, radius, .. } = *self;
        let [_, two, three, four] = inside(((height - gap) / gap).sqrt());
        let terms = 1.2 * (two - three) - 0.75 * (two - 2.0 * three + four);
        24.0 * terms / (radius * gap.powi(3)).sqrt()
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
                    through: 24.0 * (self.edge() + height) / height.powi(3),
                    carried: 0.0,
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
                    through: 12.0 * PI * (self.edge() + height).powi(2) / height.powi(3),
                    carried: 0.0,
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
            through: 0.0,
            carried: 0.0,
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
            through: 0.0,
            carried: 0.0,
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
        state = runge_kutta(&slope, start + k as f64 * step, step, state);
    }
    state
}

/// `int_0^y (1 + s^2)^-k ds` for `k` from 1 to 4.
fn inside(y: f64) -> [f64; 4] {
    let bell = |k: i32| y / (1.0 + y * y).powi(k);
    let first = y.atan();
    let second = 0.5 * (first + bell(1));
    let third = 0.75 * second + 0.25 * bell(2);
    [first, second, third, (5.0 * third + bell(3)) / 6.0]
}

/// The power of the flow through the edge of the film between two spheres, over `12 pi / G^3`: factors of
/// `e^2 Q^2`, `2 e^4 Q m` and `e^6 m^2`, with the edge at `e`, where its thickness is `G`, and with `t` the
/// gap over that.
///
/// The flow is that of the pressure `p(r) x / r`, which is `-12 (u Q r^2 + v m r^4) / (r H^3)` for the flow
/// `Q` through a circle of any radius `r`. Reynolds' equation makes `u' = 1 - u^2 + k u`,
/// `v' = u + (k - 3 - u) v` with `k = 3 r H' / H`, and the power grows by `(2 v - v^2) r^6 / H^3`,
/// derivatives by the logarithm of `r`.
fn through_spheres(t: f64) -> [f64; 3] {
    let ratio = (1.0 - t) / t;
    let start = (NEAREST / ratio.sqrt()).ln().min(-FAR);
    let step = -start / (2 * STEPS) as f64;
    let slope = |log: f64, [u, v, _]: [f64; 3]| {
        let square = (2.0 * log).exp();
        let k = 6.0 * ratio * square / (1.0 + ratio * square);
        let weight = square.powi(3) / (t + (1.0 - t) * square).powi(3);
        [1.0 - u * u + k * u, u + (k - 3.0 - u) * v, weight * (2.0 * v - v * v)]
    };
    let core = (6.0 * start).exp() / t.powi(3);
    let mut state = [1.0, 0.25, 7.0 / 96.0 * core];
    for k in 0..2 * STEPS {
        state = runge_kutta(&slope, start + k as f64 * step, step, state);
    }
    state
}

/// A step of the classical method of fourth order.
fn runge_kutta<const N: usize>(
    slope: &impl Fn(f64, [f64; N]) -> [f64; N],
    at: f64,
    step: f64,
    state: [f64; N],
) -> [f64; N] {
    let moved = |by: f64, slope: [f64; N]| std::array::from_fn(|i| state[i] + by * slope[i]);
    let first = slope(at, state);
    let second = slope(at + 0.5 * step, moved(0.5 * step, first));
    let third = slope(at + 0.5 * step, moved(0.5 * step, second));
    let fourth = slope(at + step, moved(step, third));
    moved(step / 6.0, std::array::from_fn(|i| first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]))
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
