//! Tests side by side, each on its own thread.

/// Makes the present thread compute everything by itself from now on, unless it belongs to a pool already.
/// Tests that run side by side, and ranks that are threads, would wait for each other's work if they shared
/// the threads of the process; results are the same bits for any number of threads.
pub fn compute_alone() {
    thread_local!(static POOL: Option<rayon::ThreadPool> =
        rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok());
    POOL.with(|_| ());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_computes_alone_is_its_own_pool() {
        compute_alone();
        compute_alone();
        assert_eq!(rayon::current_num_threads(), 1);
        let here = std::thread::current().id();
        let (a, b) = rayon::join(|| std::thread::current().id(), || std::thread::current().id());
        assert_eq!([a, b], [here; 2]);
        let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        assert_eq!(two.install(|| (compute_alone(), rayon::current_num_threads()).1), 2);
    }
}
