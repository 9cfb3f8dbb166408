//! Where a thread works off chunks.
//!
//! Buffers belong to nobody: an operator takes as many as it has threads for the time it is applied. They are
//! made once for all operators of a program, and what one has brought into the cache serves the next.

use std::sync::{Mutex, PoisonError};

use gluey_linalg::Scalar;

use super::simd::Nodes;

/// The buffers of one thread.
#[derive(Clone, Debug)]
pub struct Buffers<T> {
    x: Vec<T>,
    y: Vec<T>,
    /// Fields at quadrature points.
    points: Vec<T>,
}

/// Alignment of a buffer, in bytes: no node crosses a line of the cache.
const ALIGNMENT: usize = 64;
/// Numbers of a buffer. Pages that no chunk reaches are never touched, so they take no memory.
const BUFFER: usize = (4 << 16) + ALIGNMENT / 4;

impl<T: Scalar> Buffers<T> {
    fn new() -> Self {
        Self { x: vec![T::ZERO; BUFFER], y: vec![T::ZERO; BUFFER], points: Vec::new() }
    }

    /// Nodes that are read, nodes that are written, and room for fields at points.
    pub(super) fn split(&mut self) -> (&mut Nodes<T>, &mut Nodes<T>, &mut [T]) {
        (nodes_in(&mut self.x), nodes_in(&mut self.y), &mut self.points)
    }
}

fn nodes_in<T>(buffer: &mut [T]) -> &mut Nodes<T> {
    let offset = buffer.as_ptr().align_offset(ALIGNMENT).min(ALIGNMENT / 4);
    let (nodes, _) = buffer[offset..].as_chunks_mut::<4>();
    (&mut nodes[..1 << 16]).try_into().expect("the buffer is longer than all locals")
}

/// The buffers that are not in use.
#[derive(Debug)]
pub struct Pool<T> {
    free: Mutex<Vec<Buffers<T>>>,
}

impl<T: Scalar> Pool<T> {
    pub(super) const fn new() -> Self {
        Self { free: Mutex::new(Vec::new()) }
    }

    /// Moves this many buffers to `to`, with room for `points` numbers at points.
    pub(super) fn lend(&self, count: usize, points: usize, to: &mut Vec<Buffers<T>>) {
        {
            let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
            let left = free.len().saturating_sub(count);
            to.extend(free.drain(left..));
        }
        to.resize_with(count, Buffers::new);
        for buffers in to {
            buffers.points.resize(buffers.points.len().max(points), T::ZERO);
        }
    }

    /// Takes them back.
    pub(super) fn take_back(&self, from: &mut Vec<Buffers<T>>) {
        self.free.lock().unwrap_or_else(PoisonError::into_inner).append(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_made_once() {
        let pool = Pool::<f32>::new();
        let (mut first, mut second) = (Vec::new(), Vec::new());
        pool.lend(2, 10, &mut first);
        pool.lend(1, 0, &mut second);
        let places: Vec<_> = first.iter().chain(&second).map(|b| b.x.as_ptr()).collect();
        pool.take_back(&mut first);
        pool.take_back(&mut second);
        pool.lend(3, 5, &mut first);
        assert!(first.iter().all(|b| places.contains(&b.x.as_ptr()) && b.points.len() >= 5));
        assert!(pool.free.lock().unwrap().is_empty());
    }
}
