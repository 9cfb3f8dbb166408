//! Who writes which results: a locked file `<result>.lock` for as long as a run lasts.
//!
//! The lock belongs to the open file and ends with its process, however that ends; a lock file left behind by
//! a process that was killed is nobody's.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process;

use thiserror::Error;

use super::{FileError, prepare_folder_of, with_suffix};

/// Results could not be taken possession of.
#[derive(Debug, Error)]
pub enum ClaimError {
    /// Another run is writing them.
    #[error(
        "{}: in use by {}, which holds {}",
        result.display(),
        holder.map_or("another run".to_owned(), |id| format!("the run of process {id}")),
        lock.display()
    )]
    InUse {
        /// The file or folder that both want to write.
        result: PathBuf,
        /// The lock file.
        lock: PathBuf,
        /// Number of the process that runs.
        holder: Option<u32>,
    },
    /// The folder or the lock file could not be written.
    #[error(transparent)]
    Output(#[from] FileError),
}

/// The right to write one result, until it is dropped.
#[derive(Debug)]
pub(crate) struct ResultClaim {
    lock: PathBuf,
    /// Whether the file system knows locks.
    is_locked: bool,
    /// Open for as long as the lock is to last.
    _file: File,
}

impl ResultClaim {
    /// Claims the file or folder `result` and creates the folder it lies in.
    pub fn new(result: &Path) -> Result<Self, ClaimError> {
        let lock = with_suffix(result, ".lock");
        prepare_folder_of(&lock)?;
        let failed = |error| FileError::new(&lock, "write the lock file", error);
        loop {
            let options = File::options().read(true).write(true).create(true).truncate(false).open(&lock);
            let mut file = options.map_err(failed)?;
            match file.try_lock() {
                // Its last holder deleted it between the two calls: what is locked now has no name any more.
                Ok(()) if !is_named(&file, &lock).map_err(failed)? => {}
                Ok(()) => {
                    sign(&mut file).map_err(failed)?;
                    return Ok(Self { lock, is_locked: true, _file: file });
                }
                Err(TryLockError::WouldBlock) => {
                    let (result, holder) = (result.to_owned(), signature(file));
                    return Err(ClaimError::InUse { result, lock, holder });
                }
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    return Ok(Self { lock, is_locked: false, _file: file });
                }
                Err(TryLockError::Error(error)) => return Err(failed(error).into()),
            }
        }
    }

    /// The lock file, where the file system knows no locks.
    pub fn unguarded(&self) -> Option<&Path> {
        (!self.is_locked).then_some(&self.lock)
    }
}

impl Drop for ResultClaim {
    fn drop(&mut self) {
        // Where it cannot be told whether a lock file still has its name, it must keep it.
        if cfg!(unix) && self.is_locked {
            let _ = fs::remove_file(&self.lock);
        }
    }
}

/// Whether a process holds the claim on `result` now.
pub(crate) fn is_claimed(result: &Path) -> bool {
    let file = File::options().read(true).write(true).open(with_suffix(result, ".lock"));
    file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Tells others who holds the lock.
fn sign(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    writeln!(file, "{}", process::id())
}

fn signature(mut file: File) -> Option<u32> {
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Whether `path` still names the open `file`.
#[cfg(unix)]
fn is_named(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let (open, named) = (file.metadata()?, fs::metadata(path));
    Ok(named.is_ok_and(|named| (named.dev(), named.ino()) == (open.dev(), open.ino())))
}

/// Lock files keep their names.
#[cfg(not(unix))]
fn is_named(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_has_one_writer_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let (one, other) = (folder.path().join("deep/one.csv"), folder.path().join("deep/other.csv"));
        let claim = ResultClaim::new(&one).expect("free");
        let _beside = ResultClaim::new(&other).expect("another result");
        match ResultClaim::new(&one) {
            Err(ClaimError::InUse { result, holder, .. }) => {
                assert_eq!((result, holder), (one.clone(), Some(process::id())));
            }
            other => panic!("{other:?}"),
        }
        assert!(is_claimed(&one));
        drop(claim);
        assert!(!is_claimed(&one));
        ResultClaim::new(&one).expect("free again");
        assert_eq!(cfg!(unix), !with_suffix(&one, ".lock").exists());
    }

    #[test]
    fn a_lock_file_of_a_process_that_was_killed_is_nobodys() {
        let folder = tempfile::tempdir().expect("a folder");
        let result = folder.path().join("t.csv");
        fs::write(with_suffix(&result, ".lock"), "12345\n").expect("a file");
        ResultClaim::new(&result).expect("free");
    }
}
