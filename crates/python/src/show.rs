//! What the command line makes of results: pictures, a page for the browser, tables of particles.

use std::error::Error;
use std::path::PathBuf;
use std::str::FromStr;

use gluey_view::{
    AnalyseOptions, AnimationOptions, Coloring, FlowOptions, FrameChoice, Lines, Look, PlotOptions, Quantity,
    SliceChoice, ViewOptions, Viewpoint,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::plain;
use crate::pool::compute;

/// Options of pictures; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PlotRequest {
    folder: PathBuf,
    only: Vec<String>,
    frame: Option<String>,
    flow: Option<String>,
    slice: Option<String>,
    view: (f64, f64),
    colour: String,
    contacts: Option<String>,
    animation: bool,
    pixels: u32,
    rate: f64,
    formats: Vec<String>,
    width_mm: f64,
}

/// Draws the results in a folder and gives the paths of the pictures.
#[pyfunction]
pub fn plot(py: Python<'_>, plot: PlotRequest) -> PyResult<Vec<PathBuf>> {
    let slice = plot.slice.map(|slice| named::<SliceChoice>("slice", &slice)).transpose()?;
    let quantity = plot.flow.map(|flow| named::<Quantity>("flow", &flow)).transpose()?;
    let (azimuth, elevation) = plot.view;
    let look = Look {
        viewpoint: Viewpoint { azimuth, elevation },
        coloring: named::<Coloring>("colour", &plot.colour)?,
        network: plot.contacts.map(|lines| named::<Lines>("contacts", &lines)).transpose()?,
    };
    let options = PlotOptions {
        folder: plot.folder,
        flow: quantity.map(|quantity| FlowOptions { quantity, slice }),
        look,
        frame: plot.frame.map(|frame| named::<FrameChoice>("frame", &frame)).transpose()?,
        animation: plot.animation.then_some(AnimationOptions { pixels: plot.pixels, rate: plot.rate }),
        only: plot.only.iter().map(|name| named("only", name)).collect::<PyResult<_>>()?,
        formats: plot.formats.iter().map(|name| named("formats", name)).collect::<PyResult<_>>()?,
        width_mm: plot.width_mm,
    };
    told(py, compute(py, None, || gluey_view::plot(&options))?)
}

/// Writes a page for the browser and gives its path.
#[pyfunction]
pub fn view(py: Python<'_>, folder: PathBuf, out: Option<PathBuf>, every: usize) -> PyResult<PathBuf> {
    let options = ViewOptions { folder, out, every };
    let viewed = told(py, compute(py, None, || gluey_view::view(&options))?)?;
    Ok(viewed.page)
}

/// Writes tables of the frames in a folder and gives a summary.
#[pyfunction]
pub fn analyse(
    py: Python<'_>,
    folder: PathBuf,
    out: Option<PathBuf>,
    reach: f64,
    skip: Option<usize>,
) -> PyResult<String> {
    let options = AnalyseOptions { folder, out, reach_over_a: reach, skip };
    let summary = told(py, compute(py, None, || gluey_view::analyse(&options))?)?;
    Ok(summary.to_string())
}

fn named<T: FromStr<Err = String>>(argument: &str, name: &str) -> PyResult<T> {
    name.parse().map_err(|error| PyValueError::new_err(format!("{argument}: found {name:?}, {error}")))
}

fn told<T, E: Error>(py: Python<'_>, outcome: Result<T, E>) -> PyResult<T> {
    outcome.map_err(|error| plain(py, "GlueyError", &error))
}
