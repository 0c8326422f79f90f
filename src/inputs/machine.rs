//! What the system lets this process use.

use std::path::Path;

/// Bytes of memory of this machine or of the control group that the process is in, whichever is less; `None` where the system does
/// not say (it is asked as Linux is).
pub fn memory() -> Option<u64> {
    let info = std::fs::read_to_string("/proc/meminfo").ok();
    let machine = info.as_deref().and_then(of_meminfo);
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = groups.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
    // A group's own limit, and those of the groups that it is in.
    let folders = Path::new(own).ancestors().map(|group| Path::new("/sys/fs/cgroup").join(group).join("memory.max"));
    let old = Path::new("/sys/fs/cgroup/memory/memory.limit_in_bytes").to_path_buf();
    let limits = folders.chain([old]).filter_map(|file| std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok());
    limits.chain(machine).min()
}

fn of_meminfo(text: &str) -> Option<u64> {
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    total.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_total_is_read_in_kibibytes() {
        assert_eq!(of_meminfo("MemTotal:       16384 kB\nMemFree: 1 kB\n"), Some(16 << 20));
        assert_eq!(of_meminfo("MemTotal: many\n"), None);
    }
}
