//! Many particles: what is written, and the time that takes, are proportional to their number.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::output::PairForces;
use gluey::output::csv::CsvWriter;
use gluey::{Case, Ended, Progress, ProgressState, RunError, RunOptions, Silent, TrajectoryRow};
use gluey_contact::Domain;
use gluey_geom::{Particle, Spin, Twist, Vector};
use gluey_testkit::cpu_seconds;
use gluey_testkit::packing::Packing;
use tempfile::TempDir;

use crate::runs::run;

const STEP_COUNT: usize = 10;

/// Bytes of both files, and the CPU seconds of the fastest row, of spheres in a periodic box.
fn output_of(count: usize) -> (u64, u64, f64) {
    let folder = TempDir::new().expect("a folder");
    let packing = Packing::<3>::fluid(count, 0.3, 1);
    let domain = Domain::periodic(&Vector::repeat(packing.side));
    let mut particles: Vec<_> = packing.positions.iter().map(|&x| Particle::new(x, 0.5)).collect();
    let twists = vec![Twist { velocity: Vector::zeros(), spin: Spin::<3>::new(0.0, 0.0, -0.5) }; count];
    let mut writer = CsvWriter::create::<3>(&folder.path().join("t.csv"), count, false).expect("files");
    let mut fastest = f64::INFINITY;
    for step in 0..=STEP_COUNT {
        let row = TrajectoryRow {
            time: 0.01 * step as f64,
            particles: &particles,
            twists: &twists,
            domain: &domain,
        };
        let start = cpu_seconds();
        let smallest = writer.write(&row, &PairForces::default()).expect("a row").expect("a pair");
        fastest = fastest.min(cpu_seconds() - start);
        let direct = row.pairs().map(|(i, j)| row.gap(i, j)).fold(f64::INFINITY, f64::min);
        assert_eq!(smallest, direct / row.mean_radius());
        particles.iter_mut().for_each(|p| p.pose.position.x += 0.01 * p.pose.position.y);
    }
    writer.finish().expect("complete");
    let size = |name: &str| fs::metadata(folder.path().join(name)).expect("a file").len();
    (size("t.csv"), size("t-gaps.csv"), fastest)
}

#[test]
fn output_grows_with_the_number_of_particles_and_no_faster() {
    let counts = [50, 100, 200];
    let sizes = counts.map(output_of);
    for (count, (rows, gaps, time)) in counts.iter().zip(sizes) {
        println!(
            "{count} spheres, {STEP_COUNT} steps: {rows} bytes of rows, {gaps} of near pairs, {:.0} us a row",
            1e6 * time
        );
    }
    let [few, _, many] = sizes;
    // Four times as many particles; all pairs would be sixteen times as many.
    let growth = [many.0 as f64 / few.0 as f64, many.1 as f64 / few.1 as f64];
    assert!(growth.iter().all(|growth| (3.5..4.5).contains(growth)), "{growth:?}");
    assert!(many.2 < 8.0 * few.2, "{:?} and {:?}", few.2, many.2);
}

/// Twelve discs in a channel, on a mesh as coarse as can be.
fn twelve() -> Case {
    let places = (0..12).map(|n| (0.12 + 0.25 * f64::from(n % 4), 0.15 + 0.35 * f64::from(n / 4)));
    let particles: Vec<String> =
        places.map(|(x, y)| format!("{{ position = [{x}, {y}], radius = 0.085 }}")).collect();
    let text = format!(
        r#"
name = "twelve"
dimension = 2
domain.boundary = "periodic"
particles = [{}]
time = {{ step = 0.05, end = 0.3 }}
flow.mesh = {{ cells_per_radius = 1.0 }}
"#,
        particles.join(", ")
    );
    Case::parse(&text, "case.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Interrupts a run when it has reached a step.
struct StopAt(usize, Arc<AtomicBool>);

impl Progress for StopAt {
    fn report(&self, state: &ProgressState) {
        self.1.store(state.step >= self.0, Ordering::Relaxed);
    }
}

/// With files of near pairs, too, a run that was interrupted ends as one that was not.
#[test]
fn many_particles_resume_bit_by_bit() {
    let folder = TempDir::new().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let case = twelve();
    let one =
        run(&case, &RunOptions::csv(path("whole.csv")), &Silent).unwrap_or_else(|error| panic!("{error}"));
    let checkpoint = Some(path("c.checkpoint"));
    let options = RunOptions { checkpoint: checkpoint.clone(), ..RunOptions::csv(path("t.csv")) };
    let interrupt = Arc::new(AtomicBool::new(false));
    let stopped = RunOptions { interrupt: Some(interrupt.clone()), ..options.clone() };
    match run(&case, &stopped, &StopAt(2, interrupt)) {
        Err(RunError::Interrupted(Ended { step: 3, .. })) => {}
        other => panic!("{other:?}"),
    }
    let two = run(&case, &RunOptions { resume: checkpoint, ..options }, &Silent);
    let two = two.unwrap_or_else(|error| panic!("{error}"));
    let read = |path: &Path| fs::read_to_string(path).expect("a file");
    assert_eq!(read(&path("whole.csv")), read(&path("t.csv")));
    assert_eq!(read(&path("whole-gaps.csv")), read(&path("t-gaps.csv")));
    assert!(
        read(&path("t-gaps.csv")).contains(",particle\n") && read(&path("t-gaps.csv")).contains(",wall\n")
    );
    assert_eq!(
        (one.steps, one.min_gap_over_a, one.end_gap_over_a, one.reversibility_error),
        (two.steps, two.min_gap_over_a, two.end_gap_over_a, two.reversibility_error)
    );
}
