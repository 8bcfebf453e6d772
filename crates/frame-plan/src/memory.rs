//! How much memory plans may take on this machine.

use std::fs;

/// Where the system does not say.
const FALLBACK_BYTES: u64 = 4 << 30;

/// Half of the memory of the machine or of its control group: what plans on the CPU, and on devices that use the CPU's
/// memory, may take together. Software GPU drivers hand out memory that is not there, so somebody has to count.
#[must_use]
pub fn usable_bytes() -> u64 {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| total_bytes(&text));
    let group =
        fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok());
    machine.into_iter().chain(group).min().map_or(FALLBACK_BYTES, |bytes: u64| bytes / 2)
}

fn total_bytes(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::total_bytes;

    #[test]
    fn meminfo_is_read() {
        assert_eq!(total_bytes("MemTotal:       24576 kB\nMemFree: 1 kB\n"), Some(24576 * 1024));
        assert_eq!(total_bytes("MemFree: 1 kB\n"), None);
        assert_eq!(total_bytes("MemTotal: many kB\n"), None);
    }
}
