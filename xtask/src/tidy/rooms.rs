//! Rooms of a crate, lowest first, and no import cycles between its files.

use std::collections::{BTreeMap, BTreeSet};

use super::law::Law;
use super::modules::{self, Use};
use super::sources::SourceFile;

/// Uses of higher rooms, rooms that the law does not list, listed ones that do not exist, and cycles, in the
/// crates in these folders.
pub fn offences(law: &Law, folders: &[String], sources: &[SourceFile]) -> anyhow::Result<Vec<String>> {
    let name = |folder: &str| folder.strip_prefix("crates/").unwrap_or(folder).to_owned();
    let is_unknown = |listed: &&String| !folders.iter().any(|folder| name(folder) == **listed);
    let unknown = law.rooms.keys().filter(is_unknown);
    let mut offences: Vec<String> =
        unknown.map(|name| format!("ARCHITECTURE.md: rooms of `{name}`, which is not a crate")).collect();
    for crate_folder in folders {
        let folder = format!("{crate_folder}/src");
        let rooms = law.rooms.get(&name(crate_folder)).map_or(&[][..], Vec::as_slice);
        let uses = modules::uses(&folder, sources)?;
        offences.extend(unknown_rooms(&folder, rooms, sources));
        offences.extend(uses.iter().filter_map(|used| upward(&folder, rooms, used)));
        offences.extend(cycles(&uses));
    }
    Ok(offences)
}

/// The room of a file: what lies directly under `folder`; none for the roots of the crate and its programs.
fn room_of<'a>(folder: &str, file: &'a str) -> Option<&'a str> {
    let own = file.strip_prefix(folder)?.strip_prefix('/')?;
    let room = own.split('/').next()?;
    let room = room.strip_suffix(".rs").unwrap_or(room);
    (!["lib", "main", "bin"].contains(&room)).then_some(room)
}

fn unknown_rooms(folder: &str, rooms: &[String], sources: &[SourceFile]) -> Vec<String> {
    let found: BTreeSet<&str> = sources.iter().filter_map(|source| room_of(folder, &source.path)).collect();
    let unlisted = found.iter().filter(|room| !rooms.iter().any(|listed| listed == *room));
    let missing = rooms.iter().filter(|room| !found.contains(room.as_str()));
    let unlisted = unlisted.map(|room| format!("{folder}: `{room}` is not in the rooms of ARCHITECTURE.md"));
    unlisted.chain(missing.map(|room| format!("ARCHITECTURE.md: {folder} has no room `{room}`"))).collect()
}

fn upward(folder: &str, rooms: &[String], used: &Use) -> Option<String> {
    let height = |file: &str| match room_of(folder, file) {
        Some(room) => rooms.iter().position(|listed| listed == room).unwrap_or(rooms.len()),
        None => rooms.len(),
    };
    let Use { from, line, to } = used;
    (height(to) > height(from)).then(|| format!("{from}:{line}: uses {to}, which lies in a higher room"))
}

/// Each set of files that all use each other, directly or through others, with one line for the set.
fn cycles(uses: &[Use]) -> Vec<String> {
    let files: BTreeSet<&str> = uses.iter().map(|used| &*used.from).collect();
    let reached: BTreeMap<_, _> = files.iter().map(|file| (*file, reachable(file, uses))).collect();
    let is_both = |a: &str, b: &str| reached[a].contains(b) && reached[b].contains(a);
    let in_cycle = files.iter().filter(|file| is_both(file, file));
    let set = |a: &&str| files.iter().copied().filter(|b| is_both(a, b)).collect::<Vec<_>>();
    let sets: BTreeSet<Vec<&str>> = in_cycle.map(set).collect();
    sets.into_iter().map(|files| format!("import cycle: {}", files.join(" <-> "))).collect()
}

/// All files that `start` uses, directly or through others.
fn reachable<'a>(start: &'a str, uses: &'a [Use]) -> BTreeSet<&'a str> {
    let (mut found, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(file) = open.pop() {
        let next = uses.iter().filter(|used| used.from == file).map(|used| &*used.to);
        open.extend(next.filter(|file| found.insert(*file)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::modules::tests::sources;
    use super::*;

    fn offences(rooms: &[&str], files: &[(&str, &str)]) -> Vec<String> {
        let mut law = Law::default();
        law.rooms.insert("a".into(), rooms.iter().map(|room| (*room).to_owned()).collect());
        super::offences(&law, &["crates/a".to_owned()], &sources(files)).unwrap()
    }

    #[test]
    fn a_lower_room_that_uses_a_higher_one_is_named() {
        let files =
            [("lib.rs", "mod b;\nmod c;\n"), ("b.rs", "\nuse crate::c::C;\n"), ("c.rs", "pub struct C;\n")];
        let found = offences(&["b", "c"], &files);
        assert_eq!(found, ["crates/a/src/b.rs:2: uses crates/a/src/c.rs, which lies in a higher room"]);
        assert!(offences(&["c", "b"], &files).is_empty());
    }

    #[test]
    fn the_root_lies_above_all_rooms() {
        let files = [("lib.rs", "mod b;\npub struct A;\n"), ("b.rs", "use crate::A;\n")];
        assert_eq!(offences(&["b"], &files).len(), 1);
    }

    #[test]
    fn rooms_and_law_name_each_other() {
        let files = [("lib.rs", "mod b;\nmod c;\n"), ("b/mod.rs", ""), ("c.rs", ""), ("main.rs", "")];
        assert!(offences(&["b", "c"], &files).is_empty());
        assert_eq!(offences(&["b"], &files).len(), 1);
        assert_eq!(offences(&["b", "c", "d"], &files).len(), 1);
    }

    #[test]
    fn cycles_are_found_inside_a_room() {
        let files = [
            ("lib.rs", "mod b;\n"),
            ("b/mod.rs", "mod x;\nmod y;\nmod z;\n"),
            ("b/x.rs", "use super::y::Y;\npub struct X;\n"),
            ("b/y.rs", "use super::z::Z;\npub struct Y;\n"),
            ("b/z.rs", "fn f(_: super::x::X) {}\npub struct Z;\n"),
        ];
        let found = offences(&["b"], &files);
        let file = |name: &str| format!("crates/a/src/b/{name}.rs");
        assert_eq!(found, [format!("import cycle: {} <-> {} <-> {}", file("x"), file("y"), file("z"))]);
        assert!(offences(&["b"], &files[..4]).is_empty());
    }
}
