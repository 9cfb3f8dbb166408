//! Takes away what earlier runs of the same name left and nothing can use any more.

use std::path::Path;

use super::frames::StreamOptions;
use super::options::RunOptions;
use super::removal::{self, is_frame, list, remove_file};
use crate::case::Case;
use crate::output::{FileError, ResultPaths, drafts, name_of, undrafted};

/// Removes half files that killed runs left, and all of a run that this one replaces. Otherwise rows are
/// never among them. The results are claimed: no other run writes them now.
pub(super) fn remove(case: &Case, options: &RunOptions) -> Result<(), FileError> {
    let Some(record) = options.record else { return Ok(()) };
    let paths = ResultPaths::of_csv(&options.csv);
    for whole in [paths.record(), paths.case_file(), paths.checkpoint(), paths.previous_checkpoint()] {
        drafts(&whole)?.iter().try_for_each(|draft| remove_file(draft))?;
    }
    if record.force && options.resume.is_none() {
        removal::remove(&paths)?;
    }
    let streams = StreamOptions::of_run(case, options).into_iter().map(|stream| stream.folder);
    let mut folders: Vec<_> = [paths.vtk(), paths.xyz()].into_iter().chain(streams).collect();
    folders.sort();
    folders.dedup();
    folders.iter().try_for_each(|folder| remove_half_frames(folder))
}

/// Removes half frames from a folder.
fn remove_half_frames(folder: &Path) -> Result<(), FileError> {
    for path in list(folder)? {
        if undrafted(&name_of(&path)).is_some_and(is_frame) {
            remove_file(&path)?;
        }
    }
    Ok(())
}
