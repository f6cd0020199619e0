//! The memory available to this process, to refuse work that does not fit before it begins.

use std::path::Path;

/// Available bytes; nothing if the system does not report them. The minimum of the machine's available
/// memory, the remainder of the limits of control groups, and the remainder of the limit on the address
/// space.
pub(super) fn available() -> Option<usize> {
    let machine = kilobytes("/proc/meminfo", "MemAvailable:");
    [machine, addresses(), group()].into_iter().flatten().min()
}

/// Resident bytes of the process; 0 if unknown.
pub(super) fn resident() -> usize {
    kilobytes("/proc/self/status", "VmRSS:").unwrap_or(0)
}

fn number(path: &Path) -> Option<usize> {
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// The bytes in a line of a name and a number of kilobytes.
fn kilobytes(path: &str, name: &str) -> Option<usize> {
    let text = std::fs::read_to_string(path).ok()?;
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse::<usize>().ok()?.checked_mul(1024)
}

/// Remainder of the limit set by `ulimit -v`.
fn addresses() -> Option<usize> {
    let text = std::fs::read_to_string("/proc/self/limits").ok()?;
    let limit = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: usize = limit.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(kilobytes("/proc/self/status", "VmSize:")?))
}

/// The smallest remainder of the limits of control groups, versions 1 and 2, and of their parents.
fn group() -> Option<usize> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let left = |folder: &Path, limit: &str, used: &str| {
        Some(number(&folder.join(limit))?.saturating_sub(number(&folder.join(used))?))
    };
    let mut least: Option<usize> = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(_), Some(kinds), Some(name)) = (fields.next(), fields.next(), fields.next()) else {
            continue;
        };
        let (root, limit, used) = match kinds {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
            _ => continue,
        };
        let own = Path::new(root).join(name.trim_start_matches('/'));
        for folder in own.ancestors().take_while(|folder| folder.starts_with(root)) {
            least = least.into_iter().chain(left(folder, limit, used)).min();
        }
    }
    least
}
