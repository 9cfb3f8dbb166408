//! Arguments of `gluey view`.

use std::path::PathBuf;

use clap::Args;
use gluey_view::{ViewOptions, Viewed};

use super::Failure;
use crate::terminal;

/// Arguments of `gluey view`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  gluey run suspension.toml --out out --xyz 10\n  gluey view out")]
pub struct ViewArguments {
    /// Folder of a run, or of its files in extended XYZ.
    folder: PathBuf,
    /// The page; view.html in that folder when absent.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Show every Nth frame only.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = super::output::at_least_one)]
    every: usize,
}

impl ViewArguments {
    /// Writes the page.
    pub fn run(&self) -> Result<(), Failure> {
        let viewed =
            gluey_view::view(&self.options()).map_err(|error| Failure::of_results(error, &self.folder))?;
        let Viewed { page, frame_count, particle_count, size } = viewed;
        let (page, megabytes) = (page.display(), size as f64 / 1e6);
        terminal::print(&format!(
            "{page}: {frame_count} frames of {particle_count} particles, {megabytes:.1} MB; open it in a browser\n"
        ));
        Ok(())
    }

    fn options(&self) -> ViewOptions {
        let Self { folder, out, every } = self.clone();
        ViewOptions { folder, out, every }
    }
}
