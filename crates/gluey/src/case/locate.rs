//! Where in the text of a case file something stands that is wrong.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{CaseError, CaseIssue, CaseProblem, InvalidCase, IssuePlace, Key, KeyPart};
use super::findings::{CaseFindings, Violation};
use super::overrides::Override;
use super::particles_file::ParticleList;
use crate::text::{is_unseen, visible};

/// The text that errors point into.
pub(super) struct CaseSource<'a> {
    pub text: &'a str,
    pub file: &'a Path,
}

impl CaseSource<'_> {
    /// Where the files lie that the case names.
    pub fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    /// That the text is no TOML.
    pub fn syntax_error(&self, error: &toml::de::Error) -> CaseError {
        let span = error.span().unwrap_or(0..0);
        let (problem, span) = match self.unseen(&span) {
            Some(found) => found,
            None => (CaseProblem::Syntax { message: error.message().to_owned() }, span),
        };
        let place = self.place(span);
        self.invalid(vec![CaseIssue { place, key: Key::default(), value: None, problem }], 0)
    }

    /// A character that is not seen in the first line of `span`, where it begins or behind that.
    fn unseen(&self, span: &Range<usize>) -> Option<(CaseProblem, Range<usize>)> {
        let start = self.floor_boundary(span.start);
        let line_start = self.text[..start].rfind('\n').map_or(0, |end| end + 1);
        let line = self.text[start..].split('\n').next().unwrap_or_default().trim_end_matches('\r');
        let (at, character) = line.char_indices().find(|&(_, c)| is_unseen(c) && c != '\t')?;
        let at = start + at;
        let (line, is_first) = (self.text[..at].matches('\n').count() + 1, at == line_start);
        Some((CaseProblem::Unseen { line, is_first, character }, at..at + character.len_utf8()))
    }

    /// That a number has more digits than can be read; there is no other such error in what is TOML.
    pub fn value_error(&self, error: &toml::de::Error) -> CaseError {
        let problem = CaseProblem::TooManyDigits;
        let span = error.span().unwrap_or(0..0);
        let value = self.excerpt(&span);
        let place = self.place(span);
        self.invalid(vec![CaseIssue { place, key: Key::default(), value: Some(value), problem }], 0)
    }

    /// All that was found, in the order of the text; what an override brings about comes first.
    pub fn errors(
        &self,
        tree: &DeTable<'_>,
        findings: CaseFindings,
        particles: Option<&ParticleList>,
        overrides: &[Override],
    ) -> CaseError {
        let (list, more) = findings.into_parts();
        let locate = |violation: Violation| match overrides
            .iter()
            .enumerate()
            .rfind(|(_, set)| set.concerns(&violation.key))
        {
            Some((index, set)) => (index, set.issue(violation.key, violation.problem)),
            None => match particles.and_then(|list| list.issue(&violation)) {
                Some((line, issue)) => (overrides.len() + self.text.len() + line, issue),
                None => {
                    let (start, issue) = self.issue(tree, violation);
                    (overrides.len() + start, issue)
                }
            },
        };
        let mut issues: Vec<(usize, CaseIssue)> = list.into_iter().map(locate).collect();
        issues.sort_by_key(|(order, _)| *order);
        self.invalid(issues.into_iter().map(|(_, issue)| issue).collect(), more)
    }

    fn invalid(&self, issues: Vec<CaseIssue>, more: usize) -> CaseError {
        let (file, text) = (self.file.to_owned(), self.text.to_owned());
        CaseError::Invalid(Box::new(InvalidCase { file, text, issues, more }))
    }

    /// The byte where it begins, and what is wrong.
    fn issue(&self, tree: &DeTable<'_>, Violation { key, problem }: Violation) -> (usize, CaseIssue) {
        let mut holder = key.clone();
        while !holder.is_root() {
            if let Some((name, value)) = find(tree, &holder) {
                let (is_key, value_span) = (holder == key, value.span());
                let start = name.as_ref().map_or(value_span.start, |name| name.start.min(value_span.start));
                let span = match (name, &problem) {
                    (Some(name), CaseProblem::UnknownKey { .. }) if is_key => name,
                    _ => self.first_line(&(start..value_span.end)),
                };
                let is_table = matches!(value.get_ref(), DeValue::Table(_));
                let value = (is_key && !is_table).then(|| self.excerpt(&value_span));
                return (span.start, CaseIssue { place: self.place(span), key, value, problem });
            }
            holder.0.pop();
        }
        // Particles that are not listed stand where the case says where they come from.
        let sources = ["suspension", "particles_file"].map(|name| Key::default().name(name));
        let span = match sources.iter().find_map(|source| find(tree, source)) {
            Some((_, value)) if key.is_of_particles() => self.first_line(&value.span()),
            _ => 0..0,
        };
        (span.start, CaseIssue { place: self.place(span), key, value: None, problem })
    }

    fn place(&self, span: Range<usize>) -> IssuePlace {
        let before = &self.text[..self.floor_boundary(span.start)];
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        let line = before.matches('\n').count() + 1;
        let column = before[line_start..].chars().count() + 1;
        IssuePlace::Text { line, column, span }
    }

    /// The value as written, on one line and not too long.
    fn excerpt(&self, span: &Range<usize>) -> String {
        let words: Vec<&str> = self.text.get(span.clone()).unwrap_or("").split_whitespace().collect();
        let line = visible(&words.join(" "));
        match line.char_indices().nth(60) {
            Some((end, _)) => format!("{} ...", &line[..end]),
            None => line,
        }
    }

    /// The part of `span` on its first line.
    fn first_line(&self, span: &Range<usize>) -> Range<usize> {
        let start = self.floor_boundary(span.start);
        let length = self.text[start..].find('\n').unwrap_or(self.text.len() - start);
        start..span.end.clamp(start, start + length)
    }

    fn floor_boundary(&self, at: usize) -> usize {
        (0..=at.min(self.text.len())).rev().find(|&index| self.text.is_char_boundary(index)).unwrap_or(0)
    }
}

/// Where the name of `key` stands (nowhere for an entry of a list), and its value.
fn find<'a, 'i>(
    tree: &'a DeTable<'i>,
    key: &Key,
) -> Option<(Option<Range<usize>>, &'a Spanned<DeValue<'i>>)> {
    let (first, rest) = key.0.split_first()?;
    let KeyPart::Name(first) = first else { return None };
    let (name, value) = tree.get_key_value(first.as_str())?;
    let mut place = (Some(name.span()), value);
    for part in rest {
        place = match (part, place.1.get_ref()) {
            (KeyPart::Name(part), DeValue::Table(table)) => {
                let (name, value) = table.get_key_value(part.as_str())?;
                (Some(name.span()), value)
            }
            (KeyPart::Index(index), DeValue::Array(entries)) => (None, entries.get(*index)?),
            _ => return None,
        };
    }
    Some(place)
}
