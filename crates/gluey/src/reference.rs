//! Reference solutions compiled into the program, so that it compares from any folder.
//!
//! All are for the unit box at shear rate 1 and radius 0.05. The files in `data` of this package are copies
//! of those in `data/reference` of the workspace, whose README says where each came from; a test compares
//! them.

use gluey_geom::Vector;

use crate::interpolate::cubic;
use crate::table::NumberTable;
use crate::trajectory::PairHistory;

/// Names a case may give as its `reference`.
pub const NAMES: &[&str] =
    &["pair2d_trajectory", "trio2d_trajectory", "pair3d_trajectory_box", "pair3d_trajectory_unbounded"];

/// Radius of the particles in every reference.
pub(crate) const RADIUS: f64 = 0.05;
/// Height at which the shear is at rest, and coordinate z of all centres.
pub(crate) const MIDDLE: f64 = 0.5;
/// Trajectories of particles, to compare a run with.
#[derive(Clone, Debug)]
pub struct ReferenceSolution {
    dimension: usize,
    /// Whether the flow is in the unit box with Couette velocity on its boundary, or without a box.
    is_in_box: bool,
    times: Vec<f64>,
    /// Columns of x and y of each particle.
    centers: Vec<[Vec<f64>; 2]>,
    /// Gap of particles 1 and 2 over the radius.
    gap: Vec<f64>,
}

/// Distance of a run from a [`ReferenceSolution`], over the time they have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Relative error of the gap of particles 1 and 2 at the end.
    pub end_gap_rel_error: Option<f64>,
    /// Largest distance of a centre from its reference (in the plane of shear), in radii.
    pub max_abs_error_over_a: f64,
}

impl ReferenceSolution {
    /// The reference of that name.
    pub fn named(name: &str) -> Option<Self> {
        let (dimension, is_in_box, text) = match name {
            "pair2d_trajectory" => (2, true, include_str!("../data/pair2d_trajectory.csv")),
            "trio2d_trajectory" => (2, true, include_str!("../data/trio2d_trajectory.csv")),
            "pair3d_trajectory_box" => (3, true, include_str!("../data/pair3d_trajectory_box.csv")),
            "pair3d_trajectory_unbounded" => {
                (3, false, include_str!("../data/pair3d_trajectory_unbounded.csv"))
            }
            _ => return None,
        };
        Self::new(dimension, is_in_box, &NumberTable::parse(text).ok()?)
    }

    fn new(dimension: usize, is_in_box: bool, table: &NumberTable) -> Option<Self> {
        let column = |name: &str| table.find(name).map(<[f64]>::to_vec);
        let centers =
            (1..).map_while(|n| Some([column(&format!("x{n}"))?, column(&format!("y{n}"))?])).collect();
        let gap = column("D_over_a").or_else(|| column("gap12_over_a"))?;
        Some(Self { dimension, is_in_box, times: column("t")?, centers, gap })
    }

    /// Dimension of space.
    pub(crate) fn dimension(&self) -> usize {
        self.dimension
    }

    /// Whether the flow is in the unit box with Couette velocity on its boundary, or without a box.
    pub(crate) fn is_in_box(&self) -> bool {
        self.is_in_box
    }

    /// Number of particles.
    pub(crate) fn particle_count(&self) -> usize {
        self.centers.len()
    }

    /// Centres of the particles at the start; all references lie in the middle plane.
    pub(crate) fn starts(&self) -> impl Iterator<Item = [f64; 3]> {
        self.centers.iter().map(|[x, y]| [x[0], y[0], MIDDLE])
    }

    /// Largest distance of a centre from its reference at `time`, in radii.
    fn error<const D: usize>(&self, time: f64, centers: &[Vector<D>]) -> Option<f64> {
        let at = |column: &[f64]| cubic(&self.times, |index| column[index], time);
        let distances = centers
            .iter()
            .zip(&self.centers)
            .map(|(center, [x, y])| Some((center[0] - at(x)?).hypot(center[1] - at(y)?) / RADIUS));
        distances.collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::max)
    }
}

/// A run beside a [`ReferenceSolution`], row by row.
#[derive(Clone, Debug)]
pub(crate) struct Comparison {
    reference: ReferenceSolution,
    max_abs_error_over_a: Option<f64>,
}

impl Comparison {
    /// No rows yet.
    pub fn new(reference: ReferenceSolution) -> Self {
        Self { reference, max_abs_error_over_a: None }
    }

    /// Adds a row.
    pub fn add<const D: usize>(&mut self, time: f64, centers: &[Vector<D>]) {
        if self.reference.times.last().is_some_and(|&end| time <= end) {
            let errors = [self.max_abs_error_over_a, self.reference.error(time, centers)];
            self.max_abs_error_over_a = errors.into_iter().flatten().reduce(f64::max);
        }
    }

    /// The distance of all rows, in which particles 1 and 2 were as `pair` says; `None` if there is no time
    /// in common.
    pub fn deviation(&self, pair: &PairHistory) -> Option<Deviation> {
        let max_abs_error_over_a = self.max_abs_error_over_a?;
        let times = &self.reference.times;
        let end = times.last()?.min(pair.end()?);
        let gap = cubic(times, |index| self.reference.gap[index], end)?;
        let end_gap_rel_error = pair.gap_at(end).map(|found| (found / RADIUS - gap).abs() / gap.abs());
        Some(Deviation { end_gap_rel_error, max_abs_error_over_a })
    }
}

#[cfg(test)]
mod tests {
    use gluey_geom::Lattice;

    use super::*;

    #[test]
    fn every_name_has_a_table_with_ascending_times() {
        for name in NAMES {
            let reference = ReferenceSolution::named(name).expect(name);
            assert!(reference.times.len() > 20 && reference.centers.len() >= 2, "{name}");
            assert!(reference.times.is_sorted_by(|a, b| a < b), "{name}");
        }
    }

    #[test]
    fn a_reference_does_not_deviate_from_itself() {
        let reference = ReferenceSolution::named("pair2d_trajectory").expect("known");
        let shifted = |shift: f64| {
            let mut comparison = Comparison::new(reference.clone());
            let mut pair = PairHistory::default();
            for (row, &time) in reference.times.iter().enumerate() {
                let center = |n: usize| {
                    Vector::<2>::new(reference.centers[n][0][row], reference.centers[n][1][row] + shift)
                };
                let centers = [center(0), center(1)];
                comparison.add(time, &centers);
                pair.push(time, [&centers[0], &centers[1]], [RADIUS; 2], &Lattice::default());
            }
            comparison.deviation(&pair).expect("a common time")
        };
        assert!(shifted(0.0).max_abs_error_over_a < 1e-9);
        assert!(shifted(0.0).end_gap_rel_error.expect("a pair") < 1e-4);
        assert!((shifted(0.01).max_abs_error_over_a - 0.2).abs() < 1e-9);
    }
}
