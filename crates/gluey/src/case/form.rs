//! The form of a case file: whether its keys are known, their values of the right type and in range, and none
//! is missing. All of this is held against the schema.

use serde_json::Value as Schema;
use toml::Value;

use super::Case;
use super::error::{CaseProblem, Key};
use super::findings::CaseFindings;
use super::names::UnknownName;
use super::suggest::{closest, synonym};
use crate::number_text::shown;

/// Notes everything in `value`, which stands at `key`, that `schema` does not allow.
pub(super) fn check(value: &Value, schema: &Schema, key: &Key, findings: &mut CaseFindings) {
    let kind = schema["type"].as_str().unwrap_or_default();
    match (kind, value) {
        ("object", Value::Table(table)) => check_table(table, schema, key, findings),
        ("array", Value::Array(entries)) => {
            let entries = entries.iter().enumerate();
            entries.for_each(|(index, entry)| check(entry, &schema["items"], &key.index(index), findings));
        }
        ("string", Value::String(text)) => check_name(text, schema, key, findings),
        ("boolean", Value::Boolean(_)) => {}
        ("integer", Value::Integer(number)) => check_range(*number as f64, schema, key, findings),
        ("number", Value::Integer(number)) => check_range(*number as f64, schema, key, findings),
        ("number", Value::Float(number)) => check_range(*number, schema, key, findings),
        _ => findings.add(
            key.clone(),
            CaseProblem::WrongType { found: type_name(value).to_owned(), expected: expected(schema) },
        ),
    }
}

fn check_table(table: &toml::Table, schema: &Schema, key: &Key, findings: &mut CaseFindings) {
    let known = || schema["properties"].as_object().into_iter().flat_map(|known| known.keys());
    let mut meant: Vec<String> = Vec::new();
    for (name, value) in table {
        match schema["properties"].get(name) {
            Some(schema) => check(value, schema, &key.name(name), findings),
            None => {
                let names = || known().map(String::as_str);
                let near = synonym(name, names()).or(closest(name, names())).map(str::to_owned);
                let elsewhere = tables_with(name);
                let suggestion = near.filter(|_| elsewhere.is_empty());
                let known = known().cloned().collect();
                meant.extend(suggestion.clone());
                let problem = CaseProblem::UnknownKey { name: name.clone(), suggestion, elsewhere, known };
                findings.add(key.name(name), problem);
            }
        }
    }
    for name in schema["required"].as_array().into_iter().flatten().filter_map(Schema::as_str) {
        // A key that is misspelt is not missing too.
        if !table.contains_key(name) && !meant.iter().any(|key| key == name) {
            findings
                .add(key.name(name), CaseProblem::MissingKey { name: name.into(), example: example(name) });
        }
    }
}

/// The tables of a case that have a key `name`, as they are written in a case file.
fn tables_with(name: &str) -> Vec<String> {
    let mut found = Vec::new();
    search(Case::schema(), &Key::default(), name, &mut found);
    found
}

fn search(schema: &Schema, key: &Key, name: &str, found: &mut Vec<String>) {
    let is_list = schema["type"] == "array";
    let table = if is_list { &schema["items"] } else { schema };
    let Some(properties) = table["properties"].as_object() else { return };
    if properties.contains_key(name) && !key.is_root() {
        found.push(if is_list { format!("[[{key}]]") } else { format!("[{key}]") });
    }
    properties.iter().for_each(|(part, schema)| search(schema, &key.name(part), name, found));
}

fn check_name(found: &str, schema: &Schema, key: &Key, findings: &mut CaseFindings) {
    let Some(names) = schema["enum"].as_array() else { return };
    let known: Vec<String> = names.iter().filter_map(Schema::as_str).map(str::to_owned).collect();
    if !known.iter().any(|name| name == found) {
        let what = key.last_name().unwrap_or("name").to_owned();
        findings
            .add(key.clone(), CaseProblem::UnknownName(UnknownName { what, found: found.to_owned(), known }));
    }
}

fn check_range(number: f64, schema: &Schema, key: &Key, findings: &mut CaseFindings) {
    if !number.is_finite() {
        return findings.add(key.clone(), CaseProblem::NotFinite { found: number });
    }
    let range = NumberRange::of(schema);
    if !range.contains(number) {
        findings.out_of_range(key.clone(), number, &range.in_words());
    }
}

/// Numbers that a key may have.
#[derive(Clone, Copy, Debug, Default)]
struct NumberRange {
    /// Whether only whole numbers are meant.
    is_whole: bool,
    least: Option<f64>,
    above: Option<f64>,
    most: Option<f64>,
    below: Option<f64>,
}

impl NumberRange {
    fn of(schema: &Schema) -> Self {
        let number = |name: &str| schema.get(name).and_then(Schema::as_f64);
        Self {
            is_whole: schema["type"] == "integer",
            least: number("minimum"),
            above: number("exclusiveMinimum"),
            most: number("maximum"),
            below: number("exclusiveMaximum"),
        }
    }

    fn contains(&self, x: f64) -> bool {
        self.least.is_none_or(|end| x >= end)
            && self.above.is_none_or(|end| x > end)
            && self.most.is_none_or(|end| x <= end)
            && self.below.is_none_or(|end| x < end)
    }

