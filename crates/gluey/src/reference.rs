//! Reference solutions compiled into the program, so that it compares from any folder.

/// Names a case may give as its `reference`.
pub const NAMES: &[&str] =
    &["pair2d_trajectory", "trio2d_trajectory", "pair3d_trajectory_box", "pair3d_trajectory_unbounded"];
