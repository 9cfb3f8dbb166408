//! The exact solutions that stand beside the runs (`data/reference/README.md` says where each comes from).

use super::plan::CaseName;
use super::trajectory::Trajectory;
use crate::workspace_root;

/// Time of half a turn of the 2D doublet, exact to 1e-6 (units of 1/shear rate).
pub const HALF_TURN_TIME: f64 = 7.769130;
/// Time of closest approach of the 3D pair in the unit box, to 0.01.
pub const CLOSEST_APPROACH_TIME: f64 = 8.422;

/// Name of the file under `data/reference` with the exact solution of a case.
pub fn file_name(case: CaseName) -> &'static str {
    match case {
        CaseName::Pair2d => "pair2d_trajectory.csv",
        CaseName::Pair3d => "pair3d_trajectory_box.csv",
        CaseName::Trio2d => "trio2d_trajectory.csv",
    }
}

/// The exact trajectory of a case; the 2D doublet, which repeats itself every half turn, to time `end`.
pub fn load(case: CaseName, end: f64) -> anyhow::Result<Trajectory> {
    let exact = Trajectory::read(&workspace_root().join("data/reference").join(file_name(case)))?;
    Ok(if case == CaseName::Pair2d { exact.continue_half_turns(end) } else { exact })
}

#[cfg(test)]
mod tests {
    use super::super::measures;
    use super::*;

    /// Distance of each particle of the 2D doublet from the box centre.
    const DOUBLET_RADIUS: f64 = 0.05001;

    fn exact(case: CaseName) -> Trajectory {
        load(case, 30.0).unwrap()
    }

    #[test]
    fn the_constants_agree_with_the_tables() {
        let pair2d = exact(CaseName::Pair2d);
        let half_turn = measures::time_to_turn(&pair2d, -std::f64::consts::PI).unwrap();
        assert!((half_turn - HALF_TURN_TIME).abs() < 2e-6, "{half_turn}");
        let closest = measures::closest_approach(&exact(CaseName::Pair3d)).unwrap();
        assert!((closest - CLOSEST_APPROACH_TIME).abs() < 0.01, "{closest}");
    }

    #[test]
    fn the_continued_doublet_stays_on_its_circle() {
        let pair2d = exact(CaseName::Pair2d);
        assert!(pair2d.end() >= 30.0);
        let (low, high) = measures::distance_from_center(&pair2d, 0.0).unwrap();
        assert!((low - DOUBLET_RADIUS).abs() < 1e-5 && (high - DOUBLET_RADIUS).abs() < 1e-5);
    }
}
