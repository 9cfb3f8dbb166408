//! A page that shows the frames of a run in a browser: one file, which needs no network and no server.
//!
//! The page is `view/viewer.html` with its scripts, `view/viewer.js` and `view/controls.js`; the frames
//! lie in it as JSON. Numbers are rounded to single precision, so gaps below 1e-4 mean radii are only shown
//! as such.

use std::path::{Path, PathBuf};

use gluey::output::product_names::PAGE_NAME;
use gluey::output::xyz::XyzFrame;
use gluey::output::{FileError, name_of, prepare_folder_of, write_atomically};
use serde::Serialize;
use thiserror::Error;

use crate::contacts::{FrameContact, contacts_of};
use crate::frames::FramesError;
use crate::frames::{dimension, frame_files, read_frames};

const PAGE: &str = include_str!("view/viewer.html");
const SCRIPTS: [&str; 2] = [include_str!("view/viewer.js"), include_str!("view/controls.js")];

/// Options of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewOptions {
    /// Folder of a run, or of its files in extended XYZ.
    pub folder: PathBuf,
    /// The page; `view.html` in `folder` when absent.
    pub out: Option<PathBuf>,
    /// Frames from one that is shown to the next, at least 1.
    pub every: usize,
}

/// A page that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Viewed {
    /// The page.
    pub page: PathBuf,
    /// Frames in it.
    pub frame_count: usize,
    /// Particles in each.
    pub particle_count: usize,
    /// Size of the page in bytes.
    pub size: usize,
}

/// A reason why a run could not be shown.
#[derive(Debug, Error)]
pub enum ViewError {
    /// Its frames could not be read.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// The page could not be written.
    #[error(transparent)]
    Output(#[from] FileError),
}

/// Reads the frames of a run and writes the page.
pub fn view(options: &ViewOptions) -> Result<Viewed, ViewError> {
    let files = frame_files(&options.folder)?;
    let title = title(&files[0]);
    let files: Vec<PathBuf> = files.into_iter().step_by(options.every.max(1)).collect();
    let run = match dimension(&files)? {
        2 => PageRun::read::<2>(title, &files)?,
        _ => PageRun::read::<3>(title, &files)?,
    };
    let page = options.out.clone().unwrap_or_else(|| options.folder.join(PAGE_NAME));
    let text = run.page();
    prepare_folder_of(&page)?;
    write_atomically(&page, text.as_bytes())?;
    let (frame_count, particle_count) = (run.frames.len(), run.radii.len());
    Ok(Viewed { page, frame_count, particle_count, size: text.len() })
}

/// The name of the folder of a frame, without what says that frames are in it.
fn title(frame: &Path) -> String {
    let absolute = std::path::absolute(frame).unwrap_or_else(|_| frame.to_owned());
    let name = absolute.parent().map_or(String::new(), name_of);
    name.strip_suffix("-xyz").unwrap_or(&name).to_owned()
}

/// A run as the script reads it; vectors have three coordinates each, one after the other.
#[derive(Serialize)]
struct PageRun {
    title: String,
    dimension: usize,
    /// Lower corner of the box.
    origin: [f32; 3],
    /// Edges of the box without its tilt; in 2D the third is 0.
    edges: [f32; 3],
    periodic: [bool; 3],
    radii: Vec<f32>,
    frames: Vec<PageFrame>,
}

#[derive(Serialize)]
struct PageFrame {
    time: f64,
    strain: f64,
    /// Displacement in x of the upper border against the lower one.
    tilt: f32,
    positions: Vec<f32>,
    velocities: Vec<f32>,
    spins: Vec<f32>,
    /// Empty without a contact model.
    forces: Vec<f32>,
    /// Of each contact the particle, its partner (-1 for a wall), the way to it, the normal force, and
    /// whether it slides (-1 where that is not known); nothing where they are not known.
    contacts: Option<Vec<f32>>,
}

impl PageRun {
    /// All frames have the radii and the box of the first.
    fn read<const D: usize>(title: String, files: &[PathBuf]) -> Result<Self, FramesError> {
        let frames = &read_frames::<D>(files)?[..];
        let contacts = contacts_of(&files[0], frames)?;
        let contacts = |n: usize| contacts.as_ref().map(|of_frames| numbers(&of_frames[n]));
        let (container, radii) = (&frames[0].container, &frames[0].radii);
        let bounds = container.bounds();
        Ok(Self {
            title,
            dimension: D,
            origin: triple(bounds.lower.as_slice()),
            edges: triple(bounds.extent().as_slice()),
            periodic: std::array::from_fn(|d| d < D && !container.is_walled(d)),
            radii: radii.iter().map(|radius| *radius as f32).collect(),
            frames: frames.iter().enumerate().map(|(n, frame)| PageFrame::of(frame, contacts(n))).collect(),
        })
    }

    fn page(&self) -> String {
        // Numbers and text only: it cannot fail. Nothing in it can end the element of the page that holds it.
        let json = serde_json::to_string(self).expect("plain data is JSON").replace('<', "\\u003c");
        let title = self.title.replace('&', "&amp;").replace('<', "&lt;");
        let page = PAGE.replacen("{{script}}", &SCRIPTS.concat(), 1).replace("{{title}}", &title);
        page.replacen("{{run}}", &json, 1)
    }
}

impl PageFrame {
    fn of<const D: usize>(frame: &XyzFrame<D>, contacts: Option<Vec<f32>>) -> Self {
        let flat = |vectors: &[gluey_geom::Vector<D>]| {
            vectors.iter().flat_map(|vector| triple(vector.as_slice())).collect::<Vec<f32>>()
        };
        Self {
            time: frame.time,
            strain: frame.strain,
            tilt: frame.container.lattice().tilt() as f32,
            positions: flat(&frame.positions),
            velocities: flat(&frame.velocities),
            spins: frame.spins.iter().flat_map(|spin| triple(spin)).collect(),
            forces: frame.contact_forces.as_deref().map_or_else(Vec::new, flat),
            contacts,
        }
    }
}

fn numbers<const D: usize>(contacts: &[FrameContact<D>]) -> Vec<f32> {
    let of_one = |contact: &FrameContact<D>| {
        let [x, y, z] = triple(contact.arm.as_slice());
        let partner = contact.second.map_or(-1.0, |second| second as f32);
        let slides = contact.slides.map_or(-1.0, |slides| f32::from(u8::from(slides)));
        [contact.first as f32, partner, x, y, z, contact.force as f32, slides]
    };
    contacts.iter().flat_map(of_one).collect()
}

/// Three coordinates; the third of a plane is 0.
fn triple(x: &[f64]) -> [f32; 3] {
    std::array::from_fn(|d| x.get(d).map_or(0.0, |x| *x as f32))
}

#[cfg(test)]
mod tests {
    use gluey::output::product_names::PAGE_HEAD;

    use super::PAGE;

    /// A run that replaces another one takes its page away, by how it begins.
    #[test]
    fn pages_are_known_by_their_beginning() {
        let head = PAGE.split("{{title}}").next().map(str::as_bytes);
        assert_eq!(head, Some(PAGE_HEAD));
    }
}
