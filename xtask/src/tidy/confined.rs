//! Libraries whose names may be used in a few places only.

use super::law::Law;
use super::sources::{SourceFile, words};

/// Uses of confined names outside their places.
pub fn offences(law: &Law, sources: &[SourceFile]) -> Vec<String> {
    let mut offences = Vec::new();
    for source in sources {
        for (name, places) in &law.confined {
            if places.iter().any(|place| source.lies_in(place)) {
                continue;
            }
            let uses = source.all_code().filter(|(_, line)| uses(line, name));
            let places = places.join(" or ");
            offences.extend(
                uses.map(|(line, _)| format!("{}:{line}: `{name}` belongs in {places}", source.path)),
            );
        }
    }
    offences
}

/// Whether a line of code names the library in a path: `name::...` or `use name`.
fn uses(line: &str, name: &str) -> bool {
    words(line, name).any(|(before, after)| {
        !before.ends_with("::") && (after.starts_with("::") || before.ends_with("use "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_paths_only() {
        assert!(uses("use widget::Mat;", "widget"));
        assert!(uses("    let m = widget::Mat::zeros(1, 1);", "widget"));
        assert!(uses("use widget;", "widget"));
        assert!(!uses("let widget_matrix = 1;", "widget"));
        assert!(!uses("use crate::widget::x;", "widget"));
        assert!(!uses("\"solved by widget\"", "widget"));
    }

    #[test]
    fn a_use_in_the_wrong_place_is_reported_with_its_line() {
        let mut law = Law::default();
        law.confined.insert("widget".into(), vec!["crates/gadget".into()]);
        let source = |path: &str| SourceFile::new(path.into(), "// widget::\nuse widget::Mat;\n");
        assert!(offences(&law, &[source("crates/gadget/src/a.rs")]).is_empty());
        let found = offences(&law, &[source("crates/gadget2/src/a.rs")]);
        assert_eq!(found, ["crates/gadget2/src/a.rs:2: `widget` belongs in crates/gadget"]);
    }
}
