//! Several processes in one report's folder: one of them is at work, the others are told so and
//! change nothing.
//!
//! Two rounds of each here; `just torture` makes them fifty.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a long test says how far it is")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use common::{Bench, Ran, SMALL_SWEEP, files, ran};
use topometric::rng::split_mix;

fn n_rounds() -> u64 {
    std::env::var("PTM_ROUNDS").map_or(2, |text| text.parse().unwrap())
}

/// A part of the time that a report of [`SMALL_SWEEP`] takes, another one in each round.
fn pause(round: u64, most_ms: u64) -> Duration {
    Duration::from_millis(split_mix(round) % most_ms)
}

/// Everything but dates, times and the order of the journal.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.contains("timing")
            && name != "run.json"
            && name != "journal.jsonl"
            && !name.starts_with("shards/")
    });
    found
}

/// Keys of all records of a folder, of shards too.
fn keys(bench: &Bench, folder: &str) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    for (name, bytes) in files(&bench.path(folder)) {
        if name.ends_with(".jsonl") {
            let text = String::from_utf8(bytes).unwrap();
            let key = |line: &str| line.split('"').nth(3).map(str::to_owned);
            keys.extend(text.lines().filter_map(key));
        }
    }
    keys
}

fn start(bench: &Bench, arguments: &[&str]) -> Child {
    let mut command = bench.command(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn end(child: Child) -> Ran {
    ran(&child.wait_with_output().unwrap())
}

/// Done, or told to try again in one line.
fn is_done(ran: &Ran) -> bool {
    if ran.code == 75 {
        let said = ran.stderr.lines().last().unwrap_or_default();
        assert!(
            said.contains("another ptm is at work in this folder"),
            "{said}"
        );
        return false;
    }
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    true
}

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("a.toml", SMALL_SWEEP);
    let b = SMALL_SWEEP
        .replace("seed = 5", "seed = 6")
        .replace("[1, 10]", "[3, 10]");
    bench.write("b.toml", b.replace("Small", "Another"));
    bench
}

/// The second sweep replaces the first while that writes its report, or is refused; never a
/// mixture.
#[test]
fn a_forced_sweep_waits_for_the_report_of_another() {
    let bench = bench();
    for name in ["a", "b"] {
        bench.ok(&["-q", "sweep", &format!("{name}.toml"), "--out", name]);
    }
    let expected = ["a", "b"].map(|name| fixed(&bench, name));
    let mut n_refused = 0;
    for round in 0..n_rounds() {
        let force = ["-q", "sweep", "a.toml", "--out", "out", "--force"];
        let first = start(&bench, &force);
        std::thread::sleep(pause(round, 400));
        let second = end(start(
            &bench,
            &["-q", "sweep", "b.toml", "--out", "out", "--force"],
        ));
        let (first, second) = (is_done(&end(first)), is_done(&second));
        assert!(first || second);
        n_refused += u64::from(!first || !second);
        let found = fixed(&bench, "out");
        let whose = expected.iter().position(|expected| *expected == found);
        let whose = whose.expect("the folder is of one sweep, whole");
        assert!(
            [first, second][whose],
            "round {round}: changed by what was refused"
        );
        let sweep = ["a", "b"][whose];
        let run: serde_json::Value = serde_json::from_str(&bench.read("out/run.json")).unwrap();
        assert_eq!(run["sweep"], sweep);
        assert_eq!(run["starts"][0]["end"], "done");
    }
    eprintln!(
        "forced sweeps: {} rounds, {n_refused} with a refusal",
        n_rounds()
    );
}

/// `merge` may be run at any time, and no shard minds.
#[test]
fn shards_do_not_mind_a_merge() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "a.toml", "--out", "single"]);
    let (mut n_starts, mut n_merges) = (0, 0);
    for round in 0..n_rounds() {
        let out = format!("out{round}");
        let shard = |k: u32| {
            let shard = format!("{k}/3");
            let arguments = ["-q", "sweep", "a.toml", "--out", &out, "--shard", &shard];
            end(start(&bench, &arguments))
        };
        assert_eq!(shard(1).code, 0);
        let are_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let merges = scope.spawn(|| {
                let mut n = 0;
                while !are_over.load(Ordering::Relaxed) {
                    let merged = end(start(&bench, &["-q", "merge", &out]));
                    assert!([0, 75].contains(&merged.code), "{}", merged.stderr);
                    n += 1;
                }
                n
            });
            let starts = [1, 2, 3].map(|k| {
                let shard = &shard;
                scope.spawn(move || [(); 3].map(|()| shard(k)))
            });
            let ended = starts.map(|starts| starts.join());
            are_over.store(true, Ordering::Relaxed);
            for ran in ended.into_iter().flat_map(Result::unwrap) {
                assert_eq!(ran.code, 0, "round {round}: {}", ran.stderr);
                n_starts += 1;
            }
            n_merges += merges.join().unwrap();
        });
        bench.ok(&["-q", "merge", &out]);
        assert!(fixed(&bench, &out) == fixed(&bench, "single"));
    }
    eprintln!("merges: {n_starts} starts of shards beside {n_merges} merges, none failed");
}

