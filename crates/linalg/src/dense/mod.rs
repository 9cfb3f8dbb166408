//! Small dense matrices.

mod cholesky;
mod sweep;

pub use cholesky::{BlockError, invert_spd};
pub use sweep::DenseSymmetric;

/// Runs a function compiled for the widest vectors this processor has: what is inlined into it, closures that
/// are `#[inline(always)]` and all they call that is. Sums and products are rounded one by one as anywhere.
pub fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    faer::traits::pulp::Arch::new().dispatch(f)
}

#[cfg(test)]
mod tests {
    #[test]
    fn vectors_change_no_bit() {
        let x: Vec<f64> = (0..100).map(|k| f64::from(k).sin()).collect();
        let square = || x.iter().map(|x| x * x + 0.1 * x).collect::<Vec<_>>();
        assert_eq!(super::vectorised(square), square());
    }
}
