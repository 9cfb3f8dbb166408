//! `bench-stokes` prints one line of JSON that holds together, and refuses bad options.

use std::process::{Command, Output};

use serde_json::Value;

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bench-stokes")).args(arguments).output().expect("it runs")
}

/// The report of a run that must succeed: one line, and nothing beside it where no terminal is.
fn report(arguments: &[&str]) -> Value {
    let output = bench(arguments);
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success() && stderr.is_empty(), "{arguments:?}: {stderr}");
    let stdout = String::from_utf8(output.stdout).expect("text");
    assert_eq!(stdout.trim_end().lines().count(), 1, "{stdout}");
    serde_json::from_str(&stdout).expect("JSON")
}

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"))
}

fn vectors(report: &Value, key: &str) -> Vec<Vec<f64>> {
    serde_json::from_value(report[key].clone()).expect("a list of lists")
}

#[test]
fn reports_hold_together() {
    for (arguments, particles) in [
        (["--case", "C2", "--n", "16", "--formulation", "unfitted"], 0),
        (["--case", "S2", "--n", "64", "--formulation", "unfitted"], 2),
        (["--case", "S2", "--n", "64", "--formulation", "paper"], 2),
        (["--case", "C3", "--n", "8", "--formulation", "paper"], 0),
        (["--case", "M3", "--n", "16", "--formulation", "unfitted"], 27),
    ] {
        let report = report(&arguments);
        let (case, n) = (arguments[1], arguments[3].parse::<f64>().expect("a number"));
        assert_eq!((&report["case"], &report["formulation"]), (&case.into(), &arguments[5].into()));
        assert_eq!(number(&report, "n"), n);
        let dimension = if case.ends_with('2') { 2 } else { 3 };
        let dofs = f64::from(dimension) * (2.0 * n + 1.0).powi(dimension) + (n + 1.0).powi(dimension);
        assert_eq!((number(&report, "dofs"), number(&report, "cells")), (dofs, n.powi(dimension)));
        assert!(number(&report, "residual_rel") <= 1e-8 && number(&report, "residual_rel") > 0.0);
        let iterations = number(&report, "iterations");
        assert!(iterations > 3.0 && number(&report, "fine_operator_applications") > 2.0 * iterations);
        for key in ["setup_s", "solve_s", "triad_gb_s"] {
            assert!(number(&report, key) > 0.0, "{key}");
        }
        assert!(number(&report, "levels") >= 2.0);
        let twists = [vectors(&report, "velocities"), vectors(&report, "spins")];
        assert!(twists.iter().all(|list| list.len() == particles));
        assert!(twists[0].iter().all(|v| v.len() == dimension as usize));
        assert!(twists[1].iter().all(|w| w.len() == if dimension == 2 { 1 } else { 3 }));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn rates_follow_from_seconds() {
    let report = report(&["--case", "c3", "--n", "8", "--tol", "1e-6"]);
    let rate = number(&report, "dofs") / number(&report, "solve_cpu_s");
    assert!((number(&report, "dofs_per_s") / rate - 1.0).abs() < 1e-9);
    let ratio = rate / number(&report, "triad_gb_s");
    assert!((number(&report, "dofs_per_triad_gb") / ratio - 1.0).abs() < 1e-9);
    assert!(number(&report, "operator_dofs_per_s") > rate);
    assert!(number(&report, "peak_rss_mb") > 1.0);
    assert!(number(&report, "residual_rel") > 1e-8, "no tighter than asked for");
}

/// The two discs of figure 5 turn as a pair, in the mirror of each other.
#[test]
fn adaptive_and_uniform_meshes_and_any_threads_say_the_same() {
    let uniform = report(&["--case", "S2", "--n", "64"]);
    let adaptive = report(&["--case", "S2", "--n", "64", "--adaptive"]);
    let threaded = report(&["--case", "S2", "--n", "64", "--threads", "2"]);
    assert!(number(&adaptive, "cells") < 0.3 * number(&uniform, "cells"));
    assert_eq!(number(&threaded, "threads"), 2.0);
    for key in ["velocities", "spins"] {
        assert_eq!(uniform[key], threaded[key], "not the same bits");
        let (a, b) = (vectors(&uniform, key), vectors(&adaptive, key));
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < 2e-3, "{key}: {a} {b}");
        }
    }
    let spin = vectors(&uniform, "spins")[0][0];
    assert!((-0.5..-0.2).contains(&spin), "{spin}");
}

#[test]
fn bad_options_are_refused() {
    for (arguments, expected) in [
        (&["--case", "S2", "--n", "48"][..], "power of two"),
        (&["--case", "S2", "--n", "-64"], "power of two"),
        (&["--case", "S2"], "--n"),
        (&["--n", "64"], "--case"),
        (&["--case", "S4", "--n", "64"], "S4"),
        (&["--case", "S2", "--n", "64", "--formulation", "soft"], "soft"),
        (&["--case", "S2", "--n", "64", "--tol", "0"], "between 0 and 1"),
        (&["--case", "S2", "--n", "64", "--tol", "-1e-8"], "between 0 and 1"),
        (&["--case", "S2", "--n", "64", "--tol", "NaN"], "between 0 and 1"),
        (&["--case", "S2", "--n", "64", "--threads", "0"], "--threads"),
        (&["--case", "S2", "--n", "64", "--formulation", "paper", "--contrast", "1"], "larger than 1"),
        (&["--case", "S2", "--n", "64", "--formulation", "paper", "--contrast", "NaN"], "larger than 1"),
        (&["--case", "S2", "--n", "64", "--formulation", "paper", "--contrast", "-2"], "larger than 1"),
        (&["--case", "S2", "--n", "8"], "refine the mesh"),
        (&["--case", "S2", "--n", "9223372036854775808"], "level"),
        (&["--case", "S2", "--n", "64", "--fast"], "--fast"),
    ] {
        let output = bench(arguments);
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert!(!output.status.success() && output.stdout.is_empty(), "{arguments:?}");
        assert!(stderr.contains(expected), "{arguments:?}: `{expected}` is not in: {stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
    }
}
