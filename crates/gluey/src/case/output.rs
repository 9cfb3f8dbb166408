//! What a case says of frames to write.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::names::{OutputKind, Precision};

/// A stream of frames, beside the tables that every run writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// Format of the frames.
    pub kind: OutputKind,
    /// The frames go to the folder `<run>-<label>` beside the trajectory: letters, digits, `-` and `_`, at
    /// most 64 of them, other than those of the other streams. Default: the kind.
    #[serde(default)]
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub label: Option<String>,
    /// A frame every so many steps. Unit: steps. Default: none, another key says when.
    #[serde(default)]
    #[schemars(range(min = 1))]
    pub every: Option<usize>,
    /// A frame whenever the sheared distance has grown by so much strain, forth or back, at the first step
    /// that gets there. Unit: none. Default: none, another key says when.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every_strain: Option<f64>,
    /// A frame whenever so much time has gone by, at the first step that gets there. Unit: time. Default:
    /// none, another key says when.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every_time: Option<f64>,
    /// Whether the flow on the mesh is written (kind `vtk`), or particles and contacts alone. Default: true.
    #[serde(default = "yes")]
    pub fields: bool,
    /// Compression, from 0 (none) over 1 (fast) to 9 (small); of kind `xyz` 0 or any. Unit: none. Default: 1.
    #[serde(default = "fast")]
    #[schemars(range(min = 0, max = 9))]
    pub compression: u32,
    /// Precision of kind `vtk`. Default: "f64".
    #[serde(default)]
    pub precision: Precision,
}

/// The distance from one frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// Every so many steps.
    Steps(usize),
    /// Whenever the strain, forth or back, has grown by this.
    Strain(f64),
    /// Whenever so much time has gone by.
    Time(f64),
}

impl OutputSpec {
    /// What its folder is called behind the name of the run.
    pub fn label(&self) -> &str {
        self.label.as_deref().unwrap_or(self.kind.name())
    }

    /// When its frames are written; every step if nothing is said, which no checked case does.
    pub fn interval(&self) -> Interval {
        match (self.every_strain, self.every_time) {
            (Some(strain), _) => Interval::Strain(strain),
            (None, Some(time)) => Interval::Time(time),
            (None, None) => Interval::Steps(self.every.unwrap_or(1)),
        }
    }
}

impl Interval {
    /// Whether there is a frame at the beginning of this step, if each shears by `strain` and takes `time`.
    pub fn is_due(self, step: usize, strain: f64, time: f64) -> bool {
        // Frames that a step goes past.
        let a_step = match self {
            Self::Steps(every) => return step.is_multiple_of(every.max(1)),
            Self::Strain(every) => strain.abs() / every,
            Self::Time(every) => time / every,
        };
        let frames = |step: usize| (a_step * step as f64 + 1e-9).floor();
        step == 0 || frames(step) > frames(step - 1)
    }
}

fn yes() -> bool {
    true
}

fn fast() -> u32 {
    1
}
