//! The CPU time of a thread, which others on the machine do not change.

/// CPU seconds of this thread so far; where the system has no such clock, the wall time.
#[cfg(unix)]
pub fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// CPU seconds of this thread so far; where the system has no such clock, the wall time.
#[cfg(not(unix))]
pub fn cpu_seconds() -> f64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(f64::NAN, |time| time.as_secs_f64())
}
