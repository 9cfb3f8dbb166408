//! Explicit Euler and Adams-Bashforth 2 for positions and orientations.
//!
//! Both are one linear form, `x^{n+1} = x^n + c u^n + drift` (Verdon et al. 2010, eqs. 11, 12 and 31,
//! DOI 10.3166/REMN.16.365-383): Euler has `c = dt`, `drift = 0`; Adams-Bashforth 2 has `c = 3 dt/2`,
//! `drift = -(dt/2) u^{n-1}`. A contact model corrects `u^n` knowing only `c` and `drift`.

use std::fmt;

use gluey_contact::BodyStep;
use gluey_geom::{Dim, Particle, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// An explicit time scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Scheme {
    /// First order (Verdon et al. 2010, eq. 11).
    #[cfg_attr(feature = "serde", serde(rename = "euler"))]
    Euler,
    /// Second order (Verdon et al. 2010, eq. 12); its first step is Euler.
    #[cfg_attr(feature = "serde", serde(rename = "adams-bashforth-2"))]
    AdamsBashforth2,
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Euler => "euler",
            Self::AdamsBashforth2 => "adams-bashforth-2",
        })
    }
}

/// Moves particles with their velocities; owns the velocity history, which serialises for checkpoints.
///
/// One step of a simulation: predict `u*`, correct the velocities so that films stay open and nothing
/// overlaps ([`Integrator::with_step`]), [`Integrator::advance`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Integrator<const D: usize> {
    scheme: Scheme,
    /// `u^{n-1}`; empty before the first step.
    history: Vec<Twist<D>>,
    /// Time from the history to now; negative when the flow was reversed since.
    history_age: f64,
}

impl<const D: usize> Integrator<D> {
    /// An integrator without history.
    pub fn new(scheme: Scheme) -> Self {
        Self { scheme, history: Vec::new(), history_age: 0.0 }
    }

    /// The scheme.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// The factor `c` of `u^n` in the displacement of a step of length `dt`.
    pub fn velocity_weight(&self, dt: f64) -> f64 {
        dt - self.history_weight(dt)
    }

    /// Writes the part of the displacement known before `u^n`, one vector per particle.
    pub fn drift(&self, dt: f64, drift: &mut [Vector<D>]) {
        let weight = self.history_weight(dt);
        drift.fill(Vector::zeros());
        for (drift, twist) in drift.iter_mut().zip(&self.history) {
            *drift = twist.velocity * weight;
        }
    }

    /// What `correct` makes of a step of these particles, such as a contact model.
    pub fn with_step<T>(
        &self,
        dt: f64,
        particles: &[Particle<D>],
        correct: impl FnOnce(&BodyStep<'_, D>) -> T,
    ) -> T {
        let (poses, radii): (Vec<_>, Vec<_>) = particles.iter().map(|p| (p.pose, p.radius)).unzip();
        let weight = self.history_weight(dt);
        let mut drift: Vec<Twist<D>> = self.history.iter().map(|twist| *twist * weight).collect();
        drift.resize(particles.len(), Twist::default());
        let velocity_weight = self.velocity_weight(dt);
        correct(&BodyStep { poses: &poses, radii: &radii, drift: &drift, velocity_weight, dt })
    }

    /// Moves and turns the particles over `dt` with the (corrected) velocities `twists` and remembers these.
    ///
    /// Orientations turn at the constant spin `(c w^n + drift)/dt`, so the scheme is the same for both.
    pub fn advance(&mut self, dt: f64, particles: &mut [Particle<D>], twists: &[Twist<D>]) {
        let (weight, history_weight) = (self.velocity_weight(dt), self.history_weight(dt));
        for (index, (particle, twist)) in particles.iter_mut().zip(twists).enumerate() {
            let old = self.history.get(index).copied().unwrap_or_default();
            // The same expression as in the contact constraint, so that gaps closed there stay closed to
            // round-off.
            particle.pose.position += twist.velocity * weight + old.velocity * history_weight;
            let spin = twist.spin * (weight / dt) + old.spin * (history_weight / dt);
            particle.pose.orientation = Dim::<D>::advance(&particle.pose.orientation, &spin, dt);
        }
        self.remember(dt, twists);
    }

    /// Forgets the velocities: the next step is Euler. For a jump of the flow with no relation to what was
    /// before.
    pub fn restart(&mut self) {
        self.history.clear();
        self.history_age = 0.0;
    }

    /// Tells that the flow has been reversed, `u -> -u` at equal positions (Stokes flow under `-shear rate`).
    ///
    /// The velocity known from the last position then lies *ahead* on the way back, with the other sign: the
    /// next step is `dt/2 (u^n - u^{n-1})` and retraces the last one to third order. A step extrapolated from
    /// the history with the old sign would err by `2 dt |u|`, with the sign flipped but still extrapolated by
    /// `dt^2 |u'|`, a restart by Euler by `dt^2/2 |u'|`.
    pub fn reverse(&mut self) {
        self.history_age = -self.history_age;
        for twist in &mut self.history {
            *twist = -*twist;
        }
    }

    /// Weight of `u^{n-1}`: that of the line through `u^{n-1}` and `u^n` integrated over the step; `-dt/2` in
    /// a steady run, `dt/2` in the step after a reversal.
    fn history_weight(&self, dt: f64) -> f64 {
        if self.history.is_empty() { 0.0 } else { -0.5 * dt * (dt / self.history_age) }
    }

    fn remember(&mut self, dt: f64, twists: &[Twist<D>]) {
        if self.scheme == Scheme::AdamsBashforth2 {
            self.history.clear();
            self.history.extend_from_slice(twists);
            self.history_age = dt;
        }
    }
}
