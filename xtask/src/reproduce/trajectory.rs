//! Trajectories read from CSV files: those of the runs and the exact ones of `data/reference`.

use std::path::{Path, PathBuf};

/// Centres and gaps over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Times in units of 1/shear rate, ascending.
    pub times: Vec<f64>,
    /// For each particle its centre at every time, in units of the box; z = 0 in two dimensions.
    pub centers: Vec<Vec<[f64; 3]>>,
    /// Gaps between pairs of particles.
    pub gaps: Vec<PairGap>,
}

/// The gap of one pair over time.
#[derive(Clone, Debug, PartialEq)]
pub struct PairGap {
    /// The particles, counted from 1 as in the paper.
    pub pair: (usize, usize),
    /// D/a at every time.
    pub over_radius: Vec<f64>,
}

/// Why a trajectory could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A column that must be there is not.
    #[error("{path}: column `{column}` is missing", path = path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// The column's name.
        column: String,
    },
    /// A row does not hold the numbers its header promises.
    #[error("{path}, line {line}: expected {expected} numbers", path = path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Line number, counted from 1.
        line: usize,
        /// Numbers that the header promises.
        expected: usize,
    },
}

impl Trajectory {
    /// Reads a CSV file with columns `t,x1,y1[,z1],x2,...` and gaps `gap12_over_a,...` or, for a pair,
    /// `D_over_a`.
    pub fn read(path: &Path) -> Result<Self, TrajectoryError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| TrajectoryError::Io { path: path.to_owned(), source })?;
        Table::parse(&text, path)?.trajectory(path)
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
        let (row, weight) = self.locate(t)?;
        let next = (row + 1).min(values.len() - 1);
        Some((1.0 - weight) * values[row] + weight * values[next])
    }

    /// Centre of a particle (counted from 1) at time `t` by linear interpolation; `None` outside the
    /// trajectory.
    pub fn center_at(&self, particle: usize, t: f64) -> Option<[f64; 3]> {
        let (row, weight) = self.locate(t)?;
        let path = &self.centers[particle - 1];
        let (from, to) = (path[row], path[(row + 1).min(path.len() - 1)]);
        Some(std::array::from_fn(|k| (1.0 - weight) * from[k] + weight * to[k]))
    }

    /// The row at or before `t`, and how far `t` is towards the next one.
    fn locate(&self, t: f64) -> Option<(usize, f64)> {
        let after = self.times.partition_point(|&time| time <= t);
        let row = after.checked_sub(1)?;
        match self.times.get(after) {
            Some(next) => Some((row, (t - self.times[row]) / (next - self.times[row]))),
            None => (t - self.times[row] <= 1e-9 * t.abs()).then_some((row, 0.0)),
        }
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

/// Columns of numbers under names.
struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads comma-separated numbers; `#` starts a comment. A last line without its newline (a run cut short)
    /// is dropped.
    fn parse(text: &str, path: &Path) -> Result<Self, TrajectoryError> {
        let whole = &text[..text.rfind('\n').map_or(0, |at| at + 1)];
        let mut lines =
            whole.lines().enumerate().filter(|(_, line)| !line.starts_with('#') && !line.is_empty());
        let names: Vec<String> = lines
            .next()
            .map_or_else(Vec::new, |(_, header)| header.split(',').map(|n| n.trim().to_owned()).collect());
        let mut columns = vec![Vec::new(); names.len()];
        for (number, line) in lines {
            let row: Vec<f64> = line.split(',').map_while(|cell| cell.trim().parse().ok()).collect();
            if row.len() != names.len() {
                return Err(TrajectoryError::Row {
                    path: path.to_owned(),
                    line: number + 1,
                    expected: names.len(),
                });
            }
            columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        Ok(Self { names, columns })
    }

    fn column(&self, name: &str) -> Option<&Vec<f64>> {
        self.names.iter().position(|n| n == name).map(|at| &self.columns[at])
    }

    fn trajectory(&self, path: &Path) -> Result<Trajectory, TrajectoryError> {
        let required = |name: &str| {
            self.column(name)
                .ok_or_else(|| TrajectoryError::Column { path: path.to_owned(), column: name.to_owned() })
        };
        let times = required("t")?.clone();
        let mut centers = Vec::new();
        while let Some(x) = self.column(&format!("x{}", centers.len() + 1)) {
            let particle = centers.len() + 1;
            let y = required(&format!("y{particle}"))?;
            let z = self.column(&format!("z{particle}"));
            centers.push((0..times.len()).map(|row| [x[row], y[row], z.map_or(0.0, |z| z[row])]).collect());
        }
        if centers.is_empty() {
            required("x1")?;
        }
        Ok(Trajectory { times, gaps: self.gaps(centers.len()), centers })
    }

    fn gaps(&self, particle_count: usize) -> Vec<PairGap> {
        let pairs = (1..=particle_count).flat_map(|i| (i + 1..=particle_count).map(move |j| (i, j)));
        let column = |(i, j)| self.column(&format!("gap{i}{j}_over_a")).or_else(|| self.column("D_over_a"));
        pairs.filter_map(|pair| Some(PairGap { pair, over_radius: column(pair)?.clone() })).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Trajectory, TrajectoryError> {
        let path = Path::new("test.csv");
        Table::parse(text, path)?.trajectory(path)
    }

    const PAIR: &str = "# remark\nt,x1,y1,x2,y2,gap12_over_a\n0,0.4,0.5,0.6,0.5,2\n1,0.6,0.5,0.4,0.5,4\n";

    #[test]
    fn columns_are_found_by_name_and_interpolated() {
        let pair = parse(PAIR).unwrap();
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 0.25), Some(2.5));
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 1.0), Some(4.0));
        assert_eq!(pair.at(pair.gap((1, 2)).unwrap(), 1.1), None);
        assert!((pair.center_at(2, 0.5).unwrap()[0] - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_last_row_cut_short_is_dropped_and_a_bad_row_refused() {
        assert_eq!(parse(&format!("{PAIR}2,0.1,0.")).unwrap().times, [0.0, 1.0]);
        assert!(matches!(parse(&format!("{PAIR}2,0.1\n")), Err(TrajectoryError::Row { line: 5, .. })));
        assert!(matches!(parse("t,x1\n0,1\n"), Err(TrajectoryError::Column { .. })));
        assert!(matches!(parse(""), Err(TrajectoryError::Column { .. })));
    }

    #[test]
    fn half_turns_exchange_the_particles() {
        let long = parse(PAIR).unwrap().continue_half_turns(2.5);
        assert_eq!(long.times, [0.0, 1.0, 2.0, 3.0]);
        let x1: Vec<f64> = long.path_xy(1).iter().map(|p| p.0).collect();
        assert_eq!(x1, [0.4, 0.6, 0.4, 0.6]);
    }
}
