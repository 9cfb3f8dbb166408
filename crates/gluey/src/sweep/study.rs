//! The folder of a study.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{PointState, StudyPoint, SweepError};
use crate::output::{FileError, write_atomically};
use crate::run::TABLE_OF_STUDY;

/// Counts changes of the layout of [`Manifest`].
const LAYOUT: u32 = 1;

const MANIFEST: &str = "sweep.json";

/// The file `sweep.json`, in which a study says what it is about.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// Layout of this file.
    layout: u32,
    /// Version of gluey.
    gluey: String,
    /// The keys, in the order of the names of points.
    pub keys: Vec<String>,
    /// Its points, those that were added later last.
    #[serde(default)]
    pub points: Vec<NamedPoint>,
}

/// A point as a study names it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct NamedPoint {
    /// Name of the point and of its folder.
    pub name: String,
    /// Values of the keys, as they were written.
    pub values: Vec<String>,
}

impl Manifest {
    /// Of the study in a folder; `None` if there is none.
    pub fn read(folder: &Path) -> Result<Option<Self>, SweepError> {
        let text = match fs::read_to_string(folder.join(MANIFEST)) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(_) => return Err(SweepError::Foreign { folder: folder.to_owned() }),
        };
        match serde_json::from_str::<Self>(&text) {
            Ok(manifest) if manifest.layout == LAYOUT => Ok(Some(manifest)),
            _ => Err(SweepError::Foreign { folder: folder.to_owned() }),
        }
    }
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
    pub fn open(&self, points: &[StudyPoint], force: bool) -> Result<Vec<PointState>, SweepError> {
        let earlier = if force { Vec::new() } else { self.check_free()? };
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
        self.write(earlier, points)?;
        Ok(states)
    }

    /// The table of results.
    pub fn table(&self) -> PathBuf {
        self.folder.join(TABLE_OF_STUDY)
    }

    fn manifest(&self) -> PathBuf {
        self.folder.join(MANIFEST)
    }

    /// The points that the study in the folder has, if it is this one.
    fn check_free(&self) -> Result<Vec<NamedPoint>, SweepError> {
        let folder = self.folder.clone();
        match Manifest::read(&folder)? {
            None if is_free(&folder) => Ok(Vec::new()),
            None => Err(SweepError::Foreign { folder }),
            Some(manifest) if manifest.keys == self.keys => Ok(manifest.points),
            Some(manifest) => {
                Err(SweepError::OtherKeys { folder, found: manifest.keys, wanted: self.keys.clone() })
            }
        }
    }

    /// Writes down the study with its earlier points and these.
    fn write(&self, mut all: Vec<NamedPoint>, points: &[StudyPoint]) -> Result<(), FileError> {
        for StudyPoint { name, values, .. } in points {
            let point = NamedPoint { name: name.clone(), values: values.clone() };
            if !all.contains(&point) {
                all.push(point);
            }
        }
        let gluey = env!("CARGO_PKG_VERSION").to_owned();
        let manifest = Manifest { layout: LAYOUT, gluey, keys: self.keys.clone(), points: all };
        let path = self.manifest();
        let encoded = serde_json::to_string_pretty(&manifest).map_err(io::Error::from);
        let text = encoded.map_err(|error| FileError::new(&path, "encode the study", error))?;
        fs::create_dir_all(&self.folder)
            .map_err(|error| FileError::new(&self.folder, "create the folder", error))?;
        write_atomically(&path, format!("{text}\n").as_bytes())
    }

    /// Writes the table of results, all or nothing.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_table(&self, rows: &[Vec<String>]) -> Result<(), FileError> {
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
