//! What the machine has.

use std::fs;
use std::path::Path;

/// The bytes of memory that this process may fill: those of the machine, or of the tightest
/// control group around the process if that is less. Where nothing tells, all there could be.
pub(crate) fn memory() -> u64 {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| total(&text));
    let group = fs::read_to_string("/proc/self/cgroup").ok();
    let group = group.and_then(|text| tightest(&text, Path::new("/sys/fs/cgroup")));
    machine.into_iter().chain(group).min().unwrap_or(u64::MAX)
}

/// The total in `/proc/meminfo`, such as `MemTotal:  24639024 kB`.
fn total(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The least limit of the groups that `/proc/self/cgroup` names, such as `0::/user/session`, and
/// of those around them.
fn tightest(groups: &str, root: &Path) -> Option<u64> {
    let own = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let own = root.join(own);
    let around = own.ancestors().take_while(|folder| folder.starts_with(root));
    let limit = |folder: &Path| fs::read_to_string(folder.join("memory.max")).ok();
    around.filter_map(|folder| limit(folder)?.trim().parse().ok()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_tells_its_memory() {
        assert_eq!(total("MemTotal:       24639024 kB\nMemFree: 1 kB\n"), Some(24_639_024 * 1024));
        assert_eq!(total("MemFree: 1 kB\n"), None);
        assert!(memory() > 1 << 20);
    }

    #[test]
    fn the_tightest_group_around_the_process_counts() {
        let root = tempfile::tempdir().expect("temporary folders can be made");
        let inner = root.path().join("a/b");
        fs::create_dir_all(&inner).expect("the folder is empty");
        let limit = |folder: &Path, text: &str| {
            fs::write(folder.join("memory.max"), text).expect("files can be written");
        };
        assert_eq!(tightest("0::/a/b\n", root.path()), None);
        limit(&inner, "max\n");
        limit(&root.path().join("a"), "4096\n");
        limit(root.path(), "8192\n");
        assert_eq!(tightest("1:cpu:/\n0::/a/b\n", root.path()), Some(4096));
        limit(&inner, "1024\n");
        assert_eq!(tightest("0::/a/b\n", root.path()), Some(1024));
        assert_eq!(tightest("0::/\n", root.path()), Some(8192));
    }
}
