//! SIGKILL at random moments, and the sweep goes on as if nothing had happened.
//!
//! Five kills of each kind here; `just torture` makes it a hundred.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a long test says how far it is")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use common::{Bench, SMALL_SWEEP, files};
use topometric::rng::split_mix;

const N_KILLS: u64 = 5;

/// Everything but dates, times and the order of the journal.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.contains("timing") && name != "run.json" && name != "journal.jsonl"
    });
    found
}

/// Keys of the journal's whole lines.
fn keys(bench: &Bench, folder: &str) -> Vec<String> {
    let text =
        std::fs::read_to_string(bench.path(folder).join("journal.jsonl")).unwrap_or_default();
    let whole = text
        .split_inclusive('\n')
        .filter(|line| line.ends_with('\n'));
    let key = |line: &str| {
        line.split("\"key\":\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap()
            .to_owned()
    };
    whole.map(key).collect()
}

#[test]
fn kills_at_random_moments_change_nothing() {
    let n_kills = std::env::var("PTM_KILLS").map_or(N_KILLS, |text| text.parse().unwrap());
    let bench = Bench::new();
    let smoke = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps/smoke.toml");
    bench.write("smoke.toml", std::fs::read_to_string(smoke).unwrap());
    let started = Instant::now();
    bench.ok(&["-q", "sweep", "smoke.toml", "--out", "straight"]);
    let whole = started.elapsed();
    let (expected, all) = (fixed(&bench, "straight"), keys(&bench, "straight"));
    let (mut n_killed, mut n_rounds, mut n_torn, mut round) = (0, 0, 0, "r0".to_owned());
    while n_killed < n_kills {
        let mut child = bench.command(&["sweep", "smoke.toml", "--out", &round]);
        let child = child
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped());
        let mut child = child.spawn().unwrap();
        // Uniform on the length of a third of an undisturbed run.
        let share = (split_mix(n_killed) >> 11) as f64 / (1_u64 << 53) as f64;
        let deadline = Instant::now() + whole.mul_f64(share / 3.0);
        while Instant::now() < deadline && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let before = keys(&bench, &round);
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            n_killed += 1;
        }
        let ran = common::ran(&child.wait_with_output().unwrap());
        assert!([0, -1].contains(&ran.code), "{}: {}", ran.code, ran.stderr);
        n_torn += u64::from(ran.stderr.contains("the last record ends"));
        // What was on disk stays, and no chain is there twice.
        let after = keys(&bench, &round);
        assert_eq!(after[..before.len()], before);
        let distinct: BTreeSet<&String> = after.iter().collect();
        assert_eq!(
            distinct.len(),
            after.len(),
            "a finished chain was run again"
        );
        if ran.code == 0 {
            finish(&bench, &round, &expected, &all);
            n_rounds += 1;
            round = format!("r{n_rounds}");
        }
    }
    bench.ok(&["-q", "sweep", "smoke.toml", "--out", &round]);
    finish(&bench, &round, &expected, &all);
    eprintln!(
        "{n_killed} kills in {} sweeps, {n_torn} of them within a record",
        n_rounds + 1
    );
}

