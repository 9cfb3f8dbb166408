//! An allocator that counts, for tests that a steady step allocates nothing.
//!
//! ```
//! use gluey_testkit::allocation::{CountingAllocator, count_in_thread};
//!
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//!
//! # fn main() {
//! let mut sum = vec![0.0; 8];
//! let (_, allocations) = count_in_thread(|| sum.fill(1.0));
//! assert_eq!(allocations, 0);
//! let (copy, allocations) = count_in_thread(|| sum.clone());
//! assert_eq!((copy.len(), allocations), (8, 1));
//! # }
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The system's allocator, with a count of the allocations (growth included, release not).
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingAllocator;

static ALL_THREADS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    // Const and without a destructor: reaching it allocates nothing, so the allocator may use it.
    static THIS_THREAD: Cell<usize> = const { Cell::new(0) };
    /// The most bytes of one allocation.
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

fn count(bytes: usize) {
    ALL_THREADS.fetch_add(1, Ordering::Relaxed);
    // No count while a thread is being taken down.
    let _ = THIS_THREAD.try_with(|count| count.set(count.get() + 1));
    let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(bytes)));
}

// SAFETY: every call goes to `System` with its arguments unchanged, and `System` keeps the contract of
// `GlobalAlloc`. Counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps the contract of `alloc`, which is that of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as in `alloc`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(new_size);
        // SAFETY: `block` came from `System`, since all of this allocator's blocks do.
        unsafe { System.realloc(block, layout, new_size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as in `realloc`.
        unsafe { System.dealloc(block, layout) }
    }
}

/// Runs `work` and counts the allocations of this thread meanwhile. Zero, whatever happens, unless
/// [`CountingAllocator`] is the global allocator: let a test also count something that must allocate.
pub fn count_in_thread<R>(work: impl FnOnce() -> R) -> (R, usize) {
    let before = THIS_THREAD.with(Cell::get);
    let result = work();
    (result, THIS_THREAD.with(Cell::get) - before)
}

/// Runs `work` and finds the most bytes that this thread allocates at once meanwhile. Zero, whatever happens,
/// unless [`CountingAllocator`] is the global allocator.
pub fn largest_in_thread<R>(work: impl FnOnce() -> R) -> (R, usize) {
    let before = LARGEST.with(|largest| largest.replace(0));
    let result = work();
    let largest = LARGEST.with(|largest| largest.replace(before.max(largest.get())));
    (result, largest)
}

/// Runs `work` and counts the allocations of all threads meanwhile. Put such a test in a file of its own,
/// since other tests in the same process are counted too.
pub fn count_in_all_threads<R>(work: impl FnOnce() -> R) -> (R, usize) {
    let before = ALL_THREADS.load(Ordering::Relaxed);
    let result = work();
    (result, ALL_THREADS.load(Ordering::Relaxed) - before)
}
