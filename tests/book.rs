//! The book: every page is in its summary, every link leads somewhere, every command and case of the pages
//! for users works.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use gluey::Case;
use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};
use tempfile::TempDir;

/// Pages whose commands and cases are run, each in a folder of its own.
const EXECUTED: [&str; 3] = ["install.md", "first-run.md", "tutorial/your-suspension.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// All pages below a folder.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.extension() {
            _ if path.is_dir() => found.extend(pages(&path)),
            Some(extension) if extension == "md" => found.push(path),
            _ => {}
        }
    }
    found.sort();
    found
}

/// Where the links and pictures of a page lead.
fn links(page: &str) -> Vec<String> {
    let destination = |event| match event {
        Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => Some(dest_url.to_string()),
        _ => None,
    };
    Parser::new(page).filter_map(destination).collect()
}

/// What links to the headings of a page end with.
fn anchors(page: &str) -> BTreeSet<String> {
    let (mut found, mut heading) = (BTreeSet::new(), None);
    for event in Parser::new(page) {
        match (event, &mut heading) {
            (Event::Start(Tag::Heading { .. }), _) => heading = Some(String::new()),
            (Event::End(TagEnd::Heading(_)), Some(words)) => {
                found.insert(slug(words));
                heading = None;
            }
            (Event::Text(words) | Event::Code(words), Some(heading)) => heading.push_str(&words),
            _ => {}
        }
    }
    found
}

fn slug(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// Code of a page with its language, in order.
fn code(page: &str) -> Vec<(String, String)> {
    let (mut found, mut open) = (Vec::new(), None);
    for event in Parser::new(page) {
        match (event, &mut open) {
            (Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(language))), _) => {
                open = Some((language.to_string(), String::new()));
            }
            (Event::End(TagEnd::CodeBlock), _) => found.extend(open.take()),
            (Event::Text(words), Some((_, code))) => code.push_str(&words),
            _ => {}
        }
    }
    found
}

#[test]
fn every_page_is_in_the_summary_once() {
    let docs = root().join("docs");
    let mut listed = links(&text(&docs.join("SUMMARY.md")));
    let all =
        pages(&docs).into_iter().map(|page| page.strip_prefix(&docs).expect("below").display().to_string());
    let mut all: Vec<String> = all.filter(|page| page != "SUMMARY.md").collect();
    listed.sort();
    all.sort();
    assert_eq!(listed, all);
}

#[test]
fn every_link_leads_somewhere() {
    let root = root();
    let mut all: Vec<PathBuf> =
        ["docs", "data", "crates"].iter().flat_map(|part| pages(&root.join(part))).collect();
    all.extend(
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root.join(name)),
    );
    let (mut broken, mut checked) = (Vec::new(), 0);
    for page in &all {
        for link in links(&text(page)) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            checked += 1;
            let (file, anchor) =
                link.split_once('#').map_or((&link[..], None), |(file, anchor)| (file, Some(anchor)));
            let target = match file {
                "" => page.clone(),
                _ => page.parent().expect("a folder").join(file),
            };
            let is_there =
                target.exists() && anchor.is_none_or(|anchor| anchors(&text(&target)).contains(anchor));
            if !is_there {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    println!("{checked} links on {} pages", all.len());
    assert!(broken.is_empty() && checked > 100, "{}", broken.join("\n"));
}

/// Cases whose first line is `# NAME.toml` are written to that file; commands that begin with `gluey` are run
/// after one another.
#[test]
fn commands_and_cases_of_the_book_work() {
    for name in EXECUTED {
        let folder = TempDir::new().expect("a folder");
        let page = text(&root().join("docs").join(name));
        let mut commands = 0;
        for (language, code) in code(&page) {
            match &language[..] {
                "toml" => {
                    let file = code.lines().next().and_then(|line| line.strip_prefix("# "));
                    let file = file.unwrap_or_else(|| panic!("{name}: a case without the name of its file"));
                    Case::parse(&code, file).unwrap_or_else(|error| panic!("{name}: {error}"));
                    fs::write(folder.path().join(file), &code).expect("a file");
                }
                "sh" => {
                    for line in code.lines() {
                        let mut words = line.split_whitespace();
                        assert_eq!(words.next(), Some("gluey"), "{name}: {line}");
                        let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
                        let output =
                            command.current_dir(folder.path()).args(words).output().expect("it runs");
                        let stderr = String::from_utf8_lossy(&output.stderr);
                        assert!(output.status.success(), "{name}: {line}\n{stderr}");
                        commands += 1;
                    }
                }
                _ => {}
            }
        }
        assert!(commands > 2, "{name}: {commands} commands");
    }
}
