//! The counter sees what allocates and nothing else.

use gluey_testkit::allocation::{CountingAllocator, count_in_all_threads, count_in_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn allocation_growth_and_zeroed_memory_count_and_release_does_not() {
    let (mut list, count) = count_in_thread(|| Vec::<u64>::with_capacity(4));
    assert_eq!(count, 1);
    assert_eq!(count_in_thread(|| list.push(1)).1, 0);
    assert_eq!(count_in_thread(|| list.reserve_exact(1000)).1, 1);
    assert_eq!(count_in_thread(|| drop(list)).1, 0);
    assert_eq!(count_in_thread(|| std::hint::black_box(vec![0u8; 100])).1, 1);
}

#[test]
fn other_threads_count_in_the_total_only() {
    let work = || std::thread::spawn(|| drop(std::hint::black_box(vec![1u8; 1000]))).join();
    let ((outcome, in_thread), in_all) = count_in_all_threads(|| count_in_thread(work));
    assert!(outcome.is_ok());
    assert!(in_all > in_thread);
}
