//! From TOML text to a checked [`Case`], with the places of whatever is wrong.

use std::path::Path;

use toml::Value;
use toml::de::DeTable;

use super::error::{CaseError, CaseIssue, CaseProblem, InvalidCase, IssuePlace, Key};
use super::findings::CaseFindings;
use super::locate::CaseSource;
use super::overrides::Override;
use super::particles_file::ParticleList;
use super::validate::{check_mutual, check_surroundings};
use super::{Case, Formulation, VERSION, fill, form};
use crate::text;

impl Case {
    /// Reads and checks a case file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, CaseError> {
        Self::load_with(path, &[])
    }

    /// Reads and checks a case file of which some keys are set otherwise.
    pub fn load_with(path: impl AsRef<Path>, overrides: &[Override]) -> Result<Self, CaseError> {
        let path = path.as_ref();
        let text = text::read(path).map_err(|source| CaseError::Read { path: path.to_owned(), source })?;
        Self::parse_with(&text, path, overrides)
    }

    /// Checks a case given as text; `file` is what errors call it.
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self, CaseError> {
        Self::parse_with(text, file, &[])
    }

    /// Checks a case given as text of which some keys are set otherwise; `file` is what errors call it.
    ///
    /// # Errors
    /// [`CaseError::Invalid`] with all that is wrong: first syntax, then the version, then all keys and
    /// values, with what does not fit together in the parts of the case whose keys and values are right.
    pub fn parse_with(text: &str, file: impl AsRef<Path>, overrides: &[Override]) -> Result<Self, CaseError> {
        let source = CaseSource { text, file: file.as_ref() };
        let tree = DeTable::parse(text).map_err(|error| source.syntax_error(&error))?;
        let mut table: toml::Table = toml::from_str(text).map_err(|error| source.value_error(&error))?;
        let mut findings = CaseFindings::default();
        for set in overrides {
            set.apply(&mut table).unwrap_or_else(|problem| findings.add(set.key.clone(), problem));
        }
        let case = match version_problem(&table) {
            Some(problem) => {
                findings.add(Key::default().name("version"), problem);
                None
            }
            None => read(table, source.folder(), &mut findings),
        };
        match case {
            Some((case, _)) if findings.is_empty() => Ok(case),
            case => {
                let list = case.and_then(|(_, list)| list);
                Err(source.errors(tree.get_ref(), findings, list.as_ref(), overrides))
            }
        }
    }

    /// Checks a case that was not read from a file, or was changed after it was.
    ///
    /// # Errors
    /// [`CaseError::Invalid`] with all that is wrong.
    pub fn check(&self) -> Result<(), CaseError> {
        let mut findings = self.findings_in_form();
        if findings.are_good(&["dimension"]) {
            check_surroundings(self, &mut findings);
            check_mutual(self, &mut findings);
        }
        self.refuse(findings)
    }

    /// Makes the particles that `suspension` or `particles_file` describe, if one of them is there, and
    /// forgets the description: a case made by a program is then as if it had been read. Files are looked for
    /// in `folder`.
    ///
    /// # Errors
    /// [`CaseError::Invalid`] with all that is wrong in what is needed for it.
    pub fn fill_particles(&mut self, folder: impl AsRef<Path>) -> Result<(), CaseError> {
        let mut findings = self.findings_in_form();
        if findings.is_empty() {
            check_surroundings(self, &mut findings);
        }
        if findings.is_empty() {
            fill::fill(self, !self.particles.is_empty(), folder.as_ref(), &mut findings);
        }
        self.refuse(findings)
    }

    /// What is wrong with single values of a case that is no text.
    fn findings_in_form(&self) -> CaseFindings {
        let mut findings = CaseFindings::default();
        match toml::Table::try_from(self) {
            Ok(table) => form::check(&Value::Table(table), Case::schema(), &Key::default(), &mut findings),
            Err(error) => findings.add(Key::default(), CaseProblem::Malformed { message: error.to_string() }),
        }
        findings
    }

    /// An error if anything was found in a case that is no text.
    fn refuse(&self, findings: CaseFindings) -> Result<(), CaseError> {
        if findings.is_empty() {
            return Ok(());
        }
        let (list, more) = findings.into_parts();
        let issues = list
            .into_iter()
            .map(|found| CaseIssue {
                place: IssuePlace::Value,
                key: found.key,
                value: None,
                problem: found.problem,
            })
            .collect();
        let file = self.name.clone().into();
        Err(CaseError::Invalid(Box::new(InvalidCase { file, text: String::new(), issues, more })))
    }
}

/// Why nothing can be said of a case: it is written in a layout that is not known.
fn version_problem(table: &toml::Table) -> Option<CaseProblem> {
    let found = table.get("version")?.as_integer()?;
    (found != i64::from(VERSION)).then_some(CaseProblem::Version { found })
}

/// Notes keys of a formulation in a case that names none: it would be solved with another.
fn check_choice_is_named(table: &toml::Table, findings: &mut CaseFindings) {
    let Some(flow) = table.get("flow").and_then(Value::as_table) else { return };
    if flow.contains_key("formulation") {
        return;
    }
    let paper = Formulation::Paper.name();
    if flow.contains_key(paper) {
        let key = Key::default().name("flow").name(paper);
        let needs = format!("flow.formulation = \"{paper}\"");
        let found = format!("no `flow.formulation`, which means \"{}\"", Formulation::default());
        findings.unfit(key, format!("`[flow.{paper}]`"), needs, found);
    }
}

/// The case that `table` is, as far as its parts are right, and the file that lists its particles; what is
/// wrong is noted.
fn read(
    table: toml::Table,
    folder: &Path,
    findings: &mut CaseFindings,
) -> Option<(Case, Option<ParticleList>)> {
    let has_list = table.contains_key("particles");
    check_choice_is_named(&table, findings);
    let whole = Value::Table(table);
    form::check(&whole, Case::schema(), &Key::default(), findings);
    let Value::Table(mut table) = whole else { return None };
    if !findings.are_good(&["dimension"]) {
        return None;
    }
    findings.parts().flatten().for_each(|part| _ = table.remove(part));
    // What is missing or wrong was noted: these stand for it, so that the rest can be checked.
    let time = toml::Table::from_iter(["step", "end"].map(|name| (name.to_owned(), Value::Float(1.0))));
    table.entry("name").or_insert_with(|| Value::String("case".to_owned()));
    table.entry("time").or_insert(Value::Table(time));
    let mut case: Case = match table.try_into() {
        Ok(case) => case,
        Err(error) => {
            let message = error.to_string();
            findings.add(Key::default(), CaseProblem::Malformed { message });
            return None;
        }
    };
    check_surroundings(&case, findings);
    let list = match findings.are_good(&fill::NEEDED) && !findings.have_unknown_part() {
        true => fill::fill(&mut case, has_list, folder, findings),
        false => None,
    };
    check_mutual(&case, findings);
    Some((case, list))
}
