//! What all ranks have to know before they go on: whether one of them failed, and lists of any length.
//!
//! An error of a part is a [`PartError`], which no `?` makes a [`FlowError`]: that is one of all ranks, and
//! comes of [`agreed`], or of numbers that are the same on all.

use gluey_parallel::{Communicator, Ranks};

use crate::flow::{FlowError, PartError};

/// A failure of one rank is one of all, who say what the first of them said. All ranks call this.
pub fn agreed<T>(ranks: &Ranks, outcome: Result<T, impl Into<PartError>>) -> Result<T, FlowError> {
    match ranks.agreed(outcome.map_err(Into::into)) {
        Ok(outcome) => outcome.map_err(FlowError::Part),
        Err(first) => Err(FlowError::Elsewhere { rank: first.rank, message: first.message }),
    }
}

/// The records of all ranks, in their order.
pub fn gathered<const N: usize>(ranks: &Ranks, own: &[[u64; N]]) -> Vec<[u64; N]> {
    let counts = ranks.all_gather(&[own.len() as u64]);
    let most = counts.iter().copied().max().unwrap_or(0) as usize;
    if most == 0 {
        return Vec::new();
    }
    let mut padded = own.as_flattened().to_vec();
    padded.resize(most * N, 0);
    let all = ranks.all_gather(&padded);
    let of_rank = |(records, &count): (&[u64], &u64)| records.as_chunks::<N>().0[..count as usize].to_vec();
    all.chunks_exact(most * N).zip(&counts).flat_map(of_rank).collect()
}
