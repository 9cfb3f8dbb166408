//! The CPU time of a thread, which others on the machine do not change.

/// Measures the CPU time of the thread that started it; where the system has no such clock, the wall time.
pub struct CpuClock {
    start: f64,
}

impl CpuClock {
    /// Starts.
    pub fn start() -> Self {
        Self { start: now() }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        now() - self.start
    }
}

#[cfg(unix)]
fn now() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(not(unix))]
fn now() -> f64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(f64::NAN, |time| time.as_secs_f64())
}
