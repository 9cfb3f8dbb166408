//! The trajectory as comma-separated values, one row a step.
//!
//! Columns: `t`, the centres `x1,y1[,z1],x2,...`, the gaps `gap12_over_a,gap13_over_a,...` of all pairs in mean
//! radii, the spins `omega1,...` (2D) or `omega1x,omega1y,omega1z,...` (3D). Numbers have 17 significant digits, so
//! they read back exactly.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Space};

use super::{OutputError, partial};
use crate::trajectory::{Row, Trajectory};

const AXES: [char; 3] = ['x', 'y', 'z'];

/// Writes rows as they come to `<path>.partial`, and gives the file its name when it is complete.
#[derive(Debug)]
pub struct CsvWriter {
    path: PathBuf,
    file: BufWriter<File>,
}

impl CsvWriter {
    /// Starts the file with a header for particles of a `D`-dimensional run.
    pub fn create<const D: usize>(path: &Path, particle_count: usize) -> Result<Self, OutputError>
    where
        Dim<D>: Space<D>,
    {
        let create = || {
            let mut file = BufWriter::new(File::create(partial(path))?);
            writeln!(file, "{}", header::<D>(particle_count))?;
            Ok(Self { path: path.to_owned(), file })
        };
        create().map_err(|error| OutputError::new(path, "create the file", error))
    }

    /// Adds one row; it is on disk when this returns.
    pub fn write<const D: usize>(&mut self, row: &Row<'_, D>) -> Result<(), OutputError>
    where
        Dim<D>: Space<D>,
    {
        writeln!(self.file, "{}", line(row))
            .and_then(|()| self.file.flush())
            .map_err(|error| OutputError::new(&self.path, "write a row", error))
    }

    /// Adds all rows of `trajectory`.
    pub fn write_all<const D: usize>(&mut self, trajectory: &Trajectory<D>) -> Result<(), OutputError>
    where
        Dim<D>: Space<D>,
    {
        trajectory.rows().try_for_each(|row| self.write(&row))
    }

    /// Gives the complete file its name.
    pub fn finish(self) -> Result<(), OutputError> {
        let rename = |file: BufWriter<File>| -> io::Result<()> {
            file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
            fs::rename(partial(&self.path), &self.path)
        };
        rename(self.file).map_err(|error| OutputError::new(&self.path, "complete the file", error))
    }
}

/// The first line of the file.
pub fn header<const D: usize>(particle_count: usize) -> String
where
    Dim<D>: Space<D>,
{
    let mut names = vec!["t".to_owned()];
    for particle in 1..=particle_count {
        names.extend(AXES[..D].iter().map(|axis| format!("{axis}{particle}")));
    }
    for first in 1..=particle_count {
        names.extend((first + 1..=particle_count).map(|second| gap_name(first, second, particle_count)));
    }
    for particle in 1..=particle_count {
        match Dim::<D>::ROT {
            1 => names.push(format!("omega{particle}")),
            _ => names.extend(AXES.iter().map(|axis| format!("omega{particle}{axis}"))),
        }
    }
    names.join(",")
}

/// `gap12_over_a`; with ten particles or more the numbers are kept apart, `gap1_12_over_a`.
fn gap_name(first: usize, second: usize, particle_count: usize) -> String {
    match particle_count < 10 {
        true => format!("gap{first}{second}_over_a"),
        false => format!("gap{first}_{second}_over_a"),
    }
}

fn line<const D: usize>(row: &Row<'_, D>) -> String
where
    Dim<D>: Space<D>,
{
    let mean_radius = row.radii.iter().sum::<f64>() / row.radii.len() as f64;
    let mut text = format!("{:.16e}", row.time);
    let mut add = |number: f64| {
        // Writing to a string cannot fail.
        let _ = write!(text, ",{number:.16e}");
    };
    row.positions.iter().flat_map(|center| center.iter()).for_each(|&x| add(x));
    row.pairs().for_each(|(first, second)| add(row.gap(first, second) / mean_radius));
    row.spins.iter().flat_map(Dim::<D>::spin_slice).for_each(|&w| add(w));
    text
}

#[cfg(test)]
mod tests {
    use gluey_geom::{Particle, Twist, Vector};

    use super::*;

    #[test]
    fn headers_name_what_the_rows_hold() {
        assert_eq!(header::<2>(2), "t,x1,y1,x2,y2,gap12_over_a,omega1,omega2");
        assert_eq!(
            header::<3>(2),
            "t,x1,y1,z1,x2,y2,z2,gap12_over_a,omega1x,omega1y,omega1z,omega2x,omega2y,omega2z"
        );
        assert!(header::<2>(3).contains(",gap12_over_a,gap13_over_a,gap23_over_a,"));
        assert!(header::<2>(12).contains(",gap1_12_over_a,"));
    }

    fn rows_have_a_number_for_every_name<const D: usize>()
    where
        Dim<D>: Space<D>,
    {
        for count in 1..4 {
            let mut trajectory = Trajectory::<D>::new(vec![0.1; count], [None; D]);
            let particles: Vec<_> =
                (0..count).map(|n| Particle::new(Vector::<D>::repeat(n as f64 / 3.0), 0.1)).collect();
            trajectory.push(0.1, &particles, &vec![Twist::default(); count]);
            let line = line(&trajectory.row(0));
            assert_eq!(line.split(',').count(), header::<D>(count).split(',').count());
            let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            assert_eq!(numbers[0], 0.1);
            assert_eq!(numbers[D * count], particles[count - 1].pose.position[D - 1]);
        }
    }

    #[test]
    fn rows_fit_the_header() {
        rows_have_a_number_for_every_name::<2>();
        rows_have_a_number_for_every_name::<3>();
    }
}
