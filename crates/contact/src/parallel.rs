//! Threads, if the feature `parallel` is on; results are the same without.

/// Fewer items are not worth another thread.
#[cfg(feature = "parallel")]
const ITEMS_PER_TASK: usize = 4096;

/// Does both.
#[cfg(feature = "parallel")]
pub(crate) fn join(first: impl FnOnce() + Send, second: impl FnOnce() + Send) {
    rayon::join(first, second);
}

/// Does both.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join(first: impl FnOnce(), second: impl FnOnce()) {
    first();
    second();
}

/// Visits all items, each with its fellow; whether any visit returns true.
#[cfg(feature = "parallel")]
pub(crate) fn visit_all<T: Send, U: Sync>(
    items: &mut [T],
    fellows: &[U],
    visit: impl Fn(&mut T, &U) -> bool + Sync,
) -> bool {
    use rayon::prelude::*;
    let visits = items.par_iter_mut().zip(fellows).with_min_len(ITEMS_PER_TASK);
    visits.map(|(item, fellow)| visit(item, fellow)).reduce(|| false, |a, b| a | b)
}

/// Visits all items, each with its fellow; whether any visit returns true.
#[cfg(not(feature = "parallel"))]
pub(crate) fn visit_all<T, U>(items: &mut [T], fellows: &[U], visit: impl Fn(&mut T, &U) -> bool) -> bool {
    items.iter_mut().zip(fellows).fold(false, |any, (item, fellow)| any | visit(item, fellow))
}
