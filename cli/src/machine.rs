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

/// So many bytes as `800MB`, `4GiB` or `2.5G` says; a plain number counts bytes.
///
/// # Errors
/// If the text is no such thing.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let factor = match unit.trim().to_ascii_uppercase().as_str() {
        "" | "B" => Some(1.0),
        "K" | "KB" => Some(1e3),
        "M" | "MB" => Some(1e6),
        "G" | "GB" => Some(1e9),
        "T" | "TB" => Some(1e12),
        "KIB" => Some(1024.0),
        "MIB" => Some(1024.0 * 1024.0),
        "GIB" => Some(1024.0 * 1024.0 * 1024.0),
        "TIB" => Some(1024.0 * 1024.0 * 1024.0 * 1024.0),
        _ => None,
    };
    let bytes = number.parse::<f64>().ok().zip(factor).map(|(number, factor)| number * factor);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is in range")]
    let whole = |bytes: f64| bytes as u64;
    let bytes = bytes.filter(|bytes| *bytes < 9e18).map(whole);
    bytes.ok_or_else(|| "write a size such as `4GiB` or `800MB`".to_owned())
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

    #[test]
    fn sizes_are_read_as_people_write_them() {
        let read = ["17", "2kb", "1.5M", "4GiB", "1 GB"].map(|text| bytes(text).ok());
        assert_eq!(read, [17, 2000, 1_500_000, 4 << 30, 1_000_000_000].map(Some));
        for text in ["", "GB", "-1", "1e9", "3 apples", "1..2", "99999999999G"] {
            assert!(bytes(text).is_err(), "{text}");
        }
    }
}
