//! What people look at of a run of gluey: pictures, a page for the browser, statistics of its particles.
//!
//! All are made of the folder that a run wrote, and go beside its results or to another place:
//!
//! ```no_run
//! use gluey_view::{AnalyseOptions, ViewOptions, analyse, view};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     println!("{}", analyse(&AnalyseOptions::new("out"))?);
//!     let viewed = view(&ViewOptions { folder: "out".into(), out: None, every: 1 })?;
//!     println!("{}", viewed.page.display());
//!     Ok(())
//! }
//! ```
//!
//! Not for pictures of other numbers than a run of gluey wrote: `gluey_pictures` draws any.

mod analyse;
mod contacts;
mod frames;
mod plot;
mod view;

pub use analyse::{AnalyseError, AnalyseOptions, StructureSummary, analyse};
pub use frames::FramesError;
pub use plot::{
    AnimationOptions, Coloring, Figure, FlowOptions, FrameChoice, Lines, Look, PictureFormat, PlotError,
    PlotOptions, Quantity, SliceChoice, Viewpoint, plot,
};
pub use view::{ViewError, ViewOptions, Viewed, view};

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
