//! The sweeps that come with the program, and what the source report's own detections must give.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, rows, shared};
use serde_json::{Value, json};

fn sweep_files() -> Vec<std::path::PathBuf> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "toml")
    });
    files.sort();
    files
}

#[test]
fn every_shipped_sweep_can_be_planned() {
    let bench = Bench::new();
    let files = sweep_files();
    assert!(files.len() >= 4, "{files:?}");
    bench.write("window.csv", common::pairs_csv(10));
    for file in files {
        let path = file.to_str().unwrap();
        let mut arguments = vec!["plan", path];
        // Sweeps of recordings say where to get them, and run on whatever is given.
        if file
            .file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .starts_with("real-")
        {
            let refused = bench.run(&arguments);
            assert_eq!(refused.code, 1);
            let said = &refused.stderr;
            assert!(
                said.contains("got no detections, expected --data CSV: get "),
                "{said}"
            );
            assert!(
                said.contains("then ptm import ") && said.lines().count() == 1,
                "{said}"
            );
            arguments.extend(["--data", "window.csv"]);
        }
        let plan = bench.ok(&arguments);
        assert!(plan.contains("\nproposals  "), "{plan}");
    }
}

/// Every cell of `perfect.toml`, with fewer proposals and chains so that it takes a second or two.
#[test]
fn perfect_data_are_recovered_in_every_cell() {
    let bench = Bench::new();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps/perfect.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let shorter = text.replace("samples = 10000", "samples = 4000");
    let shorter = shorter.replace("chains = 4", "chains = 1");
    assert_ne!(text, shorter);
    bench.write("perfect.toml", shorter);
    bench.ok(&["-q", "sweep", "perfect.toml", "--out", "out"]);
    let chains = rows(&bench.read("out/chains.csv"));
    assert_eq!(chains.len(), 108);
    for chain in chains {
        assert_eq!(chain["recovered"], "true", "{chain:?}");
    }
}

/// What `tempering.toml` shows, with fewer worlds and chains: blind split-merge is caught in bridges, and a ladder frees it.
#[test]
fn tempering_frees_blind_split_merge() {
    let bench = Bench::new();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps/tempering.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let shorter = text
        .replace("replicates = 5", "replicates = 2")
        .replace("chains = 4", "chains = 2")
        .replace("[1, 4, 12]", "[1, 8]");
    assert_eq!(shorter.len(), text.len() - "4, 12".len() + "8".len());
    bench.write("tempering.toml", shorter);
    bench.ok(&["-q", "sweep", "tempering.toml", "--out", "out"]);
    let (mut caught, mut freed) = (0, 0);
    for chain in rows(&bench.read("out/chains.csv")) {
        let is_blind = !chain["moves"].contains("anchors");
        match (is_blind, chain["temperatures"].as_str()) {
            (true, "1") => {
                caught += u32::from(chain["recovered"] == "false");
                assert_eq!(chain["round_trips"], "");
            }
            (_, "8") => {
                freed += u32::from(chain["recovered"] == "true");
                assert_ne!(chain["round_trips"], "0");
                // The ladder is tuned in a quarter of the chain, which never counts.
                assert!(
                    chain["burn_in_found"].parse().is_ok_and(|n: u64| n >= 5000)
                        || chain["burn_in_found"].is_empty()
                );
            }
            _ => {}
        }
    }
    assert_eq!((caught, freed), (4, 8));
}

/// Setting (a) of the source report's Fig. 7, with what differs from it.
fn of_the_report(csv: &str, differing: &[&str]) -> Value {
    let setting_a = [
        csv,
        "--estimator",
        "fresh",
        "--moves",
        "split-merge=1",
        "--sigma-o",
        "1",
        "--sigma-t",
        "1",
        "--importance-samples",
        "30",
        "--chains",
        "3",
    ];
    let radius = ["--penalty-radius", "10"];
    let height = ["--penalty-height", "100"];
    let mut arguments = setting_a.to_vec();
    for default in [radius, height] {
        if !differing.contains(&default[0]) {
            arguments.extend(default);
        }
    }
    arguments.extend(differing);
    Bench::new().sample(&arguments)
}

/// Acceptance rate over all chains.
fn acceptance(json: &Value) -> f64 {
    let chains = json["chains"].as_array().unwrap();
    let rates = chains
        .iter()
        .map(|chain| chain["acceptance_rate"].as_f64().unwrap());
    rates.sum::<f64>() / chains.len() as f64
}

/// The eight pairs in the order of the report's sixteen detections.
fn eight_pairs() -> Value {
    json!([0, 1, 2, 3, 4, 5, 6, 7, 5, 4, 0, 3, 1, 2, 6, 7])
}

#[test]
fn the_reports_setting_a_finds_the_eight_pairs_from_both_ends() {
    let Some(csv) = shared("data/report/noisy_16.csv") else {
        return;
    };
    let csv = csv.to_str().unwrap();
    for (init, samples) in [("singletons", "3000"), ("one-cluster", "10000")] {
        let json = of_the_report(csv, &["--init", init, "--samples", samples]);
        assert_eq!(
            json["topologies"][0]["labels"],
            eight_pairs(),
            "from {init}"
        );
    }
}

/// MODEL.md §5: what the report's panels (b), (f) and (g) show is underflow, not over-merging.
#[test]
fn the_reports_failures_are_random_walks_of_linear_arithmetic_only() {
    let Some(csv) = shared("data/report/noisy_16.csv") else {
        return;
    };
    let csv = csv.to_str().unwrap();
    let settings: [(&str, &[&str]); 3] = [
        ("b", &["--penalty-radius", "50", "--samples", "3000"]),
        ("f", &["--penalty-height", "1000", "--samples", "3000"]),
        ("g", &["--init", "one-cluster", "--samples", "10000"]),
    ];
    for (name, differing) in settings {
        let linear = [differing, &["--arithmetic", "linear"]].concat();
        let walk = of_the_report(csv, &linear);
        let top = |json: &Value| json["topologies"][0]["frequency"].as_f64().unwrap();
        assert!(acceptance(&walk) > 0.3, "({name}) {}", acceptance(&walk));
        assert!(top(&walk) < 0.05, "({name}) {}", top(&walk));
        assert_ne!(walk["topologies"][0]["labels"], eight_pairs(), "({name})");
        let correct = of_the_report(csv, differing);
        assert!(
            acceptance(&correct) < 0.3,
            "({name}) {}",
            acceptance(&correct)
        );
        assert!(top(&correct) > 0.05, "({name}) {}", top(&correct));
    }
}
