//! Why a rank failed, as the others know it.

/// A rank that failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RankFailure {
    /// The first rank, by number, that failed of itself.
    pub rank: usize,
    /// Number of ranks.
    pub size: usize,
    /// What it said.
    pub message: String,
}

impl std::fmt::Display for RankFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rank {} of {} failed: {}", self.rank, self.size, self.message)
    }
}

impl std::error::Error for RankFailure {}
