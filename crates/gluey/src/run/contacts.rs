//! The model of contact in runs.

use gluey_contact::{PairContact, WithFixed};

/// Contact among particles some of which may move as they are told.
pub(super) type Contacts<const D: usize> = PairContact<D, WithFixed>;
