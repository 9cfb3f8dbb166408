//! A key and the values it takes: `time.step=0.1,0.05`.

use std::str::FromStr;

use crate::case::{BadOverride, Override};

/// A key of a case and the values that a study gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptKey {
    /// The key, as it was written.
    pub key: String,
    /// The values, each as what sets the key to it.
    pub values: Vec<Override>,
}

impl FromStr for SweptKey {
    type Err = BadOverride;

    /// Reads `key=value,value,...`. Values are those of `--set`; commas in lists and texts divide nothing.
    fn from_str(text: &str) -> Result<Self, BadOverride> {
        let (key, values) = text.split_once('=').ok_or(BadOverride::NoValue)?;
        let values = split(values).into_iter().map(|value| format!("{key}={value}").parse());
        Ok(Self { key: key.trim().to_owned(), values: values.collect::<Result<_, _>>()? })
    }
}

/// The value of what sets a key, as it was written.
pub(super) fn written(set: &Override) -> String {
    set.text.split_once('=').map_or(String::new(), |(_, value)| value.trim().to_owned())
}

/// Parts of a text between commas that stand neither in brackets nor in quotes.
fn split(text: &str) -> Vec<&str> {
    let (mut parts, mut begin, mut depth, mut quote) = (Vec::new(), 0, 0usize, None);
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(&text[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[begin..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_divided_by_commas_outside_of_lists_and_texts() {
        let axis: SweptKey = "particles.1.position=[0.7,0.5], [0.7,0.49]".parse().expect("an axis");
        assert_eq!(axis.key, "particles.1.position");
        let values: Vec<String> = axis.values.iter().map(written).collect();
        assert_eq!(values, ["[0.7,0.5]", "[0.7,0.49]"]);
        assert_eq!(split("\"a,b\",c"), ["\"a,b\"", "c"]);
        assert!("time.step=0.1,".parse::<SweptKey>().is_err());
        assert!("time.step".parse::<SweptKey>().is_err());
    }
}
