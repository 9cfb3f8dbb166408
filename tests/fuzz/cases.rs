//! Mutated case files, from text to the first mesh: whatever stands in them is either refused with a message
//! or can be set up, in little time and memory.
//!
//! `cargo xtask fuzz --cases 1000000` tries more of them than usual, `--seed` others: the same seed gives the
//! same texts on every machine. What came of long runs is in `docs/robustness.md`.

use std::panic::catch_unwind;
use std::time::Instant;

use crate::follow::{case_text, generates_many};
use gluey::Case;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SHIPPED: [&str; 6] = [
    include_str!("../../data/cases/pair-2d.toml"),
    include_str!("../../data/cases/pair-3d.toml"),
    include_str!("../../data/cases/pair-3d-mobility.toml"),
    include_str!("../../data/cases/trio-2d.toml"),
    include_str!("../../data/cases/trio-2d-couette.toml"),
    SUSPENSION,
];

/// Particles that are generated, in a moment.
const SUSPENSION: &str = r#"name = "many"
version = 1
dimension = 2
[domain]
boundary = "sheared"
[suspension]
volume_fraction = 0.3
count = 16
arrangement = "equilibrium"
sweeps = 3
seed = 1
min_gap = 0.01
jitter = 0.0
radii = { kind = "bidisperse", ratio = 1.4, large_number = 0.5 }
[time]
step = 0.02
end = 5.0
[flow]
formulation = "unfitted"
[flow.mesh]
cells_per_radius = 2.0
root_cells = 1
[rheology]
every = 2
"#;

/// Every key of a case that lists its particles.
const FULL: &str = r#"name = "full"
dimension = 2
shear_rate = 1.0
[domain]
lower = [0.0, 0.0]
upper = [2.0, 1.0]
boundary = "periodic"
[[particles]]
position = [0.451, 0.51]
radius = 0.05
[[particles]]
position = [1.549, 0.49]
radius = 0.08
[time]
step = 0.025
end = 30.0
scheme = "adams-bashforth-2"
reverse_at = 8.0
[contact]
strategy = "gluey"
exact_gap = true
memory = "consistent"
gamma_min = -1.0
threshold = 1e-4
solver = "auto"
tolerance = 1e-13
[flow]
hydrodynamics = "stokes"
formulation = "paper"
solver = "auto"
tolerance = 1e-6
[flow.mesh]
cells_per_radius = 3.2
coarsest_level = 3
band = 2.0
[flow.paper]
viscosity_ratio = 1e3
uzawa_steps = 1
rho = 1.0
ramp = 1.0
[flow.pair-mobility]
gap_offset = 0.0
"#;

const NUMBERS: &[&str] = &[
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "3",
    "16",
    "17",
    "0.5",
    "1.5",
    "0.1",
    "1e-9",
    "1e-17",
    "1e-200",
    "5e-324",
    "1e5",
    "65536.0",
    "262144.0",
    "262145.0",
    "4e9",
    "4294967296",
    "4294967295.0",
    "1e15",
    "1e18",
    "1e100",
    "1e200",
    "1.7e308",
    "-1.7e308",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "9223372036854775808",
    "0.3333333333333333",
    "0.1000000000000001",
    "1_000",
    "0x10",
    "1e",
    "--1",
];
const VALUES: &[&str] = &[
    "true",
    "\"\"",
    "\"gluey\"",
    "\"none\"",
    "\"periodic\"",
    "\"couette\"",
    "\"pair-mobility\"",
    "\"stokes\"",
    "\"paper\"",
    "\"rigid-dofs\"",
    "\"direct\"",
    "\"uzawa\"",
    "\"velocity-correction\"",
    "[]",
    "[[]]",
    "{}",
    "[1e300, 1e-300]",
    "[nan, 0.5]",
    "[0.5, 0.5, 0.5]",
    "1979-05-27",
    "'''x'''",
    "\"\\u0000\"",
    "",
    "\"trio2d_trajectory\"",
    "\"pair3d_trajectory_box\"",
];

