//! Trajectories read from CSV files: those of the runs and the exact ones of `data/reference`.

use std::path::Path;

use anyhow::Context;
use gluey::table::{NumberTable, TableError, linear};

/// Centres and gaps over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Times in units of 1/shear rate, ascending.
    pub times: Vec<f64>,
    /// For each particle its centre at every time, in units of the box; z = 0 in two dimensions.
    pub centers: Vec<Vec<[f64; 3]>>,
    /// Gaps between pairs of particles.
    pub gaps: Vec<GapSeries>,
}

/// The gap of one pair over time.
#[derive(Clone, Debug, PartialEq)]
pub struct GapSeries {
    /// The particles, counted from 1 as in the paper.
    pub pair: (usize, usize),
    /// D/a at every time.
    pub over_radius: Vec<f64>,
}

impl Trajectory {
    /// Reads a CSV file with columns `t,x1,y1[,z1],x2,...` and gaps `gap12_over_a,...` or, for a pair,
    /// `D_over_a`.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = || path.display().to_string();
        Self::parse(&std::fs::read_to_string(path).with_context(name)?).with_context(name)
    }

    /// Takes the columns of a table; a last line without its newline (a run cut short) is dropped.
    fn parse(text: &str) -> Result<Self, TableError> {
        let whole = &text[..text.rfind('\n').map_or(0, |at| at + 1)];
        let table = NumberTable::parse(whole)?;
        let times = table.column("t")?.to_vec();
        let mut centers = Vec::new();
        while centers.is_empty() || table.find(&format!("x{}", centers.len() + 1)).is_some() {
            let [x, y, z] = ["x", "y", "z"].map(|axis| format!("{axis}{}", centers.len() + 1));
            let (x, y, z) = (table.column(&x)?, table.column(&y)?, table.find(&z));
            centers.push((0..times.len()).map(|row| [x[row], y[row], z.map_or(0.0, |z| z[row])]).collect());
        }
        Ok(Self { times, gaps: gaps(&table, centers.len()), centers })
    }

    /// The gap of a pair, if the file has it.
    pub fn gap(&self, pair: (usize, usize)) -> Option<&[f64]> {
        self.gaps.iter().find(|gap| gap.pair == pair).map(|gap| &gap.over_radius[..])
    }

    /// Points `(x, y)` of a particle's centre (counted from 1).
    pub fn path_xy(&self, particle: usize) -> Vec<(f64, f64)> {
        self.centers[particle - 1].iter().map(|c| (c[0], c[1])).collect()
    }

    /// Last time of the trajectory; minus infinity if it is empty.
    pub fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// `values` at time `t` by linear interpolation; `None` outside the trajectory.
    pub fn at(&self, values: &[f64], t: f64) -> Option<f64> {
        linear(&self.times, |row| values[row], t)
    }

    /// Centre of a particle (counted from 1) at time `t` by linear interpolation; `None` outside the
    /// trajectory.
    pub fn center_at(&self, particle: usize, t: f64) -> Option<[f64; 3]> {
        let path = &self.centers[particle - 1];
        let [x, y, z] = [0, 1, 2].map(|axis| linear(&self.times, |row| path[row][axis], t));
        Some([x?, y?, z?])
    }

    /// The half-turn orbit of a symmetric pair continued to time `end`: after each half turn the particles
    /// have changed places and everything repeats (data/reference/README.md).
    pub fn continue_half_turns(&self, end: f64) -> Self {
        let period = self.end();
        let mut all = self.clone();
        if self.times.len() < 2 || self.centers.len() != 2 {
            return all;
        }
        let mut turns = 1;
        while all.end() < end {
            all.times.extend(self.times[1..].iter().map(|t| t + period * f64::from(turns)));
            for particle in 0..2 {
                let source = if turns % 2 == 1 { 1 - particle } else { particle };
                all.centers[particle].extend_from_slice(&self.centers[source][1..]);
            }
            for (gap, own) in all.gaps.iter_mut().zip(&self.gaps) {
                gap.over_radius.extend_from_slice(&own.over_radius[1..]);
            }
            turns += 1;
        }
        all
    }
}

/// The gaps that a table has, `gap12_over_a, ...` or, for a pair, `D_over_a`.
fn gaps(table: &NumberTable, particle_count: usize) -> Vec<GapSeries> {
    let pairs = (1..=particle_count).flat_map(|i| (i + 1..=particle_count).map(move |j| (i, j)));
    let column = |(i, j)| table.find(&format!("gap{i}{j}_over_a")).or_else(|| table.find("D_over_a"));
    pairs.filter_map(|pair| Some(GapSeries { pair, over_radius: column(pair)?.to_vec() })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: &str = "# remark\nt,x1,y1,x2,y2,gap12_over_a\n0,0.4,0.5,0.6,0.5,2\n1,0.6,0.5,0.4,0.5,4\n";

    #[test]
    fn columns_are_found_by_name_and_interpolated() {
        let pair = Trajectory::parse(PAIR).unwrap();
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 0.25), Some(2.5));
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 1.0), Some(4.0));
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 1.1), None);
        assert!((pair.center_at(2, 0.5).unwrap()[0] - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_last_row_cut_short_is_dropped_and_a_bad_row_refused() {
        assert_eq!(Trajectory::parse(&format!("{PAIR}2,0.1,0.")).unwrap().times, [0.0, 1.0]);
        assert!(matches!(Trajectory::parse(&format!("{PAIR}2,0.1\n")), Err(TableError::Row { line: 5, .. })));
        assert!(matches!(Trajectory::parse("t,x1\n0,1\n"), Err(TableError::Column { .. })));
        assert!(matches!(Trajectory::parse(""), Err(TableError::Column { .. })));
    }

    #[test]
    fn half_turns_exchange_the_particles() {
        let long = Trajectory::parse(PAIR).unwrap().continue_half_turns(2.5);
        assert_eq!(long.times, [0.0, 1.0, 2.0, 3.0]);
        let x1: Vec<f64> = long.path_xy(1).iter().map(|p| p.0).collect();
        assert_eq!(x1, [0.4, 0.6, 0.4, 0.6]);
    }
}
