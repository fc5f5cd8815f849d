//! What the machine can give.

use std::fs;
use std::path::{Path, PathBuf};

/// Bytes that this process may yet take without swapping, the least of what the system, its control groups (v1, v2) and
/// its limit of address space leave; `None` where no system tells. `root` is the root of the file system.
pub fn free_memory(root: &Path) -> Option<f64> {
    let of_system = field(&root.join("proc/meminfo"), "MemAvailable:").map(|kb| 1024.0 * kb);
    let groups = fs::read_to_string(root.join("proc/self/cgroup")).unwrap_or_default();
    let of_groups = groups.lines().filter_map(|line| group(root, line));
    of_groups.chain(of_system).chain(address_space(root)).reduce(f64::min)
}

/// What a line `number:controllers:path` of the process's control groups leaves.
fn group(root: &Path, line: &str) -> Option<f64> {
    let mut parts = line.splitn(3, ':').skip(1);
    let (controllers, path) = (parts.next()?, parts.next()?);
    let mounted = root.join("sys/fs/cgroup");
    let (top, most, now, cache) = if controllers.is_empty() {
        (mounted, "memory.max", "memory.current", "inactive_file")
    } else if controllers.split(',').any(|c| c == "memory") {
        let names = ("memory.limit_in_bytes", "memory.usage_in_bytes");
        (mounted.join("memory"), names.0, names.1, "total_inactive_file")
    } else {
        return None;
    };
    // Every group above has its say; in a container the path may begin above what is mounted.
    let own: PathBuf = top.join(path.trim_start_matches('/'));
    let groups = own.ancestors().take_while(|g| g.starts_with(&top));
    let left = groups.filter_map(|g| {
        let number = |file: &str| fs::read_to_string(g.join(file)).ok()?.trim().parse().ok();
        let (most, now): (f64, f64) = (number(most)?, number(now)?);
        // Pages of files are given back when they are wanted.
        let cached = field(&g.join("memory.stat"), cache).unwrap_or(0.0);
        Some((most - now + cached).max(0.0))
    });
    left.reduce(f64::min)
}

/// What the limit of address space (ulimit -v) leaves.
fn address_space(root: &Path) -> Option<f64> {
    let limits = fs::read_to_string(root.join("proc/self/limits")).ok()?;
    let line = limits.lines().find_map(|l| l.strip_prefix("Max address space"))?;
    let most: f64 = line.split_whitespace().next()?.parse().ok()?;
    let now = field(&root.join("proc/self/status"), "VmSize:")? * 1024.0;
    Some((most - now).max(0.0))
}

/// The number behind a name at the start of a line.
fn field(file: &Path, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    let mut lines = text.lines().map(str::split_whitespace);
    lines.find_map(|mut words| (words.next()? == name).then(|| words.next()?.parse().ok())?)
}
