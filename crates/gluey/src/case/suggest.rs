//! The known name nearest to a misspelt one.

use strsim::levenshtein;

/// Names that other programs have for keys of a case.
const SYNONYMS: [(&str, &str); 6] = [
    ("dt", "step"),
    ("time_step", "step"),
    ("t_end", "end"),
    ("phi", "volume_fraction"),
    ("n", "count"),
    ("method", "formulation"),
];

/// The candidate that `found` means elsewhere.
pub(crate) fn synonym<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let (_, name) = SYNONYMS.iter().find(|(other, _)| *other == found.to_ascii_lowercase())?;
    known.into_iter().find(|candidate| candidate == name)
}

/// What to write instead of a name that case files had.
pub(crate) fn former(found: &str) -> Option<&'static str> {
    (found == "rigid-dofs").then_some(
        "write formulation = \"unfitted\" instead, without a table [flow.rigid-dofs]: it is more exact with half the \
         cells in a radius",
    )
}

/// The candidate with the smallest edit distance to `found`, if that is at most a third of its letters (but
/// two edits are always allowed).
pub(crate) fn closest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (found.chars().count() / 3).max(2);
    known
        .into_iter()
        .map(|candidate| (levenshtein(found, candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_of_kitten_and_sitting_is_three() {
        assert_eq!(levenshtein("kitten", "sitting"), 3);
        assert_eq!(levenshtein("", "abc"), 3);
    }

    #[test]
    fn far_names_are_not_suggested() {
        assert_eq!(closest("raduis", ["position", "radius"]), Some("radius"));
        assert_eq!(closest("wombat", ["position", "radius"]), None);
    }
}
