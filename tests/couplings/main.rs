//! Coupled chains: they meet where the issue of convergence is known, what they bound is never less than
//! the distance, and the program says so.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod bounds;
#[path = "../common/mod.rs"]
mod common;
#[path = "../../benches/verdicts/mod.rs"]
#[allow(missing_docs, dead_code, reason = "shared with a bench")]
mod verdicts;

use common::Bench;

/// 25 commands of four pairs each.
fn a_hundred_pairs(csv: &std::path::Path, flags: &str) {
    let bench = Bench::new();
    for seed in 1..=25 {
        let csv = csv.to_str().unwrap();
        let seed = seed.to_string();
        let mut arguments = vec![
            "-q",
            "sample",
            csv,
            "--coupling-lag",
            "1000",
            "--seed",
            &seed,
        ];
        arguments.extend(flags.split(' '));
        arguments.extend(["--samples", "20000", "--probes", "0", "--json", "out.json"]);
        bench.ok(&arguments);
        let found: serde_json::Value = serde_json::from_str(&bench.read("out.json")).unwrap();
        let coupling = &found["convergence"]["coupling"];
        assert_eq!(coupling["pairs"], 4, "{seed}");
        assert_eq!(coupling["met"], 4, "{seed}: {coupling}");
        assert!(coupling["total_variation_after_burn_in"].as_f64().unwrap() >= 0.0);
    }
}

#[test]
fn a_hundred_of_a_hundred_pairs_meet_on_the_reports_noisy_run() {
    let Some(csv) = common::shared("data/report/noisy_16.csv") else {
        return;
    };
    a_hundred_pairs(
        &csv,
        "--penalty-radius 10 --penalty-height 100 --init singletons",
    );
}

#[test]
fn a_hundred_of_a_hundred_pairs_meet_on_the_ring_of_eight() {
    let Some(csv) = common::shared("cases/30-ring-of-eight/ring8.csv") else {
        return;
    };
    a_hundred_pairs(
        &csv,
        "--sigma-o 0.12 --sigma-t 0.6 --penalty-radius 1 --penalty-height 60 --prior dirichlet-process:2e-5",
    );
}

/// In words, in JSON and in the tables of a sweep; without a lag there is nothing of it.
#[test]
fn the_program_says_whether_pairs_met() {
    let bench = Bench::new();
    bench.write("pairs.csv", common::pairs_csv(4));
    let run = |flags: &[&str]| {
        let mut arguments = vec![
            "sample",
            "pairs.csv",
            "--samples",
            "3000",
            "--json",
            "out.json",
        ];
        arguments.extend(flags);
        let said = bench.ok(&arguments);
        let found: serde_json::Value = serde_json::from_str(&bench.read("out.json")).unwrap();
        (said, found["convergence"]["coupling"].clone())
    };
    let (said, coupling) = run(&["--coupling-lag", "200"]);
    assert!(
        said.contains("coupled     4 of 4 pairs met, the last at proposal "),
        "{said}"
    );
    // Four pairs are too few to say when the law is within 0.01.
    assert!(said.contains("53 % may be later") && coupling["proposals_until_near"].is_null());
    assert_eq!(
        (&coupling["lag"], &coupling["met"]),
        (&200.into(), &4.into())
    );
    let (said, coupling) = run(&[]);
    assert!(!said.contains("coupled") && coupling.is_null());

    let sweep = common::SMALL_SWEEP.replace("[run]", "[run]\ncoupling_lag = 200");
    bench.write("small.toml", sweep);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let rows = common::rows(&bench.read("out/convergence.csv"));
    assert!(rows.iter().all(|row| row["n_coupled"] == "2"));
    assert!(
        rows.iter()
            .any(|row| row["n_coupled_met"] == "2" && !row["coupled_distance"].is_empty())
    );
}
