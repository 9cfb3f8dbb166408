//! `gluey new`.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use thiserror::Error;

use super::failure::Failure;
use crate::terminal::print;

/// What stands for the name of the case in a template, up to the column of comments.
const NAME: &str = "\"@name@\"         ";

/// Arguments of `gluey new`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gluey new doublet\n  gluey new settling --template sedimentation --dimension 3"
)]
pub struct NewArguments {
    /// Name of the case, which is written to NAME.toml.
    name: String,
    /// What it is like.
    #[arg(long, default_value = "pair")]
    template: Template,
    /// Dimension of space.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(2..=3))]
    dimension: u8,
}

/// Templates of new cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Template {
    /// Two particles that meet in shear flow.
    Pair,
    /// A pair and a third particle that passes it.
    Trio,
    /// Particles that settle in a box at rest.
    Sedimentation,
    /// Many particles, sheared for ever.
    Suspension,
}

/// Reasons why no case was written.
#[derive(Debug, Error)]
enum NewError {
    /// Results could not have this name.
    #[error("`{name}` cannot be the name of a case")]
    Name { name: String },
    /// There is a file already.
    #[error("{}: there is such a file already; it is left as it is", path.display())]
    Exists { path: PathBuf },
    /// It cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write { path: PathBuf, source: io::Error },
}

impl NewArguments {
    /// Writes the case.
    pub fn run(&self) -> Result<(), Failure> {
        let path = self.write().map_err(|error| {
            let hint = match &error {
                NewError::Name { .. } => {
                    "take letters, digits, `-` and `_`; the file goes to the present folder"
                }
                NewError::Exists { .. } => "choose another name, or remove that file",
                NewError::Write { .. } => "go to a folder that can be written to",
            };
            Failure::new(error, Some(hint.to_owned()))
        })?;
        print(&format!("{} is written; to run it: gluey run {0} --out out\n", path.display()));
        Ok(())
    }

    fn write(&self) -> Result<PathBuf, NewError> {
        let name = self.name.strip_suffix(".toml").unwrap_or(&self.name);
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.starts_with('-') || !name.chars().all(fits) {
            return Err(NewError::Name { name: self.name.clone() });
        }
        let path = PathBuf::from(format!("{name}.toml"));
        match create(&path, &self.text(name)) {
            Ok(()) => Ok(path),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(NewError::Exists { path }),
            Err(source) => Err(NewError::Write { path, source }),
        }
    }

    fn text(&self, name: &str) -> String {
        let quoted = format!("\"{name}\"");
        let width = NAME.len() - 1;
        self.template.text(self.dimension).replace(NAME, &format!("{quoted:<width$} "))
    }
}

/// Writes a file that is not there yet, all or nothing.
fn create(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).inspect_err(|_| {
        // What is worth telling is why it could not be written.
        let _ = fs::remove_file(path);
    })
}

impl Template {
    fn text(self, dimension: u8) -> &'static str {
        match (self, dimension) {
            (Self::Pair, 2) => include_str!("../../templates/pair-2d.toml"),
            (Self::Pair, _) => include_str!("../../templates/pair-3d.toml"),
            (Self::Trio, 2) => include_str!("../../templates/trio-2d.toml"),
            (Self::Trio, _) => include_str!("../../templates/trio-3d.toml"),
            (Self::Sedimentation, 2) => include_str!("../../templates/sedimentation-2d.toml"),
            (Self::Sedimentation, _) => include_str!("../../templates/sedimentation-3d.toml"),
            (Self::Suspension, 2) => include_str!("../../templates/suspension-2d.toml"),
            (Self::Suspension, _) => include_str!("../../templates/suspension-3d.toml"),
        }
    }
}
