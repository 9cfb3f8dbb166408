//! Types by their names and comments: a name says one thing in the whole workspace, and a comment begins with
//! the noun for which the name stands.

use std::collections::BTreeMap;

use syn::visit::{self, Visit};

use super::modules::is_test;
use super::sources::SourceFile;

/// Most types that a name stands for, over all crates.
const MOST_OF_A_NAME: usize = 2;
/// Names that may stand for more: of the type that makes a page of the documentation a test.
const EXCEPTED: &str = "Readme";
/// First words of a comment that are no noun and no article before one.
const NO_NOUNS: &[&str] = &[
    "What", "Whether", "Those", "The same", "How", "It", "Where", "When", "Which", "Who", "Why", "If", "As",
    "That", "This", "These", "So", "One", "All", "Each", "Of", "In", "With", "From", "By", "For", "To", "Is",
    "Has", "Does",
];

/// Names of too many types, and comments that begin without a noun.
pub fn offences(sources: &[SourceFile]) -> anyhow::Result<Vec<String>> {
    let (mut places, mut offences) = (BTreeMap::<String, Vec<String>>::new(), Vec::new());
    for source in sources.iter().filter(|source| !source.is_test()) {
        let mut types = Types { path: &source.path, places: &mut places, unnamed: &mut offences };
        types.visit_file(&source.syntax()?);
    }
    let frequent = places.iter().filter(|(name, own)| *name != EXCEPTED && own.len() > MOST_OF_A_NAME);
    offences.extend(frequent.map(|(name, own)| {
        format!("`{name}` stands for {} types, more than {MOST_OF_A_NAME}: {}", own.len(), own.join(", "))
    }));
    Ok(offences)
}

/// The types of a source, added to those of the others.
struct Types<'a> {
    path: &'a str,
    places: &'a mut BTreeMap<String, Vec<String>>,
    unnamed: &'a mut Vec<String>,
}

impl Types<'_> {
    fn add(&mut self, name: &syn::Ident, attributes: &[syn::Attribute]) {
        let place = format!("{}:{}", self.path, name.span().start().line);
        if let Some(word) = attributes.iter().find_map(text).and_then(|text| without_noun(&text)) {
            self.unnamed.push(format!("{place}: the comment of `{name}` begins with `{word}`, not a noun"));
        }
        self.places.entry(name.to_string()).or_default().push(place);
    }
}

/// The text of a line of a comment.
fn text(attribute: &syn::Attribute) -> Option<String> {
    let syn::Meta::NameValue(pair) = &attribute.meta else { return None };
    match &pair.value {
        syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) if pair.path.is_ident("doc") => {
            Some(text.value())
        }
        _ => None,
    }
}

/// What a comment begins with, where that is no noun.
fn without_noun(text: &str) -> Option<&'static str> {
    let after = |word: &&&str| text.trim_start().strip_prefix(**word);
    let is_whole = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-');
    NO_NOUNS.iter().find(|word| after(word).is_some_and(is_whole)).copied()
}

impl<'a> Visit<'a> for Types<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        match item {
            item if is_test(item) => return,
            syn::Item::Struct(item) => self.add(&item.ident, &item.attrs),
            syn::Item::Enum(item) => self.add(&item.ident, &item.attrs),
            syn::Item::Trait(item) => self.add(&item.ident, &item.attrs),
            syn::Item::Type(item) => self.add(&item.ident, &item.attrs),
            _ => {}
        }
        visit::visit_item(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Vec<String> {
        offences(&[SourceFile::new("crates/a/src/a.rs".into(), text)]).unwrap()
    }

    #[test]
    fn a_comment_begins_with_a_noun() {
        let good = "/// A wheel.\nstruct A;\n/// Inner wheels,\n/// all of them.\nenum B {}\ntrait C {}\n";
        assert!(found(good).is_empty());
        let offences = found("\n/// What turns.\n#[derive(Clone)]\npub struct A;\n");
        assert_eq!(offences, ["crates/a/src/a.rs:4: the comment of `A` begins with `What`, not a noun"]);
        assert_eq!(found("/// The same, turned.\ntype A = u8;\n/// In a box.\ntrait B {}\n").len(), 2);
        assert!(found("#[cfg(test)]\nmod tests {\n/// What turns.\nstruct A;\n}\n").is_empty());
    }

    #[test]
    fn a_name_stands_for_few_types() {
        let modules = |name: &str, count: usize| -> String {
            (0..count).map(|k| format!("mod m{k} {{ struct {name}; }}\n")).collect()
        };
        assert!(found(&modules("A", MOST_OF_A_NAME)).is_empty());
        let offences = found(&modules("A", MOST_OF_A_NAME + 1));
        let wanted = format!("`A` stands for {} types, more than {MOST_OF_A_NAME}: ", MOST_OF_A_NAME + 1);
        assert!(offences[0].starts_with(&wanted), "{offences:?}");
        assert!(found(&modules(EXCEPTED, MOST_OF_A_NAME + 1)).is_empty());
    }
}
