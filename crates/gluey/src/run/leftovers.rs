//! Takes away what earlier runs of the same name left and nothing can use any more.

use std::fs;
use std::io;
use std::path::Path;

use super::frames::StreamOptions;
use super::options::RunOptions;
use super::paths::ResultPaths;
use crate::case::Case;
use crate::output::{OutputError, drafts, undrafted};

/// Series of frames, by the beginnings of their names.
const SERIES: [&str; 3] = ["fields", "particles", "contacts"];

/// Removes half files that killed runs left, and the frames of a run that this one replaces. Rows are never
/// among them, nor any file that no run writes. The results are claimed: no other run writes them now.
pub(super) fn remove(case: &Case, options: &RunOptions) -> Result<(), OutputError> {
    let Some(record) = options.record else { return Ok(()) };
    let paths = ResultPaths::of_csv(&options.csv);
    for whole in [paths.record(), paths.case_file(), paths.checkpoint(), paths.previous_checkpoint()] {
        drafts(&whole)?.iter().try_for_each(|draft| remove_file(draft))?;
    }
    let replaces = record.force && options.resume.is_none();
    let streams = StreamOptions::of_run(case, options).into_iter().map(|stream| stream.folder);
    let mut folders: Vec<_> = [paths.vtk(), paths.xyz()].into_iter().chain(streams).collect();
    folders.sort();
    folders.dedup();
    folders.iter().try_for_each(|folder| remove_frames(folder, replaces))
}

/// Removes half frames from a folder, and whole ones if asked to; the folder itself stays.
fn remove_frames(folder: &Path, whole: bool) -> Result<(), OutputError> {
    let list =
        || -> io::Result<Vec<_>> { fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect() };
    let names = match list() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        listed => listed.map_err(|error| OutputError::new(folder, "list the folder", error))?,
    };
    for name in names.iter().filter_map(|name| name.to_str()) {
        let complete = undrafted(name);
        if is_frame(complete.unwrap_or(name)) && (whole || complete.is_some()) {
            remove_file(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Whether a run gives such names to frames (`fields-000100.vtu`, `particles-000100.xyz.gz`), to pieces of
/// them (`fields-000100-0003.vtu`, `fields-000100.pvtu`) or to their collections (`fields.pvd`).
fn is_frame(name: &str) -> bool {
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

fn remove_file(path: &Path) -> Result<(), OutputError> {
    fs::remove_file(path).map_err(|error| OutputError::new(path, "remove what an earlier run left", error))
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
