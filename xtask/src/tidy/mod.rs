//! `cargo xtask tidy`: does the code keep the law of ARCHITECTURE.md and the rules of the house?

mod arrows;
mod confined;
mod law;
mod modules;
mod rooms;
mod shape;
mod sources;
mod style;
mod unused;

use std::path::{Path, PathBuf};

/// Why the check itself could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TidyError {
    /// A file or folder cannot be read.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A block of the law is missing or a line of it makes no sense.
    #[error("ARCHITECTURE.md: {0}")]
    Law(String),
    /// A file is not Rust.
    #[error("{path}: {error}")]
    Syntax {
        /// The file or the folder it lies in.
        path: String,
        /// Error of the parser.
        error: syn::Error,
    },
    /// `cargo metadata` did not answer.
    #[error("cargo metadata: {0}")]
    Metadata(String),
}

/// All offences, each with its place; an empty list is a tidy workspace.
pub fn offences(root: &Path) -> Result<Vec<String>, TidyError> {
    let law = law::Law::read(&root.join("ARCHITECTURE.md"))?;
    let sources = sources::all(root)?;
    let metadata = arrows::metadata(root)?;
    let mut offences = arrows::offences(&law, &metadata);
    offences.extend(unused::offences(root, &metadata, &sources));
    offences.extend(confined::offences(&law, &sources));
    offences.extend(rooms::offences(&law, &sources)?);
    offences.extend(style::offences(&sources));
    offences.extend(shape::offences(&sources)?);
    Ok(offences)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_workspace_is_tidy() {
        let offences = super::offences(&crate::workspace_root()).unwrap();
        assert!(offences.is_empty(), "\n{}", offences.join("\n"));
    }
}
