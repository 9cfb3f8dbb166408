//! `cargo xtask mdbook`: what mdBook calls before it makes pages (a preprocessor, `docs/book.toml`). Formulas
//! between dollars, which Markdown would take apart, reach MathJax whole; links out of the book lead to the
//! repository.

use std::ffi::OsString;
use std::io::{stdin, stdout};
use std::path::{Component, Path, PathBuf};

use serde_json::Value;

/// Where the sources are.
const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");

/// Reads a book as mdBook hands it on, and gives it back.
///
/// # Errors
/// If it is not the JSON of a book.
pub fn run(words: &[OsString]) -> anyhow::Result<()> {
    // A question, `supports RENDERER`: yes, all of them.
    if words.first().is_some_and(|word| word == "supports") {
        return Ok(());
    }
    let (_context, mut book): (Value, Value) = serde_json::from_reader(stdin().lock())?;
    visit(&mut book);
    Ok(serde_json::to_writer(stdout().lock(), &book)?)
}

/// Changes all chapters, wherever they stand in the book.
fn visit(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(visit),
        Value::Object(fields) => {
            let path = fields.get("path").and_then(Value::as_str).map(PathBuf::from);
            if let (Some(path), Some(Value::String(content))) = (path, fields.get_mut("content")) {
                *content = page(content, &path);
            }
            fields.values_mut().for_each(visit);
        }
        _ => {}
    }
}

/// A page, at `path` in the book, with its formulas and links changed; fenced code stays as it is.
fn page(text: &str, path: &Path) -> String {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut changed, mut words, mut is_code) = (String::new(), String::new(), false);
    for line in text.split_inclusive('\n') {
        if line.starts_with("```") {
            changed.push_str(&prose(&words, folder));
            changed.push_str(line);
            words.clear();
            is_code = !is_code;
        } else if is_code {
            changed.push_str(line);
        } else {
            words.push_str(line);
        }
    }
    changed + &prose(&words, folder)
}

fn prose(mut text: &str, folder: &Path) -> String {
    let mut changed = String::new();
    while let Some(at) = text.find(['`', '$', ']']) {
        changed.push_str(&text[..at]);
        text = &text[at..];
        let (piece, length) = piece(text, folder).unwrap_or((text[..1].to_owned(), 1));
        changed.push_str(&piece);
        text = &text[length..];
    }
    changed + text
}

/// What becomes of the code, the formula or the end of a link that `text` begins with, and how long that was.
fn piece(text: &str, folder: &Path) -> Option<(String, usize)> {
    let within = |fence: &str| {
        let inside = text.strip_prefix(fence)?;
        let end = inside.find(fence).filter(|&end| end > 0 && !inside[..end].contains("\n\n"))?;
        Some((&inside[..end], end + 2 * fence.len()))
    };
    if text.starts_with('`') {
        let ticks = text.len() - text.trim_start_matches('`').len();
        let (_, length) = within(&text[..ticks])?;
        return Some((text[..length].to_owned(), length));
    }
    if let Some(inside) = text.strip_prefix("](") {
        let target = &inside[..inside.find(')')?];
        return Some((format!("]({})", link(target, folder)), target.len() + 3));
    }
    if let Some((formula, length)) = within("$$") {
        return Some((format!("$${}$$", escaped(formula)), length));
    }
    let (formula, length) = within("$")?;
    Some((format!("${}$", escaped(formula)), length))
}

/// Text that Markdown takes for itself.
fn escaped(formula: &str) -> String {
    let escape = |c: char| if c.is_ascii_punctuation() { vec!['\\', c] } else { vec![c] };
    formula.chars().flat_map(escape).collect()
}

/// Where a link of a page in `folder` leads: the same in the book, to the repository out of it.
fn link(target: &str, folder: &Path) -> String {
    if target.contains("://") || target.starts_with('#') {
        return target.to_owned();
    }
    let mut below = Vec::new();
    for part in folder.join(target).components() {
        match part {
            Component::ParentDir if below.pop().is_none() => {
                let file = target.trim_start_matches("../");
                return format!("{REPOSITORY}/blob/HEAD/{file}");
            }
            Component::Normal(name) => below.push(name.to_owned()),
            _ => {}
        }
    }
    target.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_reach_the_reader_whole() {
        let page = |text| page(text, Path::new("theory/method.md"));
        assert_eq!(page("so $u_1^* = 2$.\n"), "so $u\\_1\\^\\* \\= 2$.\n");
        assert_eq!(page("$$a\\,b$$"), "$$a\\\\\\,b$$");
        // A dollar alone, code in a line and fenced code are no formulas.
        for text in ["5 $ a day", "`$x_1$` and ``a ` $y$``", "```sh\necho $A $B\n```\n", "$a\n\nb$"] {
            assert_eq!(page(text), text);
        }
    }

    #[test]
    fn links_out_of_the_book_lead_to_the_repository() {
        let page = |text| page(text, Path::new("tutorial/first.md"));
        for text in ["[a](second.md#part)", "[b](../files.md)", "[c](https://a.org/b.md)", "[d](#part)"] {
            assert_eq!(page(text), text);
        }
        let out = format!("[e]({REPOSITORY}/blob/HEAD/crates/fem/README.md)");
        assert_eq!(page("[e](../../crates/fem/README.md)"), out);
    }

    #[test]
    fn chapters_are_found_at_any_depth() {
        let chapter = |content: &str| serde_json::json!({"Chapter": {"path": "a.md", "content": content, "sub_items": []}});
        let mut book = serde_json::json!({"items": ["Separator", chapter("$x_1$")]});
        book["items"][1]["Chapter"]["sub_items"] = serde_json::json!([chapter("$y_1$")]);
        visit(&mut book);
        let chapter = &book["items"][1]["Chapter"];
        assert_eq!(chapter["content"], "$x\\_1$");
        assert_eq!(chapter["sub_items"][0]["Chapter"]["content"], "$y\\_1$");
    }
}