/// Most seconds that a text may take, and most memory of the whole program in bytes.
const MOST_SECONDS: f64 = 30.0;
const MOST_MEMORY: u64 = 1_000_000_000;

fn pick<T: Copy>(random: &mut ChaCha8Rng, from: &[T]) -> T {
    from[random.random_range(0..from.len())]
}

/// Where numbers begin and end.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices().chain([(text.len(), ' ')]) {
        let belongs = c.is_ascii_digit() || (start.is_some() && matches!(c, '.' | 'e' | '-'));
        match (belongs, start) {
            (true, None) => start = Some(at),
            (false, Some(begin)) => {
                found.push((begin, at));
                start = None;
            }
            _ => {}
        }
    }
    found
}

fn mutate(text: &str, random: &mut ChaCha8Rng) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let at = random.random_range(0..lines.len().max(1));
    if lines.is_empty() {
        return "name".into();
    }
    match random.random_range(0..16) {
        0..=7 => {
            let places = numbers(text);
            if places.is_empty() {
                return text.to_owned();
            }
            let (start, end) = pick(random, &places);
            return [&text[..start], pick(random, NUMBERS), &text[end..]].concat();
        }
        8 => _ = lines.remove(at),
        9 => lines.insert(at, lines[at].clone()),
        10 => {
            let name = lines[at].split('=').next().unwrap_or("").to_owned();
            lines[at] = lines[at].replacen(&name, pick(random, &["x =", "radius =", "é ", "[", "name"]), 1);
        }
        11 | 12 => {
            let name = lines[at].split('=').next().unwrap_or("").to_owned();
            lines[at] = format!("{name}= {}", pick(random, VALUES));
        }
        13 => {
            let other = random.random_range(0..lines.len());
            lines.swap(at, other);
        }
        14 => lines.truncate(at),
        _ => {
            let mut bytes = text.as_bytes().to_vec();
            let at = random.random_range(0..bytes.len());
            bytes[at] = random.random_range(0..=255);
            return String::from_utf8_lossy(&bytes).into_owned();
        }
    }
    lines.join("\n") + "\n"
}

/// A number that an environment variable sets.
fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
fn no_text_panics_hangs_or_fills_the_memory() {
    let count = setting("GLUEY_FUZZ_CASES", 6000) as usize;
    let mut random = ChaCha8Rng::seed_from_u64(setting("GLUEY_FUZZ_SEED", 2010));
    let (mut reached, mut slowest) = ([0; 3], (0.0, 0));
    for number in 0..count {
        let base = if number % 2 == 0 { FULL } else { SHIPPED[number / 2 % SHIPPED.len()] };
        let mut text = base.to_owned();
        for _ in 0..random.random_range(1..=3) {
            text = mutate(&text, &mut random);
        }
        if generates_many(&text) {
            continue;
        }
        let start = Instant::now();
        match catch_unwind(|| case_text(&text)) {
            Ok(stage) => reached[stage] += 1,
            Err(_) => panic!("text {number}:\n{text}"),
        }
        let seconds = start.elapsed().as_secs_f64();
        assert!(seconds < MOST_SECONDS, "{seconds} s, text {number}:\n{text}");
        slowest = if seconds > slowest.0 { (seconds, number) } else { slowest };
    }
    let memory = gluey::memory::peak();
    println!("{reached:?} refused, read, built; slowest {slowest:?} (seconds, number); memory {memory:?}");
    // Neither all refused nor all accepted.
    assert!(reached.iter().all(|&texts| texts > count / 100), "{reached:?}");
    assert!(memory.is_none_or(|bytes| bytes < MOST_MEMORY), "{memory:?}");
}

#[test]
fn a_box_longer_than_a_tree_can_number_is_refused() {
    for length in ["4e9", "262145.0", "1e300"] {
        let text = FULL.replace("upper = [2.0, 1.0]", &format!("upper = [{length}, 1.0]"));
        let message = Case::parse(&text, "long.toml").expect_err("too long").to_string();
        assert!(message.contains("not a small number of cubes"), "{message}");
    }
}
