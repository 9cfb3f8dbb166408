//! The blocks of ARCHITECTURE.md that machines read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::Context;

use super::sources;

/// Rules of ARCHITECTURE.md.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Law {
    /// For each crate of the workspace, those it may depend on.
    pub arrows: BTreeMap<String, BTreeSet<String>>,
    /// For each crate, those its tests may use besides.
    pub test_arrows: BTreeMap<String, BTreeSet<String>>,
    /// For each confined library, the paths under which its name may be used.
    pub confined: BTreeMap<String, Vec<String>>,
    /// For each folder of a crate that has them, its rooms, lowest first.
    pub rooms: BTreeMap<String, Vec<String>>,
}

impl Law {
    /// Reads the law.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::parse(&sources::text(path)?).context("ARCHITECTURE.md")
    }

    fn parse(text: &str) -> anyhow::Result<Self> {
        let mut law = Self::default();
        for line in block(text, "arrows")? {
            let (map, mark) =
                if line.contains("~>") { (&mut law.test_arrows, "~>") } else { (&mut law.arrows, "->") };
            let (from, to) = split(line, mark)?;
            map.entry(from).or_default().extend(to);
        }
        for line in block(text, "confined")? {
            let (name, paths) = split(line, " in ")?;
            law.confined.insert(name, paths);
        }
        for line in block(text, "rooms")? {
            let (name, rooms) = split(line, ":")?;
            law.rooms.insert(name, rooms.into_iter().filter(|word| word != "<").collect());
        }
        Ok(law)
    }
}

/// Lines that say something in the fenced block with this name.
fn block<'a>(text: &'a str, name: &str) -> anyhow::Result<Vec<&'a str>> {
    let fence = format!("```{name}");
    let mut lines = text.lines().skip_while(|line| *line != fence);
    lines.next().with_context(|| format!("there is no block `{fence}`"))?;
    Ok(lines.take_while(|line| *line != "```").filter(|line| !line.trim().is_empty()).collect())
}

fn split(line: &str, mark: &str) -> anyhow::Result<(String, Vec<String>)> {
    let parts = line.split_once(mark);
    let (name, rest) = parts.with_context(|| format!("`{line}` does not contain `{mark}`"))?;
    Ok((name.trim().to_owned(), rest.split_whitespace().map(str::to_owned).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_read_and_their_absence_is_an_error() {
        let law = Law::parse(
            "```arrows\na -> b c\nb ->\na ~> d\n```\n```confined\nx in p/q r\n```\n```rooms\na: s < t\n```\n",
        )
        .unwrap();
        assert_eq!(law.arrows["a"], BTreeSet::from(["b".to_owned(), "c".to_owned()]));
        assert!(law.arrows["b"].is_empty());
        assert_eq!(law.test_arrows["a"], BTreeSet::from(["d".to_owned()]));
        assert_eq!(law.confined["x"], ["p/q", "r"]);
        assert_eq!(law.rooms["a"], ["s", "t"]);
        assert!(Law::parse("no blocks").is_err());
        assert!(Law::parse("```arrows\na to b\n```\n```confined\n```\n```rooms\n```\n").is_err());
    }
}
