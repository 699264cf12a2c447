//! The memory that this process may have: the machine's, or less where a control group limits it.
//!
//! Groups are nested, and each holds all below it to its own limit. So the smallest limit counts,
//! on the way from the group of this process up to the root of what is mounted. Both versions of
//! cgroups may be there; see cgroups(7) and proc_pid_mountinfo(5).

use std::path::{Path, PathBuf};

/// Bytes of memory that this process may have, if that is known.
pub fn bytes() -> Option<u64> {
    bytes_under(Path::new("/"))
}

/// As [`bytes`], with `/proc` and all mounts below `root`.
fn bytes_under(root: &Path) -> Option<u64> {
    let machine = of_machine(&std::fs::read_to_string(root.join("proc/meminfo")).ok()?)?;
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap_or_default();
    let (own, mounts) = (read("proc/self/cgroup"), read("proc/self/mountinfo"));
    let mounts: Vec<Mount> = mounts.lines().filter_map(Mount::parse).collect();
    let groups = own.lines().filter_map(Group::parse);
    let limits = groups.filter_map(|group| group.limit(root, &mounts));
    Some(limits.fold(machine, u64::min))
}

fn of_machine(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The group of this process in one hierarchy.
struct Group {
    is_v2: bool,
    path: PathBuf,
}

impl Group {
    /// A line of `/proc/self/cgroup`, as in `4:memory:/a/b` or `0::/a/b`; none of a hierarchy
    /// without memory.
    fn parse(line: &str) -> Option<Self> {
        let mut parts = line.splitn(3, ':');
        let (number, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let is_v2 = number == "0" && controllers.is_empty();
        let has_memory = controllers.split(',').any(|name| name == "memory");
        let path = PathBuf::from(path);
        (is_v2 || has_memory).then_some(Self { is_v2, path })
    }

    /// The smallest limit from this group up to the root of its mount.
    fn limit(&self, root: &Path, mounts: &[Mount]) -> Option<u64> {
        let mount = mounts.iter().find(|mount| mount.is_v2 == self.is_v2)?;
        let name = match self.is_v2 {
            true => "memory.max",
            false => "memory.limit_in_bytes",
        };
        let top = root.join(mount.point.strip_prefix("/").unwrap_or(&mount.point));
        // In a container the mount may begin at the container's own group, or show nothing of this
        // one.
        let below = self.path.strip_prefix(&mount.root).unwrap_or(Path::new(""));
        let below: PathBuf = below
            .components()
            .filter(|part| matches!(part, std::path::Component::Normal(_)))
            .collect();
        let groups = below.ancestors().map(|group| top.join(group).join(name));
        let texts = groups.filter_map(|file| std::fs::read_to_string(file).ok());
        // "max" is no number, and no limit.
        texts.filter_map(|text| text.trim().parse().ok()).min()
    }
}

/// Where a hierarchy of groups is mounted.
struct Mount {
    is_v2: bool,
    /// The group that is seen at the mount point.
    root: PathBuf,
    point: PathBuf,
}

impl Mount {
    /// A line of `/proc/self/mountinfo`: the group and the mount point are its fourth and fifth
    /// field, the kind of file system and its options stand behind a dash.
    fn parse(line: &str) -> Option<Self> {
        let (before, behind) = line.split_once(" - ")?;
        let mut before = before.split(' ').skip(3);
        let (root, point) = (unescaped(before.next()?), unescaped(before.next()?));
        let mut behind = behind.split(' ');
        let (kind, options) = (behind.next()?, behind.nth(1).unwrap_or_default());
        let is_v2 = kind == "cgroup2";
        let has_memory = kind == "cgroup" && options.split(',').any(|option| option == "memory");
        (is_v2 || has_memory).then_some(Self { is_v2, root, point })
    }
}

/// Blanks and the like stand as three octal digits behind a backslash.
fn unescaped(text: &str) -> PathBuf {
    let blanks = [
        ("\\040", " "),
        ("\\011", "\t"),
        ("\\012", "\n"),
        ("\\134", "\\"),
    ];
    let text = (blanks.iter()).fold(text.to_owned(), |text, (code, c)| text.replace(code, c));
    text.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const V2: &str = "30 23 0:26 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw,nsdelegate\n";
    const V1: &str = "35 30 0:31 ROOT /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n\
                      36 30 0:32 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n";

    /// What is allowed in a made-up tree of a machine of 8 GB.
    fn allowed(cgroup: &str, mountinfo: &str, files: &[(&str, &str)]) -> Option<u64> {
        let tree = tempfile::tempdir().expect("a folder");
        let proc = [
            (
                "proc/meminfo",
                "MemFree: 1 kB\nMemTotal:        8000000 kB\n",
            ),
            ("proc/self/cgroup", cgroup),
            ("proc/self/mountinfo", mountinfo),
        ];
        for (name, text) in proc.iter().chain(files) {
            let path = tree.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, text).expect("written");
        }
        bytes_under(tree.path())
    }

    #[test]
    fn the_smallest_limit_on_the_way_up_counts() {
        let files = [
            ("sys/fs/cgroup/job/memory.max", "3000000\n"),
            ("sys/fs/cgroup/job/step/memory.max", "max\n"),
            ("sys/fs/cgroup/job/step/task/memory.max", "5000000\n"),
            ("sys/fs/cgroup/job/step/task/below/memory.max", "1\n"),
            ("sys/fs/cgroup/other/memory.max", "1\n"),
        ];
        assert_eq!(allowed("0::/job/step/task\n", V2, &files), Some(3_000_000));
        assert_eq!(allowed("0::/job/step\n", V2, &files), Some(3_000_000));
        assert_eq!(allowed("0::/\n", V2, &files), Some(8_192_000_000));
    }

    #[test]
    fn version_1_is_read_at_its_own_mount_beside_version_2() {
        let own = "5:cpu:/elsewhere\n4:memory:/slurm/job_7\n0::/init.scope\n";
        let files = [
            (
                "sys/fs/cgroup/memory/memory.limit_in_bytes",
                "9223372036854771712\n",
            ),
            (
                "sys/fs/cgroup/memory/slurm/memory.limit_in_bytes",
                "6000000\n",
            ),
            (
                "sys/fs/cgroup/memory/slurm/job_7/memory.limit_in_bytes",
                "4000000\n",
            ),
            ("sys/fs/cgroup/cpu/elsewhere/memory.limit_in_bytes", "1\n"),
        ];
        let mounts = V1.replace("ROOT", "/");
        assert_eq!(allowed(own, &mounts, &files), Some(4_000_000));
    }

    #[test]
    fn a_container_sees_its_own_group_at_the_mount_point() {
        let files = [
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "2000000\n"),
            (
                "sys/fs/cgroup/memory/inner/memory.limit_in_bytes",
                "1000000\n",
            ),
        ];
        let mounts = V1.replace("ROOT", "/docker/abc");
        let limit = |own: &str| allowed(own, &mounts, &files);
        assert_eq!(limit("4:memory:/docker/abc\n"), Some(2_000_000));
        assert_eq!(limit("4:memory:/docker/abc/inner\n"), Some(1_000_000));
        // A group that the mount does not show: what is mounted is the nearest that is known.
        assert_eq!(limit("4:memory:/docker/other\n"), Some(2_000_000));
        let v2 = [("sys/fs/cgroup/memory.max", "700\n")];
        assert_eq!(allowed("0::/../outside\n", V2, &v2), Some(700));
    }

    #[test]
    fn without_groups_it_is_the_machine() {
        assert_eq!(allowed("", "", &[]), Some(8_192_000_000));
    }
}
