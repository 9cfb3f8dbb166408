//! Mutated input. A binary of its own, since the memory of the whole process is measured.

mod cases;
mod files;
mod follow;
