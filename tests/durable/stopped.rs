//! What is left of runs that are stopped, and whether it is what there was.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A case of twelve discs, which list near pairs and have a rheology.
pub const DISCS: &str = "name = \"discs\"\ndimension = 2\ndomain = { boundary = \"sheared\" }\n\
    suspension = { volume_fraction = 0.2, count = 12, seed = 3, min_gap = 0.05 }\n\
    contact = { strategy = \"gluey\" }\ntime = { step = 0.05, end = 2.0 }\n\
    [flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = 2.0\ncoarsest_level = 2\n";

/// Whole lines of all files of rows in a folder.
pub fn rows(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_of_rows = |path: &PathBuf| {
        let name = path.to_string_lossy();
        name.contains(".csv") && !name.ends_with(".lock")
    };
    let whole = |path: PathBuf| {
        let mut bytes = fs::read(&path).expect("rows");
        bytes.truncate(bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |place| place + 1));
        (path, bytes)
    };
    paths.filter(is_of_rows).map(whole).collect()
}

/// Numbers below `most`, in no order.
pub fn numbers(mut state: u64) -> impl FnMut(u64) -> u64 {
    move |most| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) % most
    }
}

/// The file, or where it tells of what steps cost the columns that are the same on every run.
fn without_seconds(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).expect("a file");
    if !path.to_string_lossy().ends_with("-solver.csv") {
        return bytes;
    }
    let text = String::from_utf8(bytes).expect("text");
    let kept = text.lines().next().expect("a header").split(',').filter(|name| !name.ends_with("_s")).count();
    let lines = text.lines().map(|line| line.split(',').take(kept).collect::<Vec<_>>().join(","));
    lines.collect::<Vec<_>>().join("\n").into_bytes()
}

/// All results of a run, by name, but those that tell of times and what a kill cut short.
pub fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let is_left_out = |path: &Path| {
        let name = path.to_string_lossy();
        let parts = ["-run.json", ".log", ".checkpoint", ".lock", ".partial-"];
        parts.iter().any(|part| name.contains(part))
    };
    let mut folders = vec![PathBuf::new()];
    let mut found = BTreeMap::new();
    while let Some(inside) = folders.pop() {
        for entry in fs::read_dir(folder.join(&inside)).expect("a folder") {
            let path = inside.join(entry.expect("an entry").file_name());
            match folder.join(&path) {
                full if full.is_dir() => folders.push(path),
                _ if is_left_out(&path) => {}
                full => drop(found.insert(path, without_seconds(&full))),
            }
        }
    }
    found
}

/// The same files with the same bytes, and no half file but for rows of starts before the first checkpoint.
pub fn same_results(killed: &Path, whole: &Path) {
    let (killed_files, whole_files) = (results(killed), results(whole));
    assert_eq!(killed_files.keys().collect::<Vec<_>>(), whole_files.keys().collect::<Vec<_>>());
    for (path, bytes) in &whole_files {
        assert!(killed_files[path] == *bytes, "{} differs", path.display());
    }
    for kind in ["", "discs-gluey-unfitted-vtk", "discs-gluey-unfitted-xyz"] {
        for entry in fs::read_dir(killed.join(kind)).expect("a folder") {
            let name = entry.expect("an entry").file_name().into_string().expect("text");
            assert!(!name.contains(".partial-") || name.contains(".csv.partial-"), "{name} is left");
        }
    }
}
