//! `cargo xtask keys`: the reference of case files and their JSON schema, made of the code that reads them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use gluey::Case;
use gluey::case::CaseKey;

const HEAD: &str = "\
# Keys of a case file

Made by `cargo xtask keys` of the comments and ranges in [`crates/gluey/src/case.rs`](../crates/gluey/src/case.rs) and the files beside it,
which the loader checks case files against. `gluey schema` prints the same as a JSON schema for editors
([`data/case.schema.json`](../data/case.schema.json)).

Lengths and times are in the units of the box and of the shear rate; the viscosity of the fluid is 1. Keys without a default must be there;
`[[particles]]`, `[suspension]` or `particles_file` must be, one of them. Numbers are finite.
";

/// The files and what is to stand in them, from the folder of the workspace.
pub fn files() -> BTreeMap<PathBuf, String> {
    let schema =
        serde_json::to_string_pretty(Case::schema()).expect("keys are texts, and numbers have a form");
    BTreeMap::from([("docs/case-keys.md".into(), page()), ("data/case.schema.json".into(), schema + "\n")])
}

/// Writes the files.
pub fn write(root: &Path) -> anyhow::Result<()> {
    Ok(files().into_iter().try_for_each(|(path, text)| fs::write(root.join(path), text))?)
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    let keys = Case::keys();
    for part in keys.chunk_by(|a, b| a.table == b.table) {
        let title =
            if part[0].table.is_empty() { "At the top".into() } else { format!("`{}`", part[0].table) };
        let about = if part[0].table.is_empty() { "" } else { &part[0].about };
        // Writing to a text cannot fail.
        let _ = writeln!(page, "\n## {title}\n");
        if !about.is_empty() {
            let _ = writeln!(page, "{}\n", folded(about));
        }
        page.push_str("| key | value | unit | default | meaning |\n|---|---|---|---|---|\n");
        part.iter().for_each(|key| page.push_str(&row(key)));
    }
    page
}

fn row(key: &CaseKey) -> String {
    let CaseKey { name, meaning, values, choices, unit, default, .. } = key;
    let choice = |(name, meaning): &(String, String)| match meaning.as_str() {
        "" => format!("`\"{name}\"`"),
        meaning => format!("`\"{name}\"`: {}", meaning.trim_end_matches('.')),
    };
    let values = match choices[..] {
        [] => values.clone(),
        _ => choices.iter().map(choice).collect::<Vec<_>>().join("<br>"),
    };
    let unit = unit.as_deref().unwrap_or_default();
    let default = default.as_deref().unwrap_or("must be there");
    let cells = [format!("`{name}`"), values, unit.to_owned(), default.to_owned(), meaning.clone()];
    format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | "))
}

/// A text in lines of at most 140 columns.
fn folded(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("there is a line");
        match line.is_empty() {
            true => line.push_str(word),
            false if line.len() + 1 + word.len() <= 140 => line.extend([" ", word]),
            false => lines.push(word.to_owned()),
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_and_the_schema_are_those_of_the_code() {
        for (path, text) in files() {
            let found = fs::read_to_string(crate::workspace_root().join(&path)).unwrap_or_default();
            assert!(found == text, "{} is out of date: cargo xtask keys", path.display());
        }
    }
}
