//! Memory: how much this process can still have, and allocations that return an error instead of ending the process.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use crate::base::error::{Error, Result};

/// Requests up to this size in bytes are not compared with the available memory. Reading it takes about 0.1 ms.
const UNCHECKED: u128 = 1 << 24;

/// Memory of the machine in bytes, for systems without `/proc`.
static MACHINE: OnceLock<u64> = OnceLock::new();

/// Sets the memory of the machine in bytes, for systems without `/proc`.
pub fn set_machine(bytes: u64) {
    MACHINE.get_or_init(|| bytes);
}

/// Returns an error if a call that needs `bytes` for `field` exceeds the memory that this process can still have.
///
/// # Errors
/// [`Error::Argument`] with both numbers of bytes.
pub fn check(field: &str, bytes: u128) -> Result<()> {
    if bytes <= UNCHECKED {
        return Ok(());
    }
    match available(Path::new("/")).or(MACHINE.get().copied()) {
        Some(most) if bytes > most.into() => {
            let expected = format!("at most {} of memory", grouped(most.into()));
            Err(Error::argument(field, expected, grouped(bytes)))
        }
        _ => Ok(()),
    }
}

/// Returns an empty vector with room for `len` items.
///
/// # Errors
/// [`Error::Argument`] if there is not enough memory; as [`check`].
pub fn vector<T>(field: &str, len: usize) -> Result<Vec<T>> {
    let mut vector = Vec::new();
    reserve(field, &mut vector, len)?;
    Ok(vector)
}

/// Makes room for `additional` items. A vector that grows repeatedly at least doubles its room.
///
/// # Errors
/// [`Error::Argument`] if there is not enough memory; as [`check`].
pub(crate) fn reserve<T>(field: &str, vector: &mut Vec<T>, additional: usize) -> Result<()> {
    let needed = vector.len().saturating_add(additional);
    if needed <= vector.capacity() {
        return Ok(());
    }
    let capacity = needed.max(2 * vector.capacity());
    let bytes = (capacity - vector.capacity()) as u128 * size_of::<T>() as u128;
    check(field, bytes)?;
    vector
        .try_reserve_exact(capacity - vector.len())
        .map_err(|_| Error::argument(field, "memory that the system grants", grouped(bytes)))
}

/// Returns the memory in bytes that this process can still have on Linux: the smallest of what the machine, the limits
/// of the process and its control groups leave. `root` is the root of the file system.
fn available(root: &Path) -> Option<u64> {
    let read = |path: &str| fs::read_to_string(root.join(path)).unwrap_or_default();
    let machine = read("proc/meminfo");
    let (limits, used) = (read("proc/self/limits"), read("proc/self/status"));
    let left = |limit: &str, size: &str| {
        let used = 1024 * number(&used, size)?;
        Some(number(&limits, limit)?.saturating_sub(used))
    };
    let free = number(&machine, "MemAvailable:")
        .map(|free| 1024 * (free + number(&machine, "SwapFree:").unwrap_or(0)));
    let process = [
        free,
        left("Max address space", "VmSize:"),
        left("Max data size", "VmData:"),
    ];
    let groups = read("proc/self/cgroup");
    let groups = groups.lines().map(|group| left_in_group(root, group));
    process.into_iter().chain(groups).flatten().min()
}

/// Returns the memory in bytes that a control group and its parents leave, version 1 or 2. `group` is a line of
/// `/proc/self/cgroup`. Files in the page cache do not count, because the kernel can drop them.
fn left_in_group(root: &Path, group: &str) -> Option<u64> {
    let (_, group) = group.split_once(':')?;
    let (controllers, path) = group.split_once(':')?;
    let (folder, limit, usage, cache) = if controllers.is_empty() {
        ("sys/fs/cgroup", "memory.max", "memory.current", "")
    } else if controllers.split(',').any(|name| name == "memory") {
        let (limit, usage) = ("memory.limit_in_bytes", "memory.usage_in_bytes");
        ("sys/fs/cgroup/memory", limit, usage, "total_")
    } else {
        return None;
    };
    let folder = root.join(folder);
    let left = |group: &Path| {
        let read = |file| fs::read_to_string(folder.join(group).join(file)).unwrap_or_default();
        let limit = number(&read(limit), "")?;
        let (usage, stat) = (number(&read(usage), "")?, read("memory.stat"));
        let cached = ["inactive_file ", "active_file "]
            .iter()
            .filter_map(|name| number(&stat, &format!("{cache}{name}")))
            .sum();
        Some(limit.saturating_sub(usage.saturating_sub(cached)))
    };
    let groups = Path::new(path.trim_start_matches('/')).ancestors();
    groups.filter_map(left).min()
}

