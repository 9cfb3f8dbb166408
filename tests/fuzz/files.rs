//! Mutated checkpoints, lists of particles and tables of results: all are read, or refused with a message.
//!
//! `cargo xtask fuzz --checkpoints 100000 --tables 100000` tries more of them than usual.

use std::fs;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use gluey::table::NumberTable;
use gluey::{
    Case, Checkpoint, CheckpointSummary, Progress, ProgressState, RunError, RunOptions, Silent, run,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

/// What stands before the compressed part: what it is, the layout, the digest of the rest.
const HEAD: usize = 12;
const DIGEST: usize = 32;

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn random() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(setting("GLUEY_FUZZ_SEED", 2010))
}

/// Changes bytes, or takes out, doubles or overwrites a stretch of them.
fn mutate(bytes: &mut Vec<u8>, random: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        return bytes.push(random.random_range(0..=255));
    }
    let begin = random.random_range(0..bytes.len());
    let end = (begin + random.random_range(1..=16)).min(bytes.len());
    match random.random_range(0..8) {
        0 | 1 => bytes[begin] = random.random_range(0..=255),
        2 => bytes[begin] ^= 1 << random.random_range(0..8),
        3 => _ = bytes.drain(begin..end),
        4 => {
            let copy = bytes[begin..end].to_vec();
            bytes.splice(begin..begin, copy);
        }
        // Lengths and numbers that are as large as can be.
        5 => bytes[begin..end].fill(0xff),
        6 => bytes[begin..end].fill(0),
        _ => bytes.truncate(begin),
    }
}

/// A checkpoint of the compressed part that `payload` gives, with the digest that belongs to it.
fn signed(head: &[u8], payload: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    ZlibEncoder::new(payload, Compression::fast()).read_to_end(&mut body).expect("compressed");
    [head, blake3::hash(&body).as_bytes(), &body].concat()
}

/// Stops a run at once.
struct Stop(Arc<AtomicBool>);

impl Progress for Stop {
    fn report(&self, _: &ProgressState) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A run that stopped after some steps, of which there is a checkpoint and the rows.
fn stopped_run(case: &Case, folder: &Path) -> RunOptions {
    let interrupt = Arc::new(AtomicBool::new(false));
    let options = RunOptions {
        checkpoint: Some(folder.join("c.checkpoint")),
        interrupt: Some(interrupt.clone()),
        ..RunOptions::csv(folder.join("t.csv"))
    };
    assert!(matches!(run(case, &options, &Stop(interrupt)), Err(RunError::Interrupted(_))));
    RunOptions { interrupt: None, resume: options.checkpoint.clone(), ..options }
}

/// One step more from a checkpoint that may hold anything, beside rows that may not be its own.
fn go_on(case: &Case, options: &RunOptions, rows: &[(std::path::PathBuf, Vec<u8>)]) -> bool {
    rows.iter().for_each(|(path, bytes)| fs::write(path, bytes).expect("rows"));
    let is_done = run(case, options, &Silent).is_ok();
    let _ = fs::remove_file(&options.csv);
    is_done
}

#[test]
fn no_checkpoint_panics() {
    let count = setting("GLUEY_FUZZ_CHECKPOINTS", 3000);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");
    let mut case = Case::load(file).expect("a case");
    let folder = TempDir::new().expect("a folder");
    let options = stopped_run(&case, folder.path());
    case.time.end = 3.0 * case.time.step;
    let path = options.resume.clone().expect("a checkpoint");
    let good = fs::read(&path).expect("a checkpoint");
    let entries = fs::read_dir(folder.path()).expect("a folder").map(|entry| entry.expect("an entry").path());
    let is_rows = |path: &std::path::PathBuf| path.to_string_lossy().contains("partial");
    let rows: Vec<_> =
        entries.filter(is_rows).map(|path| (path.clone(), fs::read(&path).expect("rows"))).collect();
    let (head, rest) = good.split_at(HEAD);
    let mut payload = Vec::new();
    ZlibDecoder::new(&rest[DIGEST..]).read_to_end(&mut payload).expect("a payload");
    assert!(signed(head, &payload).len() > 100 && go_on(&case, &options, &rows), "the good one is none");
    let (mut random, mut reached, mut slowest) = (random(), [0; 3], 0.0f64);
    for number in 0..count {
        // Every fourth is a file that was damaged; the others look whole and hold something else.
        let mut bytes = if number % 4 == 0 { good.clone() } else { payload.clone() };
        (0..random.random_range(1..=3)).for_each(|_| mutate(&mut bytes, &mut random));
        let bytes = if number % 4 == 0 { bytes } else { signed(head, &bytes) };
        fs::write(&path, &bytes).expect("a file");
        let start = Instant::now();
        let follow = || {
            let summary = CheckpointSummary::read(&path);
            match (summary, Checkpoint::<3>::read(&case, &path)) {
                (_, Ok(_)) => 1 + usize::from(go_on(&case, &options, &rows)),
                _ => 0,
            }
        };
        let outcome = catch_unwind(AssertUnwindSafe(follow));
        slowest = slowest.max(start.elapsed().as_secs_f64());
        match outcome {
            Ok(stage) => reached[stage] += 1,
            Err(_) => {
                let kept = std::env::temp_dir().join("gluey-fuzz.checkpoint");
                fs::write(&kept, bytes).expect("a file");
                panic!("checkpoint {number} is in {}", kept.display());
            }
        }
    }
    let memory = gluey::memory::peak();
    println!("{reached:?} refused, read, gone on from; slowest {slowest} s; memory {memory:?}");
    assert!(slowest < 10.0 && memory.is_none_or(|bytes| bytes < 1_000_000_000), "{slowest} s, {memory:?}");
    assert!(reached[0] > 0 && reached[1] + reached[2] > 0, "{reached:?}");
}

#[test]
fn no_list_of_particles_and_no_table_panics() {
    let count = setting("GLUEY_FUZZ_TABLES", 5000);
    let folder = TempDir::new().expect("a folder");
    let (list, case) = (folder.path().join("list.csv"), folder.path().join("case.toml"));
    let text = "name = \"x\"\ndimension = 2\nparticles_file = \"list.csv\"\n[time]\nstep = 0.1\nend = 1.0\n";
    let particles = "# discs\nx,y,radius\n0.1,0.2,0.05\n3e-1,0.4,0.06\n0.5,0.5,0.05\n\n0.8,0.8,0.02\n";
    let table = include_str!("../../data/reference/pair2d_trajectory.csv");
    let start: String = table.lines().take(12).flat_map(|line| [line, "\n"]).collect();
    let (mut random, mut read) = (random(), [0; 2]);
    for number in 0..count {
        let mut bytes = if number % 2 == 0 { particles.into() } else { start.clone().into_bytes() };
        (0..random.random_range(1..=2)).for_each(|_| mutate(&mut bytes, &mut random));
        fs::write(&list, &bytes).expect("a file");
        let shown = String::from_utf8_lossy(&bytes).into_owned();
        let outcome = catch_unwind(|| match Case::parse(text, &case) {
            Ok(case) => usize::from(!case.particles.is_empty()),
            Err(error) => {
                let told = error.to_string();
                assert!(told.contains("case.toml:3:") || told.contains("list.csv:"), "{error}");
                0
            }
        });
        let table = catch_unwind(|| NumberTable::parse(&shown).is_ok());
        match (outcome, table) {
            (Ok(is_read), Ok(_)) => read[is_read] += 1,
            _ => panic!("file {number}:\n{shown}"),
        }
    }
    println!("{read:?} refused, read");
    assert!(read.iter().all(|&files| files > count / 100), "{read:?}");
}
