//! `cargo xtask tidy`: does the code keep the law of ARCHITECTURE.md and the rules of the house?

mod arrows;
mod confined;
mod law;
mod modules;
mod rooms;
mod shape;
mod sources;
mod style;
mod types;
mod unused;

use std::path::Path;

/// Prints all offences; whether the workspace is tidy.
pub fn run(root: &Path) -> anyhow::Result<bool> {
    let offences = offences(root)?;
    offences.iter().for_each(|offence| eprintln!("{offence}"));
    Ok(offences.is_empty())
}

/// All offences, each with its place; an empty list is a tidy workspace.
fn offences(root: &Path) -> anyhow::Result<Vec<String>> {
    let law = law::Law::read(&root.join("ARCHITECTURE.md"))?;
    let sources = sources::all(root)?;
    let metadata = arrows::metadata(root)?;
    let mut offences = arrows::offences(&law, &metadata);
    offences.extend(unused::offences(root, &metadata, &sources));
    offences.extend(confined::offences(&law, &sources));
    offences.extend(rooms::offences(&law, &metadata.folders(root), &sources)?);
    offences.extend(style::offences(&sources));
    offences.extend(shape::offences(&sources)?);
    offences.extend(types::offences(&sources)?);
    Ok(offences)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_workspace_is_tidy() {
        let offences = super::offences(&crate::workspace_root()).unwrap();
        assert!(offences.is_empty(), "\n{}", offences.join("\n"));
    }
}
