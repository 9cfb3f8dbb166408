//! The examples run, on smaller cases, and their pictures show discs that do not overlap and the contacts
//! between them.
// Both examples draw with the same file.
#![allow(clippy::duplicate_mod)]

// Their `main` functions are not called here.
#[allow(dead_code)]
#[path = "../../examples/settle.rs"]
mod settle;
#[allow(dead_code)]
#[path = "../../examples/shear.rs"]
mod shear;

/// The values of an attribute in all elements of one kind.
fn values(svg: &str, element: &str, attribute: &str) -> Vec<f64> {
    let elements = svg.lines().filter(|line| line.starts_with(&format!("<{element} ")));
    let value = |line: &str| -> f64 {
        let rest = line.split(&format!(" {attribute}=\"")).nth(1).expect("the attribute");
        rest.split('"').next().and_then(|text| text.parse().ok()).expect("a number")
    };
    elements.map(value).collect()
}

fn check(svg: &str, disc_count: usize, least_contact_count: usize) {
    let [x, y, r] = ["cx", "cy", "r"].map(|name| values(svg, "circle", name));
    assert_eq!(x.len(), disc_count);
    for j in 0..x.len() {
        for i in 0..j {
            let gap = (x[j] - x[i]).hypot(y[j] - y[i]) - (r[i] + r[j]);
            assert!(gap > -3e-4, "discs {i} and {j} overlap: {gap}");
        }
        assert!(y[j] > r[j] - 2e-4, "disc {j} is in the floor");
    }
    let lines = values(svg, "line", "stroke-width");
    assert!(lines.len() >= least_contact_count, "{} contacts", lines.len());
    assert!(lines.iter().all(|width| (0.03..=0.71).contains(width)));
}

#[test]
fn settle_makes_a_heap() {
    let svg = settle::settle(96, 10.0).unwrap_or_else(|error| panic!("{error}"));
    check(&svg, 96, 150);
    let highest = values(&svg, "circle", "cy").into_iter().fold(0.0, f64::max);
    assert!(highest < 9.0, "the heap is {highest} high");
}

#[test]
fn shear_makes_contacts_across_the_border() {
    let svg = shear::shear(8, 6, 1.0).unwrap_or_else(|error| panic!("{error}"));
    // A copy on either side of the period.
    check(&svg, 3 * 48, 72);
    assert!(svg.contains("#1f5fbf") || svg.contains("#c0271d"));
}

#[test]
fn a_thousand_discs_begin_to_settle() {
    // In the 14th step contact pushes discs farther than was searched; with the pairs that are found then,
    // others farther. Searches must not take turns for ever.
    let svg = settle::settle(1000, 5.0).unwrap_or_else(|error| panic!("{error}"));
    check(&svg, 1000, 100);
}
