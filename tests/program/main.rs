//! The program `gluey` as people use it: what it reads and refuses, what it prints, writes and draws.

mod bad_input;
mod command_line;
mod examples;
mod invalid;
mod pictures;
#[path = "../support/program.rs"]
mod program;
mod result_folder;
mod rubbing;
mod sweep;
mod tables;
mod viewer;
mod vtk;
