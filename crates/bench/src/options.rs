//! What the command line asks for.

use std::num::NonZeroUsize;

use clap::ValueEnum;
use gluey_stokes::{Formulation, Lubrication, PaperParams};
use serde::Serialize;

use crate::cases::BenchCase;

/// The command line of `bench-stokes`.
#[derive(clap::Args, Debug)]
pub struct StokesBenchOptions {
    /// C2, C3: no particle; S2, S3: two; M3: twenty-seven. The digit is the dimension.
    #[arg(long, value_name = "CASE", ignore_case = true)]
    pub case: BenchCase,
    /// Cells per side of the uniform mesh, or of its finest level with --adaptive: a power of two.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = level)]
    n: u8,
    /// How rigidity is imposed.
    #[arg(long, value_name = "NAME", default_value = "unfitted")]
    pub formulation: FormulationName,
    /// Residual to reach, relative to that of a zero guess.
    #[arg(long = "tol", value_name = "T", default_value = "1e-8", value_parser = tolerance, allow_hyphen_values = true)]
    pub tolerance: f64,
    /// Viscosity of the particles over that of the fluid, in `paper`.
    #[arg(long, value_name = "R", default_value = "1e3", allow_hyphen_values = true)]
    contrast: f64,
    /// Refine towards the particles only.
    #[arg(long)]
    pub adaptive: bool,
    /// Threads for everything.
    #[arg(long, value_name = "T", default_value = "1", allow_negative_numbers = true)]
    pub threads: NonZeroUsize,
}

/// Names of the formulations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum FormulationName {
    /// Nitsche's conditions on the true surfaces.
    Unfitted,
    /// Penalty with a ramp of one cell, solved once.
    Paper,
}

impl StokesBenchOptions {
    /// Cells per side at the finest level.
    pub fn cells_per_side(&self) -> u64 {
        1 << self.n
    }

    /// The finest level.
    pub fn level(&self) -> u8 {
        self.n
    }

    /// The formulation with its parameters.
    pub fn formulation(&self) -> Formulation {
        match self.formulation {
            FormulationName::Unfitted => Formulation::Unfitted { lubrication: Lubrication::Deficit },
            FormulationName::Paper => Formulation::Paper(PaperParams {
                viscosity_ratio: self.contrast,
                ramp: 1.0,
                uzawa_steps: 1,
                ..PaperParams::default()
            }),
        }
    }

    /// The contrast, where it matters.
    pub fn contrast_used(&self) -> Option<f64> {
        (self.formulation == FormulationName::Paper).then_some(self.contrast)
    }
}

/// What is said of a number of cells that no mesh of halved cells has, and of a tolerance that no solve can.
const NOT_A_POWER_OF_TWO: &str = "must be a power of two of at least 2, such as 64";
const BAD_TOLERANCE: &str = "must lie between 0 and 1";

/// The level of a mesh with this number of cells per side.
fn level(text: &str) -> Result<u8, &'static str> {
    let count = text.parse::<u64>().ok().filter(|n| n.is_power_of_two() && *n > 1);
    count.map(|n| n.ilog2() as u8).ok_or(NOT_A_POWER_OF_TWO)
}

fn tolerance(text: &str) -> Result<f64, &'static str> {
    text.parse().ok().filter(|t| *t > 0.0 && *t < 1.0).ok_or(BAD_TOLERANCE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_per_side_are_powers_of_two() {
        assert_eq!(level("64"), Ok(6));
        for wrong in ["0", "1", "48", "-64", "64.0", "", "many", "18446744073709551616"] {
            assert_eq!(level(wrong), Err(NOT_A_POWER_OF_TWO), "{wrong}");
        }
    }

    #[test]
    fn tolerances_lie_between_zero_and_one() {
        assert_eq!(tolerance("1e-6"), Ok(1e-6));
        for wrong in ["0", "1", "-1e-8", "NaN", "inf", "small"] {
            assert_eq!(tolerance(wrong), Err(BAD_TOLERANCE), "{wrong}");
        }
    }
}
