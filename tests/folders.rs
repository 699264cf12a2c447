//! The folder of a report when something in it is missing, damaged, left over or of a strange name.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;

use common::{Bench, SMALL_SWEEP, files, pairs_csv, ran};

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.write("other.toml", SMALL_SWEEP.replace("seed = 5", "seed = 6"));
    bench
}

fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.contains("timing") && name != "run.json" && name != "journal.jsonl"
    });
    found
}

#[test]
fn a_damaged_run_json_is_content_and_force_replaces_it() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "straight"]);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let whole = bench.read("out/run.json");
    let damages: [&[u8]; 4] = [
        b"[1, 2]\n",
        &whole.as_bytes()[..whole.len() / 2],
        b"\xff\xfe\xff\xfe",
        b"",
    ];
    // Those that are not replaced by --force come first: a refusal leaves them as they are.
    for damage in damages {
        bench.write("out/run.json", damage);
        let before = files(&bench.path("out"));
        let readers: [&[&str]; 5] = [
            &["sweep", "small.toml", "--out", "out"],
            &["report", "out"],
            &["merge", "out"],
            &["export", "out", "--out", "draws.csv"],
            &["sweep", "small.toml", "--out", "out", "--shard", "1/2"],
        ];
        for arguments in readers {
            let ran = bench.run(arguments);
            assert_eq!(ran.code, 65, "{arguments:?}: {}", ran.stderr);
            let said = "ptm: out/run.json: got a damaged file (";
            assert!(ran.stderr.starts_with(said), "{}", ran.stderr);
            assert!(ran.stderr.contains("--force"), "{}", ran.stderr);
            assert_eq!(ran.stderr.lines().count(), 1);
        }
        assert!(
            files(&bench.path("out")) == before,
            "a refusal changes nothing"
        );
        if damage.len() > 3 {
            continue;
        }
        let forced = bench.run(&["sweep", "small.toml", "--out", "out", "--force"]);
        assert_eq!(forced.code, 0, "{}", forced.stderr);
        let kept = "16 chains were finished earlier and are kept";
        assert!(forced.stderr.contains(kept), "{}", forced.stderr);
        assert!(fixed(&bench, "out") == fixed(&bench, "straight"));
    }
    // Without any, it is recognised by its journal.
    std::fs::remove_file(bench.path("out/run.json")).unwrap();
    let missing = bench.run(&["sweep", "small.toml", "--out", "out"]);
    assert_eq!(missing.code, 1);
    let said = "out: the folder holds a sweep without its run.json; ";
    assert!(missing.stderr.contains(said), "{}", missing.stderr);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out", "--force"]);
    assert!(fixed(&bench, "out") == fixed(&bench, "straight"));
    // Somebody else's run.json is no reason to clear a folder.
    bench.write("mine/run.json", "{\"steps\": 3}");
    bench.write("mine/thesis.tex", "all there is");
    let foreign = bench.run(&["sweep", "small.toml", "--out", "mine", "--force"]);
    assert_eq!(foreign.code, 1);
    assert!(
        foreign.stderr.contains("files that are no sweep's"),
        "{}",
        foreign.stderr
    );
    assert_eq!(files(&bench.path("mine")).len(), 2);
}

#[test]
fn a_forced_sweep_whose_journal_is_damaged_leaves_the_report() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let journal = bench.read("out/journal.jsonl");
    bench.write(
        "out/journal.jsonl",
        journal.replacen("\"done\"", "\"DONE\"", 1),
    );
    let before = files(&bench.path("out"));
    let refused = bench.run(&["sweep", "other.toml", "--out", "out", "--force"]);
    assert_eq!(refused.code, 65, "{}", refused.stderr);
    assert!(files(&bench.path("out")) == before);
}

#[test]
fn checkpoints_of_chains_that_are_done_are_removed_at_the_next_start() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let keys: Vec<String> = common::rows(&bench.read("out/timings.csv"))
        .iter()
        .map(|row| row["key"].clone())
        .collect();
    let commands: [&[&str]; 4] = [
        &["-q", "sweep", "small.toml", "--out", "out"],
        &["-q", "merge", "out"],
        &["-q", "report", "out"],
        &[
            "-q",
            "sweep",
            "small.toml",
            "--out",
            "out",
            "--shard",
            "1/2",
        ],
    ];
    for arguments in commands {
        bench.write(&format!("out/checkpoints/{}", keys[0]), "left by a kill");
        bench.write(&format!("out/checkpoints/{}", keys[7]), "left by a kill");
        bench.ok(arguments);
        assert!(!bench.exists("out/checkpoints"), "{arguments:?}");
    }
}

#[test]
fn an_export_of_a_part_says_what_is_missing() {
    let bench = bench();
    bench.ok(&[
        "-q",
        "sweep",
        "small.toml",
        "--out",
        "out",
        "--shard",
        "1/2",
    ]);
    for name in ["draws.csv", "draws.parquet"] {
        let ran = bench.run(&["export", "out", "--out", name]);
        assert_eq!(ran.code, 75, "{}", ran.stderr);
        assert_eq!(
            ran.stderr,
            "ptm: out: 8 of 16 chains have no record, and what was written is without them; run \
             the sweep to its end, then export again\n"
        );
        assert!(bench.exists(name));
    }
    let report = bench.run(&["report", "out"]);
    assert_eq!(report.code, 0);
    assert!(
        report.stderr.contains("8 of 16 chains have no record"),
        "{}",
        report.stderr
    );
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    bench.ok(&["-q", "export", "out", "--out", "draws.csv"]);
}

