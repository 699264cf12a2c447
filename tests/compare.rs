//! Black-box tests of `ptm compare`: what it finds, what it refuses, its exit codes.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, SMALL_SWEEP};
use serde_json::Value;

/// The small sweep with so many worlds and chains, and other settings.
fn sweep(bench: &Bench, folder: &str, edits: &[(&str, &str)]) {
    let mut text = SMALL_SWEEP.to_owned();
    for (from, to) in edits {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let file = format!("{folder}.toml");
    bench.write(&file, text);
    bench.ok(&["-q", "sweep", &file, "--out", folder]);
}

const MORE: (&str, &str) = ("replicates = 2", "replicates = 5");

#[test]
fn the_same_sweep_is_not_different_and_another_sampler_is() {
    let bench = Bench::new();
    sweep(&bench, "a", &[MORE]);
    sweep(&bench, "again", &[MORE]);
    // Of the report's sampler the acceptance is far lower than that of the default moves.
    let other = (
        "importance_samples = 5",
        "importance_samples = 5\nmoves = \"split-merge=1\"\nestimator = \"fresh\"",
    );
    sweep(&bench, "b", &[MORE, other]);

    let same = bench.run(&["compare", "a", "again"]);
    assert_eq!(same.code, 0, "{}", same.stderr);
    assert!(
        same.stdout
            .contains("4 on 5 worlds, 4 of them the same in every chain"),
        "{}",
        same.stdout
    );
    assert!(
        same.stdout
            .ends_with("verdict     no difference found at level 0.05\n"),
        "{}",
        same.stdout
    );

    let differs = bench.run(&["compare", "a", "b", "--json", "-"]);
    assert_eq!(differs.code, 3, "{}", differs.stderr);
    let json: Value = serde_json::from_str(&differs.stdout).unwrap();
    assert_eq!(json["differs"], true);
    assert_eq!(
        json["settings_that_differ"]["estimator"],
        serde_json::json!(["auto", "fresh"])
    );
    let overall = json["overall"].as_array().unwrap();
    let acceptance = overall
        .iter()
        .find(|row| row["measure"] == "acceptance")
        .unwrap();
    assert_eq!(acceptance["found"], true);
    assert_eq!(acceptance["n_units"], 5);
    let (a, b) = (
        acceptance["a"].as_f64().unwrap(),
        acceptance["b"].as_f64().unwrap(),
    );
    assert!((b - a - acceptance["difference"].as_f64().unwrap()).abs() < 1e-12);
    // The numbers are those of the tables.
    let chains = common::rows(&bench.read("a/chains.csv"));
    let rates = chains
        .iter()
        .map(|row| row["acceptance_rate"].parse::<f64>().unwrap());
    assert!((rates.sum::<f64>() / chains.len() as f64 - a).abs() < 1e-12);
    assert_eq!(json["cells"].as_array().unwrap().len(), 4);

    let text = bench.run(&["compare", "a", "b"]);
    assert_eq!(text.code, 3);
    assert!(
        text.stdout
            .contains("setting     estimator: A auto, B fresh"),
        "{}",
        text.stdout
    );
    assert!(
        text.stdout
            .ends_with("verdict     DIFFERENT at level 0.05\n"),
        "{}",
        text.stdout
    );
    let quiet = bench.run(&["-q", "compare", "a", "b"]);
    assert_eq!((quiet.code, quiet.stdout.as_str()), (3, ""));
}

#[test]
fn what_cannot_be_compared_is_refused_in_one_line() {
    let bench = Bench::new();
    sweep(&bench, "a", &[]);
    sweep(&bench, "other-seed", &[("seed = 5", "seed = 6")]);
    sweep(&bench, "fewer", &[("[1, 10]", "[10]")]);
    let refusal = |arguments: &[&str]| {
        let ran = bench.run(&[&["compare"], arguments].concat());
        assert_eq!(ran.stdout, "");
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
        (ran.code, ran.stderr)
    };
    let (code, message) = refusal(&["a", "other-seed"]);
    assert!(
        code == 1 && message.contains("different detections on world 1"),
        "{message}"
    );
    sweep(&bench, "apart", &[("[1, 10]", "[3]")]);
    let (code, message) = refusal(&["a", "apart"]);
    assert!(
        code == 1 && message.contains("got no cell in common among 4 of A"),
        "{message}"
    );
    let (code, message) = refusal(&["a", "nowhere"]);
    assert!(
        code == 1 && message.contains("nowhere/cells.csv: cannot be read"),
        "{message}"
    );
    let (code, message) = refusal(&["a", "fewer", "--level", "5"]);
    assert!(code == 1 && message.contains("--level: got 5"), "{message}");
    let chains = bench.read("fewer/chains.csv");
    bench.write(
        "fewer/chains.csv",
        chains.replace("mean_n_sets", "mean_sets"),
    );
    let (code, message) = refusal(&["fewer", "fewer"]);
    assert!(
        code == 65 && message.contains("got no column mean_n_sets"),
        "{message}"
    );
}

/// Grids that overlap in part are compared where they do; three sweeps make a page of two parts.
#[test]
fn sweeps_that_overlap_in_part_are_compared_on_a_page() {
    let bench = Bench::new();
    sweep(&bench, "a", &[]);
    sweep(&bench, "fewer", &[("[1, 10]", "[10]")]);
    sweep(&bench, "more", &[("[1, 10]", "[1, 3, 10]")]);
    let ran = bench.run(&["compare", "a", "fewer", "more", "--page", "page.html"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let left_out = [
        "2 cells only in A, 0 only in B",
        "0 cells only in A, 2 only in B",
    ];
    for words in left_out {
        assert!(ran.stdout.contains(words), "{}", ran.stdout);
    }
    let page = bench.read("page.html");
    assert_eq!(page.matches("<h2>").count(), 2);
    assert!(page.contains("Does fewer (B) differ from a (A)?"), "{page}");
    // Offline and in one file: a map of differences for each, and no address but that of SVG.
    assert!(page.matches("<svg").count() >= 3 && !page.contains("<img"));
    let addresses = page.matches("http").count();
    assert_eq!(
        addresses,
        page.matches("http://www.w3.org/2000/svg").count()
    );
    let json = bench.run(&["compare", "a", "fewer", "more", "--json", "-"]);
    let found: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(found[0]["n_alone"], serde_json::json!([2, 0]));
    assert_eq!(found[1]["n_alone"], serde_json::json!([0, 2]));
    // The same cells: every chain is the same.
    assert_eq!(found[0]["n_identical"], 2);
}
