//! Figures 9 to 11: three discs.

use super::{Evidence, RADIUS, exact, films_hold, measured, no_overlap, paper};
use crate::reproduce::measures::{center_deviation, last_gap, median_gap, offset_of_the_pair, smallest_gap};
use crate::reproduce::plan::{Approach, CaseName};
use crate::reproduce::trajectory::Trajectory;
use crate::reproduce::verdict::Claim;
use gluey_verify::Wanted;

const CASE: CaseName = CaseName::Trio2d;
const MEDIAN_D12: &str = "median of D12/a over the second half of the run";

const THIRD_TO_NEARER: &str = "gap at the end from disc 3 to the nearer one of the others, in radii";

fn third_to_nearer(run: &Trajectory) -> Option<f64> {
    Some(last_gap(run, (1, 3))?.min(last_gap(run, (2, 3))?))
}

/// Figure 9.
pub fn distances(evidence: &Evidence<'_>) -> Vec<Claim> {
    let run = |approach| evidence.run(CASE, approach);
    let median = |approach| median_gap(run(approach)?, (1, 2));
    let smallest = |approach| run(approach).and_then(smallest_gap);
    vec![
        paper(
            "fig9-gluey-together",
            "The two first particles remain together with the gluey model.",
            "trio-2d-gluey",
            measured(MEDIAN_D12, median(Approach::Gluey)),
            Wanted::AtMost(0.03),
        ),
        paper(
            "fig9-none-together",
            "They remain together without correction.",
            "trio-2d-none",
            measured(MEDIAN_D12, median(Approach::None)),
            Wanted::AtMost(0.03),
        ),
        paper(
            "fig9-inelastic-separated",
            "They are separated with inelastic collisions.",
            "trio-2d-inelastic",
            measured(MEDIAN_D12, median(Approach::Inelastic)),
            Wanted::AtLeast(0.03),
        ),
        paper(
            "fig9-third-joins",
            "Without correction the third particle is aggregated to the two others at t = 30: D23 < 0.01 a.",
            "trio-2d-none",
            measured("D23/a at t = 30", run(Approach::None).and_then(|run| run.at(run.gap((2, 3))?, 30.0))),
            Wanted::AtMost(0.01),
        )
        .full_only(),
        no_overlap("fig9-gluey-no-overlap", "trio-2d-gluey", smallest(Approach::Gluey)),
        no_overlap("fig9-inelastic-no-overlap", "trio-2d-inelastic", smallest(Approach::Inelastic)),
        films_hold("fig9-unfitted-no-overlap", "trio-2d-unfitted", smallest(Approach::Unfitted)),
    ]
}

/// Figure 10.
pub fn without_correction(evidence: &Evidence<'_>) -> Vec<Claim> {
    let run = |approach| evidence.run(CASE, approach);
    let apart = |case| {
        let (none, gluey) = (evidence.run(case, Approach::None)?, evidence.run(case, Approach::Gluey)?);
        Some(center_deviation(none, gluey, f64::INFINITY)? / RADIUS)
    };
    let (three, two) = (apart(CASE), apart(CaseName::Pair2d));
    let mut claims = vec![
        paper(
            "fig10-overlap",
            "Without correction particles overlap.",
            "trio-2d-none",
            measured("smallest D/a", run(Approach::None).and_then(smallest_gap)),
            Wanted::AtMost(-0.01),
        ),
        paper(
            "fig10-three-together",
            "Therefore the three particles remain together at the end of the computation.",
            "trio-2d-none",
            measured(THIRD_TO_NEARER, run(Approach::None).and_then(third_to_nearer)),
            Wanted::AtMost(0.1),
        )
        .full_only(),
        paper(
            "fig10-paths-differ",
            "Trajectories without correction and with gluey contact are not the same.",
            "trio-2d-none and -gluey",
            measured("largest distance between the centres, in radii", three),
            Wanted::AtLeast(0.1),
        ),
        paper(
            "fig10-more-than-two",
            "The difference is bigger than in the case with two particles.",
            "trio-2d and pair-2d, -none and -gluey",
            measured(
                "the same distance, over that of two particles",
                three.zip(two).map(|(three, two)| three / two),
            ),
            Wanted::AtLeast(1.5),
        ),
        paper(
            "fig10-not-symmetric",
            "Due to the third particle the motion is not symmetric with respect to the mid-plane.",
            "trio-2d-gluey",
            measured(
                "largest distance of the middle of particles 1 and 2 from the mid-plane, in radii",
                run(Approach::Gluey).and_then(|run| Some(offset_of_the_pair(run)? / RADIUS)),
            ),
            Wanted::AtLeast(0.1),
        ),
    ];
    claims.push(against_the_exact_trio(evidence));
    claims
}

/// To the time up to which the exact data are checked.
fn against_the_exact_trio(evidence: &Evidence<'_>) -> Claim {
    let off = || {
        let (run, exact) = (evidence.run(CASE, Approach::Unfitted)?, evidence.exact(CASE)?);
        Some(center_deviation(run, exact, 6.0)? / RADIUS)
    };
    exact(
        "fig10-exact-6",
        "trio-2d-unfitted",
        measured("largest distance of a centre from the exact one to t = 6, in radii", off()),
        Wanted::AtMost(evidence.limit(1.47e-3, 2.4e-3)),
    )
}

/// Figure 11.
pub fn inelastic(evidence: &Evidence<'_>) -> Vec<Claim> {
    let run = |approach| evidence.run(CASE, approach);
    let apart = run(Approach::Inelastic)
        .zip(run(Approach::Gluey))
        .and_then(|(own, gluey)| Some(center_deviation(own, gluey, f64::INFINITY)? / RADIUS));
    vec![
        paper(
            "fig11-paths-differ",
            "The results with inelastic collision are quite different.",
            "trio-2d-inelastic and -gluey",
            measured("largest distance between the centres, in radii", apart),
            Wanted::AtLeast(0.5),
        ),
        paper(
            "fig11-apart",
            "With inelastic collision the three particles are no more close together.",
            "trio-2d-inelastic",
            measured(THIRD_TO_NEARER, run(Approach::Inelastic).and_then(third_to_nearer)),
            Wanted::AtLeast(1.0),
        )
        .full_only(),
    ]
}
