//! How much memory the system can give.

use std::path::Path;

use super::RunError;
use super::memory::MIB;

/// Bytes that a new computation can take, where the system tells: on Linux what is available without swapping, or what
/// the control groups of the process leave if that is less. The environment variable MONOLAYER_MEMORY (MiB) takes
/// precedence.
///
/// # Errors
/// [`RunError::BadMemory`]
pub fn available() -> Result<Option<f64>, RunError> {
    match std::env::var("MONOLAYER_MEMORY") {
        Ok(value) => match value.trim().parse::<f64>() {
            Ok(mib) if mib.is_finite() && mib > 0.0 => Ok(Some(mib * MIB)),
            Ok(_) | Err(_) => Err(RunError::BadMemory { value }),
        },
        Err(_) => Ok(on_linux(Path::new("/"))),
    }
}

/// As [`available`] from the files below `root`.
fn on_linux(root: &Path) -> Option<f64> {
    let meminfo = std::fs::read_to_string(root.join("proc/meminfo")).ok()?;
    let free = 1024.0 * entry(&meminfo, "MemAvailable:")?;
    let groups = std::fs::read_to_string(root.join("proc/self/cgroup")).unwrap_or_default();
    let lines = groups.lines().filter_map(|line| Group::parse(root, line));
    Some(lines.filter_map(|group| group.room()).fold(free, f64::min))
}

/// The number after a name.
fn entry(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find(|line| line.split_whitespace().next() == Some(name))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// A control group with its files.
struct Group<'g> {
    /// Where the hierarchy is mounted.
    mount: std::path::PathBuf,
    /// Path of the group in it.
    path: &'g str,
    limit: &'static str,
    usage: &'static str,
    /// Part of the usage that is given back on demand, in `memory.stat`.
    cache: &'static str,
}

impl<'g> Group<'g> {
    /// From a line `number:controllers:path` of `/proc/self/cgroup`; version 2 names no controllers.
    fn parse(root: &Path, line: &'g str) -> Option<Self> {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        if controllers.is_empty() {
            let mount = root.join("sys/fs/cgroup");
            let (limit, usage, cache) = ("memory.max", "memory.current", "inactive_file");
            return Some(Self { mount, path, limit, usage, cache });
        }
        controllers.split(',').any(|name| name == "memory").then(|| {
            let mount = root.join("sys/fs/cgroup/memory");
            let (limit, usage, cache) = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file");
            Self { mount, path, limit, usage, cache }
        })
    }

    /// What the group and all groups around it leave; those that a container does not see are left out.
    fn room(&self) -> Option<f64> {
        let mut folder = self.mount.join(self.path.trim_start_matches('/'));
        let mut least: Option<f64> = None;
        loop {
            let number = |name: &str| std::fs::read_to_string(folder.join(name)).ok()?.trim().parse::<f64>().ok();
            if let Some(limit) = number(self.limit) {
                let stat = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
                let cache = entry(&stat, self.cache).unwrap_or(0.0);
                let left = (limit - (number(self.usage).unwrap_or(0.0) - cache).max(0.0)).max(0.0);
                least = Some(least.map_or(left, |l| l.min(left)));
            }
            if folder == self.mount || !folder.pop() {
                return least;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: f64 = 1024.0 * MIB;

    /// A system with these files and 8 GiB available.
    fn system(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().expect("a folder");
        let all = [("proc/meminfo", "MemTotal:  16777216 kB\nMemFree: 1 kB\nMemAvailable:   8388608 kB\n")];
        for (path, text) in all.iter().chain(files) {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, text).expect("written");
        }
        root
    }

    fn gib(files: &[(&str, &str)]) -> f64 {
        on_linux(system(files).path()).expect("the system tells") / GIB
    }

    #[test]
    fn without_groups_all_that_is_available_counts() {
        assert_eq!(gib(&[]), 8.0);
        assert_eq!(gib(&[("proc/self/cgroup", "0::/user.slice\n")]), 8.0);
        assert_eq!(on_linux(tempfile::tempdir().expect("a folder").path()), None);
    }

    #[test]
    fn the_lowest_limit_around_the_process_counts() {
        let group = ("proc/self/cgroup", "0::/a/b\n");
        let two = ("sys/fs/cgroup/a/memory.max", "2147483648\n");
        let none = ("sys/fs/cgroup/a/b/memory.max", "max\n");
        assert_eq!(gib(&[group, two]), 2.0);
        assert_eq!(gib(&[group, two, none]), 2.0);
        assert_eq!(gib(&[group, two, ("sys/fs/cgroup/a/b/memory.max", "1073741824\n")]), 1.0);
        assert_eq!(gib(&[group, ("sys/fs/cgroup/a/memory.max", "17179869184\n")]), 8.0);
        // a container that is told its path outside sees its own group as the root
        assert_eq!(gib(&[group, ("sys/fs/cgroup/memory.max", "2147483648\n")]), 2.0);
    }

    #[test]
    fn what_the_group_uses_already_is_gone_but_for_its_cache() {
        let group = ("proc/self/cgroup", "0::/a\n");
        let files = [
            group,
            ("sys/fs/cgroup/a/memory.max", "4294967296\n"),
            ("sys/fs/cgroup/a/memory.current", "2147483648\n"),
            ("sys/fs/cgroup/a/memory.stat", "anon 7\ninactive_file 1073741824\nactive_file 3\n"),
        ];
        assert_eq!(gib(&files), 3.0);
        assert_eq!(gib(&files[..3]), 2.0);
    }

    #[test]
    fn groups_of_the_first_version_are_understood() {
        let group = ("proc/self/cgroup", "5:cpu,cpuacct:/x\n4:memory:/a\n0::/y\n");
        let limit = |bytes| ("sys/fs/cgroup/memory/a/memory.limit_in_bytes", bytes);
        assert_eq!(gib(&[group, limit("1073741824\n")]), 1.0);
        assert_eq!(gib(&[group, limit("9223372036854771712\n")]), 8.0);
        let (used, stat) = ("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "sys/fs/cgroup/memory/a/memory.stat");
        assert_eq!(gib(&[group, limit("4294967296\n"), (used, "3221225472\n")]), 1.0);
        let cache = (stat, "inactive_file 0\ntotal_inactive_file 2147483648\n");
        assert_eq!(gib(&[group, limit("4294967296\n"), (used, "3221225472\n"), cache]), 3.0);
    }
}
