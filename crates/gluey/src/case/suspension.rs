//! How a case describes particles that are to be generated.

use gluey_suspension::packing::{Amount, Arrangement, DEFAULT_SWEEPS, LargeShare, PackingParams, Sizes};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::names::{ArrangementName, RadiiKind};
use super::particle_problem::ParticleProblem;

/// Particles to generate. Two of `volume_fraction`, `count` and `radius` are given; the third follows from
/// the box. With a fraction and a radius the number of particles is rounded, and the radii are adapted so
/// that the fraction is met exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SuspensionSpec {
    /// Volume of the particles; in 2D their area. Unit: volume of the box, in 2D its area. Default: what
    /// follows from `count` and `radius`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub volume_fraction: Option<f64>,
    /// Number of particles. Unit: particles. Default: what follows from `volume_fraction` and `radius`.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub count: Option<usize>,
    /// Mean radius. Unit: length. Default: what follows from `volume_fraction` and `count`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<f64>,
    /// How particles are arranged. Default: "equilibrium".
    pub arrangement: ArrangementName,
    /// Monte Carlo moves of each particle for `equilibrium`. Unit: moves. Default: 4000.
    #[schemars(range(max = 1_000_000))]
    pub sweeps: Option<usize>,
    /// Seed of the random numbers. Unit: none. Default: 1.
    pub seed: u64,
    /// Smallest gap between surfaces, walls included. Unit: mean radius. Default: 0.01.
    #[schemars(range(min = 0, max = 1))]
    pub min_gap: f64,
    /// Displacements from the sites of a lattice. Unit: the largest that keep the smallest gap. Default: 0.
    #[schemars(range(min = 0, max = 1))]
    pub jitter: f64,
    /// Whether all of them are held where they are: a fixed bed. Default: false.
    pub held: bool,
    /// Distribution of the radii.
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
            held: false,
            radii: RadiiSpec::default(),
        }
    }
}

/// Distribution of radii.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RadiiSpec {
    /// Kind of the distribution. Default: "equal".
    pub kind: RadiiKind,
    /// `bidisperse`: the larger radius. Unit: the smaller radius. Default: none, it is needed there.
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 1))]
    pub ratio: Option<f64>,
    /// `bidisperse`: how many particles are large. Unit: number of particles. Default: 0.5, without
    /// `large_volume`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub large_number: Option<f64>,
    /// `bidisperse`: volume of the large particles, instead of `large_number`. Unit: volume of all particles.
    /// Default: what follows from `large_number`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub large_volume: Option<f64>,
    /// `lognormal`: standard deviation of the logarithm of the radius; it is cut at three of them. Unit:
    /// none. Default: none, it is needed there.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0))]
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
