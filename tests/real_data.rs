//! From detections to scores and maps, as a user meets it; other programs read the maps back.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stdout, reason = "a skipped test says so")]

mod common;

use std::process::Command;

use common::{Bench, pairs_csv, rows};
use serde_json::Value;

/// Settings under which pairs 0.25 m apart on a grid of 20 m are found at once.
const EASY: [&str; 6] = [
    "--penalty-radius",
    "5",
    "--samples",
    "3000",
    "--chains",
    "2",
];

#[test]
fn evaluate_scores_estimates_beside_baselines_and_calibrates_across_files() {
    let bench = Bench::new();
    let mut files = Vec::new();
    for replicate in 1..=6 {
        let name = format!("w{replicate}.csv");
        let number = replicate.to_string();
        bench.ok(&[
            "simulate",
            "--seed",
            "3",
            "--replicate",
            &number,
            "--out",
            &name,
        ]);
        files.push(name);
    }
    let names: Vec<&str> = files.iter().map(String::as_str).collect();
    let sampler = [
        "--samples",
        "2000",
        "--chains",
        "2",
        "--penalty-height",
        "50",
    ];
    let evaluate = |out: &str, threads: &str| {
        let with = ["--out", out, "--threads", threads];
        bench.ok(&[&["evaluate"], &names[..], &sampler, &with].concat())
    };
    let said = evaluate("a", "2");
    assert!(
        said.contains("DBSCAN*") && said.contains("bins of probability within"),
        "{said}"
    );
    let scores = rows(&bench.read("a/scores.csv"));
    // Three estimates and five baselines of each.
    assert_eq!(scores.len(), 6 * 8);
    let of = |method: &str| {
        let found = scores.iter().filter(|row| row["method"] == method);
        let numbers = found.map(|row| row["adjusted_rand_index"].parse::<f64>().unwrap());
        numbers.sum::<f64>() / 6.0
    };
    // Corners are 15 m apart and more, the two visits of one 1 to 6 m: all do well, the tuned best.
    assert!(of("map") > 0.8 && of("nearest-true-centroid") == 1.0 && of("dbscan-tuned") > 0.9);
    for row in &scores {
        let told = ["map", "binder", "vi", "gate"].contains(&row["method"].as_str());
        assert_eq!(row["uses_truth"], if told { "false" } else { "true" });
        assert_eq!(row["n_landmarks"].parse::<f64>().unwrap(), 8.0);
    }
    let bins = rows(&bench.read("a/reliability.csv"));
    let known: Vec<f64> = scores
        .iter()
        .filter(|row| row["method"] == "map")
        .map(|row| row["n_known"].parse().unwrap())
        .collect();
    let n_pairs: f64 = known.iter().map(|n| n * (n - 1.0) / 2.0).sum();
    for kind in ["sampled", "recalibrated"] {
        let of_kind = bins.iter().filter(|row| row["probabilities"] == kind);
        let sum: f64 = of_kind
            .map(|row| row["n_pairs"].parse::<f64>().unwrap())
            .sum();
        assert_eq!(sum, n_pairs);
    }
    // The same bytes whatever the threads.
    evaluate("b", "1");
    for file in [
        "scores.parquet",
        "reliability.parquet",
        "reliability.png",
        "evaluation.json",
    ] {
        let read = |folder: &str| std::fs::read(bench.path(folder).join(file)).unwrap();
        assert_eq!(read("a"), read("b"), "{file}");
    }
}

#[test]
fn evaluate_needs_truth() {
    let bench = Bench::new();
    bench.write("bare.csv", "x,y\n0,0\n1,1\n");
    let ran = bench.run(&["evaluate", "bare.csv", "--samples", "100"]);
    assert_eq!(ran.code, 65);
    assert_eq!(
        ran.stderr,
        "ptm: bare.csv: got no detection of known landmark, expected some; add the column landmark, or use \
         ptm sample\n"
    );
    assert_eq!(bench.run(&["evaluate"]).code, 1);
}

#[test]
fn maps_are_written_in_every_format() {
    let bench = Bench::new();
    bench.write("pairs.csv", pairs_csv(12));
    let said = bench.ok(&[&["sample", "pairs.csv", "--map", "maps"], &EASY[..]].concat());
    assert!(said.contains("maps        maps"), "{said}");
    for stem in ["map", "consensus"] {
        for extension in ["png", "svg", "graphml", "geojson", "dot", "g2o"] {
            assert!(
                bench.exists(&format!("maps/{stem}.{extension}")),
                "{stem}.{extension}"
            );
        }
    }
    let map: Value = serde_json::from_str(&bench.read("maps/map.geojson")).unwrap();
    let features = map["features"].as_array().unwrap();
    let points: Vec<&Value> = features
        .iter()
        .filter(|f| f["geometry"]["type"] == "Point")
        .collect();
    // Six pairs in a row of the grid, and the way from each to the next.
    assert_eq!((points.len(), features.len()), (6, 11));
    for (k, point) in points.iter().enumerate() {
        assert_eq!(
            point["properties"]["detections"],
            serde_json::json!([2 * k, 2 * k + 1])
        );
        let x = point["geometry"]["coordinates"][0].as_f64().unwrap();
        assert!((x - (20.0 * k as f64 + 0.125)).abs() < 1e-9, "{x}");
        // σ_o = 1, two members: 1/(2·2).
        let variance = point["properties"]["cov_xx"].as_f64().unwrap();
        assert!((variance - 0.25).abs() < 1e-12);
        assert!(point["properties"]["probability"].as_f64().unwrap() > 0.9);
    }
    let edge = &features[6]["properties"];
    assert_eq!(
        (&edge["source"], &edge["target"]),
        (&Value::from(0), &Value::from(1))
    );
    assert_eq!(edge["support"], 1.0);
}

