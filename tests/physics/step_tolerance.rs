//! Steps in as many parts as a tolerance of their error asks for: errors at the end fall with it, rows stay
//! where they are, what was missed is counted, and a run that is resumed has the same bits.

use gluey::{Case, RunOptions, RunReport, Silent};

use crate::runs::{beside, case, centers, column, resumes_bit_by_bit, run};

/// Two spheres that pass each other, their mobility exact.
fn encounter(step: f64, tolerance: Option<f64>) -> Case {
    let tolerance = tolerance.map_or(String::new(), |tolerance| format!("tolerance = {tolerance:e}"));
    case(&format!(
        r#"
        name = "encounter"
        dimension = 3
        particles = [
            {{ position = [0.3, 0.525, 0.5], radius = 0.05 }},
            {{ position = [0.7, 0.475, 0.5], radius = 0.05 }},
        ]
        [time]
        step = {step}
        end = 16.0
        {tolerance}
        [contact]
        strategy = "none"
        [flow]
        hydrodynamics = "pair-mobility"
        [flow.pair-mobility]
        gap_offset = 0.0
        "#
    ))
}

/// What came of an encounter: the last centre of the first sphere, in radii, and columns of rows.
struct Passage {
    report: RunReport,
    end: [f64; 2],
    times: Vec<f64>,
    parts: Vec<f64>,
    errors: Vec<f64>,
}

fn passage(case: &Case) -> Passage {
    let folder = tempfile::tempdir().expect("a folder");
    let csv = folder.path().join("t.csv");
    let report = run(case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    let end = centers::<3>(&csv, 2).last().expect("a row")[0] / 0.05;
    let solver = beside(&csv, "solver");
    let [parts, errors] = ["parts", "step_error_over_radius"].map(|name| column(&solver, name));
    Passage { report, end: [end.x, end.y], times: column(&csv, "t"), parts, errors }
}

/// Errors at the end of 0.2, 0.032, 5.5e-3 and 1.4e-3 radii, in 33, 64, 130 and 288 flows: about as in as
/// many equal steps, but nobody had to choose their length.
#[test]
fn errors_at_the_end_fall_with_the_tolerance() {
    let exact = passage(&encounter(0.01, None)).end;
    let mut errors = Vec::new();
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
        let case = encounter(1.6, Some(tolerance));
        let Passage { report, end, times, parts, errors: estimated } = passage(&case);
        assert!(times.iter().copied().eq((0..=10).map(|step| f64::from(step) * 1.6)), "{times:?}");
        assert!(parts.iter().all(|parts| *parts >= 1.0) && parts.iter().sum::<f64>() > 20.0, "{parts:?}");
        let missed = estimated.iter().filter(|error| **error > tolerance).count();
        assert_eq!(report.tally.inaccurate_steps, missed, "{estimated:?}");
        let largest = estimated.iter().copied().fold(0.0, f64::max);
        assert!((report.tally.step_error - largest).abs() < 1e-3 * largest, "{report}");
        assert!(missed <= 5 && largest < 4.0 * tolerance, "{estimated:?}");
        errors.push((end[0] - exact[0]).hypot(end[1] - exact[1]));
    }
    assert!(errors[0] < 0.4 && errors[3] < 3e-3, "{errors:?}");
    assert!(errors.windows(2).all(|errors| errors[1] < 0.33 * errors[0]), "{errors:?}");
}

/// Equal steps tell their error as well: in the median a quarter of the length has an error 64 times smaller.
#[test]
fn errors_of_equal_steps_are_of_third_order() {
    let [long, short] = [0.1, 0.025].map(|step| {
        let Passage { mut errors, parts, report, .. } = passage(&encounter(step, None));
        assert_eq!((errors[0], report.tally.inaccurate_steps), (0.0, 0));
        assert!(parts.iter().all(|parts| *parts == 1.0));
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    });
    assert!((60.0..68.0).contains(&(long / short)), "{long:e} {short:e}");
}

/// Films alone, and rough discs whose contacts act in the flow.
#[test]
fn parts_are_the_same_after_a_resumption() {
    for contact in ["strategy = 'none'", "strategy = 'rough'\nroughness = 0.05"] {
        let case = case(&format!(
            r#"
            name = "crowd"
            dimension = 2
            [domain]
            boundary = "sheared"
            [suspension]
            volume_fraction = 0.65
            count = 8
            seed = 1
            min_gap = 0.06
            [time]
            step = 0.2
            end = 0.6
            tolerance = 1e-3
            [contact]
            {contact}
            [flow.mesh]
            cells_per_radius = 1.6
            "#
        ));
        let (report, parts) = {
            let folder = tempfile::tempdir().expect("a folder");
            let csv = folder.path().join("t.csv");
            let report =
                run(&case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
            (report, column(&beside(&csv, "solver"), "parts"))
        };
        assert!(parts.iter().all(|parts| *parts > 1.0), "{parts:?}");
        assert_eq!(report.tally.halved_steps, 0, "{report}");
        resumes_bit_by_bit(&case, 1, &["rheology"]);
    }
}
