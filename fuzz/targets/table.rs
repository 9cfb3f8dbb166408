//! Tables of results, and lists of particles.
#![no_main]

use gluey::Case;
use gluey::table::NumberTable;

const CASE: &str =
    "name = \"x\"\ndimension = 2\nparticles_file = \"list.csv\"\n[time]\nstep = 0.1\nend = 1.0\n";

libfuzzer_sys::fuzz_target!(|text: &str| {
    // Either answer will do.
    let _ = NumberTable::parse(text);
    let folder = tempfile::TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("list.csv"), text).expect("a file");
    let _ = Case::parse(CASE, folder.path().join("case.toml"));
});
