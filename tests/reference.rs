//! The posteriors that sort failures: asked for once, sampled as all other chains are, and shared
//! by cells that differ in their sampler only.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::{Bench, files, rows};

/// Two models and two starts on one world; chains too short to get anywhere from one cluster.
const SWEEP: &str = "\
title = \"Faults\"
[data]
noise = 0.3
[sampler]
estimator = \"fresh\"
moves = \"split-merge=1\"
importance_samples = 5
[run]
samples = 300
chains = 2
seed = 5
[design]
kind = \"grid\"
[design.factors]
penalty_radius = [1, 10]
init = [\"singletons\", \"one-cluster\"]
";

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("faults.toml", SWEEP);
    bench.ok(&["-q", "sweep", "faults.toml", "--out", "single"]);
    bench
}

/// What must be the same however the sweep was run.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.contains("timing") && !name.starts_with("shards/") && !name.ends_with("run.json")
    });
    let journal = found.get_mut("journal.jsonl").unwrap();
    let mut lines: Vec<&[u8]> = journal.split_inclusive(|&byte| byte == b'\n').collect();
    lines.sort_unstable();
    *journal = lines.concat();
    found
}

#[test]
fn a_posterior_is_sampled_once_for_all_cells_that_share_it() {
    let bench = bench();
    let plan = bench.ok(&["plan", "faults.toml"]);
    let line = "reference  8 more chains, of the posteriors of 2 models and worlds: they sort the failures\n";
    assert!(plan.contains("chains     8 (2 per world)\n"), "{plan}");
    assert!(plan.contains(line), "{plan}");
    // Of cells and of posteriors: 8 chains each, none twice.
    assert_eq!(bench.read("single/journal.jsonl").lines().count(), 16);
    let posteriors = rows(&bench.read("single/posteriors.csv"));
    let cells: Vec<&str> = posteriors.iter().map(|row| row["cells"].as_str()).collect();
    assert_eq!(cells, ["c001 c002", "c003 c004"]);
    for row in &posteriors {
        assert_eq!(row["answered_by"], "reference chains");
        assert_eq!(row["n_chains_planned"], "4");
    }
    // They are no rows of cells, chains or factors.
    assert_eq!(rows(&bench.read("single/chains.csv")).len(), 8);
    assert_eq!(rows(&bench.read("single/cells.csv")).len(), 4);

    let explained = bench.ok(&["plan", "--explain", "faults.toml", "--out", "single"]);
    assert!(explained.contains("reference  8 kept\n"), "{explained}");
    assert!(
        explained.contains("0 of 16 chains would run"),
        "{explained}"
    );
}

#[test]
fn every_failure_has_one_fault_and_it_is_what_the_posterior_says() {
    let bench = bench();
    let posteriors = rows(&bench.read("single/posteriors.csv"));
    let prefers: BTreeMap<&str, &str> = posteriors
        .iter()
        .map(|row| (row["penalty_radius"].as_str(), row["prefers"].as_str()))
        .collect();
    // Landmarks stand 5 m apart and more: a radius of 1 m is no reason to merge, one of 10 m is.
    assert_eq!(prefers["1.0"], "other-map", "{posteriors:?}");
    assert_eq!(prefers["10.0"], "truth", "{posteriors:?}");
    let mut found = BTreeSet::new();
    for chain in rows(&bench.read("single/chains.csv")) {
        let expected = match (
            chain["recovered"].as_str(),
            prefers[chain["penalty_radius"].as_str()],
        ) {
            ("true", _) => "",
            (_, "truth") => "sampler",
            _ => "model",
        };
        assert_eq!(chain["fault"], expected, "{chain:?}");
        found.insert(expected);
    }
    assert!(
        found.contains("model") && found.contains("sampler"),
        "{found:?}"
    );
    let page = bench.read("single/index.html");
    assert!(page.contains("Whose fault"), "the answer names it");
}

#[test]
fn shards_and_resumes_give_the_bytes_of_one_run() {
    let bench = bench();
    let single = fixed(&bench, "single");
    for shard in ["1/3", "2/3", "3/3"] {
        let sweep = ["-q", "sweep", "faults.toml", "--out", "shards", "--shard"];
        bench.ok(&[sweep.as_slice(), &[shard]].concat());
    }
    bench.ok(&["-q", "merge", "shards"]);
    assert_eq!(fixed(&bench, "shards"), single);

    // As a kill leaves it: the cells' chains are there, and some of the posteriors'.
    let journal = bench.read("single/journal.jsonl");
    let half: Vec<&str> = journal.split_inclusive('\n').take(10).collect();
    bench.ok(&["-q", "sweep", "faults.toml", "--out", "resumed"]);
    bench.write("resumed/journal.jsonl", half.concat());
    bench.ok(&["-q", "sweep", "faults.toml", "--out", "resumed"]);
    assert_eq!(fixed(&bench, "resumed"), single);
}

#[test]
fn nothing_is_asked_where_it_is_switched_off_or_the_sampler_is_the_default() {
    let bench = Bench::new();
    let off = SWEEP.replace("seed = 5", "seed = 5\nreference = \"none\"");
    let default = SWEEP.replace("estimator = \"fresh\"\nmoves = \"split-merge=1\"\n", "");
    for (name, text) in [("off", off), ("default", default)] {
        assert_ne!(text, SWEEP);
        let file = format!("{name}.toml");
        bench.write(&file, text);
        bench.ok(&["-q", "sweep", &file, "--out", name]);
        assert!(!bench.exists(&format!("{name}/posteriors.csv")));
        let chains = rows(&bench.read(&format!("{name}/chains.csv")));
        assert!(chains.iter().all(|chain| chain["fault"].is_empty()));
    }
    let bad = SWEEP.replace("seed = 5", "seed = 5\nreference = \"explicit\"");
    bench.write("bad.toml", bad);
    let refused = bench.run(&["sweep", "bad.toml", "--out", "bad"]);
    assert!(
        refused
            .stderr
            .contains("reference: got \"explicit\", expected auto or none"),
        "{}",
        refused.stderr
    );
}

/// Few detections: the exact posterior answers in the place of the reference chains.
#[test]
fn where_the_exact_posterior_is_known_it_answers() {
    let bench = Bench::new();
    let sweep = "[model]\nsigma_o = 0.3\nsigma_t = 0.3\n[sampler]\nestimator = \"fresh\"\n\
                 [run]\nsamples = 500\n[design]\nkind = \"grid\"\n\
                 [design.factors]\npenalty_radius = [0.01, 2]\n";
    bench.write("few.toml", sweep);
    bench.write("few.csv", "x,y,landmark\n0,0,0\n0.2,0,0\n5,0,1\n5.2,0,1\n");
    bench.ok(&[
        "-q", "sweep", "few.toml", "--data", "few.csv", "--out", "out",
    ]);
    let found = rows(&bench.read("out/posteriors.csv"));
    let of = |row: &BTreeMap<String, String>| {
        let columns = ["penalty_radius", "answered_by", "prefers"];
        columns.map(|name| row[name].clone())
    };
    let found: Vec<[String; 3]> = found.iter().map(of).collect();
    let expected = [["0.01", "exact", "other-map"], ["2.0", "exact", "truth"]];
    assert_eq!(found, expected);
}
