//! Figures 5 and 6: two discs.

use std::f64::consts::PI;

use super::{Evidence, exact, films_hold, measured, no_overlap, paper};
use crate::reproduce::measures::{
    gap_difference_while_apart, gap_error, largest_gap, largest_gap_after_smallest,
    largest_gap_while_touching, orbit_ratio, smallest_gap, time_to_turn,
};
use crate::reproduce::plan::{Approach, CaseName};
use crate::reproduce::reference::HALF_TURN_TIME;
use crate::reproduce::trajectory::Trajectory;
use crate::reproduce::verdict::Claim;
use gluey_verify::Wanted;

const CASE: CaseName = CaseName::Pair2d;
const PAIR: (usize, usize) = (1, 2);

/// Figure 5.
pub fn distances(evidence: &Evidence<'_>) -> Vec<Claim> {
    let run = |approach| evidence.run(CASE, approach);
    let smallest = |approach| run(approach).and_then(smallest_gap);
    let mut claims = without_correction(evidence);
    claims.extend(as_printed(evidence));
    claims.extend([
        no_overlap("fig5-gluey-no-overlap", "pair-2d-gluey", smallest(Approach::Gluey)),
        no_overlap("fig5-inelastic-no-overlap", "pair-2d-inelastic", smallest(Approach::Inelastic)),
        no_overlap(
            "fig5-as-printed-no-overlap",
            "pair-2d-gluey-as-printed",
            smallest(Approach::GlueyAsPrinted),
        ),
        films_hold("fig5-unfitted-no-overlap", "pair-2d-unfitted", smallest(Approach::Unfitted)),
    ]);
    claims.extend(against_the_exact_doublet(evidence));
    claims
}

fn without_correction(evidence: &Evidence<'_>) -> Vec<Claim> {
    let (none, gluey) = (evidence.run(CASE, Approach::None), evidence.run(CASE, Approach::Gluey));
    let same = |none: &Trajectory, gluey: &Trajectory| {
        Some(gap_difference_while_apart(none, gluey)? / largest_gap(none, PAIR)?)
    };
    vec![
        paper(
            "fig5-overlap",
            "Without correction the overlap is rather important, bigger than 0.01 a.",
            "pair-2d-none",
            measured("smallest D/a", none.and_then(smallest_gap)),
            Wanted::AtMost(-0.01),
        ),
        paper(
            "fig5-not-stuck",
            "Without correction the overlapping particles do not remain stuck.",
            "pair-2d-none",
            measured("largest D/a after the deepest overlap", none.and_then(largest_gap_after_smallest)),
            Wanted::AtLeast(1e-3),
        ),
        paper(
            "fig5-same-while-apart",
            "Without correction the distance, while positive, is that of the gluey model.",
            "pair-2d-none and -gluey",
            measured(
                "largest difference of D at all times when it is positive, over the largest D",
                none.zip(gluey).and_then(|(none, gluey)| same(none, gluey)),
            ),
            Wanted::AtMost(0.05),
        ),
    ]
}

fn as_printed(evidence: &Evidence<'_>) -> Vec<Claim> {
    let gluey = evidence.run(CASE, Approach::Gluey);
    let while_active = |approach| largest_gap_while_touching(evidence.run(CASE, approach)?, gluey?);
    let own = while_active(Approach::GlueyAsPrinted);
    let large_step = while_active(Approach::GlueyAsPrintedLargeStep);
    vec![
        paper(
            "fig5-as-printed-distance",
            "While the gluey procedure is active the distance can be bigger than 0.01 a.",
            "pair-2d-gluey-as-printed",
            measured("largest D/a while pair-2d-gluey is in contact", own),
            Wanted::AtLeast(0.01),
        ),
        paper(
            "fig5-as-printed-step",
            "That distance decreases with the time step.",
            "pair-2d-gluey-as-printed",
            measured(
                "the same, over that with twice the time step",
                own.zip(large_step).map(|(own, large)| own / large),
            ),
            Wanted::AtMost(0.5),
        ),
    ]
}

fn against_the_exact_doublet(evidence: &Evidence<'_>) -> Vec<Claim> {
    let half_turn = |approach| Some(time_to_turn(evidence.run(CASE, approach)?, -PI)? / HALF_TURN_TIME - 1.0);
    let name = "time of half a turn, relative error";
    let unfitted = evidence.run(CASE, Approach::Unfitted);
    let error = |run: &Trajectory| gap_error(run, evidence.exact(CASE)?, run.end(), f64::INFINITY);
    let band = |limit: f64| Wanted::Between(-limit, limit);
    vec![
        exact(
            "fig5-half-turn-paper",
            "pair-2d-gluey",
            measured(name, half_turn(Approach::Gluey)),
            band(0.04),
        ),
        exact(
            "fig5-half-turn-unfitted",
            "pair-2d-unfitted",
            measured(name, half_turn(Approach::Unfitted)),
            band(evidence.limit(2.6e-4, 2.3e-4)),
        ),
        exact(
            "fig5-distance-unfitted",
            "pair-2d-unfitted",
            measured("largest error of D/a", unfitted.and_then(error)),
            Wanted::AtMost(evidence.limit(1e-7, 5.4e-8)),
        ),
    ]
}

/// Figure 6.
pub fn orbits(evidence: &Evidence<'_>) -> Vec<Claim> {
    let ratio = |approach, from: f64| orbit_ratio(evidence.run(CASE, approach)?, from);
    let last_turn = |approach| {
        let run = evidence.run(CASE, approach)?;
        orbit_ratio(run, run.end() - 2.0 * HALF_TURN_TIME)
    };
    let whole = "greatest over least distance from the box centre";
    let last = "greatest over least distance from the box centre, last turn";
    vec![
        paper(
            "fig6-circle",
            "With the gluey model the trajectory is a circle, the limit of zero initial distance.",
            "pair-2d-gluey",
            measured(whole, ratio(Approach::Gluey, 0.0)),
            Wanted::AtMost(1.009),
        ),
        paper(
            "fig6-fluctuations",
            "Without correction the trajectories are similar to a circle, with small fluctuations.",
            "pair-2d-none",
            measured(whole, ratio(Approach::None, 0.0)),
            Wanted::Between(1.005, 1.1),
        ),
        paper(
            "fig6-ellipse",
            "With the inelastic model the particles jump to a new orbit that is more ellipsoidal.",
            "pair-2d-inelastic",
            measured(last, last_turn(Approach::Inelastic)),
            Wanted::AtLeast(1.01),
        ),
        // The gap alone makes 1.00002 of it. The rest is the middle of the pair, whose place in the middle
        // of the box is unstable: it leaves it like exp(0.17 t) and is 7e-6 a away at the end.
        exact(
            "fig6-circle-unfitted",
            "pair-2d-unfitted",
            measured(whole, ratio(Approach::Unfitted, 0.0)),
            Wanted::AtMost(1.00006),
        ),
    ]
}
