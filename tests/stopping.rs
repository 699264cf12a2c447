//! Worlds added until the recovery rate is known: the same worlds and bytes however the sweep was run.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::{Bench, files, rows};

/// Four cells that stop for different reasons: crossing-ranges is one world however often it is asked for; in
/// square-ring one radius never recovers, and the other almost always.
const SWEEP: &str = "\
title = \"Until known\"
[data]
noise = 0.8
replicates = 3
rate_error = 0.165
max_replicates = 12
[sampler]
importance_samples = 5
[run]
samples = 150
chains = 2
seed = 5
exact_up_to = 0
[design]
kind = \"grid\"
[design.factors]
world = [\"crossing-ranges\", \"square-ring\"]
penalty_radius = [1, 10]
";

/// What must be the same however the sweep was run.
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

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("until.toml", SWEEP);
    bench.ok(&[
        "-q",
        "--threads",
        "1",
        "sweep",
        "until.toml",
        "--out",
        "straight",
    ]);
    bench
}

fn assert_same(bench: &Bench, folder: &str) {
    let (found, expected) = (fixed(bench, folder), fixed(bench, "straight"));
    let names = |of: &BTreeMap<String, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(&expected));
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{folder}/{name} differs");
    }
}

/// Lines of a journal.
fn records(bench: &Bench, folder: &str) -> Vec<String> {
    let text = bench.read(&format!("{folder}/journal.jsonl"));
    text.split_inclusive('\n').map(str::to_owned).collect()
}

#[test]
fn every_cell_stops_when_the_rule_says() {
    let bench = bench();
    let cells = rows(&bench.read("straight/cells.csv"));
    let chains = rows(&bench.read("straight/chains.csv"));
    let stopping: Vec<&str> = cells.iter().map(|row| row["stopping"].as_str()).collect();
    assert_eq!(stopping.len(), 4);
    for cell in &cells {
        let n: usize = cell["n_replicates"].parse().unwrap();
        let error: f64 = cell["recovery_error"].parse().unwrap();
        let (low, high): (f64, f64) = (
            cell["recovery_low"].parse().unwrap(),
            cell["recovery_high"].parse().unwrap(),
        );
        assert!((error - (high - low) / 2.0).abs() < 1e-12);
        // The rounds are 3, 5, 8 and 12.
        match cell["stopping"].as_str() {
            "reached" => assert!(error <= 0.165 && [3, 5, 8, 12].contains(&n), "{cell:?}"),
            "at-cap" => assert!(error > 0.165 && n == 12, "{cell:?}"),
            "no-new-worlds" => {
                assert!(
                    error > 0.165 && n == 3 && cell["world"] == "crossing-ranges",
                    "{cell:?}"
                )
            }
            other => panic!("{other}"),
        }
        let own = chains.iter().filter(|row| row["cell"] == cell["cell"]);
        assert_eq!(own.count(), 2 * n, "{cell:?}");
    }
    let distinct: BTreeSet<&str> = stopping.into_iter().collect();
    assert_eq!(
        distinct.into_iter().collect::<Vec<_>>(),
        ["at-cap", "no-new-worlds", "reached"]
    );
    // Every world that a chain ran on is there to be sampled again.
    for row in &chains {
        let number: usize = row["data"].parse().unwrap();
        assert!(bench.exists(&format!("straight/detections/d{number:03}.csv")));
    }
    let run: serde_json::Value = serde_json::from_str(&bench.read("straight/run.json")).unwrap();
    assert_eq!(run["chains"], chains.len());
    let page = bench.read("straight/report.md");
    assert!(
        page.contains("Stopped at the cap before that: c0"),
        "the report names them"
    );
    assert!(
        page.contains("1 cell stopped at the cap of 12 worlds"),
        "and warns"
    );
    assert!(page.contains("Stopped because more worlds would be the same again: c001, c002."));
}

#[test]
fn threads_kills_and_the_order_of_records_change_nothing() {
    let bench = bench();
    bench.ok(&[
        "-q",
        "--threads",
        "2",
        "sweep",
        "until.toml",
        "--out",
        "two",
    ]);
    assert_same(&bench, "two");
    let all = records(&bench, "straight");
    let run = bench.read("straight/run.json");
    // What a kill leaves: some records, the last one torn; in the first round, in a later one, and at its end.
    for (kept, torn) in [
        (0, 9),
        (4, 0),
        (all.len() / 2, 30),
        (all.len() - 1, 1),
        (all.len(), 0),
    ] {
        let folder = format!("killed-{kept}");
        let mut journal = all[..kept].concat();
        journal.push_str(&all.get(kept).map_or("", |line| line)[..torn]);
        bench.write(&format!("{folder}/run.json"), &run);
        bench.write(&format!("{folder}/journal.jsonl"), journal);
        bench.ok(&["-q", "sweep", "until.toml", "--out", &folder]);
        assert_same(&bench, &folder);
        let found: BTreeSet<String> = records(&bench, &folder).into_iter().collect();
        assert_eq!(
            found,
            all.iter().cloned().collect(),
            "each chain was run once"
        );
    }
    // Chains end in another order, here the last world first: a cell is judged by all of a round or not at all.
    let backwards: Vec<String> = all.iter().rev().cloned().collect();
    bench.write("order/run.json", &run);
    bench.write("order/journal.jsonl", backwards[..all.len() / 2].concat());
    let half = bench.run(&["report", "order"]);
    assert_eq!(
        half.code, 1,
        "the sweep file is not there yet: {}",
        half.stderr
    );
    bench.ok(&["-q", "sweep", "until.toml", "--out", "order"]);
    assert_same(&bench, "order");
}

