//! Whose particles are, where several ranks share them.

/// Whose the particles of a list are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ownership {
    /// Number of each particle among those of all ranks.
    pub names: Vec<u32>,
    pub is_own: Vec<bool>,
}

impl Ownership {
    /// Whether the pair of two particles belongs here.
    pub(super) fn has_pair(&self, one: u32, other: u32) -> bool {
        let [one, other] = [one, other].map(|particle| particle as usize);
        self.is_own[if self.names[one] < self.names[other] { one } else { other }]
    }
}
