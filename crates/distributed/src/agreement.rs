//! What all ranks have to know before they go on: whether one of them failed, and lists of any length.

use gluey_parallel::Communicator;
use gluey_stokes::StokesError;

use crate::flow::FlowError;

/// Bytes of a message that others pass on, at most.
const LONGEST_MESSAGE: usize = 400;

/// A failure of one rank is one of all, which say what it was.
pub fn agreed<T>(ranks: &dyn Communicator, outcome: Result<T, StokesError>) -> Result<T, FlowError> {
    let message = outcome.as_ref().err().map(ToString::to_string);
    let failed = ranks.all_gather(&[u64::from(message.is_some())]);
    let Some(rank) = failed.iter().position(|&failed| failed == 1) else { return Ok(outcome?) };
    let mut bytes = vec![0.0; LONGEST_MESSAGE];
    if let Some(text) = message.filter(|_| rank == ranks.rank()) {
        bytes.iter_mut().zip(text.bytes()).for_each(|(number, byte)| *number = f64::from(byte));
    }
    ranks.sum(&mut bytes);
    let bytes: Vec<u8> = bytes.into_iter().map(|byte| byte as u8).take_while(|&byte| byte != 0).collect();
    match outcome {
        Err(error) => Err(error.into()),
        Ok(_) => Err(FlowError::Elsewhere { rank, message: String::from_utf8_lossy(&bytes).into_owned() }),
    }
}

/// The records of all ranks, in their order.
pub fn gathered<const N: usize>(ranks: &dyn Communicator, own: &[[u64; N]]) -> Vec<[u64; N]> {
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
