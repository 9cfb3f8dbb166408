//! Copies of what other ranks own.
//!
//! Each number belongs to one rank, its owner; ranks that read it, or add to it, keep a copy: a ghost. An
//! update brings the owners' values to the ghosts, an accumulation the ghosts' values to the owners, which
//! add them in the order of the ranks. One is the transpose of the other.

use std::ops::AddAssign;

use crate::communicator::{Communicator, Message};
use crate::number::{Number, read_all, write_all};

/// A ghost that a rank wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Wanted {
    /// The rank that owns it.
    pub owner: usize,
    /// What both call it.
    pub key: u64,
    /// Where the copy stands.
    pub place: u32,
}

/// A plan of who sends what to whom, as often as it is needed.
#[derive(Clone, Debug, Default)]
pub struct GhostPlan {
    /// Ghosts elsewhere of what stands here.
    owned: Side,
    /// Ghosts here.
    ghosts: Side,
}

/// Places, rank by rank, and the messages they are read from or written to.
#[derive(Clone, Debug, Default)]
struct Side {
    places: Vec<Vec<u32>>,
    messages: Vec<Message>,
}

impl Side {
    fn push(&mut self, rank: usize, places: Vec<u32>) {
        if !places.is_empty() {
            self.places.push(places);
            self.messages.push(Message { rank, bytes: Vec::new() });
        }
    }

    /// Makes room for as many bytes as items of this size need.
    fn fit(&mut self, item: usize) {
        for (places, message) in self.places.iter().zip(&mut self.messages) {
            message.bytes.resize(places.len() * item, 0);
        }
    }

    /// Copies from `x` to the messages.
    fn pack<T: Number, const C: usize>(&mut self, x: &[T]) {
        self.fit(C * T::SIZE);
        for (places, message) in self.places.iter().zip(&mut self.messages) {
            for (&place, item) in places.iter().zip(message.bytes.chunks_exact_mut(C * T::SIZE)) {
                let values = &x[place as usize * C..][..C];
                values.iter().zip(item.chunks_exact_mut(T::SIZE)).for_each(|(x, bytes)| x.write(bytes));
            }
        }
    }

    /// Hands `take` each value that came and where it belongs.
    fn unpack<T: Number, const C: usize>(&self, x: &mut [T], take: impl Fn(&mut T, T)) {
        for (places, message) in self.places.iter().zip(&self.messages) {
            for (&place, item) in places.iter().zip(message.bytes.chunks_exact(C * T::SIZE)) {
                let values = &mut x[place as usize * C..][..C];
                values.iter_mut().zip(read_all(item)).for_each(|(x, value)| take(x, value));
            }
        }
    }

    fn count(&self) -> usize {
        self.places.iter().map(Vec::len).sum()
    }

    /// The places rank by rank.
    fn by_rank(&self) -> impl Iterator<Item = (usize, &Vec<u32>)> {
        self.messages.iter().map(|message| message.rank).zip(&self.places)
    }

    /// Places that `keep`, which is asked once for each in this order.
    fn filtered(&self, mut keep: impl FnMut(u32) -> bool) -> Self {
        let mut kept = Self::default();
        for (rank, places) in self.by_rank() {
            kept.push(rank, places.iter().copied().filter(|&place| keep(place)).collect());
        }
        kept
    }

    /// The places of several sides in one, entry by entry.
    fn joined(sides: &[(&Self, usize, usize)]) -> Self {
        let ranks = sides.iter().flat_map(|(side, ..)| side.messages.iter().map(|message| message.rank));
        let mut ranks: Vec<usize> = ranks.collect();
        ranks.sort_unstable();
        ranks.dedup();
        let mut joined = Self::default();
        for rank in ranks {
            let mut entries = Vec::new();
            for &(side, width, first) in sides {
                let of_rank = side.by_rank().filter(|of| of.0 == rank).flat_map(|of| of.1);
                let of_place =
                    |&place: &u32| (0..width).map(move |c| (first + place as usize * width + c) as u32);
                entries.extend(of_rank.flat_map(of_place));
            }
            joined.push(rank, entries);
        }
        joined
    }
}

impl GhostPlan {
    /// Asks the owners of `wanted` for updates; `find` says where something that this rank owns stands.
    ///
    /// # Panics
    /// If a rank is asked for what it does not own.
    pub fn new(ranks: &dyn Communicator, mut wanted: Vec<Wanted>, find: impl Fn(u64) -> Option<u32>) -> Self {
        wanted.sort_unstable();
        wanted.dedup();
        let mut plan = Self::default();
        let mut asked = Vec::new();
        for of_owner in wanted.chunk_by(|a, b| a.owner == b.owner) {
            let keys: Vec<u64> = of_owner.iter().map(|wanted| wanted.key).collect();
            let mut bytes = Vec::new();
            write_all(&keys, &mut bytes);
            asked.push(Message { rank: of_owner[0].owner, bytes });
            plan.ghosts.push(of_owner[0].owner, of_owner.iter().map(|wanted| wanted.place).collect());
        }
        for Message { rank, bytes } in deliver(ranks, &asked) {
            let place = |key| find(key).expect("ranks agree on who owns what");
            plan.owned.push(rank, read_all(&bytes).map(place).collect());
        }
        plan
    }

    /// Several plans in one message to each rank: each a plan, the number of components of its fields, and
    /// where these begin in a vector that holds them all. The plan is one of entries of that vector, with one
    /// component each.
    #[must_use]
    pub fn joined(plans: &[(&Self, usize, usize)]) -> Self {
        let side = |of: fn(&Self) -> &Side| {
            Side::joined(
                &plans.iter().map(|&(plan, width, first)| (of(plan), width, first)).collect::<Vec<_>>(),
            )
        };
        Self { owned: side(|plan| &plan.owned), ghosts: side(|plan| &plan.ghosts) }
    }

