//! `gluey completions`.

use std::io::{Write, stdout};

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use super::failure::Failure;

/// Arguments of `gluey completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gluey completions bash > ~/.local/share/bash-completion/completions/gluey\n  \
                        gluey completions zsh > \"${fpath[1]}/_gluey\""
)]
pub struct CompletionsArguments {
    /// The shell.
    shell: Shell,
}

impl CompletionsArguments {
    /// Prints what the shell is to read, for the command `C`.
    pub fn run<C: CommandFactory>(&self) -> Result<(), Failure> {
        let mut script = Vec::new();
        generate(self.shell, &mut C::command(), "gluey", &mut script);
        stdout().write_all(&script).map_err(|error| Failure::new(error, None))
    }
}
