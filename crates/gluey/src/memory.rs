//! Whether a run fits into the memory of the machine, found out before anything is allocated; how much this
//! process took.

use std::fs;
use std::path::Path;

use thiserror::Error;

use crate::case::Case;
use crate::flow::MeshEstimate;
use crate::number_text::shown_to;

/// Nodes and cells are numbered in 32 bits.
const MOST_UNKNOWNS: f64 = u32::MAX as f64;

/// A case that needs more memory than there is.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "the mesh would have about {} cells and {} unknowns, which need about {} of memory{}; {}",
    shown_to(.estimate.cell_count, 3), shown_to(.estimate.unknown_count, 3), size(.estimate.bytes), of_each(*.ranks),
    there(*.available, *.limit)
)]
pub struct TooLarge {
    /// Size of its mesh.
    pub estimate: MeshEstimate,
    /// Processes that would share it, each of which takes the bytes of the estimate.
    pub ranks: usize,
    /// Bytes there are for one of them, if that is known.
    pub available: Option<u64>,
    /// Bytes that one of them may take, if that was limited.
    pub limit: Option<u64>,
}

fn of_each(ranks: usize) -> String {
    if ranks > 1 { format!(" in each of {ranks} processes") } else { String::new() }
}

fn there(available: Option<u64>, limit: Option<u64>) -> String {
    match (available, limit) {
        (_, Some(limit)) if available.is_none_or(|bytes| limit <= bytes) => {
            format!("the limit is {}", size(limit as f64))
        }
        (Some(bytes), _) => format!("{} are there", size(bytes as f64)),
        (None, _) => "at most 2^32 - 1 can be numbered".into(),
    }
}

/// An amount of memory in words.
pub fn size(bytes: f64) -> String {
    match bytes {
        ..1e9 => format!("{:.0} MB", bytes / 1e6),
        _ => format!("{:.1} GB", bytes / 1e9),
    }
}

/// Refuses a case whose mesh cannot be numbered, or needs more memory than there is, or than `limit` bytes
/// however much there is. Where nobody tells how much there is, and without a limit, only the first is
/// checked.
///
/// # Errors
/// [`TooLarge`] with the size expected.
pub fn check_within(case: &Case, limit: Option<u64>) -> Result<(), TooLarge> {
    check_shared(case, limit, Sharing { ranks: 1, available: available() })
}

/// Processes that share a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sharing {
    /// How many.
    pub ranks: usize,
    /// Bytes that there are for each of them, if that is known.
    pub available: Option<u64>,
}

/// The same for a case that several processes share, of which each may take `limit` bytes.
///
/// # Errors
/// [`TooLarge`] with the size expected.
pub fn check_shared(case: &Case, limit: Option<u64>, sharing: Sharing) -> Result<(), TooLarge> {
    let Sharing { ranks, available } = sharing;
    let least = available.into_iter().chain(limit).min();
    match MeshEstimate::of_rank(case, ranks) {
        Some(estimate) if !fits(&estimate, ranks, least) => {
            Err(TooLarge { estimate, ranks, available, limit })
        }
        _ => Ok(()),
    }
}

fn fits(estimate: &MeshEstimate, ranks: usize, available: Option<u64>) -> bool {
    let enough = available.is_none_or(|bytes| estimate.bytes <= bytes as f64);
    enough && estimate.unknown_count <= MOST_UNKNOWNS * ranks as f64
}

/// Bytes this process may still take: what the machine has left, and what its control groups and the limit of
/// its address space (`ulimit -v`) leave it. Linux only.
pub fn available() -> Option<u64> {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let machine = read(Path::new("/proc/meminfo")).and_then(|text| bytes_of("MemAvailable:", &text));
    let groups = read(Path::new("/proc/self/cgroup")).unwrap_or_default();
    let limits = group_folders(&groups).into_iter().filter_map(|folder| group_rest(&folder, read));
    let of_shell = read(Path::new("/proc/self/limits")).zip(read(Path::new("/proc/self/status")));
    let of_shell = of_shell.and_then(|(limits, status)| address_space_rest(&limits, &status));
    machine.into_iter().chain(limits).chain(of_shell).min()
}

/// The share of an address space that can be filled: allocators and threads reserve more than they use.
const FILLED: f64 = 0.75;

/// What the limit of the address space leaves to be filled; `None` without a limit.
fn address_space_rest(limits: &str, status: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    let rest = limit.saturating_sub(bytes_of("VmSize:", status).unwrap_or(0));
    Some((FILLED * rest as f64) as u64)
}

/// The most bytes this process has held so far. Linux only.
pub fn peak() -> Option<u64> {
    bytes_of("VmHWM:", &fs::read_to_string("/proc/self/status").ok()?)
}

/// What the system says of `key`, on a line like `MemAvailable:  1234 kB`.
fn bytes_of(key: &str, text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// Folders of the control groups this process is in, their parents and the root: version 2 (`0::/a/b`) and
/// the memory controller of version 1 (`4:memory:/a/b`). In a container the group's path may not be there,
/// the root is.
fn group_folders(text: &str) -> Vec<String> {
    let mut folders = Vec::new();
    for line in text.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let root = match controllers {
            "" => "/sys/fs/cgroup",
            _ if controllers.split(',').any(|name| name == "memory") => "/sys/fs/cgroup/memory",
            _ => continue,
        };
        let names: Vec<&str> = path.split('/').filter(|name| !name.is_empty()).collect();
        for depth in 0..=names.len() {
            folders.push([&[root], &names[..depth]].concat().join("/"));
        }
    }
    folders
}