#[test]
fn another_rule_keeps_the_chains() {
    let bench = bench();
    let before = records(&bench, "straight");
    bench.write(
        "more.toml",
        SWEEP.replace("max_replicates = 12", "max_replicates = 20"),
    );
    let refused = bench.run(&["sweep", "more.toml", "--out", "straight"]);
    assert_eq!(refused.code, 1, "{}", refused.stderr);
    bench.ok(&["-q", "sweep", "more.toml", "--out", "straight", "--force"]);
    let after = records(&bench, "straight");
    assert_eq!(after[..before.len()], before, "nothing is run again");
    assert!(after.len() > before.len());
    let key = |line: &String| line.split("\"key\":\"").nth(1).unwrap()[..32].to_owned();
    let keys: BTreeSet<String> = after.iter().map(key).collect();
    assert_eq!(keys.len(), after.len());
    let cells = rows(&bench.read("straight/cells.csv"));
    let most = cells
        .iter()
        .map(|row| row["n_replicates"].parse::<u64>().unwrap())
        .max();
    assert_eq!(most, Some(18), "3, 5, 8, 12, 18");
    // Back to the old rule: what it does not ask for is left out, and the tables are as they were.
    bench.ok(&["-q", "sweep", "until.toml", "--out", "straight", "--force"]);
    assert_eq!(records(&bench, "straight"), after);
    bench.ok(&["-q", "sweep", "until.toml", "--out", "fresh"]);
    let (again, fresh) = (fixed(&bench, "straight"), fixed(&bench, "fresh"));
    for name in ["cells.csv", "chains.csv", "convergence.csv", "report.md"] {
        assert!(again[name] == fresh[name], "{name}");
    }
}

#[test]
fn shards_take_whole_cells() {
    let bench = bench();
    let sweep = ["-q", "sweep", "until.toml", "--out", "out", "--shard"];
    for shard in ["2/3", "1/3"] {
        bench.ok(&[&sweep[..], &[shard]].concat());
    }
    let gaps = bench.run(&["merge", "out"]);
    assert_eq!(gaps.code, 75, "{}", gaps.stderr);
    assert!(
        gaps.stderr.contains("those of shards 3/3 (6)"),
        "{}",
        gaps.stderr
    );
    bench.ok(&[&sweep[..], &["3/3"]].concat());
    let merged = bench.run(&["-q", "merge", "out"]);
    assert_eq!(merged.code, 0, "{}", merged.stderr);
    assert_same(&bench, "out");
}

#[test]
fn a_plan_says_the_first_round_and_the_most() {
    let bench = Bench::new();
    bench.write("until.toml", SWEEP);
    let plan = bench.ok(&["plan", "until.toml"]);
    for line in [
        "chains     24 (2 per world)\n",
        "rounds     this is the first; a cell whose recovery rate is not known to ± 0.165 goes on, to 5, 8, 12 worlds\n",
        "at most    96 chains (12 worlds per cell)\n",
    ] {
        assert!(plan.contains(line), "{line}{plan}");
    }
    let explained = bench.ok(&["plan", "--explain", "until.toml", "--out", "out"]);
    assert!(
        explained.contains("24 of 24 chains would run in out\n"),
        "{explained}"
    );
    assert!(
        explained.contains(
            "then at most 72 more, while the recovery rates of 4 of 4 cells are not known to ± 0.165"
        ),
        "{explained}"
    );
    bench.ok(&["-q", "sweep", "until.toml", "--out", "out"]);
    let explained = bench.ok(&["plan", "--explain", "until.toml", "--out", "out"]);
    assert!(explained.contains("\n0 of "), "{explained}");
    assert!(
        explained.contains("then at most 0 more, while the recovery rates of 0 of 4"),
        "{explained}"
    );
}

#[test]
fn recorded_detections_have_no_more_worlds() {
    let bench = Bench::new();
    bench.write("until.toml", SWEEP);
    bench.ok(&["-q", "simulate", "--out", "d.csv"]);
    let out = bench.run(&["plan", "until.toml", "--data", "d.csv"]);
    assert_eq!(out.code, 0, "{}", out.stderr);
    assert!(!out.stdout.contains("rounds"), "{}", out.stdout);
    let given = SWEEP.replace(
        "replicates = 3\n",
        "replicates = 3\ndetections = \"d.csv\"\n",
    );
    bench.write(
        "given.toml",
        given.replace("world = [\"crossing-ranges\", \"square-ring\"]\n", ""),
    );
    let refused = bench.run(&["plan", "given.toml"]);
    assert_eq!(refused.code, 65);
    assert_eq!(
        refused.stderr,
        "ptm: given.toml: [data] rate_error: got 0.165 with detections, expected a simulated world: there are no more \
         worlds of recorded detections; leave it out and raise chains\n"
    );
}

