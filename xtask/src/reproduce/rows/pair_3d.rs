//! Figures 7a and 7b: two spheres.

use super::{Evidence, RADIUS, exact, films_hold, measured, no_overlap, paper};
use crate::reproduce::measures::{
    center_deviation, closest_approach, gap_deviation, gap_error, last_gap, smallest_gap,
};
use crate::reproduce::plan::{Approach, CaseName};
use crate::reproduce::reference::CLOSEST_APPROACH_TIME;
use crate::reproduce::verdict::Claim;
use gluey_verify::Wanted;

const CASE: CaseName = CaseName::Pair3d;
const REVERSIBILITY: &str = "reversibility error: |D(t* + s) - D(t* - s)| / D(t* - s)";

/// Figure 7a.
pub fn distances(evidence: &Evidence<'_>) -> Vec<Claim> {
    let smallest = |approach| evidence.run(CASE, approach).and_then(smallest_gap);
    let mut claims = strategies(evidence);
    claims.extend([
        no_overlap("fig7a-inelastic-no-overlap", "pair-3d-inelastic", smallest(Approach::Inelastic)),
        no_overlap("fig7a-gluey-no-overlap", "pair-3d-gluey", smallest(Approach::Gluey)),
        no_overlap(
            "fig7a-as-printed-no-overlap",
            "pair-3d-gluey-as-printed",
            smallest(Approach::GlueyAsPrinted),
        ),
        films_hold("fig7a-unfitted-no-overlap", "pair-3d-unfitted", smallest(Approach::Unfitted)),
    ]);
    claims.extend(against_the_exact_encounter(evidence));
    claims
}

fn strategies(evidence: &Evidence<'_>) -> Vec<Claim> {
    let error = |approach| evidence.report(CASE, approach)?.reversibility_error;
    let as_printed = error(Approach::GlueyAsPrinted);
    let large_step = error(Approach::GlueyAsPrintedLargeStep);
    vec![
        paper(
            "fig7a-overlap",
            "Without correction there is a large overlap.",
            "pair-3d-none",
            measured("smallest D/a", evidence.run(CASE, Approach::None).and_then(smallest_gap)),
            Wanted::AtMost(-0.01),
        ),
        paper(
            "fig7a-inelastic-irreversible",
            "With the inelastic model reversibility is no more satisfied: the distance shows it.",
            "pair-3d-inelastic",
            measured(REVERSIBILITY, error(Approach::Inelastic)),
            Wanted::AtLeast(0.1),
        ),
        paper(
            "fig7a-gluey-reversible",
            "With gluey contact reversibility is almost recovered (relative error at the end: 6.5 %).",
            "pair-3d-gluey",
            measured(REVERSIBILITY, error(Approach::Gluey)),
            Wanted::AtMost(0.065),
        ),
        paper(
            "fig7a-as-printed-error",
            "The relative error of the distance when reversibility occurs is 6.5 %.",
            "pair-3d-gluey-as-printed",
            measured(REVERSIBILITY, as_printed),
            Wanted::Between(0.02, 0.2),
        ),
        paper(
            "fig7a-as-printed-step",
            "A better accuracy can be obtained with a smaller time step.",
            "pair-3d-gluey-as-printed",
            measured(
                "reversibility error, over that with twice the time step (of the six pairs of 1, 2, 3 and 4 times the step \
                 the only one that agrees)",
                as_printed.zip(large_step).map(|(own, large)| own / large),
            ),
            Wanted::AtMost(0.75),
        )
        .full_only(),
    ]
}

fn against_the_exact_encounter(evidence: &Evidence<'_>) -> Vec<Claim> {
    let unfitted = evidence.run(CASE, Approach::Unfitted);
    let with_exact = unfitted.zip(evidence.exact(CASE));
    let row = |id, what, value, wanted| exact(id, "pair-3d-unfitted", measured(what, value), wanted);
    let band = |limit: f64| Wanted::Between(-limit, limit);
    vec![
        row(
            "fig7a-far-unfitted",
            "D(t), largest relative error while D > 0.2 a (2 % is the error of the exact data)",
            with_exact.and_then(|(run, exact)| gap_deviation(run, exact, 0.2)),
            Wanted::AtMost(evidence.limit(0.007, 0.02)),
        ),
        row(
            "fig7a-near-unfitted",
            "D(t)/a, largest error while D < 0.2 a",
            with_exact.and_then(|(run, exact)| gap_error(run, exact, exact.end(), 0.2)),
            Wanted::AtMost(evidence.limit(0.0015, 0.0045)),
        ),
        row(
            "fig7a-smallest-unfitted",
            "smallest D/a, relative error",
            with_exact.and_then(|(run, exact)| Some(smallest_gap(run)? / smallest_gap(exact)? - 1.0)),
            band(evidence.limit(0.016, 0.04)),
        ),
        row(
            "fig7a-time-unfitted",
            "time of closest approach, relative error",
            unfitted.and_then(|run| Some(closest_approach(run)? / CLOSEST_APPROACH_TIME - 1.0)),
            band(evidence.limit(3.4e-4, 8.5e-4)),
        ),
        row(
            "fig7a-reversibility-unfitted",
            REVERSIBILITY,
            evidence.report(CASE, Approach::Unfitted).and_then(|report| report.reversibility_error),
            Wanted::AtMost(evidence.limit(3e-4, 8.5e-4)),
        ),
    ]
}

/// Figure 7b.
pub fn paths(evidence: &Evidence<'_>) -> Vec<Claim> {
    let run = |approach| evidence.run(CASE, approach);
    // An exact encounter ends as far from the plane y = 1/2 as it began.
    let offset_change = |approach| {
        let path = &run(approach)?.centers[0];
        let (first, last) = (path.first()?[1] - 0.5, path.last()?[1] - 0.5);
        Some((last / first - 1.0).abs())
    };
    let off_exact =
        |approach| Some(center_deviation(run(approach)?, evidence.exact(CASE)?, f64::INFINITY)? / RADIUS);
    let end_gap = |approach| last_gap(run(approach)?, (1, 2));
    let change = "relative change of sphere 1's distance from the plane y = 1/2";
    vec![
        paper(
            "fig7b-inelastic-paths",
            "The inelastic model modifies the trajectories significantly.",
            "pair-3d-inelastic",
            measured(change, offset_change(Approach::Inelastic)),
            Wanted::AtLeast(0.1),
        ),
        paper(
            "fig7b-gluey-paths",
            "With gluey contact the trajectories are almost reversible.",
            "pair-3d-gluey",
            measured(change, offset_change(Approach::Gluey)),
            Wanted::AtMost(0.05),
        ),
        paper(
            "fig7b-inelastic-ends-elsewhere",
            "Inelastic spheres part on other paths than gluey ones.",
            "pair-3d-inelastic and -gluey",
            measured(
                "D at the end, relative difference",
                end_gap(Approach::Inelastic)
                    .zip(end_gap(Approach::Gluey))
                    .map(|(own, gluey)| (own - gluey).abs() / gluey),
            ),
            Wanted::AtLeast(0.1),
        ),
        exact(
            "fig7b-paths-unfitted",
            "pair-3d-unfitted",
            measured(
                "largest distance of a centre from the exact one, in radii",
                off_exact(Approach::Unfitted),
            ),
            Wanted::AtMost(evidence.limit(0.0057, 0.015)),
        ),
    ]
}
