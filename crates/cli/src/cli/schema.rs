//! `gluey schema`.

use clap::Args;
use gluey::Case;

use super::failure::Failure;
use crate::terminal::print_json;

/// Arguments of `gluey schema`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example, for the editor extension Even Better TOML and other users of Taplo:
  gluey schema > case.schema.json

and as the first line of a case file beside it:
  #:schema case.schema.json")]
pub struct SchemaArguments {}

impl SchemaArguments {
    /// Prints it.
    pub fn run(&self) -> Result<(), Failure> {
        print_json(Case::schema());
        Ok(())
    }
}
