//! SIGKILL at random moments, and the sweep goes on as if nothing had happened.
//!
//! Five kills here; `just torture` makes it a hundred.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a long test says how far it is")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use common::{Bench, files};
use topometric::rng::split_mix;

const N_KILLS: u64 = 5;

/// Everything but dates, times and the order of the journal.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.starts_with("timings.") && name != "run.json" && name != "journal.jsonl"
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
