//! What holds or drives particles as comma-separated values, a row per step.
//!
//! Force and torque on each such particle by what holds it, about its centre: together with fluid, films,
//! weight and repulsion they make it move as it is told. Without weight and free particles their sum is minus
//! that of the force density on the box. Before them stand the mean velocity of fluid and particles over the
//! box and the force density.

use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Space};
use gluey_motion::Holding;

use super::draft::{Draft, Mark, RowsError};
use super::{OutputError, drafts};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Writes rows as they come, like [`super::csv::CsvWriter`], to `<stem>-forces.csv` beside the trajectory.
#[derive(Debug)]
pub struct ForcesWriter(Draft);

impl ForcesWriter {
    /// Starts the file beside the trajectory `csv` for the particles of these indices.
    pub fn create<const D: usize>(
        csv: &Path,
        particles: impl IntoIterator<Item = usize>,
    ) -> Result<Self, RowsError> {
        let mut draft = Draft::create(&forces_path(csv))?;
        draft.write(&format!("{}\n", header::<D>(particles)))?;
        Ok(Self(draft))
    }

    /// Goes on with the file at `mark`.
    pub(crate) fn resume(csv: &Path, mark: &Mark) -> Result<Self, RowsError> {
        Ok(Self(Draft::resume(&forces_path(csv), mark)?))
    }

    /// Adds the row of a time, which is with the operating system when this returns.
    pub fn write<const D: usize>(&mut self, time: f64, holding: &Holding<D>) -> Result<(), RowsError>
    where
        Dim<D>: Space<D>,
    {
        self.0.write(&line(time, holding))
    }

    /// How far the file has come.
    pub(crate) fn mark(&self) -> Mark {
        self.0.mark()
    }

    /// Gives the complete file its name.
    pub fn finish(self) -> Result<(), OutputError> {
        self.0.finish()
    }
}

/// Drafts that earlier runs left.
pub(crate) fn earlier_drafts(csv: &Path) -> Result<Vec<PathBuf>, OutputError> {
    drafts(&forces_path(csv))
}

/// The file beside a trajectory.
pub fn forces_path(csv: &Path) -> PathBuf {
    let mut name = csv.file_stem().unwrap_or_default().to_owned();
    name.push("-forces.csv");
    csv.with_file_name(name)
}

/// The first line, for the particles of these indices.
pub fn header<const D: usize>(particles: impl IntoIterator<Item = usize>) -> String {
    let mut names = vec!["t".to_owned()];
    names.extend(AXES[..D].iter().map(|axis| format!("mean_velocity_{axis}")));
    names.extend(AXES[..D].iter().map(|axis| format!("body_force_{axis}")));
    for number in particles.into_iter().map(|index| index + 1) {
        names.extend(AXES[..D].iter().map(|axis| format!("force{number}{axis}")));
        match D {
            2 => names.push(format!("torque{number}")),
            _ => names.extend(AXES[..D].iter().map(|axis| format!("torque{number}{axis}"))),
        }
    }
    names.join(",")
}

/// A row as text, with its end of line.
fn line<const D: usize>(time: f64, holding: &Holding<D>) -> String
where
    Dim<D>: Space<D>,
{
    let of_particles = holding.wrenches.iter().flat_map(|(_, wrench)| {
        wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)).copied().collect::<Vec<f64>>()
    });
    let of_box = holding.mean_velocity.iter().chain(&holding.force_density).copied();
    let numbers = std::iter::once(time).chain(of_box).chain(of_particles);
    let cells: Vec<String> = numbers.map(|number| format!("{number:.16e}")).collect();
    format!("{}\n", cells.join(","))
}

#[cfg(test)]
mod tests {
    use gluey_geom::{Spin, Vector, Wrench};

    use super::*;

    #[test]
    fn a_row_has_a_number_for_each_name() {
        let wrench = Wrench { force: Vector::<2>::new(1.0, -2.0), torque: Spin::<2>::new(0.5) };
        let (mean_velocity, force_density) = (Vector::<2>::new(0.25, 0.0), Vector::<2>::new(0.0, 7.0));
        let holding = Holding { mean_velocity, force_density, wrenches: vec![(2, wrench)] };
        let names = "t,mean_velocity_x,mean_velocity_y,body_force_x,body_force_y,force3x,force3y,torque3";
        assert_eq!(header::<2>([2]), names);
        let line = line(3.0, &holding);
        let numbers: Vec<f64> = line.trim_end().split(',').map(|x| x.parse().expect("a number")).collect();
        assert_eq!(numbers, [3.0, 0.25, 0.0, 0.0, 7.0, 1.0, -2.0, 0.5]);
        assert_eq!(header::<3>([0, 4]).split(',').count(), 7 + 2 * 6);
    }
}
