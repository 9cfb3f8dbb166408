//! How a case describes particles that are to be generated.

use gluey_suspension::packing::{Amount, Arrangement, DEFAULT_SWEEPS, LargeShare, PackingParams, Sizes};
use serde::{Deserialize, Serialize};

use super::names::{ArrangementName, RadiiKind};
use super::particle_problem::ParticleProblem;

/// Particles to generate. Two of `volume_fraction`, `count` and `radius` are given; the third follows from
/// the box. With a fraction and a radius the number of particles is rounded, and the radii are adapted so
/// that the fraction is met exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SuspensionSpec {
    /// Volume of the particles over that of the box; in 2D areas.
    pub volume_fraction: Option<f64>,
    /// Number of particles.
    pub count: Option<usize>,
    /// Mean radius.
    pub radius: Option<f64>,
    /// How particles are arranged; `equilibrium` when absent.
    pub arrangement: ArrangementName,
    /// Monte Carlo moves of each particle for `equilibrium`; when absent, [`DEFAULT_SWEEPS`].
    pub sweeps: Option<usize>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Smallest gap between surfaces, walls included, in mean radii; 0.01 when absent.
    pub min_gap: f64,
    /// Displacements from the sites of a lattice, relative to the largest that keep the smallest gap: 0 to 1.
    pub jitter: f64,
    /// Distribution of the radii; equal when absent.
    pub radii: RadiiSpec,
}

impl Default for SuspensionSpec {
    fn default() -> Self {
        Self {
            volume_fraction: None,
            count: None,
            radius: None,
            arrangement: ArrangementName::Equilibrium,
            sweeps: None,
            seed: 1,
            min_gap: 0.01,
            jitter: 0.0,
            radii: RadiiSpec::default(),
        }
    }
}

/// Distribution of radii.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RadiiSpec {
    /// `equal`, `bidisperse` or `lognormal`.
    pub kind: RadiiKind,
    /// `bidisperse`: the larger radius over the smaller one.
    pub ratio: Option<f64>,
    /// `bidisperse`: share of the number of particles that is large; half of it when this and `large_volume`
    /// are absent.
    pub large_number: Option<f64>,
    /// `bidisperse`: share of the volume of particles that is in large ones, instead of `large_number`.
    pub large_volume: Option<f64>,
    /// `lognormal`: standard deviation of the logarithm of the radius; it is cut at three of them.
    pub deviation: Option<f64>,
}

impl RadiiSpec {
    fn sizes(&self) -> Result<Sizes, ParticleProblem> {
        let Self { kind, ratio, large_number, large_volume, deviation } = *self;
        let bidisperse = [("ratio", ratio), ("large_number", large_number), ("large_volume", large_volume)];
        let takes = |key: &str| match kind {
            RadiiKind::Equal => false,
            RadiiKind::Bidisperse => key != "deviation",
            RadiiKind::Lognormal => key == "deviation",
        };
        let problem = |key, is_missing| ParticleProblem::RadiiKey { key, kind: kind.name(), is_missing };
        let mut given = bidisperse.into_iter().chain([("deviation", deviation)]);
        if let Some((key, _)) = given.find(|(key, value)| value.is_some() && !takes(key)) {
            return Err(problem(key, false));
        }
        match kind {
            RadiiKind::Equal => Ok(Sizes::Equal),
            RadiiKind::Lognormal => {
                deviation.map(|deviation| Sizes::Lognormal { deviation }).ok_or(problem("deviation", true))
            }
            RadiiKind::Bidisperse => {
                let large = match (large_number, large_volume) {
                    (Some(_), Some(_)) => return Err(problem("large_volume", false)),
                    (None, Some(share)) => LargeShare::OfVolume(share),
                    (share, None) => LargeShare::OfNumber(share.unwrap_or(0.5)),
                };
                ratio.map(|ratio| Sizes::Bidisperse { ratio, large }).ok_or(problem("ratio", true))
            }
        }
    }
}

impl SuspensionSpec {
    /// What the packing is to be.
    pub fn params(&self) -> Result<PackingParams, ParticleProblem> {
        let amount = match (self.volume_fraction, self.count, self.radius) {
            (Some(fraction), Some(count), None) => Amount::Count { fraction, count },
            (Some(fraction), None, Some(radius)) => Amount::Radius { fraction, radius },
            (None, Some(count), Some(radius)) => Amount::CountAndRadius { count, radius },
            (fraction, count, radius) => {
                let given = [fraction.is_some(), count.is_some(), radius.is_some()];
                return Err(ParticleProblem::Amount { given: given.iter().filter(|is| **is).count() });
            }
        };
        Ok(PackingParams {
            amount,
            sizes: self.radii.sizes()?,
            arrangement: self.arrangement(),
            min_gap: self.min_gap,
            jitter: self.jitter,
            seed: self.seed,
        })
    }

    fn arrangement(&self) -> Arrangement {
        match self.arrangement {
            ArrangementName::Equilibrium => {
                Arrangement::Equilibrium { sweep_count: self.sweeps.unwrap_or(DEFAULT_SWEEPS) }
            }
            ArrangementName::Random => Arrangement::Random,
            ArrangementName::Square => Arrangement::Square,
            ArrangementName::Hexagonal => Arrangement::Hexagonal,
            ArrangementName::SimpleCubic => Arrangement::SimpleCubic,
            ArrangementName::BodyCentred => Arrangement::BodyCentred,
            ArrangementName::FaceCentred => Arrangement::FaceCentred,
        }
    }
}
