//! Takes away all that is left of a run that another one replaces: what it wrote, and the tables, pictures
//! and pages that were made of that. Files that gluey did not write stay.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::output::product_names::{PAGE_NAME, is_page, is_picture, is_table};
use crate::output::{FileError, ResultPaths, drafts, entries, is_claimed, name_of, undrafted};

/// Series of frames, by the beginnings of their names.
const SERIES: [&str; 3] = ["fields", "particles", "contacts"];

/// Removes all of the run at `paths`. Its record goes first: what is half removed is no run.
pub(super) fn remove(paths: &ResultPaths) -> Result<(), FileError> {
    for file in [paths.record(), paths.case_file(), paths.log()] {
        remove_if_there(&file)?;
    }
    let tables = paths.tables();
    let entries = list(paths.folder())?;
    let of_run: Vec<&PathBuf> = entries.iter().filter(|path| is_of_run(path, paths, &entries)).collect();
    // The tables and the page of a folder are of the only run in it that has frames.
    let others_have_frames = entries
        .iter()
        .any(|path| name_of(path).ends_with("-xyz") && !of_run.contains(&path) && holds(path, is_frame));
    for table in &tables {
        remove_if_there(table)?;
        drafts(table)?.iter().try_for_each(|draft| remove_file(draft))?;
    }
    let checkpoint = name_of(&paths.checkpoint());
    for path in of_run {
        match path.is_dir() {
            true => empty(path)?,
            false if is_lock(path) => remove_lock(path)?,
            false if name_of(path).starts_with(&checkpoint) => remove_if_there(path)?,
            false => {}
        }
    }
    if others_have_frames { Ok(()) } else { remove_shown(paths.folder()) }
}

/// Whether a name begins with that of the run, and not with the longer one of another run that is recorded.
fn is_of_run(path: &Path, paths: &ResultPaths, entries: &[PathBuf]) -> bool {
    let (name, stem) = (name_of(path), paths.stem());
    let begins = |stem: &str| {
        let rest = name.strip_prefix(stem);
        rest.is_some_and(|rest| rest.starts_with(['-', '.']))
    };
    let others = entries.iter().filter_map(|entry| ResultPaths::of_record(entry)).map(|run| run.stem());
    begins(&stem) && !others.into_iter().any(|other| other.len() > stem.len() && begins(&other))
}

/// Removes frames, tables, pictures and pages from a folder, and the folder where nothing else is in it.
fn empty(folder: &Path) -> Result<(), FileError> {
    remove_shown(folder)?;
    for path in list(folder)? {
        let name = name_of(&path);
        if path.is_dir() && name == "plots" {
            empty(&path)?;
        } else if is_frame(undrafted(&name).unwrap_or(&name)) || is_picture(&name) {
            remove_file(&path)?;
        }
    }
    remove_if_empty(folder)
}

/// Removes the tables of `gluey analyse`, their pictures and the page of `gluey view` from a folder.
fn remove_shown(folder: &Path) -> Result<(), FileError> {
    // Others may have files of such names.
    let begins = |name: &str, is_ours: fn(&[u8]) -> bool| {
        fs::read(folder.join(name)).is_ok_and(|bytes| is_ours(&bytes))
    };
    let tables = begins("series.csv", |text| text.starts_with(b"t,strain,"));
    let page = begins(PAGE_NAME, is_page);
    for path in list(folder)? {
        let name = name_of(&path);
        if (tables && is_table(&name)) || (page && name == PAGE_NAME) {
            remove_file(&path)?;
        } else if tables && name == "structure-plots" {
            list(&path)?
                .iter()
                .filter(|path| is_picture(&name_of(path)))
                .try_for_each(|path| remove_file(path))?;
            remove_if_empty(&path)?;
        }
    }
    Ok(())
}

fn is_lock(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "lock")
}

/// Removes a lock that no process holds.
fn remove_lock(path: &Path) -> Result<(), FileError> {
    if is_claimed(&path.with_extension("")) { Ok(()) } else { remove_if_there(path) }
}

/// Whether a run gives such names to frames (`fields-000100.vtu`, `particles-000100.xyz.gz`), to pieces of
/// them (`fields-000100-0003.vtu`, `fields-000100.pvtu`) or to their collections (`fields.pvd`).
pub(super) fn is_frame(name: &str) -> bool {
    let Some((stem, extension)) = name.split_once('.') else { return false };
    let is_number = |text: &str, digits| text.len() >= digits && text.bytes().all(|b| b.is_ascii_digit());
    let words: Vec<&str> = stem.split('-').collect();
    match (&words[..], extension) {
        ([series], "pvd") => SERIES.contains(series),
        ([series, step], "vtu" | "pvtu" | "xyz" | "xyz.gz") => SERIES.contains(series) && is_number(step, 6),
        ([series, step, rank], "vtu") => SERIES.contains(series) && is_number(step, 6) && is_number(rank, 4),
        _ => false,
    }
}

pub(super) fn remove_file(path: &Path) -> Result<(), FileError> {
    fs::remove_file(path).map_err(|error| FileError::new(path, "remove what an earlier run left", error))
}

fn remove_if_there(path: &Path) -> Result<(), FileError> {
    if path.exists() { remove_file(path) } else { Ok(()) }
}

fn remove_if_empty(folder: &Path) -> Result<(), FileError> {
    if !list(folder)?.is_empty() {
        return Ok(());
    }
    fs::remove_dir(folder).map_err(|error| FileError::new(folder, "remove the folder", error))
}

fn holds(folder: &Path, is_wanted: impl Fn(&str) -> bool) -> bool {
    list(folder).is_ok_and(|entries| entries.iter().any(|path| is_wanted(&name_of(path))))
}

/// What is in a folder, sorted; nothing in one that is not there.
pub(super) fn list(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    match entries(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        listed => listed.map_err(|error| FileError::new(folder, "list the folder", error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_told_from_other_files() {
        for frame in [
            "fields-000000.vtu",
            "fields-000000-0012.vtu",
            "fields-000000.pvtu",
            "contacts.pvd",
            "particles-1234567.xyz",
            "particles-000020.xyz.gz",
        ] {
            assert!(is_frame(frame), "{frame}");
        }
        for other in [
            "notes.pvd",
            "fields-final.vtu",
            "fields-000000-a.vtu",
            "particles-1.xyz",
            "fields",
            "x-000000.vtu",
        ] {
            assert!(!is_frame(other), "{other}");
        }
    }
}
