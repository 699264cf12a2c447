//! A folder that is full or must not be written: said in a line, nothing half written, and the sweep goes on
//! when there is room.
//!
//! On a tiny file system of its own, which only root can mount; others are told that this is skipped.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a skipped test must say so")]

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::{Bench, SMALL_SWEEP, files};

/// A file system in memory, gone at the end of the test.
struct Tmpfs(PathBuf);

impl Tmpfs {
    fn mount(path: &Path, options: &str) -> Option<Self> {
        std::fs::create_dir(path).unwrap();
        let mut command = Command::new("mount");
        command
            .args(["-t", "tmpfs", "-o", options, "tmpfs"])
            .arg(path);
        let mounted = command.output().is_ok_and(|output| output.status.success());
        if !mounted {
            eprintln!("SKIPPED: a tmpfs cannot be mounted here");
        }
        mounted.then(|| Self(path.to_owned()))
    }

    fn remount(&self, options: &str) {
        let options = format!("remount,{options}");
        let mut command = Command::new("mount");
        let remounted = command
            .args(["-o", &options])
            .arg(&self.0)
            .status()
            .unwrap();
        assert!(remounted.success());
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

fn fixed(bench: &Bench, folder: &str) -> Vec<(String, Vec<u8>)> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.contains("timing") && name != "run.json" && name != "journal.jsonl"
    });
    found.into_iter().collect()
}

#[test]
fn a_full_disk_loses_nothing() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    let Some(disk) = Tmpfs::mount(&bench.path("disk"), "size=16k") else {
        return;
    };
    let sweep = ["-q", "sweep", "small.toml", "--out", "disk/an öut"];
    let mut codes = Vec::new();
    let mut n_records = 0;
    // From too small for the inputs, by too small for the journal and too small for the report, to enough.
    for kilobytes in [16, 48, 80, 112, 160, 400, 1000, 32_000] {
        disk.remount(&format!("size={kilobytes}k"));
        let ran = bench.run(&sweep);
        codes.push(ran.code);
        let journal = std::fs::read_to_string(bench.path("disk/an öut/journal.jsonl"));
        let journal = journal.unwrap_or_default();
        assert!(
            journal.is_empty() || journal.ends_with('\n'),
            "half a record at {kilobytes} kB"
        );
        let n = journal.lines().count();
        assert!(n >= n_records, "records were lost at {kilobytes} kB");
        n_records = n;
        if ran.code == 0 {
            break;
        }
        assert_eq!(ran.code, 75, "{kilobytes} kB: {}", ran.stderr);
        assert!(
            ran.stderr.contains("No space left on device") && ran.stderr.contains("free space"),
            "{}",
            ran.stderr
        );
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    }
    assert_eq!(codes.last(), Some(&0), "{codes:?}");
    assert!(codes.len() >= 5, "it was full often enough: {codes:?}");
    assert_eq!(n_records, 16, "no chain was run twice that was on disk");
    bench.ok(&["-q", "sweep", "small.toml", "--out", "straight"]);
    assert!(fixed(&bench, "disk/an öut") == fixed(&bench, "straight"));

    disk.remount("ro");
    let ran = bench.run(&sweep);
    assert_eq!(ran.code, 1);
    assert!(
        ran.stderr
            .contains("disk/an öut/.lock: cannot be written (Read-only file system"),
        "{}",
        ran.stderr
    );
}