    /// The plan of the ghosts that `keep` here, and elsewhere as it does there.
    #[must_use]
    pub fn restricted(&self, ranks: &dyn Communicator, keep: impl Fn(u32) -> bool) -> Self {
        let kept = |(rank, places): (usize, &Vec<u32>)| Message {
            rank,
            bytes: places.iter().map(|&place| u8::from(keep(place))).collect(),
        };
        let told: Vec<Message> = self.ghosts.by_rank().map(kept).collect();
        let mut heard: Vec<Message> = (self.owned.by_rank())
            .map(|(rank, places)| Message { rank, bytes: vec![0; places.len()] })
            .collect();
        ranks.exchange(&told, &mut heard);
        let mut wanted = heard.iter().flat_map(|message| &message.bytes);
        Self { owned: self.owned.filtered(|_| wanted.next() == Some(&1)), ghosts: self.ghosts.filtered(keep) }
    }

    /// Number of ghosts here.
    pub fn ghost_count(&self) -> usize {
        self.ghosts.count()
    }

    /// Number of ranks that this one sends updates to.
    pub fn neighbour_count(&self) -> usize {
        self.owned.places.len()
    }

    /// Places of the ghosts here, rank by rank.
    pub fn ghosts(&self) -> impl Iterator<Item = u32> {
        self.ghosts.places.iter().flatten().copied()
    }

    /// Places here of what has ghosts elsewhere, rank by rank.
    pub fn owned(&self) -> impl Iterator<Item = u32> {
        self.owned.places.iter().flatten().copied()
    }

    /// Sets the ghosts of a field with `C` interleaved components to the values of their owners.
    pub fn update<T: Number, const C: usize>(&mut self, ranks: &dyn Communicator, x: &mut [T]) {
        self.owned.pack::<T, C>(x);
        self.ghosts.fit(C * T::SIZE);
        ranks.exchange(&self.owned.messages, &mut self.ghosts.messages);
        self.ghosts.unpack::<T, C>(x, |x, value| *x = value);
    }

    /// Adds the ghosts of a field with `C` interleaved components to the values of their owners, in the
    /// order of the ranks. The ghosts are zero then.
    pub fn accumulate<T: Number + AddAssign, const C: usize>(
        &mut self,
        ranks: &dyn Communicator,
        x: &mut [T],
    ) {
        self.ghosts.pack::<T, C>(x);
        self.owned.fit(C * T::SIZE);
        ranks.exchange(&self.ghosts.messages, &mut self.owned.messages);
        self.owned.unpack::<T, C>(x, |x, value| *x += value);
        for place in self.ghosts.places.iter().flatten() {
            x[*place as usize * C..][..C].fill(T::default());
        }
    }
}

/// Records for ranks that do not expect them. Returns what came, in the order of the ranks, of each in the
/// order in which it was given; what a rank has for itself is among it.
pub fn route<const N: usize>(ranks: &dyn Communicator, records: Vec<(usize, [u64; N])>) -> Vec<[u64; N]> {
    let mut records = records;
    records.sort_by_key(|record| record.0);
    let (mut messages, mut own) = (Vec::new(), Vec::new());
    for of_rank in records.chunk_by(|a, b| a.0 == b.0) {
        let (rank, mut bytes) = (of_rank[0].0, Vec::new());
        if rank == ranks.rank() {
            own.extend(of_rank.iter().map(|record| record.1));
            continue;
        }
        let numbers: Vec<u64> = of_rank.iter().flat_map(|record| record.1).collect();
        write_all(&numbers, &mut bytes);
        messages.push(Message { rank, bytes });
    }
    drop(records);
    let (mut all, mut own) = (Vec::new(), Some(own));
    for message in deliver(ranks, &messages) {
        if message.rank > ranks.rank() {
            all.extend(own.take().into_iter().flatten());
        }
        let numbers: Vec<u64> = read_all(&message.bytes).collect();
        all.extend_from_slice(numbers.as_chunks::<N>().0);
    }
    all.extend(own.into_iter().flatten());
    all
}

/// Messages of any length to ranks that do not expect them: lengths go before. Returns what came, in the
/// order of the ranks.
fn deliver(ranks: &dyn Communicator, messages: &[Message]) -> Vec<Message> {
    let others = || (0..ranks.size()).filter(|&rank| rank != ranks.rank());
    let mut lengths: Vec<Message> =
        others().map(|rank| Message { rank, bytes: 0u64.to_le_bytes().to_vec() }).collect();
    let mut coming = lengths.clone();
    for message in messages {
        assert_ne!(message.rank, ranks.rank(), "a rank asks others only");
        let own = usize::from(message.rank > ranks.rank());
        lengths[message.rank - own].bytes = length_of(message);
    }
    ranks.exchange(&lengths, &mut coming);
    let length = |message: &Message| u64::read(&message.bytes) as usize;
    let mut received: Vec<Message> = coming
        .iter()
        .map(|message| Message { rank: message.rank, bytes: vec![0; length(message)] })
        .filter(|message| !message.bytes.is_empty())
        .collect();
    ranks.exchange(messages, &mut received);
    received
}

/// The length of a message, as bytes.
fn length_of(message: &Message) -> Vec<u8> {
    (message.bytes.len() as u64).to_le_bytes().to_vec()
}