/// Limit less usage of a control group; `None` without a limit.
fn group_rest(folder: &str, read: impl Fn(&Path) -> Option<String>) -> Option<u64> {
    let number = |file: &str| -> Option<u64> { read(&Path::new(folder).join(file))?.trim().parse().ok() };
    let [limit, usage] =
        [("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")]
            .into_iter()
            .find_map(|(limit, usage)| Some([number(limit)?, number(usage).unwrap_or(0)]))?;
    Some(limit.saturating_sub(usage))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_of_the_machine_is_read() {
        let text = "MemTotal:       24689764 kB\nMemFree:  9 kB\nMemAvailable:   22000000 kB\n";
        assert_eq!(bytes_of("MemAvailable:", text), Some(22_000_000 * 1024));
        assert_eq!(bytes_of("MemAvailable:", "MemAvailable: much\n"), None);
        assert_eq!(bytes_of("MemAvailable:", ""), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_peak_of_this_process_is_known() {
        assert!(peak().is_some_and(|bytes| bytes > 100_000 && bytes < 1_000_000_000_000));
    }

    #[test]
    fn groups_are_found_with_their_parents() {
        assert_eq!(
            group_folders("0::/jobs/7\n"),
            ["/sys/fs/cgroup", "/sys/fs/cgroup/jobs", "/sys/fs/cgroup/jobs/7"]
        );
        let old = "5:cpu,cpuacct:/x\n4:hugetlb,memory:/y\nnonsense\n";
        assert_eq!(group_folders(old), ["/sys/fs/cgroup/memory", "/sys/fs/cgroup/memory/y"]);
    }

    #[test]
    fn a_group_leaves_its_limit_less_what_is_used() {
        let files = |limit: &'static str, usage: &'static str| {
            move |path: &Path| match path.to_str()? {
                "g/memory.max" => Some(limit.to_owned()),
                "g/memory.current" => Some(usage.to_owned()),
                _ => None,
            }
        };
        assert_eq!(group_rest("g", files("1000\n", "300\n")), Some(700));
        assert_eq!(group_rest("g", files("1000\n", "3000\n")), Some(0));
        assert_eq!(group_rest("g", files("max\n", "3000\n")), None);
        assert_eq!(group_rest("h", files("1000\n", "300\n")), None);
    }

    #[test]
    fn a_shell_leaves_part_of_its_limit_less_what_is_mapped() {
        let limits = |soft: &str| {
            format!("Limit  Soft Limit\nMax address space         {soft}      unlimited      bytes\n")
        };
        let status = "VmPeak:\t  900 kB\nVmSize:\t  100 kB\n";
        assert_eq!(address_space_rest(&limits("1024000"), status), Some(691_200));
        assert_eq!(address_space_rest(&limits("unlimited"), status), None);
        assert_eq!(address_space_rest("", status), None);
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!((size(20.4e6), size(2.04e9)), ("20 MB".to_owned(), "2.0 GB".to_owned()));
    }

    /// Eight processes run under a limit what one refuses.
    #[test]
    fn processes_that_share_a_case_need_less_each() {
        let toml = "name = \"many\"\ndimension = 3\nparticles = [{ position = [0.5, 0.5, 0.5], radius = 0.05 }]\n\
                    [time]\nstep = 0.1\nend = 0.1\n\
                    [flow.mesh]\nband = 40\n";
        let case = Case::parse(toml, "many.toml").unwrap();
        let bytes = |ranks| MeshEstimate::of_rank(&case, ranks).unwrap().bytes;
        assert_eq!(bytes(1), MeshEstimate::of(&case).unwrap().bytes);
        assert!(bytes(8) > bytes(1) / 8.0 && bytes(8) < 0.5 * bytes(1), "{} {}", bytes(8), bytes(1));
        let limit = Some((0.5 * (bytes(1) + bytes(8))) as u64);
        let check = |ranks| check_shared(&case, limit, Sharing { ranks, available: None });
        assert!(check(8).is_ok());
        let refused = check(1).unwrap_err();
        assert!(!refused.to_string().contains("processes"), "{refused}");
        let refused =
            check_shared(&case, Some(1 << 20), Sharing { ranks: 8, available: Some(1 << 40) }).unwrap_err();
        assert!(refused.to_string().contains("in each of 8 processes"), "{refused}");
    }

    #[test]
    fn what_is_too_large_does_not_fit() {
        let estimate = |unknown_count: f64| MeshEstimate {
            cell_count: unknown_count / 10.0,
            unknown_count,
            bytes: 1e3 * unknown_count,
        };
        assert!(fits(&estimate(1e6), 1, Some(2_000_000_000)) && !fits(&estimate(1e6), 1, Some(900_000_000)));
        assert!(fits(&estimate(1e9), 1, None) && !fits(&estimate(5e9), 1, None));
        assert!(fits(&estimate(5e9), 2, None), "each numbers its own");
        assert!(!fits(&estimate(f64::INFINITY), 1, Some(u64::MAX)));
    }
}
