//! From TOML text to a checked [`Case`], with the place of whatever is wrong.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{CaseError, CaseIssue, Key, KeyPart, Problem};
use super::overrides::Override;
use super::suggest::{closest, synonym};
use super::validate::{Violation, check, check_surroundings};
use super::{Case, UnknownName, fill};

impl Case {
    /// Reads and checks a case file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, CaseError> {
        Self::load_with(path, &[])
    }

    /// Reads and checks a case file of which some keys are set otherwise.
    pub fn load_with(path: impl AsRef<Path>, overrides: &[Override]) -> Result<Self, CaseError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| CaseError::Read { path: path.to_owned(), source })?;
        Self::parse_with(&text, path, overrides)
    }

    /// Checks a case given as text; `file` is what errors call it.
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self, CaseError> {
        Self::parse_with(text, file, &[])
    }

    /// Checks a case given as text of which some keys are set otherwise; `file` is what errors call it.
    pub fn parse_with(text: &str, file: impl AsRef<Path>, overrides: &[Override]) -> Result<Self, CaseError> {
        let source = Source { text, file: file.as_ref() };
        let tree = DeTable::parse(text).map_err(|error| source.syntax_issue(&error))?;
        let (mut case, has_list) = match overrides {
            [] => {
                let case: Self = toml::from_str(text).map_err(|error| source.type_issue(&tree, &error))?;
                (case, tree.get_ref().contains_key("particles"))
            }
            _ => source.overridden(&tree, overrides)?,
        };
        let issue = |violation: Violation| match overrides.iter().rfind(|set| set.concerns(&violation.key)) {
            None => source.value_issue(&tree, violation),
            Some(set) => argument_issue(set, violation.key, violation.problem),
        };
        check_surroundings(&case)
            .and_then(|()| fill::fill(&mut case, has_list, source.folder()))
            .map_err(issue)?;
        check(&case).map_err(issue)?;
        Ok(case)
    }

    /// Checks a case that was not read from a file, or was changed after it was.
    pub fn check(&self) -> Result<(), CaseError> {
        check(self).map_err(|violation| CaseError::of_value(&self.name, violation.key, violation.problem))
    }
}

impl CaseError {
    /// Something wrong in a case of this name that was not read from a file.
    pub(super) fn of_value(name: &str, key: Key, problem: Problem) -> Self {
        Source { text: "", file: Path::new(name) }.issue(0..0, key, None, problem)
    }
}

fn argument_issue(set: &Override, key: Key, problem: Problem) -> CaseError {
    let key = if key == set.key { Key::default() } else { key };
    CaseError::Argument { argument: set.text.clone(), key, problem: Box::new(problem) }
}

/// The text an error points into.
struct Source<'a> {
    text: &'a str,
    file: &'a Path,
}