#[test]
fn what_has_no_end_is_left_in_time() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    symlink("/dev/zero", bench.path("zero.toml")).unwrap();
    let design = "[design]\nkind = \"list\"\n[[design.cells]]\nsamples = 300\n";
    bench.write(
        "world.toml",
        format!("[data]\nworld = \"zero.toml\"\n{design}"),
    );
    bench.write("good.csv", pairs_csv(4));
    let start = |file: &str| {
        let path = bench.path(file);
        let _ = std::fs::remove_file(&path);
        symlink("/dev/zero", path).unwrap();
    };
    let refused = |arguments: &[&str], said: &str| {
        let ran = bench.run(arguments);
        assert_eq!(ran.code, 65, "{arguments:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(said), "{arguments:?}: {}", ran.stderr);
    };
    refused(
        &["plan", "/dev/zero"],
        "/dev/zero: got more than 16 MB, expected a sweep file of at most",
    );
    refused(
        &["plan", "world.toml"],
        "zero.toml: got more than 16 MB, expected a world file of at most",
    );
    refused(
        &["simulate", "--world", "zero.toml"],
        "zero.toml: got more than 16 MB",
    );
    refused(
        &["sample", "good.csv", "--init", "file:/dev/zero"],
        "/dev/zero: got no list of labels (it has more than 64 MB)",
    );
    start("out/journal.jsonl");
    refused(
        &["report", "out"],
        "out/journal.jsonl:1: got a damaged record",
    );
    start("out/run.json");
    refused(
        &["report", "out"],
        "out/run.json: got a damaged file (it has more than 1000 MB)",
    );
}

/// Linux takes any bytes in a name, and so do all commands that read data.
#[cfg(target_os = "linux")]
#[test]
fn data_whose_name_is_not_utf8_are_read() {
    let bench = bench();
    let name = OsStr::from_bytes(b"data-\xff\xfe.csv");
    let twin = OsStr::from_bytes(b"data-\xfe\xff.csv");
    std::fs::write(bench.path("").join(name), pairs_csv(4)).unwrap();
    std::fs::write(bench.path("").join(twin), pairs_csv(6)).unwrap();
    let labels = OsStr::from_bytes(b"labels-\xff");
    std::fs::write(bench.path("").join(labels), "0,0,1,1\n").unwrap();
    let run = |words: &[&str], name: &OsStr, more: &[&str]| {
        let mut command = bench.command(words);
        ran(&command.arg(name).args(more).output().unwrap())
    };
    let sample = ["--samples", "100", "--figure", "f.png", "--json", "s.json"];
    let said = run(&["sample"], name, &sample);
    assert_eq!(said.code, 0, "{}", said.stderr);
    assert!(
        said.stdout
            .contains("data-\u{fffd}\u{fffd}.csv: 4 detections"),
        "{}",
        said.stdout
    );
    assert!(said.stdout.is_ascii() || said.stdout.contains('\u{fffd}'));
    // The settings name the file so that it can be found again.
    let json: serde_json::Value = serde_json::from_str(&bench.read("s.json")).unwrap();
    let text = json["settings"]["detections"].as_str().unwrap();
    assert_eq!(topometric::files::path_of(text).as_os_str(), name);
    assert_eq!(run(&["exact"], name, &[]).code, 0);
    assert_eq!(run(&["tune", "--no-simulation"], name, &[]).code, 0);
    assert_eq!(
        run(&["evaluate"], name, &["--samples", "100", "--out", "e"]).code,
        0
    );
    let mut init = b"file:".to_vec();
    init.extend(labels.as_bytes());
    bench.write("plain.csv", pairs_csv(4));
    let start = run(
        &["sample", "plain.csv", "--init"],
        OsStr::from_bytes(&init),
        &sample[..4],
    );
    assert_eq!(start.code, 0, "{}", start.stderr);
    // A sweep on them is continued, reported and refused for others as any sweep is.
    for data in [name, name] {
        let swept = run(
            &["-q", "sweep", "small.toml", "--out", "out", "--data"],
            data,
            &[],
        );
        assert_eq!(swept.code, 0, "{}", swept.stderr);
    }
    bench.ok(&["-q", "report", "out"]);
    let other = run(
        &["-q", "sweep", "small.toml", "--out", "out", "--data"],
        twin,
        &[],
    );
    assert_eq!(other.code, 1);
    let said = "another run of this sweep, on data-\u{fffd}\u{fffd}.csv";
    assert!(other.stderr.contains(said), "{}", other.stderr);
    let missing = run(&["sample"], OsStr::from_bytes(b"no-\xff"), &[]);
    assert_eq!(missing.code, 1);
    assert!(missing.stderr.contains("no-\u{fffd}"), "{}", missing.stderr);
}

/// A report of half a sweep may have a figure that the whole one has not.
#[test]
fn a_figure_of_an_earlier_report_goes_and_a_file_of_the_user_stays() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let before = files(&bench.path("out"));
    let page = bench.read("out/report.md");
    bench.write(
        "out/report.md",
        format!("{page}\n![an earlier one](figures/response-earlier.png)\n"),
    );
    for file in ["response-earlier.png", "response-earlier.svg", "mine.png"] {
        bench.write(&format!("out/figures/{file}"), "a picture");
    }
    bench.ok(&["-q", "report", "out"]);
    let mut after = files(&bench.path("out"));
    assert!(after.remove("figures/mine.png").is_some());
    let names = |of: &BTreeMap<String, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&after), names(&before));
}
