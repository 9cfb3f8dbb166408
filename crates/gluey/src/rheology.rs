//! Means of the rheology of a sheared suspension behind its transient.

mod mean;

use std::fmt;
use std::path::{Path, PathBuf};

use gluey_suspension::statistics::mser;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use mean::Mean;

use crate::output::{FileError, rows_of, whole_lines};
use crate::table::{NumberTable, TableError};

/// Means of the columns of `<name>-rheology.csv`, over viscosity and shear rate as they are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RheologyMeans {
    /// Rows of the table.
    pub row_count: usize,
    /// Rows left out at the beginning.
    pub skipped: usize,
    /// Strain at the first row that counts.
    pub strain_skipped: f64,
    /// Viscosity of the suspension over that of the fluid.
    pub viscosity: Option<Mean>,
    /// The same by the power of the shear.
    pub viscosity_by_dissipation: Option<Mean>,
    /// Share of contacts in the first, where they act in the flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscosity_of_contacts: Option<Mean>,
    /// That of their tangential forces alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscosity_of_friction: Option<Mean>,
    /// Contacts of a particle that stick, where they act in the flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sticking_contacts: Option<Mean>,
    /// Those that slide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sliding_contacts: Option<Mean>,
    /// First normal stress difference.
    #[serde(rename = "N1")]
    pub n1: Option<Mean>,
    /// Second normal stress difference; in 3D.
    #[serde(rename = "N2")]
    pub n2: Option<Mean>,
    /// Pressure of the particles.
    pub particle_pressure: Option<Mean>,
}

/// A table of rheology could not be read.
#[derive(Debug, Error)]
pub enum RheologyError {
    /// The file could not be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// It is no such table.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: TableError,
    },
}

impl RheologyMeans {
    /// Of the table `path`, or of what there is of it; `None` if there is no row. The transient is that of
    /// the viscosity by the rule MSER-5, unless it is given as the time at which it is over.
    pub fn read(path: &Path, begin: Option<f64>) -> Result<Option<Self>, RheologyError> {
        let Some(rows) = rows_of(path) else { return Ok(None) };
        let text = whole_lines(&rows)?;
        let means = NumberTable::parse(&text).and_then(|table| Self::of(&table, begin));
        means.map_err(|source| RheologyError::Table { path: rows, source })
    }

    fn of(table: &NumberTable, begin: Option<f64>) -> Result<Option<Self>, TableError> {
        let (t, strain, viscosity) =
            (table.column("t")?, table.column("strain")?, table.column("viscosity")?);
        let skipped = match begin {
            Some(begin) => t.partition_point(|time| *time < begin),
            None => mser(viscosity).length,
        };
        let Some(&strain_skipped) = strain.get(skipped) else { return Ok(None) };
        let mean = |values: Option<&[f64]>| {
            let kept = values?[skipped..].iter().copied().filter(|value| value.is_finite());
            Mean::of(&kept.collect::<Vec<f64>>())
        };
        let in_flow = |name| mean(table.find("viscosity_of_friction").and(table.find(name)));
        Ok(Some(Self {
            row_count: t.len(),
            skipped,
            strain_skipped,
            viscosity: mean(Some(viscosity)),
            viscosity_by_dissipation: mean(table.find("viscosity_by_dissipation")),
            viscosity_of_contacts: in_flow("viscosity_of_contacts"),
            viscosity_of_friction: in_flow("viscosity_of_friction"),
            sticking_contacts: in_flow("sticking_contacts"),
            sliding_contacts: in_flow("sliding_contacts"),
            n1: mean(Some(table.column("N1")?)),
            n2: mean(table.find("N2")),
            particle_pressure: mean(Some(table.column("particle_pressure")?)),
        }))
    }

    /// Names and means of what there is.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, Mean)> {
        let all = [
            ("relative viscosity", self.viscosity),
            ("the same by dissipation", self.viscosity_by_dissipation),
            ("share of contacts", self.viscosity_of_contacts),
            ("share of friction", self.viscosity_of_friction),
            ("sticking contacts", self.sticking_contacts),
            ("sliding contacts", self.sliding_contacts),
            ("N1", self.n1),
            ("N2", self.n2),
            ("particle pressure", self.particle_pressure),
        ];
        all.into_iter().filter_map(|(name, mean)| Some((name, mean?)))
    }
}

impl fmt::Display for RheologyMeans {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { row_count, skipped, .. } = self;
        writeln!(f, "{row_count} rows of rheology, the first {skipped} left out")?;
        self.named().try_for_each(|(name, mean)| writeln!(f, "  {name:<23} {mean}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A viscosity of 2 and 3 in turn behind ten rows of a start at 9, a normal stress difference that
    /// changes every five rows; in 2D.
    fn table() -> NumberTable {
        let line = |row: i32| {
            let viscosity = if row < 10 { 9 } else { 2 + row % 2 };
            let by_dissipation = if row % 2 == 0 { String::new() } else { "2.5".to_owned() };
            let n1 = if row % 10 < 5 { -0.25 } else { -0.75 };
            format!("{row},{},{viscosity},{by_dissipation},{n1},{}\n", 0.5 * f64::from(row), 1 + row % 2)
        };
        let head = "t,strain,viscosity,viscosity_by_dissipation,N1,particle_pressure\n";
        NumberTable::parse(&(head.to_owned() + &(0..60).map(line).collect::<String>())).expect("a table")
    }

    #[test]
    fn means_are_those_behind_the_transient() {
        let means = RheologyMeans::of(&table(), None).expect("columns").expect("rows");
        assert_eq!((means.row_count, means.skipped, means.strain_skipped), (60, 10, 5.0));
        let mean = |mean: Option<Mean>| mean.expect("a mean").mean;
        assert_eq!((mean(means.viscosity), mean(means.n1)), (2.5, -0.5));
        assert_eq!((mean(means.viscosity_by_dissipation), mean(means.particle_pressure)), (2.5, 1.5));
        let half_width = |mean: Option<Mean>| mean.expect("a mean").half_width;
        assert_eq!(half_width(means.viscosity), Some(0.0), "each block has as many rows of 2 as of 3");
        assert!(half_width(means.n1) > Some(0.0) && means.n2.is_none());
        let from = RheologyMeans::of(&table(), Some(30.0)).expect("columns").expect("rows");
        assert_eq!((from.skipped, from.strain_skipped), (30, 15.0));
        assert_eq!(RheologyMeans::of(&table(), Some(60.0)), Ok(None));
    }
}