impl Source<'_> {
    /// Where the files lie that the case names.
    fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    /// The case with its overrides, and whether it lists particles. An error that the file has without any
    /// override is the file's, another one that of the first override that brings it about.
    fn overridden(
        &self,
        tree: &Spanned<DeTable<'_>>,
        overrides: &[Override],
    ) -> Result<(Case, bool), CaseError> {
        let mut table: toml::Table =
            toml::from_str(self.text).map_err(|error| self.type_issue(tree, &error))?;
        let mut tables = vec![table.clone()];
        for set in overrides {
            set.apply(&mut table).map_err(|problem| argument_issue(set, set.key.clone(), problem))?;
            tables.push(table.clone());
        }
        let typed = |table: &toml::Table| table.clone().try_into::<Case>();
        let error = match typed(&table) {
            Ok(case) => return Ok((case, table.contains_key("particles"))),
            Err(error) => error.message().to_owned(),
        };
        let is_so = |table: &toml::Table| typed(table).is_err_and(|found| found.message() == error);
        let first = tables.iter().position(is_so).unwrap_or(overrides.len());
        match (first, toml::from_str::<Case>(self.text)) {
            (0, Err(error)) => Err(self.type_issue(tree, &error)),
            (first, _) => {
                let set = &overrides[first.max(1) - 1];
                Err(argument_issue(set, set.key.clone(), classify(&error, &set.key)))
            }
        }
    }

    fn syntax_issue(&self, error: &toml::de::Error) -> CaseError {
        let problem = Problem::Syntax { message: error.message().to_owned() };
        self.issue(error.span().unwrap_or(0..0), Key::default(), None, problem)
    }

    fn type_issue(&self, tree: &Spanned<DeTable<'_>>, error: &toml::de::Error) -> CaseError {
        let span = error.span().unwrap_or(0..0);
        let key = key_at(tree, &span);
        let problem = classify(error.message(), &key);
        let key = match &problem {
            Problem::MissingKey { name, .. } => table_at(tree, &span).name(name),
            _ => key,
        };
        let span = match &problem {
            Problem::MissingKey { .. } => first_line(self.text, &span),
            _ => span,
        };
        let value = match &problem {
            Problem::MissingKey { .. } => None,
            _ => find(tree, &key).map(|(_, value)| self.excerpt(&value)),
        };
        self.issue(span, key, value, problem)
    }

    fn value_issue(&self, tree: &Spanned<DeTable<'_>>, violation: Violation) -> CaseError {
        let mut key = violation.key.clone();
        while !key.is_root() {
            if let Some((whole, value)) = find(tree, &key) {
                let text = (key == violation.key).then(|| self.excerpt(&value));
                return self.issue(first_line(self.text, &whole), violation.key, text, violation.problem);
            }
            key.0.pop();
        }
        self.issue(0..0, violation.key, None, violation.problem)
    }

    fn issue(&self, span: Range<usize>, key: Key, value: Option<String>, problem: Problem) -> CaseError {
        let before = &self.text[..floor_boundary(self.text, span.start)];
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        CaseError::Invalid(Box::new(CaseIssue {
            file: self.file.to_owned(),
            text: self.text.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            span,
            key,
            value,
            problem,
        }))
    }

    /// The value as written, on one line and not too long.
    fn excerpt(&self, span: &Range<usize>) -> String {
        let words: Vec<&str> = self.text.get(span.clone()).unwrap_or("").split_whitespace().collect();
        let line = words.join(" ");
        match line.char_indices().nth(60) {
            Some((end, _)) => format!("{} ...", &line[..end]),
            None => line,
        }
    }
}

/// Sorts serde's message about the value of `key` into a [`Problem`].
fn classify(message: &str, key: &Key) -> Problem {
    let quoted: Vec<String> = message.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    let first = quoted.first().cloned().unwrap_or_default();
    if message.starts_with("missing field") {
        Problem::MissingKey { example: example(&first), name: first }
    } else if message.starts_with("unknown field") {
        let known = quoted[1..].to_vec();
        let names = || known.iter().map(String::as_str);
        let suggestion = synonym(&first, names()).or(closest(&first, names())).map(str::to_owned);
        Problem::UnknownKey { name: first, suggestion, known }
    } else if message.starts_with("unknown variant") {
        let what = key.0.iter().rev().find_map(|part| match part {
            KeyPart::Name(name) => Some(name.clone()),
            KeyPart::Index(_) => None,
        });
        let what = what.unwrap_or_else(|| "name".to_owned());
        Problem::UnknownName(UnknownName { what, found: first, known: quoted[1..].to_vec() })
    } else if message.starts_with("wanted string") {
        Problem::WrongType { found: "something without quotes".into(), expected: "a name in quotes".into() }
    } else if let Some((found, expected)) = wrong_type(message) {
        Problem::WrongType { found, expected }
    } else {
        Problem::Malformed { message: message.to_owned() }
    }
}

/// Splits "invalid type: string \"x\", expected f64" (or "invalid value: ...") into its two halves.
fn wrong_type(message: &str) -> Option<(String, String)> {
    let rest = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "))?;
    let (found, expected) = rest.rsplit_once(", expected ")?;
    Some((found.to_owned(), in_words(expected)))
}

