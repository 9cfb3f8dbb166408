//! Checkpoints: files that were damaged, and files that look whole and hold something else.
#![no_main]

use std::fs;
use std::io::Read;
use std::sync::OnceLock;

use flate2::Compression;
use flate2::read::ZlibEncoder;
use gluey::{Case, Checkpoint, CheckpointSummary, RunOptions, Silent, run};
use tempfile::TempDir;

/// What stands before the digest: what the file is, and its layout.
const HEAD: usize = 12;
const CASE: &str = "name = \"x\"\ndimension = 3\n\
    particles = [{ position = [0.3, 0.5, 0.5], radius = 0.05 }, { position = [0.7, 0.5, 0.5], radius = 0.05 }]\n\
    time = { step = 0.1, end = 0.2 }\nflow = { hydrodynamics = \"pair-mobility\" }\n";

/// A case, a folder, and how checkpoints begin that this program writes.
fn setting() -> &'static (Case, TempDir, Vec<u8>) {
    static SETTING: OnceLock<(Case, TempDir, Vec<u8>)> = OnceLock::new();
    SETTING.get_or_init(|| {
        let case = Case::parse(CASE, "case.toml").expect("a case");
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("good.checkpoint");
        let options = RunOptions {
            checkpoint: Some(path.clone()),
            checkpoint_every: Some(1),
            ..RunOptions::csv(folder.path().join("good.csv"))
        };
        run(&case, &options, &Silent).expect("a run");
        let head = fs::read(path).expect("a checkpoint")[..HEAD].to_vec();
        (case, folder, head)
    })
}

/// A checkpoint that holds `payload`, with the digest that belongs to it.
fn signed(head: &[u8], payload: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    ZlibEncoder::new(payload, Compression::fast()).read_to_end(&mut body).expect("compressed");
    [head, blake3::hash(&body).as_bytes(), &body].concat()
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else { return };
    let (case, folder, head) = setting();
    let path = folder.path().join("made-up.checkpoint");
    let file = if *first == 0 { rest.to_vec() } else { signed(head, rest) };
    fs::write(&path, file).expect("a file");
    // Either answer will do.
    let _ = CheckpointSummary::read(&path);
    let _ = Checkpoint::<3>::read(case, &path);
});