/// A merge replaces the journal that a starting sweep has opened: every record stays.
#[test]
fn no_record_is_lost_between_opening_a_journal_and_locking_it() {
    let bench = bench();
    // `flock` that dawdles, so that the window is wide. Without a C compiler it is as narrow as it
    // is.
    bench.write("slow.c", SLOW_FLOCK);
    let mut cc = std::process::Command::new("cc");
    cc.args(["-shared", "-fPIC", "-o", "slow.so", "slow.c", "-ldl"]);
    let has_slow = cc
        .current_dir(bench.path(""))
        .status()
        .is_ok_and(|status| status.success());
    if !has_slow {
        eprintln!("SKIPPED: no C compiler, so locks are not slowed down");
    }
    for round in 0..n_rounds() {
        let out = format!("out{round}");
        bench.ok(&["-q", "sweep", "a.toml", "--out", &out, "--shard", "1/2"]);
        let mut command = bench.command(&["-q", "sweep", "a.toml", "--out", &out]);
        if has_slow {
            command.env("LD_PRELOAD", bench.path("slow.so"));
        }
        let sweep = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(pause(round, 500));
        let merged = end(start(&bench, &["-q", "merge", &out]));
        assert!([0, 75].contains(&merged.code), "{}", merged.stderr);
        let is_all = is_done(&end(sweep));
        assert_eq!(
            keys(&bench, &out).len(),
            if is_all { 16 } else { 8 },
            "round {round}"
        );
        let last = bench.run(&["-q", "merge", &out]);
        assert_eq!(last.code, if is_all { 0 } else { 75 }, "{}", last.stderr);
    }
}

const SLOW_FLOCK: &str = "\
#define _GNU_SOURCE
#include <dlfcn.h>
#include <unistd.h>
int flock(int fd, int op) {
    int (*real)(int, int) = dlsym(RTLD_NEXT, \"flock\");
    usleep(300000);
    return real(fd, op);
}
";

/// A refused --force has changed nothing: the sweep that it was refused for goes on after a kill.
#[test]
fn a_refused_force_changes_nothing() {
    let bench = bench();
    let head = "[run]\nchains = 2\n[design]\nkind = \"list\"\n[[design.cells]]\n";
    bench.write("long.toml", format!("{head}samples = 100000000\n"));
    bench.write("short.toml", format!("{head}samples = 300\n"));
    for round in 0..n_rounds() {
        let out = format!("out{round}");
        let sweep = [
            "-q",
            "sweep",
            "long.toml",
            "--out",
            &out,
            "--checkpoint-seconds",
            "0.05",
        ];
        let mut first = start(&bench, &sweep);
        while !bench.path(&out).join("checkpoints").exists() {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(pause(round, 100));
        let what = || {
            let mut found = files_that_stay(&bench, &out);
            found.retain(|name, _| !name.starts_with("checkpoints/") && !name.contains(".ptm-"));
            found
        };
        let before = what();
        let commands: [&[&str]; 5] = [
            &["-q", "sweep", "short.toml", "--out", &out, "--force"],
            &["-q", "sweep", "long.toml", "--out", &out],
            &["-q", "sweep", "long.toml", "--out", &out, "--force"],
            &["-q", "report", &out],
            &["-q", "merge", &out],
        ];
        for arguments in commands {
            assert!(!is_done(&end(start(&bench, arguments))), "{arguments:?}");
        }
        // A shard of another sweep is refused as ever; one of this sweep may run beside.
        let shard = [
            "sweep",
            "short.toml",
            "--out",
            &out,
            "--shard",
            "1/2",
            "--force",
        ];
        assert!(!is_done(&end(start(&bench, &shard))));
        assert!(
            what() == before,
            "round {round}: a refusal changed the folder"
        );
        first.kill().unwrap();
        first.wait().unwrap();
        // The first goes on, and stops when it is told to.
        let again = start(&bench, &sweep);
        std::thread::sleep(Duration::from_millis(300));
        std::process::Command::new("kill")
            .arg(again.id().to_string())
            .status()
            .unwrap();
        let again = end(again);
        assert_eq!(again.code, 143, "{}", again.stderr);
    }
}

fn files_that_stay(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![bench.path(folder)];
    while let Some(here) = open.pop() {
        for entry in std::fs::read_dir(&here).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = path
                .strip_prefix(bench.path(folder))
                .unwrap()
                .display()
                .to_string();
            if path.is_dir() {
                open.push(path);
            } else if let Ok(bytes) = std::fs::read(&path) {
                found.insert(name, bytes);
            }
        }
    }
    found
}

/// Several commands on a finished folder: each is done or told to try again, and the report is
/// whole.
#[test]
fn several_commands_on_a_finished_folder_leave_it_whole() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "a.toml", "--out", "done"]);
    let expected = fixed(&bench, "done");
    let (mut n_done, mut n_refused) = (0, 0);
    for round in 0..n_rounds() {
        let commands: [&[&str]; 5] = [
            &["-q", "sweep", "a.toml", "--out", "done"],
            &["-q", "sweep", "a.toml", "--out", "done", "--force"],
            &["-q", "report", "done"],
            &["-q", "merge", "done"],
            &["-q", "sweep", "a.toml", "--out", "done"],
        ];
        let children = commands.map(|arguments| start(&bench, arguments));
        let done = children.map(end).iter().filter(|ran| is_done(ran)).count();
        assert!(done > 0);
        n_done += done;
        n_refused += commands.len() - done;
        assert!(fixed(&bench, "done") == expected, "round {round}");
    }
    eprintln!("a finished folder: {n_done} commands done, {n_refused} refused");
}
