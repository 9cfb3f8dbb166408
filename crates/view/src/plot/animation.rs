//! An animation of the particles of all frames of a run.

use std::path::{Path, PathBuf};

use gluey::output::xyz::XyzFrame;
use gluey_pictures::{Animation, Canvas, Still};
use rayon::prelude::*;

use super::error::PlotError;
use super::look::Look;
use super::snapshot::{Scene, SceneView, beside_pictures, lines_of_contacts};
use crate::contacts::FrameContact;
use crate::frames::{dimension, frame_files, read_frames};

/// Width of the drawings in SVG pixels: the size of their text, whatever their pixels.
const WIDTH: f64 = 600.0;
/// Frames that are drawn before they are written.
const BATCH: usize = 32;

/// Options of an animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimationOptions {
    /// Pixels across.
    pub pixels: u32,
    /// Frames a second.
    pub rate: f64,
}

/// The animation of all frames of a run as a GIF, and its path: the same scale and the same colours in all.
pub(super) fn animation(
    folder: &Path,
    options: AnimationOptions,
    look: &Look,
) -> Result<(Vec<u8>, PathBuf), PlotError> {
    let files = frame_files(folder)?;
    let path = beside_pictures(&files[0]).with_file_name("particles.gif");
    let bytes = match dimension(&files)? {
        2 => animated(&read_frames::<2>(&files)?, options, look, [&files[0], &path])?,
        _ => animated(&read_frames::<3>(&files)?, options, look, [&files[0], &path])?,
    };
    Ok((bytes, path))
}

fn animated<const D: usize>(
    frames: &[XyzFrame<D>],
    options: AnimationOptions,
    look: &Look,
    [first, path]: [&Path; 2],
) -> Result<Vec<u8>, PlotError> {
    look.check(frames, first)?;
    let is_sheared = frames.iter().any(|frame| frame.strain != 0.0);
    let contacts = lines_of_contacts(frames, look, first)?;
    let frames: Vec<_> = frames.iter().zip(&contacts).collect();
    let scene = |(frame, contacts): &(&XyzFrame<D>, &Vec<FrameContact<D>>)| {
        Scene::of(frame, contacts, look, is_sheared)
    };
    let views = frames.par_iter().map(|frame| scene(frame).view());
    let Some(view) = views.reduce_with(SceneView::around) else { return Ok(Vec::new()) };
    let still = |canvas: &Canvas| {
        let still = Still::new(canvas, options.pixels);
        still.map_err(|source| PlotError::Png { path: path.to_owned(), source })
    };
    let failed = |source| PlotError::Animation { path: path.to_owned(), source };
    let mut animation: Option<Animation> = None;
    for batch in frames.chunks(BATCH) {
        let draw = |frame: &_| still(&scene(frame).draw(&view, WIDTH));
        let stills = batch.par_iter().map(draw).collect::<Result<Vec<Still>, _>>()?;
        for still in stills {
            match &mut animation {
                None => animation = Some(Animation::new(still, options.rate).map_err(failed)?),
                Some(animation) => animation.push(still).map_err(failed)?,
            }
        }
    }
    animation.map_or(Ok(Vec::new()), |animation| animation.into_bytes().map_err(failed))
}
