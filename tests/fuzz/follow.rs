//! How far a case file that may hold anything is followed: by the tests (`cases.rs`) and by the targets
//! of cargo-fuzz (`fuzz`).

use gluey::Case;
use gluey::flow::{MeshEstimate, MeshSize};

/// Particles and moves that are few enough to generate.
const FEW_PARTICLES: i64 = 200;
const FEW_SWEEPS: i64 = 20;

/// Cells that are few enough to build the mesh.
const FEW_CELLS: f64 = 4000.0;

/// How far a text comes: 0 refused, 1 read, 2 a mesh was built.
pub fn case_text(text: &str) -> usize {
    let case = match Case::parse(text, "fuzz.toml") {
        Ok(case) => case,
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with("fuzz.toml:"), "{message}");
            return 0;
        }
    };
    case.check().expect("a case that was read can be checked again");
    assert!(case.step_count() <= 1_000_000_001 && case.mean_radius() > 0.0);
    assert!(!case.file_stem().is_empty());
    let Some(estimate) = MeshEstimate::of(&case) else { return 1 };
    assert!(estimate.cell_count >= 1.0 && estimate.bytes >= 0.0, "{estimate:?}");
    1 + usize::from(is_built(&case, &estimate))
}

/// Whether a text asks for particles whose generation would take long, as a user may wish.
pub fn generates_many(text: &str) -> bool {
    let Ok(table) = toml::from_str::<toml::Table>(text) else { return false };
    let Some(suspension) = table.get("suspension").and_then(toml::Value::as_table) else { return false };
    let number = |key: &str| suspension.get(key).and_then(toml::Value::as_integer);
    number("count").is_none_or(|count| count > FEW_PARTICLES)
        || number("sweeps").is_none_or(|sweeps| sweeps > FEW_SWEEPS)
}

/// Builds the first mesh, if it is small; whether it was.
fn is_built(case: &Case, estimate: &MeshEstimate) -> bool {
    if estimate.cell_count > FEW_CELLS {
        return false;
    }
    // Refused with a typed error, or built: both are answers.
    if let Ok(Some(MeshSize { cell_count, .. })) = MeshSize::of(case) {
        let ratio = cell_count as f64 / estimate.cell_count;
        assert!((0.3..3.0).contains(&ratio), "{cell_count} cells, {estimate:?}");
    }
    true
}
