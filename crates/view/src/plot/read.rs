//! The tables of a run, read back.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use gluey::ResultPaths;
use gluey::case::{Case, Hydrodynamics};
use gluey::output::{FileError, entries, rows_of, undrafted, whole_lines};
use gluey::table::NumberTable;
use gluey_pictures::Curve;

use super::error::PlotError;
use super::figure::Figure;
use super::snapshot::{EDGE, PERIODIC};
use crate::contacts::with_numbers;

/// How trajectories begin.
const HEADER: &[u8] = b"t,x1,";

/// A table and where it came from.
pub struct TableSource {
    /// The file.
    pub path: PathBuf,
    /// Its numbers.
    pub table: NumberTable,
}

impl TableSource {
    /// A column that must be there.
    pub fn column(&self, name: &str) -> Result<&[f64], PlotError> {
        self.table.column(name).map_err(|source| PlotError::Table { path: self.path.clone(), source })
    }

    /// The table, if a line can be drawn through its rows.
    fn with_rows(self, figure: Figure) -> Result<Self, PlotError> {
        let rows = self.table.row_count();
        if rows < 2 {
            return Err(PlotError::TooShort { path: self.path, figure, rows });
        }
        Ok(self)
    }
}

/// The results of one run.
pub struct Results {
    paths: ResultPaths,
}

impl Results {
    /// Folder of its pictures.
    pub fn plots(&self) -> PathBuf {
        self.paths.frames("plots")
    }

    /// Where particles were.
    pub fn trajectory(&self, figure: Figure) -> Result<TableSource, PlotError> {
        let csv = self.paths.csv();
        read(rows_of(&csv).unwrap_or(csv))?.with_rows(figure)
    }

    /// Near pairs, which runs of ten and more particles list.
    pub fn near_pairs(&self) -> Result<Option<TableSource>, PlotError> {
        rows_of(&self.paths.gaps()).map(read).transpose()
    }

    /// Stresses; an error where they are needed and not there.
    pub fn rheology(&self, is_needed: bool) -> Result<Option<TableSource>, PlotError> {
        let hint = "runs in boxes with domain.boundary = \"sheared\" write it";
        self.table(self.paths.rheology(), Figure::Rheology, is_needed, hint)
    }

    /// What the steps cost; an error where it is needed and not there.
    pub fn solver(&self, is_needed: bool) -> Result<Option<TableSource>, PlotError> {
        self.table(self.paths.solver(), Figure::Solver, is_needed, "a run writes it beside its trajectory")
    }

    /// A table beside the trajectory; an error where it is needed and not there.
    fn table(
        &self,
        path: PathBuf,
        figure: Figure,
        is_needed: bool,
        hint: &'static str,
    ) -> Result<Option<TableSource>, PlotError> {
        match (rows_of(&path), is_needed) {
            (Some(rows), _) => Ok(Some(read(rows)?.with_rows(figure)?)),
            (None, false) => Ok(None),
            (None, true) => Err(PlotError::Missing { path, figure, hint }),
        }
    }

    /// The box of the case as it was run, where its file is there and space has an end.
    pub fn borders(&self) -> Option<Borders> {
        let case = Case::load(self.paths.case_file()).ok()?;
        if case.flow.hydrodynamics != Hydrodynamics::Stokes {
            return None;
        }
        let is_periodic = (0..case.dimension).map(|axis| case.period(axis).is_some()).collect();
        Some(Borders { lower: case.lower(), upper: case.upper(), is_periodic })
    }

    /// The trajectory.
    pub fn csv(&self) -> PathBuf {
        self.paths.csv()
    }
}

/// The borders of a box.
pub struct Borders {
    lower: Vec<f64>,
    upper: Vec<f64>,
    is_periodic: Vec<bool>,
}

impl Borders {
    /// Those across x and across another axis, seen along the third.
    pub fn curves(&self, axis: usize) -> Vec<Curve> {
        let [left, right] = [self.lower[0], self.upper[0]];
        let [low, high] = [self.lower[axis], self.upper[axis]];
        let across_x = vec![vec![(left, low), (left, high)], vec![(right, low), (right, high)]];
        let across_axis = vec![vec![(left, low), (right, low)], vec![(left, high), (right, high)]];
        let curve = |pieces, of: usize| {
            let stroke = if self.is_periodic[of] { PERIODIC } else { EDGE };
            Curve { label: None, stroke, pieces }
        };
        vec![curve(across_x, 0), curve(across_axis, axis)]
    }
}

/// The tables of `gluey analyse` in a folder.
pub struct StructureTables<'a> {
    folder: &'a Path,
}

impl<'a> StructureTables<'a> {
    /// Those in this folder.
    pub fn new(folder: &'a Path) -> Self {
        Self { folder }
    }

    /// Folder of their pictures.
    pub fn plots(&self) -> PathBuf {
        self.folder.join("structure-plots")
    }

    /// Whether there are any.
    pub fn are_there(&self) -> bool {
        self.folder.join("series.csv").exists()
    }

    /// A table with two rows at least; an error where it is needed and not so.
    pub fn table(
        &self,
        name: &str,
        figure: Figure,
        is_needed: bool,
    ) -> Result<Option<TableSource>, PlotError> {
        let path = self.folder.join(name);
        match (path.exists(), is_needed) {
            (true, true) => Ok(Some(read(path)?.with_rows(figure)?)),
            (true, false) => Ok(Some(read(path)?).filter(|source| source.table.row_count() > 1)),
            (false, false) => Ok(None),
            (false, true) => {
                let hint = "`gluey analyse` writes it, of frames that `gluey run --xyz N` left";
                Err(PlotError::Missing { path, figure, hint })
            }
        }
    }
}

/// All runs with a trajectory in a folder, by name; one that is not complete has the rows that it wrote.
pub fn results_in(folder: &Path) -> Result<Vec<Results>, PlotError> {
    let mut found = Vec::new();
    for path in listed(folder)? {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
        let complete = path.with_file_name(undrafted(name).unwrap_or(name));
        if complete.extension().is_some_and(|extension| extension == "csv") && is_trajectory(&path)? {
            found.push(complete);
        }
    }
    found.sort();
    found.dedup();
    if found.is_empty() {
        return Err(PlotError::NoResults { folder: folder.to_owned() });
    }
    Ok(found.iter().map(|csv| Results { paths: ResultPaths::of_csv(csv) }).collect())
}

/// What is in a folder, sorted.
pub(super) fn listed(folder: &Path) -> Result<Vec<PathBuf>, PlotError> {
    Ok(entries(folder).map_err(|error| FileError::new(folder, "be listed", error))?)
}

/// Whether a file begins as trajectories do.
fn is_trajectory(path: &Path) -> Result<bool, PlotError> {
    let begins = || {
        let mut start = Vec::new();
        File::open(path)?.take(HEADER.len() as u64).read_to_end(&mut start)?;
        Ok(start == HEADER)
    };
    Ok(begins().map_err(|error| FileError::unread(path, error))?)
}

fn read(path: PathBuf) -> Result<TableSource, PlotError> {
    let text = whole_lines(&path)?;
    match NumberTable::parse(&with_numbers(&text)) {
        Ok(table) => Ok(TableSource { path, table }),
        Err(source) => Err(PlotError::Table { path, source }),
    }
}
