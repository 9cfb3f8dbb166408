//! Lanes of any processor.

use gluey_linalg::Scalar;

use super::{Lanes, Nodes};

/// Four numbers.
#[derive(Clone, Copy)]
pub struct Portable<T>([T; 4]);

impl<T: Scalar> Portable<T> {
    #[inline(always)]
    fn map(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        Self(std::array::from_fn(|l| f(self.0[l], other.0[l])))
    }
}

impl<T: Scalar> Lanes for Portable<T> {
    type Scalar = T;
    const COUNT: usize = 4;

    #[inline(always)]
    fn splat(x: T) -> Self {
        Self([x; 4])
    }

    #[inline(always)]
    fn load(from: &[T]) -> Self {
        Self(std::array::from_fn(|l| from[l]))
    }

    #[inline(always)]
    fn store(self, to: &mut [T]) {
        to[..4].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.map(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.map(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.map(other, |a, b| a * b)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }

    #[inline(always)]
    fn gather(nodes: &Nodes<T>, index: &[u16], stride: usize) -> [Self; 4] {
        std::array::from_fn(|c| Self(std::array::from_fn(|l| nodes[index[l * stride] as usize][c])))
    }

    #[inline(always)]
    fn scatter(values: [Self; 4], nodes: &mut Nodes<T>, index: &[u16], stride: usize) {
        for l in 0..4 {
            let node = &mut nodes[index[l * stride] as usize];
            for c in 0..4 {
                node[c] += values[c].0[l];
            }
        }
    }
}
