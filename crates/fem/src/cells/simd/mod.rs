//! Vectors with one cell a lane, and the transposition between them and nodes.
//!
//! A node is four numbers: the components of its velocity, and after them its pressure.

mod portable;
#[cfg(target_arch = "x86_64")]
pub(super) mod x86;

pub use portable::Portable;

use gluey_linalg::Scalar;

/// Velocity components and pressure at one node.
pub type Node<T> = [T; 4];
/// A buffer of nodes as long as an index of 16 bits reaches, so that no index needs to be checked.
pub type Nodes<T> = [Node<T>; 1 << 16];

/// Numbers of [`Lanes::COUNT`] cells.
pub trait Lanes: Copy {
    /// One number.
    type Scalar: Scalar;
    /// Number of lanes; a divisor of `GROUP`.
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
