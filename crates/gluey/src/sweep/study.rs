//! The folder of a study.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Point, PointState, SweepError};
use crate::output::{OutputError, write_atomically};
use crate::run::TABLE_OF_STUDY;

/// Counts changes of the layout of [`Manifest`].
const LAYOUT: u32 = 1;

/// What a study says of itself, `sweep.json`.
#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    /// Layout of this file.
    layout: u32,
    /// Version of gluey.
    gluey: String,
    /// The keys, in the order of the names of points.
    keys: Vec<String>,
}

/// The folder of a study, in which its points are run.
#[derive(Clone, Debug)]
pub struct Study {
    folder: PathBuf,
    keys: Vec<String>,
}

impl Study {
    /// A study of these keys.
    pub fn new(folder: impl Into<PathBuf>, keys: Vec<String>) -> Self {
        Self { folder: folder.into(), keys }
    }

    /// Makes sure that nothing in the folder belongs to another study, unless that may be replaced (`force`),
    /// and writes down which study is there from now on. Gives the states of the points.
    ///
    /// # Errors
    /// [`SweepError`] with what is in the way; everything is then as it was.
    pub fn open(&self, points: &[Point], force: bool) -> Result<Vec<PointState>, SweepError> {
        if !force {
            self.check_free()?;
        }
        let mut states = Vec::new();
        for point in points {
            let state = match point.state() {
                Err(_) if force => PointState::OtherCase,
                state => state?,
            };
            if state == PointState::OtherCase && !force {
                return Err(SweepError::OtherCase { folder: point.paths.folder().to_owned() });
            }
            states.push(state);
        }
        self.write()?;
        Ok(states)
    }

    /// The table of results.
    pub fn table(&self) -> PathBuf {
        self.folder.join(TABLE_OF_STUDY)
    }

    fn manifest(&self) -> PathBuf {
        self.folder.join("sweep.json")
    }

    fn check_free(&self) -> Result<(), SweepError> {
        let folder = self.folder.clone();
        let text = match fs::read_to_string(self.manifest()) {
            Ok(text) => text,
            Err(_) if is_free(&folder) => return Ok(()),
            Err(_) => return Err(SweepError::Foreign { folder }),
        };
        match serde_json::from_str::<Manifest>(&text) {
            Ok(manifest) if manifest.layout == LAYOUT && manifest.keys == self.keys => Ok(()),
            Ok(manifest) if manifest.layout == LAYOUT => {
                Err(SweepError::OtherKeys { folder, found: manifest.keys, wanted: self.keys.clone() })
            }
            _ => Err(SweepError::Foreign { folder }),
        }
    }

    fn write(&self) -> Result<(), OutputError> {
        let manifest =
            Manifest { layout: LAYOUT, gluey: env!("CARGO_PKG_VERSION").to_owned(), keys: self.keys.clone() };
        let path = self.manifest();
        let encoded = serde_json::to_string_pretty(&manifest).map_err(io::Error::from);
        let text = encoded.map_err(|error| OutputError::new(&path, "encode the study", error))?;
        fs::create_dir_all(&self.folder)
            .map_err(|error| OutputError::new(&self.folder, "create the folder", error))?;
        write_atomically(&path, format!("{text}\n").as_bytes())
    }

    /// Writes the table of results, all or nothing.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_table(&self, rows: &[Vec<String>]) -> Result<(), OutputError> {
        let line =
            |row: &Vec<String>| row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
        let text: String = rows.iter().map(line).collect();
        write_atomically(&self.table(), text.as_bytes())
    }
}

/// Whether nothing is in a folder, or no such folder is there.
fn is_free(folder: &Path) -> bool {
    fs::read_dir(folder).map_or(!folder.exists(), |mut entries| entries.next().is_none())
}

/// A cell of a table as RFC 4180 has it.
fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_owned(),
    }
}
