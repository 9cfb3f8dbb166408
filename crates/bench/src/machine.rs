//! What the machine says: seconds, memory, and how fast it moves numbers.

use std::time::Instant;

use rayon::prelude::*;

/// Numbers in each of the three arrays of the triad: together larger than the caches of one core's share of a
/// server.
const TRIAD_LENGTH: usize = 1 << 24;
/// Runs of the triad, of which the fastest counts, as in STREAM (McCalpin 1995).
const TRIAD_RUNS: usize = 7;
/// Numbers a task of the triad.
const TRIAD_CHUNK: usize = 1 << 16;

/// Seconds.
#[derive(Clone, Copy, Debug)]
pub struct SolveTimes {
    /// By the clock on the wall.
    pub wall: f64,
    /// Of all threads together, where the system tells.
    pub cpu: Option<f64>,
}

/// Measures a stretch of time.
pub struct Stopwatch {
    wall: Instant,
    cpu: Option<f64>,
}

impl Stopwatch {
    /// Starts to measure.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: cpu_s() }
    }

    /// What went by since the start.
    pub fn stop(&self) -> SolveTimes {
        let cpu = cpu_s().zip(self.cpu).map(|(now, start)| now - start);
        SolveTimes { wall: self.wall.elapsed().as_secs_f64(), cpu }
    }
}

/// CPU seconds of this process so far, user and system.
#[cfg(unix)]
fn cpu_s() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn cpu_s() -> Option<f64> {
    None
}

/// Largest resident memory of this process so far in 1e6 bytes; only Linux tells.
pub fn peak_rss_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    peak_rss_in(&status)
}

/// `VmHWM:  1234 kB` in the status of a process.
fn peak_rss_in(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024.0 / 1e6)
}

/// `a = b + s c` on all threads of the pool, in 1e9 bytes a second: two reads and a write of eight bytes a
/// number.
pub fn triad_gb_s() -> f64 {
    let mut a = vec![0.0f64; TRIAD_LENGTH];
    let (b, c) = (vec![1.0f64; TRIAD_LENGTH], vec![2.0f64; TRIAD_LENGTH]);
    triad(&mut a, &b, &c);
    let seconds = (0..TRIAD_RUNS).map(|_| {
        let start = Instant::now();
        triad(&mut a, &b, &c);
        std::hint::black_box(&mut a);
        start.elapsed().as_secs_f64()
    });
    let fastest = seconds.fold(f64::INFINITY, f64::min);
    (3 * size_of::<f64>() * TRIAD_LENGTH) as f64 / fastest / 1e9
}

fn triad(a: &mut [f64], b: &[f64], c: &[f64]) {
    let chunks = b.par_chunks(TRIAD_CHUNK).zip(c.par_chunks(TRIAD_CHUNK));
    a.par_chunks_mut(TRIAD_CHUNK).zip(chunks).for_each(|(a, (b, c))| {
        for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(c)) {
            *a = b + 3.0 * c;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_a_status() {
        assert_eq!(peak_rss_in("VmPeak:\t 9 kB\nVmHWM:\t    2000 kB\nVmRSS:\t1 kB\n"), Some(2.048));
        assert_eq!(peak_rss_in("VmHWM: much\n"), None);
        assert_eq!(peak_rss_in(""), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_machine_answers() {
        let stopwatch = Stopwatch::start();
        let mut sum = 0u64;
        while stopwatch.stop().cpu.is_some_and(|s| s < 0.01) {
            sum = std::hint::black_box(sum + 1);
        }
        let times = stopwatch.stop();
        assert!(times.cpu.is_some_and(|cpu| cpu >= 0.01) && times.wall > 0.0);
        assert!(peak_rss_mb().is_some_and(|mb| mb > 1.0 && mb < 1e6));
    }
}
