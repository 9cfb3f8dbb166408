//! Threads for vectors, with the same bits for any number of them.
//!
//! A vector is cut into pieces whose length depends on its own alone; sums over pieces are added from first
//! to last. Short vectors, and all vectors in a pool of one thread, are handled by the calling thread.

use std::ops::Range;

use rayon::prelude::*;

/// Shortest vector that is shared by threads: below, waking them takes longer than the work.
const SHORTEST: usize = 1 << 15;
/// Most pieces in a sum; their partial sums lie on the stack.
const MOST_PIECES: usize = 256;
/// The length of a piece is a multiple of this.
const UNIT: usize = 4096;

/// Whether vectors of length `len` are shared by threads.
pub fn is_shared(len: usize) -> bool {
    len >= SHORTEST && rayon::current_num_threads() > 1
}

/// Length of the pieces of a vector of length `len`.
pub fn piece_len(len: usize) -> usize {
    len.div_ceil(MOST_PIECES).next_multiple_of(UNIT).max(UNIT)
}

/// `sum_k term(piece k)` over the pieces of `0..len`.
pub fn sum<const N: usize>(len: usize, term: impl Fn(Range<usize>) -> [f64; N] + Sync) -> [f64; N] {
    let piece = piece_len(len);
    let range = |k: usize| k * piece..((k + 1) * piece).min(len);
    let count = len.div_ceil(piece);
    if !is_shared(len) {
        return add((0..count).map(|k| term(range(k))));
    }
    let mut partial = [[0.0; N]; MOST_PIECES];
    partial[..count].par_iter_mut().enumerate().for_each(|(k, partial)| *partial = term(range(k)));
    add(partial[..count].iter().copied())
}

/// Changes `x` piece by piece with `term(first index, piece)` and sums what that returns.
pub fn update_and_sum<T: Send, const N: usize>(
    x: &mut [T],
    term: impl Fn(usize, &mut [T]) -> [f64; N] + Sync,
) -> [f64; N] {
    let (len, piece) = (x.len(), piece_len(x.len()));
    let chunks = |(k, chunk): (usize, &mut [T])| term(k * piece, chunk);
    if !is_shared(len) {
        return add(x.chunks_mut(piece).enumerate().map(chunks));
    }
    let mut partial = [[0.0; N]; MOST_PIECES];
    let count = len.div_ceil(piece);
    let pieces = x.par_chunks_mut(piece).enumerate().zip(&mut partial[..count]);
    pieces.for_each(|(chunk, partial)| *partial = chunks(chunk));
    add(partial[..count].iter().copied())
}

fn add<const N: usize>(terms: impl Iterator<Item = [f64; N]>) -> [f64; N] {
    terms.fold([0.0; N], |sum, term| std::array::from_fn(|n| sum[n] + term[n]))
}

/// `work(first index, piece)` on all pieces of `x`.
pub fn for_each<T: Send>(x: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if !is_shared(x.len()) {
        return work(0, x);
    }
    let piece = piece_len(x.len());
    x.par_chunks_mut(piece).enumerate().for_each(|(k, x)| work(k * piece, x));
}

/// Bytes from which memory comes from the system page by page.
const OF_THE_SYSTEM: usize = 1 << 17;

/// A vector of equal entries, as `vec![value; len]`, whose memory has been written, by the threads.
///
/// A vector of zeros fresh from the system is no memory at all: a page that is read before it is written is
/// one page of zeros for all, and its first write a second fault, for which every other thread of the process
/// is interrupted. Vectors that are added to are made here.
pub fn filled<T: Copy + Send + Sync>(value: T, len: usize) -> Vec<T> {
    let mut x = vec![value; len];
    if size_of::<T>() * len >= OF_THE_SYSTEM {
        // The compiler knows that these are zeros already.
        for_each(std::hint::black_box(x.as_mut_slice()), |_, x| x.fill(value));
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_threads<R: Send>(threads: usize, work: impl Fn() -> R + Send) -> R {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
    }

    #[test]
    fn sums_have_the_same_bits_for_any_number_of_threads() {
        for len in [0, 1, UNIT, UNIT + 1, SHORTEST, SHORTEST + 17, 3_000_001] {
            let x: Vec<f64> = (0..len).map(|i| (0.37 * i as f64).sin()).collect();
            let run = || {
                let mut y = x.clone();
                let total = sum(len, |range| [x[range.clone()].iter().sum(), range.len() as f64]);
                let changed = update_and_sum(&mut y, |first, piece| {
                    piece.iter_mut().zip(&x[first..]).for_each(|(y, x)| *y += 0.3 * x);
                    [piece.iter().sum()]
                });
                (total, changed, y)
            };
            let one = with_threads(1, run);
            assert_eq!(one.0[1], len as f64);
            assert!((one.1[0] - 1.3 * one.0[0]).abs() <= 1e-9 * (1.0 + len as f64));
            for threads in [2, 4] {
                assert_eq!(with_threads(threads, run), one);
            }
        }
    }

    #[test]
    fn filled_vectors_have_equal_entries() {
        for (len, threads) in [(0, 1), (10, 1), (100_003, 1), (100_003, 3)] {
            assert_eq!(with_threads(threads, || filled([0.5, 2.0], len)), vec![[0.5, 2.0]; len]);
        }
    }

    #[test]
    fn every_entry_is_visited_once() {
        for (len, threads) in [(10, 1), (100_003, 1), (100_003, 3)] {
            let x = with_threads(threads, || {
                let mut x = vec![0; len];
                for_each(&mut x, |first, x| x.iter_mut().enumerate().for_each(|(i, x)| *x += first + i));
                x
            });
            assert!((0..len).all(|i| x[i] == i));
        }
    }
}