/// Worlds whose chains are led on until they have converged: some end at the first look, some later
/// and some at the last.
const LED_ON: &str = "\
title = \"Until converged\"
[data]
noise = 0.5
replicates = 2
[sampler]
importance_samples = 5
[run]
samples = 400
until = \"converged\"
max_samples = 50_000
seed = 5
exact_up_to = 0
[design]
kind = \"grid\"
[design.factors]
penalty_height = [3, 1000]
temperatures = [1, 2]
";

#[test]
fn chains_that_are_led_on_end_alike_however_they_are_run() {
    let bench = Bench::new();
    bench.write("led.toml", LED_ON);
    bench.ok(&[
        "-q",
        "--threads",
        "1",
        "sweep",
        "led.toml",
        "--out",
        "straight",
    ]);
    let chains = rows(&bench.read("straight/chains.csv"));
    let worlds = rows(&bench.read("straight/convergence.csv"));
    let mut lengths = BTreeSet::new();
    for world in &worlds {
        let is_of = |row: &&BTreeMap<String, String>| {
            ["cell", "world"]
                .iter()
                .all(|name| row[*name] == world[*name])
        };
        let own: BTreeSet<u64> = chains
            .iter()
            .filter(is_of)
            .map(|row| row["n_proposals"].parse().unwrap())
            .collect();
        let length = *own.first().unwrap();
        assert_eq!(
            own.len(),
            1,
            "the chains of a world have one length: {own:?}"
        );
        assert!(length == 50_000 || (length / 400).is_power_of_two());
        assert!(
            length == 50_000 || world["convergence"] != "not-shown",
            "{world:?}"
        );
        lengths.insert(length);
    }
    assert!(lengths.len() >= 3, "{lengths:?}");

    bench.ok(&["-q", "--threads", "2", "sweep", "led.toml", "--out", "two"]);
    assert_same(&bench, "two");
    for shard in ["1/2", "2/2"] {
        bench.ok(&[
            "-q", "sweep", "led.toml", "--out", "parts", "--shard", shard,
        ]);
    }
    bench.ok(&["-q", "merge", "parts"]);
    assert_same(&bench, "parts");

    // A kill between the records of one world, and in the middle of its chains.
    let all = records(&bench, "straight");
    bench.write("killed/run.json", bench.read("straight/run.json"));
    bench.write("killed/journal.jsonl", all[..6].concat());
    bench.ok(&["-q", "sweep", "led.toml", "--out", "killed"]);
    assert_same(&bench, "killed");
    let found: BTreeSet<String> = records(&bench, "killed").into_iter().collect();
    assert_eq!(found, all.into_iter().collect(), "each chain is there once");
    let mut n_cut = 0;
    for seconds in ["0.01", "0.02", "0.05", "0.1", "0.2", "100"] {
        let limited = [
            "-q",
            "sweep",
            "led.toml",
            "--out",
            "cut",
            "--max-seconds",
            seconds,
        ];
        n_cut += usize::from(bench.run(&limited).code != 0);
    }
    assert!(n_cut >= 2, "{n_cut}");
    bench.ok(&["-q", "sweep", "led.toml", "--out", "cut"]);
    assert_same(&bench, "cut");
}

/// Chains that end at a length are those that were asked for that length.
#[test]
fn a_chain_that_is_led_on_is_the_chain_of_its_length() {
    let bench = Bench::new();
    bench.write("pairs.csv", common::pairs_csv(6));
    for temperatures in ["1", "2"] {
        let common = [
            "pairs.csv",
            "--seed",
            "3",
            "--exact-up-to",
            "0",
            "--temperatures",
            temperatures,
        ];
        let led = [&common[..], &["--samples", "300", "--until", "converged"]].concat();
        let led = bench.sample(&led);
        let length = led["chains"][0]["n_steps"].as_u64().unwrap();
        assert!(length > 300, "{length}");
        if temperatures == "2" {
            // The ladder is tuned in a quarter of the first length.
            continue;
        }
        let asked = bench.sample(&[&common[..], &["--samples", &length.to_string()]].concat());
        for part in [
            "topologies",
            "chains",
            "co_clustering",
            "convergence",
            "estimates",
        ] {
            assert_eq!(led[part], asked[part], "{part}");
        }
    }
    let refused = bench.run(&[
        "sample",
        "pairs.csv",
        "--until",
        "converged",
        "--chains",
        "1",
    ]);
    assert_eq!(refused.code, 1, "{}", refused.stderr);
    assert!(
        refused
            .stderr
            .contains("chains: got 1 with until converged, expected at least 2")
    );
}
