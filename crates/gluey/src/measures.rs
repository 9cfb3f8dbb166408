//! Measures of a run, updated row by row: the rows themselves are on disk only.

use gluey_geom::{Lattice, Vector};

use crate::case::Case;
use crate::reference::{Comparison, Deviation, ReferenceSolution};
use crate::trajectory::PairHistory;

/// Part of a row that enters the measures; a resumed run reads it from its file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Instant<const D: usize> {
    /// Time.
    pub time: f64,
    /// Centres of all particles.
    pub centers: Vec<Vector<D>>,
    /// The smallest gap of any pair, in mean radii; `None` for a single particle.
    pub smallest_gap_over_a: Option<f64>,
}

/// The measures of all rows so far.
#[derive(Clone, Debug)]
pub(crate) struct RunMeasures<const D: usize> {
    radii: Vec<f64>,
    /// Periods of the box; `None` where images slide, and the first two particles are no pair.
    lattice: Option<Lattice<D>>,
    row_count: usize,
    smallest_gap_over_a: Option<f64>,
    pair: PairHistory,
    comparison: Option<Comparison>,
}

impl<const D: usize> RunMeasures<D> {
    /// No rows yet of a run of `case`.
    pub fn new(case: &Case) -> Self {
        let reference = case.reference.as_deref().and_then(ReferenceSolution::named);
        Self {
            radii: case.particles.iter().map(|particle| particle.radius).collect(),
            lattice: (!case.is_sheared()).then(|| case.surroundings().lattice),
            row_count: 0,
            smallest_gap_over_a: None,
            pair: PairHistory::default(),
            comparison: reference.map(Comparison::new),
        }
    }

    /// Adds a row, later than all before.
    pub fn add(&mut self, instant: &Instant<D>) {
        let Instant { time, centers, smallest_gap_over_a } = instant;
        self.row_count += 1;
        let gaps = [self.smallest_gap_over_a, *smallest_gap_over_a];
        self.smallest_gap_over_a = gaps.into_iter().flatten().reduce(f64::min);
        if let ([one, other, ..], [first, second, ..], Some(lattice)) =
            (&centers[..], &self.radii[..], &self.lattice)
        {
            self.pair.push(*time, [one, other], [*first, *second], lattice);
        }
        if let Some(comparison) = &mut self.comparison {
            comparison.add(*time, centers);
        }
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.row_count
    }

    /// Mean radius of the particles.
    pub fn mean_radius(&self) -> f64 {
        self.radii.iter().sum::<f64>() / self.radii.len() as f64
    }

    /// The smallest gap of any pair in any row, in mean radii.
    pub fn smallest_gap_over_a(&self) -> Option<f64> {
        self.smallest_gap_over_a
    }

    /// Particles 1 and 2 in all rows; no rows for a single particle.
    pub fn pair(&self) -> &PairHistory {
        &self.pair
    }

    /// How far the run is from the reference of its case.
    pub fn deviation(&self) -> Option<Deviation> {
        self.comparison.as_ref()?.deviation(&self.pair)
    }
}
