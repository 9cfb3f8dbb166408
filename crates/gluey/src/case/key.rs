//! Places in a case.

use std::fmt;

/// A place in a case: names of tables and keys, indices of arrays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Key(pub Vec<KeyPart>);

/// A step down a [`Key`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum KeyPart {
    /// A key of a table.
    Name(String),
    /// An entry of an array, from 0.
    Index(usize),
}

impl Key {
    /// Whether this is the case as a whole.
    pub fn is_root(&self) -> bool {
        self.0.is_empty()
    }

    /// The key below this one in a table.
    pub fn name(&self, name: &str) -> Self {
        self.with(KeyPart::Name(name.to_owned()))
    }

    /// The entry below this one in an array.
    pub fn index(&self, index: usize) -> Self {
        self.with(KeyPart::Index(index))
    }

    /// Whether it is particles, or something of one.
    pub(crate) fn is_of_particles(&self) -> bool {
        self.0.first() == Some(&KeyPart::Name("particles".to_owned()))
    }

    /// The last name in it, indices left out.
    pub(crate) fn last_name(&self) -> Option<&str> {
        self.0.iter().rev().find_map(|part| match part {
            KeyPart::Name(name) => Some(name.as_str()),
            KeyPart::Index(_) => None,
        })
    }

    fn with(&self, part: KeyPart) -> Self {
        let mut parts = self.0.clone();
        parts.push(part);
        Self(parts)
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, part) in self.0.iter().enumerate() {
            match part {
                KeyPart::Name(name) if depth == 0 => write!(f, "{name}")?,
                KeyPart::Name(name) => write!(f, ".{name}")?,
                KeyPart::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}