/// Reads the graph with networkx and prints what it found.
const READ_BACK: &str = "
import sys
try:
    import networkx as nx
except ImportError:
    print('no networkx'); sys.exit(0)
g = nx.read_graphml(sys.argv[1])
print(g.number_of_nodes(), g.number_of_edges(), g.is_directed(), g.graph.get('id'))
print(*(type(v).__name__ for v in (g.nodes['0']['x'], g.nodes['0']['detections'], g.edges['0', '1']['weight'])))
print(g.nodes['1']['detections'], g.edges['0', '1']['weight'], g.edges['0', '1']['support'])
print(sum(g.nodes[n]['x'] for n in g))
";

#[test]
fn networkx_reads_the_map_back() {
    let bench = Bench::new();
    bench.write("a & b.csv", pairs_csv(6));
    bench.ok(&[&["sample", "a & b.csv", "--map", "maps"], &EASY[..]].concat());
    let path = bench.path("maps/map.graphml");
    let ran = Command::new("python3")
        .args(["-c", READ_BACK])
        .arg(&path)
        .output();
    let said = match ran {
        Ok(output) => {
            let errors = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{errors}");
            String::from_utf8(output.stdout).unwrap()
        }
        Err(error) => {
            println!("SKIPPED: no python3 ({error})");
            return;
        }
    };
    if said.starts_with("no networkx") {
        println!("SKIPPED: python3 has no networkx");
        return;
    }
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines[0].starts_with("3 2 False"), "{said}");
    assert_eq!(lines[1], "float str int");
    assert_eq!(lines[2], "2 3 1 1.0");
    assert_eq!(lines[3].parse::<f64>().unwrap(), 60.375);
}

#[test]
fn tune_gives_a_command_that_recovers_what_it_never_looked_at() {
    let bench = Bench::new();
    bench.ok(&[
        "simulate", "--seed", "3", "--noise", "0.7", "--out", "ring.csv",
    ]);
    let said = bench.ok(&["tune", "ring.csv", "--json", "tune.json"]);
    assert!(said.contains("decided     yes"), "{said}");
    let command = said.lines().find(|line| line.starts_with("use ")).unwrap();
    let flags: Vec<&str> = command.split_whitespace().skip(4).collect();
    let short = ["--samples", "4000", "--chains", "2"];
    let result = bench.sample(&[&["ring.csv"], &flags[..], &short].concat());
    assert_eq!(result["estimates"][0]["truth"]["recovered"], true);
    let found: Value = serde_json::from_str(&bench.read("tune.json")).unwrap();
    let radius = found["settings"]["penalty_radius"].as_f64().unwrap();
    let interval = &found["intervals"][2];
    let [low, high] = ["low", "high"].map(|end| interval[end].as_f64().unwrap());
    assert!(low <= radius && radius <= high);
    assert!(found["simulated"]["tried"].as_array().unwrap().len() == 12);
    let again = bench.ok(&[
        "evaluate",
        "ring.csv",
        "--tune",
        "--samples",
        "4000",
        "--chains",
        "2",
    ]);
    assert!(
        again.contains("ring") && again.contains("1.00 +0"),
        "{again}"
    );
}

#[test]
fn tune_gives_a_command_for_the_covariance_model_too() {
    let bench = Bench::new();
    bench.ok(&[
        "simulate", "--seed", "3", "--noise", "0.7", "--out", "ring.csv",
    ]);
    let said = bench.ok(&[
        "tune",
        "ring.csv",
        "--model",
        "covariance",
        "--no-simulation",
    ]);
    assert!(said.contains("times what is stated"), "{said}");
    let command = said.lines().find(|line| line.starts_with("use ")).unwrap();
    let flags: Vec<&str> = command.split_whitespace().skip(4).collect();
    assert_eq!(flags[..2], ["--model", "covariance"]);
    let short = ["--samples", "4000", "--chains", "2"];
    let result = bench.sample(&[&["ring.csv"], &flags[..], &short].concat());
    assert_eq!(result["estimates"][0]["truth"]["recovered"], true);
}

#[test]
fn what_cannot_be_tuned_is_refused_in_one_line() {
    let bench = Bench::new();
    bench.write("few.csv", "x,y\n0,0\n1,1\n");
    let refused = |arguments: &[&str]| {
        let ran = bench.run(arguments);
        (ran.code, ran.stderr)
    };
    let (code, said) = refused(&["tune", "few.csv"]);
    assert_eq!(code, 65);
    assert_eq!(
        said,
        "ptm: few.csv: tune: got 2 detections, expected at least 4 at different places; bring more of them\n"
    );
    let (code, said) = refused(&["tune", "few.csv", "--sensor-noise", "0"]);
    assert_eq!(code, 1);
    assert_eq!(
        said,
        "ptm: --sensor-noise: got 0, expected a number of metres > 0\n"
    );
    assert_eq!(refused(&["tune", "nowhere.csv"]).0, 1);
    bench.write("bare.csv", pairs_csv(6));
    let (code, said) = refused(&["tune", "bare.csv", "--model", "covariance"]);
    assert_eq!(code, 65);
    assert_eq!(
        said,
        "ptm: bare.csv: tune: got detections without covariances, expected the columns cov_xx,cov_xy,cov_yy for \
         --model covariance; add them, or leave --model out\n"
    );
    let (code, said) = refused(&["tune", "bare.csv", "--model", "topology"]);
    assert_eq!(code, 1);
    assert_eq!(said.lines().count(), 1, "{said}");
    let (code, said) = refused(&["evaluate", "few.csv", "--tune", "--sigma-o", "1"]);
    assert_eq!(code, 1);
    assert_eq!(said.lines().count(), 1, "{said}");
}