/// Rust's names of types in words of the case file.
fn in_words(expected: &str) -> String {
    match expected {
        "f64" => "a number".into(),
        "usize" | "u32" | "u64" => "a whole number, 0 or more".into(),
        "a boolean" => "true or false".into(),
        "a sequence" => "a list like [1.0, 2.0]".into(),
        other => match other.strip_prefix("struct ") {
            Some(_) => "a table".into(),
            None => other.to_owned(),
        },
    }
}

/// A line that would supply a missing key.
fn example(name: &str) -> &'static str {
    match name {
        "name" => "name = \"my-case\"",
        "dimension" => "dimension = 2",
        "particles" => "[[particles]]",
        "position" => "position = [0.5, 0.5]",
        "radius" => "radius = 0.05",
        "time" => "[time]",
        "step" => "step = 0.025",
        "end" => "end = 10.0",
        _ => "key = value",
    }
}

/// The innermost table that holds `span`, or that `span` is.
fn table_at(tree: &Spanned<DeTable<'_>>, span: &Range<usize>) -> Key {
    let mut best = (usize::MAX, Key::default());
    visit(tree.get_ref(), &Key::default(), &mut |key, _, value| {
        let holder = value.span();
        let is_table = matches!(value.get_ref(), DeValue::Table(_));
        let size = holder.end - holder.start;
        if is_table && holder.start <= span.start && span.end <= holder.end && size <= best.0 {
            best = (size, key.clone());
        }
    });
    best.1
}

/// The innermost key whose name or value holds `span`.
fn key_at(tree: &Spanned<DeTable<'_>>, span: &Range<usize>) -> Key {
    let mut best = (usize::MAX, Key::default());
    visit(tree.get_ref(), &Key::default(), &mut |key, name, value| {
        for holder in name.into_iter().chain([value.span()]) {
            let size = holder.end - holder.start;
            if holder.start <= span.start && span.end <= holder.end && size <= best.0 {
                best = (size, key.clone());
            }
        }
    });
    best.1
}

/// Where `key` stands: the whole entry (name to value) and the value alone.
fn find(tree: &Spanned<DeTable<'_>>, key: &Key) -> Option<(Range<usize>, Range<usize>)> {
    let mut found = None;
    visit(tree.get_ref(), &Key::default(), &mut |at, name, value| {
        if at == key {
            let value = value.span();
            let start = name.map_or(value.start, |name| name.start.min(value.start));
            found = Some((start..value.end, value));
        }
    });
    found
}

/// Walks over all entries: key, span of its name (none for array entries), value.
fn visit(
    table: &DeTable<'_>,
    at: &Key,
    act: &mut impl FnMut(&Key, Option<Range<usize>>, &Spanned<DeValue<'_>>),
) {
    for (name, value) in table {
        visit_value(&at.name(name.get_ref()), Some(name.span()), value, act);
    }
}

fn visit_value(
    key: &Key,
    name: Option<Range<usize>>,
    value: &Spanned<DeValue<'_>>,
    act: &mut impl FnMut(&Key, Option<Range<usize>>, &Spanned<DeValue<'_>>),
) {
    act(key, name, value);
    match value.get_ref() {
        DeValue::Table(table) => visit(table, key, act),
        DeValue::Array(entries) => {
            for (index, entry) in entries.iter().enumerate() {
                visit_value(&key.index(index), None, entry, act);
            }
        }
        _ => {}
    }
}

/// The part of `span` on its first line.
fn first_line(text: &str, span: &Range<usize>) -> Range<usize> {
    let start = floor_boundary(text, span.start);
    let length = text[start..].find('\n').unwrap_or(text.len() - start);
    start..span.end.clamp(start, start + length)
}

fn floor_boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|&index| text.is_char_boundary(index)).unwrap_or(0)
}
