//! Messages of a step: what rank zero says to all, what it deals to each, what it hears from each.

use gluey_contact::part::{PartFrame, RankShare};
use gluey_parallel::{Communicator, Message, Number, Ranks};

use super::words;

/// What all ranks do next.
pub(super) enum Verdict<const D: usize> {
    /// Take what was sent, and solve.
    Deal(PartFrame<D>),
    Done,
    Failed(String),
}

impl<const D: usize> Verdict<D> {
    /// For rank zero.
    pub fn tell(&self, ranks: &Ranks) {
        let (kind, mut numbers) = match self {
            Self::Done => (0.0, Vec::new()),
            Self::Deal(frame) => (1.0, words::of_frame(frame)),
            Self::Failed(message) => (2.0, message.bytes().map(f64::from).collect()),
        };
        ranks.share(&mut [kind, numbers.len() as f64]);
        ranks.share(&mut numbers);
    }

    /// For the others.
    pub fn hear(ranks: &Ranks) -> Self {
        let mut head = [0.0; 2];
        ranks.share(&mut head);
        let mut numbers = vec![0.0; head[1] as usize];
        ranks.share(&mut numbers);
        match head[0] as u8 {
            0 => Self::Done,
            1 => Self::Deal(words::frame_of(&numbers)),
            _ => {
                let bytes: Vec<u8> = numbers.into_iter().map(|byte| byte as u8).collect();
                Self::Failed(String::from_utf8_lossy(&bytes).into_owned())
            }
        }
    }
}

/// What each rank gets from rank zero, who has it for all.
pub(super) fn partition<const D: usize>(ranks: &Ranks, mut all: Vec<RankShare<D>>) -> RankShare<D> {
    let others = all.split_off(all.len().min(1));
    match all.pop() {
        Some(own) => {
            let words = others.iter().map(words::of_dealt);
            scatter(ranks, Some(std::iter::once(Vec::new()).chain(words).collect()));
            own
        }
        None => words::dealt_of(ranks.rank(), &scatter(ranks, None)),
    }
}

/// What rank zero, which alone has some, has for each rank.
pub(super) fn scatter(ranks: &Ranks, words: Option<Vec<Vec<u64>>>) -> Vec<u64> {
    let mut words = words.unwrap_or_default();
    let mut lengths = vec![0.0; ranks.size()];
    lengths.iter_mut().zip(&words).for_each(|(length, words)| *length = words.len() as f64);
    ranks.share(&mut lengths);
    let rank = ranks.rank();
    if rank > 0 {
        let mut message = [Message { rank: 0, bytes: vec![0; lengths[rank] as usize * u64::SIZE] }];
        ranks.exchange(&[], &mut message);
        return words_of(&message[0].bytes);
    }
    let message = |(rank, words): (usize, &Vec<u64>)| Message { rank, bytes: bytes_of(words) };
    let told: Vec<Message> = words.iter().enumerate().skip(1).map(message).collect();
    ranks.exchange(&told, &mut []);
    if words.is_empty() { Vec::new() } else { words.swap_remove(0) }
}

/// The words of all ranks in their order, on rank zero.
pub(super) fn collect(ranks: &Ranks, own: &[u64]) -> Option<Vec<Vec<u64>>> {
    let lengths = ranks.all_gather(&[own.len() as u64]);
    if ranks.rank() > 0 {
        ranks.exchange(&[Message { rank: 0, bytes: bytes_of(own) }], &mut []);
        return None;
    }
    let coming =
        |(rank, &length): (usize, &u64)| Message { rank, bytes: vec![0; length as usize * u64::SIZE] };
    let mut messages: Vec<Message> = lengths.iter().enumerate().skip(1).map(coming).collect();
    ranks.exchange(&[], &mut messages);
    let heard = messages.iter().map(|message| words_of(&message.bytes));
    Some(std::iter::once(own.to_vec()).chain(heard).collect())
}

fn bytes_of(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn words_of(bytes: &[u8]) -> Vec<u64> {
    bytes.chunks_exact(u64::SIZE).map(u64::read).collect()
}