    fn in_words(&self) -> String {
        let lower = self.least.map(|end| (end, "from")).or(self.above.map(|end| (end, "greater than")));
        let upper = self.most.map(|end| (end, "to")).or(self.below.map(|end| (end, "less than")));
        match (lower, upper) {
            (Some((a, "from")), Some((b, "to"))) if b == a => format!("equal to {}", shown(a)),
            (Some((a, "from")), Some((b, "to"))) if self.is_whole && b == a + 1.0 => {
                format!("equal to {} or {}", shown(a), shown(b))
            }
            (Some((a, "from")), Some((b, "to"))) => format!("from {} to {}", shown(a), shown(b)),
            (Some((a, "from")), Some((b, _))) => format!("from {} to less than {}", shown(a), shown(b)),
            (Some((a, _)), Some((b, "to"))) => format!("greater than {}, at most {}", shown(a), shown(b)),
            (Some((a, _)), Some((b, _))) => {
                format!("between {} and {}, without the ends", shown(a), shown(b))
            }
            (Some((a, "from")), None) => format!("of {} or more", shown(a)),
            (Some((a, _)), None) => format!("greater than {}", shown(a)),
            (None, Some((b, "to"))) => format!("of {} or less", shown(b)),
            (None, Some((b, _))) => format!("less than {}", shown(b)),
            (None, None) => "of any size".to_owned(),
        }
    }
}

/// What a number of this schema may be, in words.
pub(crate) fn range_in_words(schema: &Schema) -> String {
    NumberRange::of(schema).in_words()
}

/// A value's type in words of the case file.
pub(super) fn type_name(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "a text",
        Value::Integer(_) => "a whole number",
        Value::Float(_) => "a number with a point",
        Value::Boolean(_) => "true or false",
        Value::Datetime(_) => "a date",
        Value::Array(_) => "a list",
        Value::Table(_) => "a table",
    }
}

/// What a value of this schema is to be.
fn expected(schema: &Schema) -> String {
    match schema["type"].as_str().unwrap_or_default() {
        "number" => "a number".into(),
        "integer" => format!("a whole number {}", range_in_words(schema)).replace(" of any size", ""),
        "boolean" => "true or false, without quotes".into(),
        "string" if schema["enum"].is_array() => {
            let names = schema["enum"].as_array().into_iter().flatten().map(Schema::to_string);
            format!("a name in quotes: {}", names.collect::<Vec<_>>().join(", "))
        }
        "string" => "a text in quotes".into(),
        "array" if schema["items"]["type"] == "object" => {
            "a list of tables, each under a line like [[particles]]".into()
        }
        "array" => "a list like [1.0, 2.0]".into(),
        _ => "a table: a line like [time] with keys below it, or { key = value }".into(),
    }
}

/// A line that would supply a missing key.
fn example(name: &str) -> &'static str {
    match name {
        "name" => "name = \"my-case\"",
        "dimension" => "dimension = 2",
        "position" => "position = [0.5, 0.5]",
        "radius" => "radius = 0.05",
        "time" => "[time]` with lines like `step = 0.025` and `end = 10.0",
        "step" => "step = 0.025",
        "end" => "end = 10.0",
        _ => "key = value",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of what is found in the form of a case.
    fn found(text: &str) -> Vec<String> {
        let mut findings = CaseFindings::default();
        let table: toml::Table = toml::from_str(text).expect("TOML");
        check(&Value::Table(table), Case::schema(), &Key::default(), &mut findings);
        let (list, more) = findings.into_parts();
        assert_eq!(more, 0);
        list.into_iter().map(|found| format!("{}: {}", found.key, found.problem.hint())).collect()
    }

    #[test]
    fn all_that_is_wrong_is_found() {
        let text = "name = 3\ndimension = 4\nparticles = [{ position = [nan, \"a\"] }]\n\
                    [time]\nstep = 0\n[contact]\nstrategy = \"glue\"\n[flow.mesh]\nband = -1\nviscosity_ratio = 1\n";
        let expected = [
            "contact.strategy: did you mean \"gluey\"?",
            "dimension: expected a number equal to 2 or 3",
            "flow.mesh.band: expected a number from 0 to 1000",
            "flow.mesh.viscosity_ratio: it is a key of [flow.paper]",
            "name: expected a text in quotes",
            "particles[0].position[0]: expected a finite number",
            "particles[0].position[1]: expected a number",
            "particles[0].radius: add a line like `radius = 0.05`",
            "time.step: expected a number greater than 0",
            "time.end: add a line like `end = 10.0`",
        ];
        let mut lines = found(text);
        let mut expected = expected.to_vec();
        lines.sort();
        expected.sort();
        assert_eq!(lines.len(), expected.len(), "{lines:#?}");
        for (line, expected) in lines.iter().zip(expected) {
            assert!(line.starts_with(expected), "{line} is not {expected}");
        }
    }

    #[test]
    fn ranges_are_told_in_words() {
        let words = |range: serde_json::Value| range_in_words(&range);
        assert_eq!(words(serde_json::json!({ "minimum": 1e-15, "maximum": 1e-3 })), "from 1e-15 to 1e-3");
        assert_eq!(
            words(serde_json::json!({ "exclusiveMinimum": 0, "maximum": 0.5 })),
            "greater than 0, at most 0.5"
        );
        assert_eq!(
            words(serde_json::json!({ "minimum": 0, "exclusiveMaximum": 1 })),
            "from 0 to less than 1"
        );
        assert_eq!(words(serde_json::json!({})), "of any size");
    }
}
