//! The schema of case files, made of the types they are read into: keys, types, ranges, defaults and what
//! they mean. The loader, editors (`gluey schema`) and the documentation all take it from here.

use std::sync::LazyLock;

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::Case;

static SCHEMA: LazyLock<Value> = LazyLock::new(generate);

impl Case {
    /// The JSON schema (draft 7) of case files.
    ///
    /// ```
    /// let schema = gluey::Case::schema();
    /// assert_eq!(schema["properties"]["flow"]["properties"]["mesh"]["properties"]["band"]["default"], 2.0);
    /// ```
    pub fn schema() -> &'static Value {
        &SCHEMA
    }
}

fn generate() -> Value {
    let mut settings = SchemaSettings::draft07();
    settings.inline_subschemas = true;
    let mut schema = settings.into_generator().into_root_schema_for::<Case>().to_value();
    simplify(&mut schema);
    schema["title"] = json!("A case of gluey");
    schema
}

/// Takes out what a TOML file cannot hold (null) and what nobody reads, in all of the schema.
fn simplify(schema: &mut Value) {
    let Value::Object(object) = schema else { return };
    without_null(object);
    if let Some(choices) = object.remove("oneOf") {
        choices_of_names(object, &choices);
    }
    object.remove("format");
    if matches!(object.get("default"), Some(Value::Null | Value::Object(_) | Value::Array(_))) {
        // Keys that are absent by default, and tables whose keys state their own defaults.
        object.remove("default");
    }
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = text.replace("\n\n", "\u{1}").replace('\n', " ").replace('\u{1}', "\n\n");
    }
    if let Some(Value::Object(properties)) = object.get_mut("properties") {
        properties.values_mut().for_each(simplify);
    }
    if let Some(entries) = object.get_mut("items") {
        simplify(entries);
    }
}

/// `null` is how absent keys look like in JSON.
fn without_null(object: &mut Map<String, Value>) {
    let is_null = |choice: &Value| *choice == json!("null") || *choice == json!({ "type": "null" });
    if let Some(Value::Array(types)) = object.get("type") {
        let kind = types.iter().find(|kind| !is_null(kind)).cloned();
        object.insert("type".to_owned(), kind.unwrap_or_default());
    }
    if let Some(Value::Array(choices)) = object.remove("anyOf") {
        let kept = choices.into_iter().find(|choice| !is_null(choice));
        let Some(Value::Object(kept)) = kept else { return };
        for (key, value) in kept {
            // The description of a key is nearer than that of its type.
            object.entry(key).or_insert(value);
        }
    }
}

/// Names of which one is to be chosen, with what they mean where the editors of TOML look for it.
fn choices_of_names(object: &mut Map<String, Value>, choices: &Value) {
    let each = |name: &str| -> Vec<Value> {
        let choices = choices.as_array().into_iter().flatten();
        choices.filter_map(|choice| choice.get(name)).cloned().collect()
    };
    let meanings: Vec<Value> = each("description")
        .iter()
        .map(|text| json!(text.as_str().unwrap_or_default().replace('\n', " ")))
        .collect();
    object.insert("type".to_owned(), json!("string"));
    object.insert("enum".to_owned(), json!(each("const")));
    object.insert("x-taplo".to_owned(), json!({ "docs": { "enumValues": meanings } }));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the loader reads of a schema, and what only says something to people and editors. Numbers of
    /// coordinates depend on the dimension, which no schema can say: they are checked with the case.
    const READ: [&str; 10] = [
        "type",
        "properties",
        "additionalProperties",
        "required",
        "items",
        "enum",
        "minimum",
        "maximum",
        "exclusiveMinimum",
        "exclusiveMaximum",
    ];
    const TOLD: [&str; 8] =
        ["$schema", "title", "description", "default", "x-taplo", "pattern", "minItems", "maxItems"];

    fn check(schema: &Value, path: &str) {
        let object = schema.as_object().expect("a schema is an object");
        for keyword in object.keys() {
            assert!(READ.contains(&&**keyword) || TOLD.contains(&&**keyword), "{path}: {keyword}");
        }
        assert!(object.contains_key("description"), "{path}");
        if schema["type"] == "object" {
            assert_eq!(schema["additionalProperties"], false, "{path}");
        }
        let parts = schema["properties"].as_object().into_iter().flatten();
        parts.for_each(|(name, part)| check(part, &format!("{path}.{name}")));
        if schema["items"]["type"] == "object" {
            check(&schema["items"], &format!("{path}[]"));
        }
    }

    /// Whatever an editor refuses by the schema the loader refuses too, unknown keys above all.
    #[test]
    fn the_loader_reads_all_of_the_schema() {
        check(Case::schema(), "");
    }
}
