//! Sweeps from the file to the report: identical whatever the threads, interruptions and repetitions.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::collections::BTreeMap;
use std::process::Stdio;
use std::time::{Duration, Instant};

use common::{Bench, SMALL_SWEEP, files, ran, rows};

/// Four cells of two chains of 40,000 proposals: long enough to be stopped half-way.
const LONG_SWEEP: &str = "\
[data]
replicates = 1
[sampler]
importance_samples = 30
[run]
samples = 40000
chains = 4
[design]
kind = \"grid\"
[design.factors]
penalty_radius = [5, 10]
";

/// What a sweep's folder must hold the same bytes of, however it was run.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| !base(name).starts_with("timing") && name != "run.json");
    // Chains end in any order, so the journal is a set of lines.
    let journal = found.get_mut("journal.jsonl").unwrap();
    let mut lines: Vec<&[u8]> = journal.split_inclusive(|&byte| byte == b'\n').collect();
    lines.sort_unstable();
    *journal = lines.concat();
    found
}

/// The name of a file without its folder.
fn base(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

fn assert_same(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in a {
        assert!(b[name] == *bytes, "{name} differs");
    }
}

#[test]
fn threads_repetition_and_resume_change_no_byte() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    let sweep = |threads: &str, out: &str| {
        bench.ok(&[
            "-q",
            "sweep",
            "small.toml",
            "--threads",
            threads,
            "--out",
            out,
        ]);
    };
    sweep("1", "one");
    sweep("2", "two");
    sweep("2", "again");
    let one = fixed(&bench, "one");
    for name in [
        "chains.parquet",
        "cells.csv",
        "topologies.csv",
        "index.html",
        "report.md",
    ] {
        assert!(one.contains_key(name), "{name}");
    }
    assert_same(&one, &fixed(&bench, "two"));
    assert_same(&one, &fixed(&bench, "again"));

    // Three records and a torn fourth, as a run leaves them that is killed.
    let journal = bench.read("again/journal.jsonl");
    let lines: Vec<&str> = journal.split_inclusive('\n').collect();
    assert_eq!(lines.len(), 16);
    let torn = lines[..3].concat() + &lines[3][..lines[3].len() / 2];
    bench.write("again/journal.jsonl", torn);
    let resumed = bench.run(&["sweep", "small.toml", "--out", "again"]);
    assert_eq!(resumed.code, 0);
    assert!(
        resumed
            .stderr
            .contains("3 chains were finished earlier and are kept")
    );
    assert_same(&one, &fixed(&bench, "again"));

    // The order of a sweep file, and its comments, are nobody's business but the reader's.
    let (head, factors) = SMALL_SWEEP.split_once("[design.factors]\n").unwrap();
    let turned: Vec<&str> = factors.lines().rev().collect();
    let turned = format!("# turned\n{head}[design.factors]\n{}\n", turned.join("\n"));
    bench.write("small.toml", turned.replace("[1, 10]", "[10, 1]"));
    sweep("2", "one");
    let mut other = fixed(&bench, "one");
    other.insert("sweep.toml".to_owned(), SMALL_SWEEP.into());
    assert_same(&one, &other);
}

#[test]
fn the_report_is_written_again_and_pages_on_demand() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let whole = fixed(&bench, "out");
    for page in [
        "cells/c002.html",
        "figures/cells/c002.png",
        "figures/cells/c002.svg",
        "factors/init.html",
        "index.html",
    ] {
        std::fs::remove_file(bench.path("out").join(page)).unwrap();
    }
    let said = bench.ok(&["report", "out", "--cell", "c002"]);
    assert!(said.contains("index.html"));
    assert_same(&whole, &fixed(&bench, "out"));
    // All that a page names is there.
    for (name, bytes) in &whole {
        let Some(folder) = name.strip_suffix(".html").map(|name| name.contains('/')) else {
            continue;
        };
        let text = String::from_utf8(bytes.clone()).unwrap();
        let targets = text
            .split("=\"")
            .filter_map(|part| part.split_once('"').map(|split| split.0));
        for target in targets.filter(|t| {
            [".html", ".png", ".svg", ".csv", ".parquet"]
                .iter()
                .any(|e| t.ends_with(e))
        }) {
            let base = if folder { "out/cells/" } else { "out/" };
            assert!(bench.exists(&format!("{base}{target}")), "{name}: {target}");
        }
    }
}