/// Returns the first number after `name` in the line that begins with it. `None` if that is a word, as for a limit that
/// is not set.
fn number(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// Formats a number of bytes with a comma between groups of three digits.
fn grouped(bytes: u128) -> String {
    let digits = bytes.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text + " bytes"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes the files below a new folder and returns the memory that they leave.
    fn left(name: &str, files: &[(&str, &str)]) -> Option<u64> {
        let root = std::env::temp_dir().join(format!("flockesc-{name}-{}", std::process::id()));
        for (path, text) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a new folder");
            fs::write(path, text).expect("a new file");
        }
        let found = available(&root);
        fs::remove_dir_all(&root).expect("the folder exists");
        found
    }

    const MACHINE: (&str, &str) = (
        "proc/meminfo",
        "MemTotal: 9000 kB\nMemAvailable:    3000 kB\nSwapFree:  1000 kB\n",
    );

    #[test]
    fn the_machine_gives_what_is_available_and_swap() {
        assert_eq!(left("machine", &[MACHINE]), Some(4000 * 1024));
        let files = [("proc/self/cgroup", "0::/\n")];
        assert_eq!(left("other", &files), None);
    }

    #[test]
    fn limits_of_the_process_give_what_it_does_not_use() {
        let status = ("proc/self/status", "VmSize:\t 100 kB\nVmData:\t 40 kB\n");
        for (limits, expected) in [
            ("Max data size unlimited unlimited bytes", 4000 * 1024),
            ("Max address space   1024000 unlimited bytes", 900 * 1024),
            ("Max address space   1024 unlimited bytes", 0),
            (
                "Max data size 51200 61440 bytes\nMax address space 1024000 2 bytes",
                10 * 1024,
            ),
        ] {
            let files = [MACHINE, status, ("proc/self/limits", limits)];
            assert_eq!(left("limits", &files), Some(expected), "{limits}");
        }
    }

    #[test]
    fn the_tightest_control_group_counts_without_its_page_cache() {
        let second = [
            MACHINE,
            ("proc/self/cgroup", "1:cpu:/a\n0::/a/b\n"),
            ("sys/fs/cgroup/memory.max", "max\n"),
            ("sys/fs/cgroup/a/memory.max", "5000\n"),
            ("sys/fs/cgroup/a/memory.current", "4500\n"),
            (
                "sys/fs/cgroup/a/memory.stat",
                "anon 7\ninactive_file 1000\nactive_file 200\n",
            ),
            ("sys/fs/cgroup/a/b/memory.max", "9000\n"),
            ("sys/fs/cgroup/a/b/memory.current", "4000\n"),
        ];
        assert_eq!(left("second", &second), Some(1700));
        let first = [
            MACHINE,
            ("proc/self/cgroup", "4:cpu,memory:/host/name\n0::/\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "6000\n"),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", "3000\n"),
            (
                "sys/fs/cgroup/memory/memory.stat",
                "inactive_file 9\ntotal_inactive_file 500\n",
            ),
        ];
        assert_eq!(left("first", &first), Some(3500));
    }

    #[test]
    fn requests_beyond_any_memory_name_their_size() {
        let error = vector::<f64>("states", usize::MAX / 16).unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("states: expected at most "), "{text}");
        assert!(
            text.ends_with("got 9,223,372,036,854,775,800 bytes"),
            "{text}"
        );
        let mut growing = vector::<u8>("states", 3).expect("a little memory");
        assert_eq!(growing.capacity(), 3);
        growing.extend([0; 3]);
        reserve("states", &mut growing, 1).expect("a little memory");
        assert_eq!(growing.capacity(), 6);
    }
}
