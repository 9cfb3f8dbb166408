//! House rules that a machine can check: no loose ends, no unwrap outside tests, no long files.

use super::sources::SourceFile;

/// Longest file, in lines.
const LONGEST_FILE: usize = 500;
/// Loose ends, in comments and code alike. Written in halves so that this file does not offend.
const LOOSE_ENDS: [&str; 5] = [
    concat!("TO", "DO"),
    concat!("FIX", "ME"),
    concat!("to", "do!("),
    concat!("unimpl", "emented!("),
    concat!("#[ig", "nore"),
];
/// Calls that panic on bad luck.
const PANICS: [&str; 2] = [concat!(".unw", "rap()"), concat!("pa", "nic!(")];

/// All offences against the house rules.
pub fn offences(sources: &[SourceFile]) -> Vec<String> {
    sources.iter().flat_map(of_source).collect()
}

fn of_source(source: &SourceFile) -> Vec<String> {
    let path = &source.path;
    let mut offences = Vec::new();
    if source.lines.len() > LONGEST_FILE {
        offences.push(format!("{path}: {} lines, more than {LONGEST_FILE}", source.lines.len()));
    }
    for (index, line) in source.lines.iter().enumerate() {
        let found = LOOSE_ENDS.iter().filter(|mark| line.contains(**mark));
        offences.extend(found.map(|mark| format!("{path}:{}: `{mark}`", index + 1)));
    }
    for (number, line) in source.code() {
        let found = PANICS.iter().filter(|call| line.contains(**call));
        offences.extend(found.map(|call| format!("{path}:{number}: `{call}` outside tests")));
    }
    offences
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loose_ends_panics_and_long_files_are_found() {
        let marks = LOOSE_ENDS.iter().chain(&PANICS);
        for mark in marks {
            let source = SourceFile::new("crates/a/src/a.rs".into(), &format!("fn a() {{}}\nx{mark}\n"));
            assert_eq!(of_source(&source).len(), 1, "{mark}");
        }
        let long = SourceFile::new("crates/a/src/a.rs".into(), &"fn a() {}\n".repeat(LONGEST_FILE + 1));
        assert_eq!(of_source(&long).len(), 1);
    }

    #[test]
    fn tests_may_panic() {
        let text = format!("#[cfg(test)]\nmod tests {{\n x{}\n}}\n", PANICS[0]);
        assert!(of_source(&SourceFile::new("crates/a/src/a.rs".into(), &text)).is_empty());
    }
}
