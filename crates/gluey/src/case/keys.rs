//! The keys of a case file one by one, for documentation: read off the schema.
//!
//! The comment of a key ends with its unit and its default, "Unit: length. Default: 1.", where it has them.

use serde_json::Value as Schema;

use super::Case;
use super::form::range_in_words;

/// A key of a case file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaseKey {
    /// The table it stands in, as in a case file: `[flow.mesh]`, `[[particles]]`; empty at the top.
    pub table: String,
    /// What that table is about.
    pub about: String,
    /// Its name.
    pub name: String,
    /// What it means.
    pub meaning: String,
    /// Type and range of its value.
    pub values: String,
    /// Names to choose from, and what they mean where their comments say so.
    pub choices: Vec<(String, String)>,
    /// Unit of its number or numbers.
    pub unit: Option<String>,
    /// What is taken where it is absent; none for a key that must be there.
    pub default: Option<String>,
}

impl Case {
    /// All keys of a case file, table by table.
    ///
    /// ```
    /// let keys = gluey::Case::keys();
    /// let band = keys.iter().find(|key| key.name == "band").expect("a key of the mesh");
    /// assert_eq!((band.table.as_str(), band.unit.as_deref()), ("[flow.mesh]", Some("cells")));
    /// ```
    pub fn keys() -> Vec<CaseKey> {
        let mut keys = Vec::new();
        collect(Self::schema(), "", false, &mut keys);
        keys
    }
}

/// Keys of a table, then those of the tables in it.
fn collect(schema: &Schema, path: &str, is_list: bool, keys: &mut Vec<CaseKey>) {
    let table = match (path, is_list) {
        ("", _) => String::new(),
        (path, true) => format!("[[{path}]]"),
        (path, false) => format!("[{path}]"),
    };
    let about = described(schema).0;
    let body = if is_list { &schema["items"] } else { schema };
    let parts = || body["properties"].as_object().into_iter().flatten();
    let is_table = |part: &Schema| part["type"] == "object" || part["items"]["type"] == "object";
    for (name, part) in parts().filter(|(_, part)| !is_table(part)) {
        keys.push(key(name, part, &table, &about));
    }
    for (name, part) in parts().filter(|(_, part)| is_table(part)) {
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        collect(part, &path, part["type"] == "array", keys);
    }
}

fn key(name: &str, schema: &Schema, table: &str, about: &str) -> CaseKey {
    let (meaning, unit, default) = described(schema);
    let texts = |list: &Schema| -> Vec<String> {
        let texts = list.as_array().into_iter().flatten().filter_map(Schema::as_str);
        texts.map(str::to_owned).collect()
    };
    let mut meanings = texts(&schema["x-taplo"]["docs"]["enumValues"]).into_iter();
    let names = texts(&schema["enum"]).into_iter();
    CaseKey {
        table: table.to_owned(),
        about: about.to_owned(),
        name: name.to_owned(),
        meaning,
        values: values(schema),
        choices: names.map(|name| (name, meanings.next().unwrap_or_default())).collect(),
        unit,
        default,
    }
}

/// Type and range in words.
fn values(schema: &Schema) -> String {
    let range = || match range_in_words(schema).as_str() {
        "of any size" => String::new(),
        range => format!(" {range}"),
    };
    match schema["type"].as_str().unwrap_or_default() {
        "number" => format!("number{}", range()),
        "integer" => format!("whole number{}", range()),
        "array" => match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
            (Some(least), Some(most)) => format!("list of {least} to {most} numbers"),
            _ => "list of numbers".to_owned(),
        },
        "boolean" => "true, false".to_owned(),
        _ if schema["enum"].is_array() => "name".to_owned(),
        _ => "text".to_owned(),
    }
}

/// Meaning, unit and default, as the comment of a key has them.
fn described(schema: &Schema) -> (String, Option<String>, Option<String>) {
    let text = schema["description"].as_str().unwrap_or_default();
    let (text, default) = split_last(text, "Default: ");
    let (text, unit) = split_last(text, "Unit: ");
    (text.to_owned(), unit, default)
}

/// A text without its last sentence, and what that says after `word`, if it begins with it.
fn split_last<'a>(text: &'a str, word: &str) -> (&'a str, Option<String>) {
    match text.rsplit_once(word) {
        Some((rest, last)) => (rest.trim_end(), Some(last.trim_end_matches('.').to_owned())),
        None => (text, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_states_its_unit_and_its_default() {
        let keys = Case::keys();
        assert!(keys.len() > 50, "{}", keys.len());
        let needed = ["name", "dimension", "position", "radius", "step", "end", "kind"];
        for key in &keys {
            let is_number = key.values.contains("number");
            assert_eq!(key.unit.is_some(), is_number, "{key:?}");
            let must_be_there = needed.contains(&key.name.as_str()) && !key.table.starts_with("[suspension");
            assert_eq!(key.default.is_none(), must_be_there, "{key:?}");
            assert!(!key.meaning.is_empty() && key.meaning.ends_with('.'), "{key:?}");
        }
    }

    /// Comments may not drift from the code.
    #[test]
    fn the_defaults_that_comments_state_are_those_of_the_code() {
        fn walk(schema: &Schema, compared: &mut usize) {
            let (_, _, stated) = described(schema);
            if let (Some(default), Some(stated)) = (schema.get("default"), stated) {
                let stated: toml::Table = toml::from_str(&format!("x = {stated}")).expect("a value");
                let stated = serde_json::to_value(&stated["x"]).expect("JSON");
                let are_equal =
                    stated == *default || stated.as_f64().is_some_and(|x| default.as_f64() == Some(x));
                assert!(are_equal, "{stated} is stated, {default} is so: {schema}");
                *compared += 1;
            }
            let parts = schema["properties"].as_object().into_iter().flatten();
            parts.for_each(|(_, part)| walk(part, compared));
            if schema["items"].is_object() {
                walk(&schema["items"], compared);
            }
        }
        let mut compared = 0;
        walk(Case::schema(), &mut compared);
        assert!(compared > 25, "{compared}");
    }
}
