//! Vectors with one cell a lane, and the transposition between them and nodes.
//!
//! A node is four numbers: the components of its velocity, and after them its pressure.

use gluey_linalg::Scalar;

use super::buffers::Pool;

/// Velocity components and pressure at one node.
pub type Node<T> = [T; 4];
/// A buffer of nodes as long as an index of 16 bits reaches, so that no index needs to be checked.
pub type Nodes<T> = [Node<T>; 1 << 16];

/// Numbers of [`Lanes::COUNT`] cells.
pub trait Lanes: Copy {
    /// One number.
    type Scalar: Scalar;
    /// Number of lanes; a divisor of [`super::GROUP`].
    const COUNT: usize;

    /// The same number in all lanes.
    fn splat(x: Self::Scalar) -> Self;
    /// The first numbers of a slice.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes the first numbers of a slice.
    fn store(self, to: &mut [Self::Scalar]);
    /// `self + other`.
    fn add(self, other: Self) -> Self;
    /// `self - other`.
    fn sub(self, other: Self) -> Self;
    /// `self * other`.
    fn mul(self, other: Self) -> Self;
    /// `self * factor + term`, in one rounding where the processor has it.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// The numbers of the nodes `index[0]`, `index[stride]`, ...: one vector for each of the four.
    fn gather(nodes: &Nodes<Self::Scalar>, index: &[u16], stride: usize) -> [Self; 4];
    /// Adds to the nodes `index[0]`, `index[stride]`, ..., in this order.
    fn scatter(values: [Self; 4], nodes: &mut Nodes<Self::Scalar>, index: &[u16], stride: usize);
}

/// The scalars that kernels are compiled for.
pub trait CellScalar: Scalar {
    /// Lanes of 512 bits.
    #[cfg(target_arch = "x86_64")]
    type Avx512: Lanes<Scalar = Self>;
    /// Lanes of 256 bits.
    #[cfg(target_arch = "x86_64")]
    type Avx2: Lanes<Scalar = Self>;

    /// The buffers of all operators in this precision.
    fn pool() -> &'static Pool<Self>;
}

impl CellScalar for f64 {
    #[cfg(target_arch = "x86_64")]
    type Avx512 = super::x86::F64x8;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = super::x86::F64x4;

    fn pool() -> &'static Pool<Self> {
        static POOL: Pool<f64> = Pool::new();
        &POOL
    }
}

impl CellScalar for f32 {
    #[cfg(target_arch = "x86_64")]
    type Avx512 = super::x86::F32x16;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = super::x86::F32x8;

    fn pool() -> &'static Pool<Self> {
        static POOL: Pool<f32> = Pool::new();
        &POOL
    }
}

/// Lanes of any processor.
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
