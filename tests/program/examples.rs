//! The examples run, and what the tutorial (docs/tutorial/suspension-solver.md) says of them holds for the
//! first steps.

#[path = "../../crates/gluey/examples/suspension_solver.rs"]
mod suspension_solver;

use suspension_solver::{Instant, encounter, methods};

/// Radii that two discs of unit radius may lose by rounding.
const ROUNDING: f64 = 1e-12;

/// What the program prints in full, in the tutorial.
const PAGE: &str = include_str!("../../docs/tutorial/suspension-solver.md");

/// The numbers below the name of a method on the page, row by row.
fn rows(name: &str) -> Vec<Vec<f64>> {
    let mut lines = PAGE.lines().skip_while(|line| *line != name).skip(2);
    let numbers = |line: &str| line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>();
    std::iter::from_fn(|| lines.next().and_then(numbers)).collect()
}

/// The encounter goes on to time 2, when the line of centres has not yet turned by 90 degrees. The page has
/// the same numbers, to the digits it shows.
#[test]
fn soft_discs_overlap_and_those_with_contact_or_a_film_do_not() {
    let gaps = methods().map(|method| {
        let instants = encounter(&method, 2.0).expect("an encounter");
        let rows = rows(method.name);
        assert_eq!(rows.len(), 9, "{}", method.name);
        for (row, Instant { time, angle, gap, gamma }) in rows.iter().zip(instants.iter().step_by(40)) {
            for (said, number) in row.iter().zip([time, angle, gap, gamma]) {
                assert!((said - number).abs() < 0.006 * number.abs() + ROUNDING, "{row:?}: {number}");
            }
        }
        let gaps: Vec<f64> = instants.iter().map(|Instant { gap, .. }| *gap).collect();
        let gamma = instants.last().expect("instants").gamma;
        (gaps.into_iter().fold(f64::INFINITY, f64::min), gamma)
    });
    println!("{gaps:?}");
    let [(overlap, _), (closed, gamma), (film, none)] = gaps;
    assert!(overlap < -1e-2, "{overlap}");
    assert!(closed.abs() < ROUNDING && gamma < 0.0, "{closed}, {gamma}");
    assert!((3.4e-4..4.3e-4).contains(&film) && none == 0.0, "{film}, {none}");
}

/// The program as a whole is compiled and not run: it takes most of a minute.
const _: fn() -> Result<(), Box<dyn std::error::Error>> = suspension_solver::main;
