//! The floating-point types that kernels are compiled for.

use gluey_linalg::Scalar;

use super::buffers::Pool;
use super::simd::Lanes;
#[cfg(target_arch = "x86_64")]
use super::simd::x86;

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
    type Avx512 = x86::F64x8;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F64x4;

    fn pool() -> &'static Pool<Self> {
        static POOL: Pool<f64> = Pool::new();
        &POOL
    }
}

impl CellScalar for f32 {
    #[cfg(target_arch = "x86_64")]
    type Avx512 = x86::F32x16;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F32x8;

    fn pool() -> &'static Pool<Self> {
        static POOL: Pool<f32> = Pool::new();
        &POOL
    }
}