/// Starts the long sweep and waits until it has put a chain on disk.
fn started(bench: &Bench) -> std::process::Child {
    bench.write("long.toml", LONG_SWEEP);
    let child = bench
        .command(&["sweep", "long.toml", "--threads", "1", "--out", "out"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while n_records(bench) == 0 {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "no chain after a minute"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

fn n_records(bench: &Bench) -> usize {
    if bench.exists("out/journal.jsonl") {
        bench.read("out/journal.jsonl").lines().count()
    } else {
        0
    }
}

fn signalled(name: &str, code: i32) {
    let bench = Bench::new();
    let child = started(&bench);
    let kill = std::process::Command::new("kill");
    let mut kill = kill;
    let killed = kill.args([name, &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let stopped = ran(&child.wait_with_output().unwrap());
    let kept = n_records(&bench);
    assert!((1..8).contains(&kept), "stopped half-way: {kept}");
    if code > 0 {
        assert_eq!(stopped.code, code);
        assert!(
            stopped
                .stderr
                .contains(&format!("stopped: {kept} of 8 chains are kept"))
        );
    }
    assert_eq!(stopped.stdout, "");
    assert!(!bench.exists("out/index.html"), "no report of half a sweep");
    let resumed = bench.run(&["sweep", "long.toml", "--out", "out"]);
    assert_eq!(resumed.code, 0, "{}", resumed.stderr);
    assert!(resumed.stderr.contains("finished earlier and are kept"));
    bench.ok(&["-q", "sweep", "long.toml", "--out", "straight"]);
    assert_same(&fixed(&bench, "out"), &fixed(&bench, "straight"));
}

#[test]
fn a_killed_sweep_continues() {
    signalled("-KILL", -1);
}

#[test]
fn ctrl_c_keeps_what_is_finished() {
    signalled("-INT", 130);
}

#[test]
fn a_terminated_sweep_keeps_what_is_finished() {
    signalled("-TERM", 143);
}

#[test]
fn chains_whose_data_fail_are_rows_and_stop_nothing() {
    let bench = Bench::new();
    let head = SMALL_SWEEP.split("[design.factors]").next().unwrap();
    bench.write(
        "some.toml",
        format!("{head}[design.factors]\nmin_sightings = [3, 1000000]\n"),
    );
    bench.write(
        "all.toml",
        format!("{head}[design.factors]\nmin_sightings = [1000000, 2000000]\n"),
    );
    for (sweep, n_failed, n) in [("some", 4, 8), ("all", 8, 8)] {
        let ran = bench.run(&["sweep", &format!("{sweep}.toml"), "--out", sweep]);
        assert_eq!(ran.code, 2, "{}", ran.stderr);
        assert!(ran.stdout.contains(&format!("{n_failed} chains failed")));
        let rows = rows(&bench.read(&format!("{sweep}/chains.csv")));
        assert_eq!(rows.len(), n);
        let failed: Vec<_> = rows
            .iter()
            .filter(|row| row["status"] == "failed")
            .collect();
        assert_eq!(failed.len(), n_failed);
        for row in failed {
            assert!(row["reason"].contains("sightings") && row["acceptance_rate"].is_empty());
        }
        // The page of a cell that failed says why, and every link leads somewhere.
        let index = bench.read(&format!("{sweep}/index.html"));
        for cell in ["c001", "c002"] {
            assert!(index.contains(&format!("href=\"cells/{cell}.html\"")));
            assert!(bench.exists(&format!("{sweep}/cells/{cell}.html")));
        }
        assert!(
            bench
                .read(&format!("{sweep}/cells/c002.html"))
                .contains("failed: ")
        );
        assert_eq!(bench.run(&["-q", "report", sweep]).code, 2);
        assert_eq!(
            bench
                .run(&["-q", "sweep", &format!("{sweep}.toml"), "--out", sweep])
                .code,
            2
        );
    }
}

/// Every page tells how to run its cell alone; what that gives is the first world's row.
#[test]
fn the_rerun_command_gives_the_same_chain() {
    let bench = Bench::new();
    bench.write(
        "small.toml",
        SMALL_SWEEP.replace("penalty_radius = [1, 10]", "sigma_o = [0.1, 1]"),
    );
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let chains = rows(&bench.read("out/chains.csv"));
    let topologies = rows(&bench.read("out/topologies.csv"));
    for cell in ["c001", "c002", "c003", "c004"] {
        let page = bench.read(&format!("out/cells/{cell}.html"));
        let command = page.split("ptm sample ").nth(1).unwrap();
        let command = format!("ptm sample {}", command.split("</pre>").next().unwrap());
        let words: Vec<&str> = command.split(' ').collect();
        assert_eq!(&words[..2], ["ptm", "sample"]);
        let csv = format!("out/{}", words[2]);
        // One chain of the two, so that the pooled counts are its own.
        let mut flags: Vec<&str> = words[3..].to_vec();
        let n_chains = flags.iter().position(|flag| *flag == "--chains").unwrap();
        flags[n_chains + 1] = "1";
        let json = bench.sample(&[&[csv.as_str()][..], &flags].concat());
        let is_first = |row: &&BTreeMap<String, String>| {
            row["cell"] == cell && row["world"] == "1" && row["chain"] == "1"
        };
        let map = &json["topologies"][0];
        let labels: Vec<String> = map["labels"]
            .as_array()
            .unwrap()
            .iter()
            .map(|l| l.to_string())
            .collect();
        let chain = chains.iter().find(is_first).unwrap();
        assert_eq!(chain["map_labels"], labels.join(","));
        for kind in ["merge", "split"] {
            for what in ["proposed", "accepted", "impossible"] {
                let got = json["chains"][0]["moves"][kind][what].to_string();
                assert_eq!(
                    chain[&format!("{kind}_{what}")],
                    got,
                    "{cell} {kind} {what}"
                );
            }
        }
        let top = topologies.iter().find(is_first).unwrap();
        assert_eq!(
            (&top["rank"], &top["count"]),
            (&"1".to_owned(), &map["count"].to_string())
        );
    }
}

/// The other command runs the cell with all its worlds and chains as they are in the sweep, into a folder
/// that can be reported on again; the record of every chain is the same.
#[test]
fn a_cell_alone_has_the_chains_it_has_in_the_sweep() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let page = bench.read("out/cells/c003.html");
    let command = page.split("ptm sweep ").nth(1).unwrap();
    let command = command.split("</pre>").next().unwrap();
    let words: Vec<&str> = ["-q", "sweep"]
        .into_iter()
        .chain(command.split(' '))
        .collect();
    let mut again = bench.command(&words);
    let ran = common::ran(&again.current_dir(bench.path("out")).output().unwrap());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let lines = |journal: &str| {
        let text = bench.read(journal);
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort_unstable();
        lines
    };
    let keys: Vec<String> = rows(&bench.read("out/chains.csv"))
        .into_iter()
        .filter(|row| row["cell"] == "c003")
        .map(|row| row["key"].clone())
        .collect();
    assert_eq!(keys.len(), 4);
    let of_cell = |line: &String| keys.iter().any(|key| line.contains(key.as_str()));
    let mut in_sweep = lines("out/journal.jsonl");
    in_sweep.retain(of_cell);
    assert_eq!(lines("out/c003-again/journal.jsonl"), in_sweep);
    bench.ok(&["-q", "report", "out/c003-again"]);
    assert!(bench.exists("out/c003-again/cells/c003.html"));
    // Verdicts are of the same random numbers too.
    let verdicts = |file: &str| -> Vec<String> {
        let rows = rows(&bench.read(file)).into_iter();
        let own = rows.filter(|row| row["cell"] == "c003");
        own.map(|row| format!("{} {}", row["verdict"], row["topology_distance_p"]))
            .collect()
    };
    assert_eq!(
        verdicts("out/convergence.csv"),
        verdicts("out/c003-again/convergence.csv")
    );
    let ran = bench.run(&["sweep", "small.toml", "--cell", "c9", "--out", "no"]);
    assert_eq!(ran.code, 65, "{}", ran.stderr);
    assert!(ran.stderr.contains("c001 to c004"), "{}", ran.stderr);
}

/// Labels are the user's: they must neither become markup nor break a table. And every setting that
/// a design may vary is a column of the tables, beside those of the results.
#[test]
fn hostile_labels_and_extreme_settings_leave_a_sound_report() {
    let bench = Bench::new();
    let cells = [
        ("<script>alert(1)</script>", "samples = 1"),
        ("a|b", "sigma_o = 1e-6\nburn_in = 99"),
        (
            "\\\"quoted\\\" ../../etc",
            "sigma_o = 1e6\npenalty_height = 1e6\npenalty_radius = 1e9",
        ),
        (
            "zero",
            "sigma_t = 1e-6\npenalty_height = 0\npenalty_radius = 1e-9\nlaps = 0.5",
        ),
        (
            "linear",
            "estimator = \"fresh\"\narithmetic = \"linear\"\nsplit = \"prefix-cut\"\ninit = \"random\"\nmin_sightings = 2",
        ),
    ];
    let cells =
        cells.map(|(label, keys)| format!("[[design.cells]]\nlabel = \"{label}\"\n{keys}\n"));
    let head = "title = \"A <b>title</b> | & [x](y)\"\n[run]\nsamples = 100\nchains = 1\n[design]\nkind = \"list\"\n";
    bench.write("odd ü.toml", head.to_owned() + &cells.concat());
    let ran = bench.run(&["sweep", "odd ü.toml", "--out", "an öut"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    for (name, bytes) in files(&bench.path("an öut")) {
        let Ok(text) = String::from_utf8(bytes) else {
            continue;
        };
        if name.ends_with(".html") || name.ends_with(".md") {
            assert!(
                !text.contains("<script>alert") && !text.contains("<b>title"),
                "{name}"
            );
        }
        let lower = text.to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).collect();
        assert!(
            !words.contains(&"nan") && !words.contains(&"inf"),
            "{name} holds a NaN"
        );
    }
    let text = bench.read("an öut/report.md");
    let unescaped = |line: &str| line.replace("\\|", "").matches('|').count();
    let mut n_tables = 0;
    for table in text.split("\n\n").filter(|part| part.contains("|---|")) {
        let counts: Vec<usize> = table.trim().lines().map(unescaped).collect();
        assert!(
            counts.len() > 2 && counts.iter().all(|n| *n == counts[0]),
            "{counts:?} {table}"
        );
        n_tables += 1;
    }
    assert_eq!(n_tables, 3, "verdicts, cells and what now");
    let rows = rows(&bench.read("an öut/chains.csv"));
    assert_eq!(rows[1]["burn_in"], "auto");
    assert!(rows.iter().all(|row| row.contains_key("burn_in_found")));
}