fn finish(bench: &Bench, round: &str, expected: &BTreeMap<String, Vec<u8>>, all: &[String]) {
    let sorted = |keys: &[String]| -> BTreeSet<String> { keys.iter().cloned().collect() };
    let found = keys(bench, round);
    assert_eq!((found.len(), sorted(&found)), (all.len(), sorted(all)));
    let got = fixed(bench, round);
    assert_eq!(
        got.keys().collect::<Vec<_>>(),
        expected.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in expected {
        assert!(got[name] == *bytes, "{name} differs");
    }
}

/// Chains of seconds, killed when they have said how far they are: they go on from there.
#[test]
fn long_chains_go_on_from_their_checkpoints() {
    let bench = Bench::new();
    let tempered = "[[design.cells]]\nsamples = 150000\ntemperatures = 3\n";
    let plain = "[[design.cells]]\nsamples = 600000\n";
    let head = "[run]\nchains = 1\nmax_topologies = 50\n[design]\nkind = \"list\"\n";
    bench.write("long.toml", format!("{head}{plain}{tempered}"));
    bench.ok(&["-q", "sweep", "long.toml", "--out", "straight"]);
    let saved = |out: &str| -> BTreeMap<String, Vec<u8>> {
        let folder = bench.path(out).join("checkpoints");
        if !folder.exists() {
            return BTreeMap::new();
        }
        let mut found = files_that_stay(&folder);
        found.retain(|name, _| !name.starts_with(".ptm-"));
        found
    };
    let sweep = [
        "-q",
        "sweep",
        "long.toml",
        "--out",
        "out",
        "--checkpoint-seconds",
        "0.02",
    ];
    for _ in 0..3 {
        let before = saved("out");
        let mut child = bench.command(&sweep).spawn().unwrap();
        let started = Instant::now();
        // Until another checkpoint than the last is there, and then a little further.
        while saved("out") == before && child.try_wait().unwrap().is_none() {
            assert!(started.elapsed() < Duration::from_secs(60), "no checkpoint");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(30));
        assert!(child.try_wait().unwrap().is_none(), "killed before its end");
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(!saved("out").is_empty());
    let last = bench.run(&["sweep", "long.toml", "--out", "out"]);
    assert_eq!(last.code, 0, "{}", last.stderr);
    assert!(!last.stderr.contains("checkpoint"), "{}", last.stderr);
    assert!(!bench.exists("out/checkpoints"));
    assert!(fixed(&bench, "out") == fixed(&bench, "straight"));
    // One that was changed is said, and costs time only.
    let mut child = bench
        .command(&[&sweep[..4], &["again"], &sweep[5..]].concat())
        .spawn()
        .unwrap();
    while saved("again").is_empty() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    for (name, mut bytes) in saved("again") {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        bench.write(&format!("again/checkpoints/{name}"), bytes);
    }
    let damaged = bench.run(&["sweep", "long.toml", "--out", "again"]);
    assert_eq!(damaged.code, 0);
    assert!(
        damaged
            .stderr
            .contains("a checkpoint that cannot be used (it is damaged)"),
        "{}",
        damaged.stderr
    );
    assert!(fixed(&bench, "again") == fixed(&bench, "straight"));
}

/// A command that is killed, and the folder that it works in.
struct Case {
    name: &'static str,
    /// What stands in the folder before, copied from here.
    template: Option<&'static str>,
    arguments: &'static [&'static str],
    /// A folder that is as this one must be in the end.
    expected: &'static str,
}

const CASES: [Case; 5] = [
    Case {
        name: "checkpoints",
        template: None,
        arguments: &[
            "-q",
            "sweep",
            "long.toml",
            "--checkpoint-seconds",
            "0.01",
            "--out",
        ],
        expected: "long",
    },
    Case {
        name: "rounds of worlds",
        template: None,
        arguments: &["-q", "sweep", "until.toml", "--out"],
        expected: "until",
    },
    Case {
        name: "report",
        template: Some("small"),
        arguments: &["-q", "report"],
        expected: "small",
    },
    Case {
        name: "merge",
        template: Some("shards"),
        arguments: &["-q", "merge"],
        expected: "small",
    },
    Case {
        name: "force",
        template: Some("until"),
        arguments: &["-q", "sweep", "small.toml", "--force", "--out"],
        expected: "small",
    },
];

/// SIGKILL within each kind of work, with a second process of the kind started at a random moment:
/// the same command again gives the same bytes, and nothing is left behind.
#[test]
fn kills_of_every_command_with_another_beside_it_change_nothing() {
    let n_kills = std::env::var("PTM_KILLS").map_or(N_KILLS, |text| text.parse().unwrap());
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    let until = "noise = 0.8\nrate_error = 0.3\nmax_replicates = 8";
    bench.write("until.toml", SMALL_SWEEP.replace("noise = 0.8", until));
    bench.write(
        "long.toml",
        SMALL_SWEEP.replace("samples = 300", "samples = 20000"),
    );
    for name in ["small", "until", "long"] {
        bench.ok(&["-q", "sweep", &format!("{name}.toml"), "--out", name]);
    }
    for shard in ["1/2", "2/2"] {
        let arguments = [
            "-q",
            "sweep",
            "small.toml",
            "--out",
            "shards",
            "--shard",
            shard,
        ];
        bench.ok(&arguments);
    }
    let whole = CASES.map(|case| {
        lay_out(&bench, &case);
        let started = Instant::now();
        bench.ok(&[case.arguments, &["out"]].concat());
        started.elapsed()
    });
    let mut random = 0;
    let mut moment = |most: Duration| {
        random += 1;
        most.mul_f64((split_mix(random) >> 11) as f64 / (1_u64 << 53) as f64)
    };
    let mut n_killed = [0; CASES.len()];
    let mut round = 0;
    while n_killed.iter().sum::<u64>() < n_kills {
        let ix = round % CASES.len();
        let case = &CASES[ix];
        let arguments = [case.arguments, &["out"]].concat();
        lay_out(&bench, case);
        for _ in 0..2 {
            let mut first = start(&bench, &arguments);
            let (kill, second) = (moment(whole[ix]), moment(whole[ix]));
            std::thread::sleep(kill.min(second));
            let beside = (second < kill).then(|| start(&bench, &arguments));
            std::thread::sleep(kill - kill.min(second));
            if first.try_wait().unwrap().is_none() {
                first.kill().unwrap();
                n_killed[ix] += 1;
            }
            for child in [Some(first), beside].into_iter().flatten() {
                let ran = common::ran(&child.wait_with_output().unwrap());
                let name = case.name;
                assert!([-1, 0, 75].contains(&ran.code), "{name}: {}", ran.stderr);
            }
        }
        bench.ok(&arguments);
        let (got, expected) = (
            without_shards(&bench, "out"),
            without_shards(&bench, case.expected),
        );
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(
            names(&got),
            names(&expected),
            "{}, round {round}",
            case.name
        );
        for (name, bytes) in expected {
            assert!(
                got[&name] == bytes,
                "{}, round {round}: {name} differs",
                case.name
            );
        }
        round += 1;
    }
    let killed = CASES
        .iter()
        .zip(n_killed)
        .map(|(case, n)| format!("{} {n}", case.name));
    let killed: Vec<String> = killed.collect();
    eprintln!("kills in {round} rounds: {}", killed.join(", "));
}

fn start(bench: &Bench, arguments: &[&str]) -> std::process::Child {
    let mut command = bench.command(arguments);
    let command = command.stdout(std::process::Stdio::piped());
    command
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap()
}

fn without_shards(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = fixed(bench, folder);
    found.retain(|name, _| !name.starts_with("shards/"));
    found
}

/// The folder `out` as it is before the command of a case.
fn lay_out(bench: &Bench, case: &Case) {
    let _ = std::fs::remove_dir_all(bench.path("out"));
    if let Some(template) = case.template {
        for (name, bytes) in files(&bench.path(template)) {
            bench.write(&format!("out/{name}"), bytes);
        }
    }
}

/// Every file of a folder whose files come and go.
fn files_that_stay(folder: &std::path::Path) -> BTreeMap<String, Vec<u8>> {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let read = |entry: std::fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        Some((name, std::fs::read(entry.path()).ok()?))
    };
    names.filter_map(read).collect()
}
