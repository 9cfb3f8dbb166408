//! The record that contact models keep from step to step.

use crate::{Contact, ContactState, MemoryError, PairState};

/// The contacts of the last step, and the memory they leave.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactRecord {
    pub state: ContactState,
    pub contacts: Vec<Contact>,
}

impl ContactRecord {
    /// The gap that the last step left of what is remembered, unless the record was resumed.
    pub(crate) fn expected(&self, place: usize) -> Option<f64> {
        self.contacts.get(place).map(|contact| contact.gap)
    }

    /// Replaces the contacts by those that `list` adds, and the memory by theirs.
    pub(crate) fn replace(&mut self, list: impl FnOnce(&mut Vec<Contact>)) {
        self.contacts.clear();
        list(&mut self.contacts);
        self.contacts.sort_unstable_by_key(|contact| contact.pair);
        self.state.pairs.clear();
        let state = |contact: &Contact| PairState {
            pair: contact.pair,
            gamma: contact.gamma,
            lambda: contact.lambda,
        };
        self.state.pairs.extend(self.contacts.iter().map(state));
    }

    /// Goes on from a checkpoint; on an error nothing has changed.
    pub(crate) fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.state = state.checked()?;
        self.contacts.clear();
        Ok(())
    }

    /// Changes the sign of remembered forces.
    pub(crate) fn reverse(&mut self) {
        self.state.reverse();
    }
}
