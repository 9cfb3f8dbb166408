//! Keys of a case that a command line sets: `time.step=0.01`, `particles.0.radius=0.06`.

use std::str::FromStr;

use thiserror::Error;
use toml::{Table, Value};

use super::error::{CaseIssue, CaseProblem, IssuePlace, Key, KeyPart};
use super::form::type_name;

/// A key of a case and the value it is to have instead of that of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// The key.
    pub key: Key,
    /// The value.
    pub value: Value,
    /// The argument of the command line that sets it.
    pub text: String,
}

/// A text that is no override.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum BadOverride {
    /// Without a value.
    #[error("expected KEY=VALUE, such as time.step=0.01")]
    NoValue,
    /// Without a key, or with an empty part in it.
    #[error("`{found}` is not a key; keys are written as time.step or particles.0.radius")]
    BadKey {
        /// The key as written.
        found: String,
    },
    /// Neither a TOML value nor a plain word.
    #[error("`{found}` is not a value; write 0.5, 3, true, gluey, \"some text\" or [0.5, 0.5]")]
    BadValue {
        /// The value as written.
        found: String,
    },
}

impl FromStr for Override {
    type Err = BadOverride;

    /// Reads `key=value`. Parts of the key are divided by points, entries of lists counted from 0
    /// (`particles.0.radius`, `particles[0].radius`); the value is one of TOML, where words need no quotes.
    fn from_str(text: &str) -> Result<Self, BadOverride> {
        let (key, value) = text.split_once('=').ok_or(BadOverride::NoValue)?;
        let (key, value) = (parse_key(key.trim())?, parse_value(value.trim())?);
        Ok(Self { key, value, text: format!("--set {text}") })
    }
}

impl Override {
    /// What an option of its own sets, such as `--strategy`: a name below these tables.
    pub fn of_option(option: &str, path: &[&str], name: &str) -> Self {
        let key = path.iter().fold(Key::default(), |key, part| key.name(part));
        Self { key, value: Value::String(name.to_owned()), text: format!("{option} {name}") }
    }

    /// Sets the key in the table of a case, which stays as it is where that cannot be done.
    pub(super) fn apply(&self, table: &mut Table) -> Result<(), CaseProblem> {
        let (last, path) = self.key.0.split_last().expect("a key has a part");
        let mut place = Value::Table(table.clone());
        let holder = path.iter().try_fold(&mut place, enter)?;
        *enter(holder, last)? = self.value.clone();
        if let Value::Table(changed) = place {
            *table = changed;
        }
        Ok(())
    }

    /// What is wrong with `key` because of this.
    pub(super) fn issue(&self, key: Key, problem: CaseProblem) -> CaseIssue {
        let key = if key == self.key { Key::default() } else { key };
        CaseIssue { place: IssuePlace::Argument(self.text.clone()), key, value: None, problem }
    }

    /// Whether this key is `other`, above it or below it.
    pub(super) fn concerns(&self, other: &Key) -> bool {
        !other.is_root() && self.key.0.iter().zip(&other.0).all(|(a, b)| a == b)
    }
}

/// What stands at `part` of a table or list; an empty table where nothing does.
fn enter<'a>(holder: &'a mut Value, part: &KeyPart) -> Result<&'a mut Value, CaseProblem> {
    match (part, holder) {
        (KeyPart::Name(name), Value::Table(table)) => {
            Ok(table.entry(name.clone()).or_insert_with(|| Value::Table(Table::new())))
        }
        (KeyPart::Index(index), Value::Array(list)) => {
            let count = list.len();
            list.get_mut(*index).ok_or(CaseProblem::NoEntry { index: *index, count })
        }
        (KeyPart::Index(index), _) => Err(CaseProblem::NoEntry { index: *index, count: 0 }),
        (KeyPart::Name(name), other) => Err(CaseProblem::WrongType {
            found: format!("{}, which has no key `{name}`", type_name(other)),
            expected: "a key of the case, such as time.step or particles.0.radius".into(),
        }),
    }
}

fn parse_key(text: &str) -> Result<Key, BadOverride> {
    let bad = || BadOverride::BadKey { found: text.to_owned() };
    let fits = |part: &&str| {
        !part.is_empty() && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
    };
    let dotted = text.replace('[', ".").replace(']', "");
    let parts: Vec<&str> = dotted.split('.').collect();
    if !parts.iter().all(fits) {
        return Err(bad());
    }
    let part = |part: &&str| match part.parse() {
        Ok(index) => KeyPart::Index(index),
        Err(_) => KeyPart::Name((*part).to_owned()),
    };
    Ok(Key(parts.iter().map(part).collect()))
}

fn parse_value(text: &str) -> Result<Value, BadOverride> {
    let bad = || BadOverride::BadValue { found: text.to_owned() };
    if text.contains('\n') {
        return Err(bad());
    }
    let parsed: Option<Table> = toml::from_str(&format!("value = {text}\n")).ok();
    if let Some(value) = parsed.and_then(|mut table| table.remove("value")) {
        return Ok(value);
    }
    let fits = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    let is_word = text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(fits);
    is_word.then(|| Value::String(text.to_owned())).ok_or_else(bad)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str, case: &str) -> Result<Table, CaseProblem> {
        let mut table: Table = toml::from_str(case).expect("TOML");
        let change: Override = text.parse().expect("an override");
        change.apply(&mut table).map(|()| table)
    }

    #[test]
    fn keys_are_set_at_any_depth() {
        let case = "[time]\nstep = 1.0\n[[particles]]\nradius = 1.0\n[[particles]]\nradius = 2.0\n";
        let table = set("particles.1.radius=3", case).expect("set");
        assert_eq!(table["particles"][1]["radius"], Value::Integer(3));
        assert_eq!(set("particles[1].radius=3", case).expect("set"), table);
        assert_eq!(set("flow.mesh.band=0.5", case).expect("set")["flow"]["mesh"]["band"], Value::Float(0.5));
        assert_eq!(
            set("contact.solver=active-set", case).expect("set")["contact"]["solver"].as_str(),
            Some("active-set")
        );
        assert_eq!(set("particles.2.radius=3", case), Err(CaseProblem::NoEntry { index: 2, count: 2 }));
        assert!(matches!(set("time.step.size=3", case), Err(CaseProblem::WrongType { .. })));
    }

    #[test]
    fn what_is_no_override_is_refused() {
        for text in [
            "time.step",
            "=3",
            "time..step=3",
            "a b=3",
            "step=",
            "step=1 2",
            "step=0.1.2",
            "x=\"",
            "x=1\ny = 2",
        ] {
            assert!(text.parse::<Override>().is_err(), "{text}");
        }
    }
}
