//! Where the frames with fields are, and the case that they are of.

use std::path::{Path, PathBuf};

use gluey::case::Case;
use gluey::output::name_of;

use super::super::error::PlotError;
use super::super::read::listed;
use super::super::snapshot::FrameChoice;

/// The files of a frame, and its case.
pub struct FlowFrame {
    pub step: usize,
    pub fields: PathBuf,
    pub particles: PathBuf,
    pub case: Case,
    /// Folder of the run's pictures.
    pub plots: PathBuf,
}

impl FlowFrame {
    /// The frame of a step in `folder`, or in the only folder in it that has fields.
    pub fn find(folder: &Path, choice: FrameChoice) -> Result<Self, PlotError> {
        let frames = frames(folder)?;
        let frame = match choice {
            FrameChoice::Last => frames.last(),
            FrameChoice::Step(step) => frames.iter().find(|frame| frame.0 == step),
        };
        let (step, fields) = frame.cloned().ok_or_else(|| PlotError::NoFrame {
            folder: folder.to_owned(),
            steps: frames.iter().map(|frame| frame.0).collect(),
        })?;
        let series = std::path::absolute(&fields).unwrap_or_else(|_| fields.clone());
        let series = series.parent().unwrap_or(Path::new("")).to_owned();
        let (stem, case) = case_of(&series)?;
        let particles = fields.with_file_name(format!("particles-{step:06}.vtu"));
        // As the folder was named, so that paths stay as short as they were.
        let beside = fields.parent().and_then(Path::parent).filter(|_| !is_series(folder));
        let beside = beside.unwrap_or_else(|| series.parent().unwrap_or(Path::new("")));
        let plots = beside.join(format!("{stem}-plots"));
        Ok(Self { step, fields, particles, case, plots })
    }
}

fn is_series(folder: &Path) -> bool {
    own_frames(folder).is_ok_and(|frames| !frames.is_empty())
}

/// Steps and files, in order.
fn frames(folder: &Path) -> Result<Vec<(usize, PathBuf)>, PlotError> {
    let own = own_frames(folder)?;
    if !own.is_empty() {
        return Ok(own);
    }
    let mut found: Option<(PathBuf, Vec<(usize, PathBuf)>)> = None;
    for path in listed(folder)?.into_iter().filter(|path| path.is_dir()) {
        let frames = own_frames(&path)?;
        match &found {
            _ if frames.is_empty() => {}
            None => found = Some((path, frames)),
            Some((first, _)) => {
                let (folder, first) = (folder.to_owned(), first.clone());
                return Err(PlotError::SeveralFields { folder, first, second: path });
            }
        }
    }
    found.map(|(_, frames)| frames).ok_or_else(|| PlotError::NoFields { folder: folder.to_owned() })
}

fn own_frames(folder: &Path) -> Result<Vec<(usize, PathBuf)>, PlotError> {
    let step = |path: &Path| {
        let name = path.file_name()?.to_str()?;
        let name = name.strip_prefix("fields-")?;
        name.strip_suffix(".vtu").or_else(|| name.strip_suffix(".pvtu"))?.parse().ok()
    };
    let files = listed(folder)?.into_iter().filter_map(|path| Some((step(&path)?, path)));
    let mut frames: Vec<(usize, PathBuf)> = files.collect();
    frames.sort();
    Ok(frames)
}

/// The case beside a folder of frames, and the name of its run: the longest that the folder's begins with.
fn case_of(series: &Path) -> Result<(String, Case), PlotError> {
    let missing = || PlotError::NoCase { folder: series.to_owned() };
    let name = name_of(series);
    let beside = series.parent().ok_or_else(missing)?;
    let stems = listed(beside)?.into_iter().filter_map(|path| {
        let stem = path.file_name()?.to_str()?.strip_suffix("-case.toml")?.to_owned();
        name.starts_with(&format!("{stem}-")).then_some(stem)
    });
    let stem = stems.max_by_key(String::len).ok_or_else(missing)?;
    let file = beside.join(format!("{stem}-case.toml"));
    match Case::load(&file) {
        Ok(case) => Ok((stem, case)),
        Err(source) => Err(PlotError::Case { file, source: Box::new(source) }),
    }
}
