//! Names of the files of a run.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use super::{entries, is_claimed};

/// What the name of a record ends with.
const RECORD: &str = "-run.json";

/// Names of the files of a run: all begin with the same stem in the same folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultPaths {
    folder: PathBuf,
    stem: OsString,
}

impl ResultPaths {
    /// The files in `folder` whose names begin with `stem`.
    pub fn new(folder: impl Into<PathBuf>, stem: impl Into<OsString>) -> Self {
        Self { folder: folder.into(), stem: stem.into() }
    }

    /// The files beside a trajectory.
    pub fn of_csv(csv: &Path) -> Self {
        let folder = csv.parent().unwrap_or(Path::new(""));
        Self::new(folder, csv.file_stem().unwrap_or_default())
    }

    /// The files of the run whose record `path` is by its name.
    pub fn of_record(path: &Path) -> Option<Self> {
        let stem = path.file_name()?.to_str()?.strip_suffix(RECORD)?;
        Some(Self::new(path.parent().unwrap_or(Path::new("")), stem))
    }

    /// The files of all runs in `folder` that left a record, sorted by name.
    ///
    /// # Errors
    /// When the folder cannot be listed.
    pub fn in_folder(folder: &Path) -> io::Result<Vec<Self>> {
        let entries = entries(folder)?;
        let mut stems: Vec<_> = entries.iter().filter_map(|path| Some(Self::of_record(path)?.stem)).collect();
        stems.sort();
        Ok(stems.into_iter().map(|stem| Self::new(folder, stem)).collect())
    }

    /// Whether a process is writing these results now.
    pub fn are_being_written(&self) -> bool {
        is_claimed(&self.csv())
    }

    /// The folder; `.` for the present one.
    pub fn folder(&self) -> &Path {
        if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder }
    }

    /// The command that goes on with the run, which is named where others are in its folder.
    pub fn resume_command(&self) -> String {
        let is_alone = Self::in_folder(self.folder()).is_ok_and(|runs| runs.len() == 1);
        let which = if is_alone { String::new() } else { format!(" --case {}", self.stem()) };
        format!("gluey resume {}{which}", self.folder().display())
    }

    /// What all names begin with.
    pub fn stem(&self) -> String {
        self.stem.to_string_lossy().into_owned()
    }

    /// The trajectory.
    pub fn csv(&self) -> PathBuf {
        self.with(".csv")
    }

    /// The near pairs, of runs of many particles.
    pub fn gaps(&self) -> PathBuf {
        self.with("-gaps.csv")
    }

    /// The rheology, of runs that are sheared for ever.
    pub fn rheology(&self) -> PathBuf {
        self.with("-rheology.csv")
    }

    /// What holds or drives particles.
    pub fn forces(&self) -> PathBuf {
        self.with("-forces.csv")
    }

    /// What each step cost.
    pub fn solver(&self) -> PathBuf {
        self.with("-solver.csv")
    }

    /// All files of rows that a run may have, the trajectory first.
    pub fn tables(&self) -> [PathBuf; 5] {
        [self.csv(), self.gaps(), self.rheology(), self.forces(), self.solver()]
    }

    /// The case as it was run.
    pub fn case_file(&self) -> PathBuf {
        self.with("-case.toml")
    }

    /// The record of the run.
    pub fn record(&self) -> PathBuf {
        self.with(RECORD)
    }

    /// The log, lines for people.
    pub fn log(&self) -> PathBuf {
        self.with(".log")
    }

    /// The last checkpoint.
    pub fn checkpoint(&self) -> PathBuf {
        self.with(".checkpoint")
    }

    /// The checkpoint before the last.
    pub fn previous_checkpoint(&self) -> PathBuf {
        Self::previous(&self.checkpoint())
    }

    /// The generation before a checkpoint.
    pub fn previous(checkpoint: &Path) -> PathBuf {
        let mut name = checkpoint.as_os_str().to_owned();
        name.push(".previous");
        name.into()
    }

    /// The folder of files for ParaView.
    pub fn vtk(&self) -> PathBuf {
        self.frames("vtk")
    }

    /// The folder of files in extended XYZ.
    pub fn xyz(&self) -> PathBuf {
        self.frames("xyz")
    }

    /// The folder of a stream of frames with this label.
    pub fn frames(&self, label: &str) -> PathBuf {
        self.with(&format!("-{label}"))
    }

    fn with(&self, suffix: &str) -> PathBuf {
        let mut name = self.stem.clone();
        name.push(suffix);
        self.folder.join(name)
    }
}
