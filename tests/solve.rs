//! `ptm solve` as a user meets it: a graph in, a graph out, and what is refused.
//!
//! The public graphs are not part of the project. Where they lie beside the checkout, in
//! `../shared/data`, they are solved too; where not, that test says so and passes.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, rows, shared};
use serde_json::Value;
use topometric::import::{DriftNoise, Noise, SensorNoise, read_g2o};
use topometric::mission::{Graph, SolveSettings, optimum_of, solve};
use topometric::partition::Topology;

/// Round a square of 4 m sides, five times, past four landmarks outside its corners; the odometry
/// turns by 1 % too much.
fn round() -> String {
    let corners = [[6.0, -2.0], [6.0, 6.0], [-2.0, 6.0], [-2.0, -2.0]];
    let (mut text, mut k) = (String::new(), 0);
    let (mut x, mut y, mut heading) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..20 {
        for step in 0..4 {
            for (id, corner) in corners.iter().enumerate() {
                let (dx, dy) = (corner[0] - x, corner[1] - y);
                if dx.hypot(dy) < 4.5 {
                    let ahead = heading.cos() * dx + heading.sin() * dy;
                    let left = heading.cos() * dy - heading.sin() * dx;
                    text += &format!("EDGE_SE2_XY {k} {} {ahead} {left} 400 0 400\n", 900 + id);
                }
            }
            let turn = if step == 3 {
                std::f64::consts::FRAC_PI_2
            } else {
                0.0
            };
            let (turned, next) = (1.01 * turn, k + 1);
            text += &format!("EDGE_SE2 {k} {next} 1 0 {turned} 400 0 0 400 0 2500\n");
            (x, y, heading) = (x + heading.cos(), y + heading.sin(), heading + turn);
            k = next;
        }
    }
    text
}

#[test]
fn a_graph_is_solved_and_read_again() {
    let bench = Bench::new();
    bench.write("round.g2o", round());
    let said = bench.ok(&["solve", "round.g2o", "--out", "a"]);
    assert!(said.contains("landmarks   4\n"), "{said}");
    assert!(
        said.contains("4 landmarks, adjusted Rand index 1.0000\n"),
        "{said}"
    );
    let summary: Value = serde_json::from_str(&bench.read("a/summary.json")).unwrap();
    assert_eq!(summary["landmarks"], 4);
    assert_eq!(summary["poses"], 81);
    let sightings = rows(&bench.read("a/sightings.csv"));
    assert_eq!(
        sightings.len(),
        summary["sightings"].as_u64().unwrap() as usize
    );
    for row in &sightings {
        assert!(row["probability"].parse::<f64>().unwrap() > 0.9, "{row:?}");
    }
    assert_eq!(bench.read("a/trajectory.tum").lines().count(), 81);
    assert!(bench.read("a/map.geojson").contains("coordinate_units"));
    let graph = bench.read("a/graph.g2o");
    assert!(graph.starts_with("VERTEX_SE2 0 0 0 0\n") && graph.contains("\nFIX 0\n"));
    assert_eq!(
        graph
            .lines()
            .filter(|line| line.starts_with("VERTEX_XY"))
            .count(),
        4
    );
    // What was written is solved to the same trajectory.
    bench.ok(&["solve", "a/graph.g2o", "--out", "b"]);
    let numbers = |name: &str| -> Vec<f64> {
        let text = bench.read(name);
        text.split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect()
    };
    let (a, b) = (numbers("a/trajectory.tum"), numbers("b/trajectory.tum"));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn the_page_answers_and_the_summary_has_the_noise() {
    let bench = Bench::new();
    bench.write("round.g2o", round());
    // What an earlier solution left.
    for number in [1, 2] {
        std::fs::create_dir_all(bench.path(&format!("a/alternatives/{number}"))).unwrap();
        bench.write(&format!("a/alternatives/{number}/graph.g2o"), String::new());
    }
    bench.ok(&["solve", "round.g2o", "--out", "a"]);
    assert!(!bench.path("a/alternatives").exists());
    let page = bench.read("a/index.html");
    for words in [
        "Which sightings are of one landmark, and where was the robot?",
        "sightings from 81 poses are of 4 landmarks.",
        "id=\"landmarks\"",
        "<svg",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let picture = std::fs::read(bench.path("a/map.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    let summary: Value = serde_json::from_str(&bench.read("a/summary.json")).unwrap();
    for name in ["range", "bearing", "odometry_place", "odometry_heading"] {
        assert!(summary["noise_factors"][name].as_f64().unwrap() > 0.0);
    }
    let stated = bench.ok(&[
        "solve",
        "round.g2o",
        "--stated-noise",
        "--online",
        "--out",
        "b",
    ]);
    assert!(
        stated.contains(" poses a second, the slowest in "),
        "{stated}"
    );
    assert!(stated.contains("The noise is taken as it is stated."));
    let summary: Value = serde_json::from_str(&bench.read("b/summary.json")).unwrap();
    assert_eq!(summary["noise_factors"]["range"], 1.0);
    assert_eq!(summary["weight"], 1.0);
    let online = &summary["online"];
    assert!(online["adjusted_rand_index_with_map"].as_f64().unwrap() > 0.9);
}

/// A drive that was simulated, as a recording: solved, and imported from the solved poses.
#[test]
fn a_simulated_recording_is_solved_and_imported() {
    let bench = Bench::new();
    bench.ok(&[
        "simulate",
        "--world",
        "square-ring",
        "--recording",
        "drive.csv",
        "--out",
        "detections.csv",
    ]);
    let found = bench.ok(&["solve", "drive.csv", "--sweeps", "2", "--out", "a"]);
    assert!(found.contains("adjusted Rand index"), "{found}");
    bench.ok(&["import", "drive.csv", "--solve", "--out", "solved.csv"]);
    assert!(!rows(&bench.read("solved.csv")).is_empty());
    // The odometry of `round` turns too far; from the solved poses each landmark is in one place.
    let (reckoned, solved) = (spread_m(&bench, &[]), spread_m(&bench, &["--solve"]));
    assert!(reckoned > 0.5 && solved < 0.05, "{reckoned} {solved}");
    let refused = bench.run(&["import", "drive.csv", "--solve", "--align"]);
    assert_eq!(refused.code, 1, "{}", refused.stderr);
    let refused = bench.run(&[
        "simulate",
        "--world",
        "crossing-ranges",
        "--recording",
        "x.csv",
    ]);
    assert_eq!(
        (refused.code, refused.stderr.lines().count()),
        (1, 1),
        "{}",
        refused.stderr
    );
}

/// How far apart the detections of one landmark lie at most when `round` is imported, m.
fn spread_m(bench: &Bench, flags: &[&str]) -> f64 {
    bench.write("round.g2o", round());
    let first = [
        "import",
        "round.g2o",
        "--min-sightings",
        "1",
        "--out",
        "d.csv",
    ];
    bench.ok(&[&first, flags].concat());
    let found = rows(&bench.read("d.csv"));
    let place = |row: &std::collections::BTreeMap<String, String>| {
        ["x", "y"].map(|axis| row[axis].parse::<f64>().unwrap())
    };
    let mut most = 0.0_f64;
    for a in &found {
        for b in &found {
            if a["landmark"] == b["landmark"] {
                let ([ax, ay], [bx, by]) = (place(a), place(b));
                most = most.max((ax - bx).hypot(ay - by));
            }
        }
    }
    most
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let bench = Bench::new();
    bench.write("round.g2o", round());
    for (out, threads) in [("a", "1"), ("b", "2")] {
        bench.ok(&[
            "solve",
            "round.g2o",
            "--out",
            out,
            "--threads",
            threads,
            "--seed",
            "7",
        ]);
    }
    for name in [
        "graph.g2o",
        "trajectory.tum",
        "sightings.csv",
        "map.graphml",
    ] {
        assert_eq!(
            bench.read(&format!("a/{name}")),
            bench.read(&format!("b/{name}")),
            "{name}"
        );
    }
}

#[test]
fn what_cannot_be_solved_is_refused_in_one_line() {
    let bench = Bench::new();
    bench.write("round.g2o", round());
    for (arguments, code, words) in [
        (
            &["round.g2o", "--max-range", "0.1"][..],
            65,
            "no sighting of a landmark is left",
        ),
        (&["missing.g2o"], 1, "missing.g2o: cannot be read"),
        (
            &["round.g2o", "--range-noise", "1"],
            1,
            "no such flag for g2o",
        ),
        (
            &["round.g2o", "--robot", "1"],
            1,
            "only MRCLAM folders have robots",
        ),
        (
            &["round.g2o", "--from", "3", "--until", "2"],
            1,
            "a time after --from",
        ),
    ] {
        let ran = bench.run(&[&["solve"], arguments, &["--out", "x"]].concat());
        assert_eq!(
            (ran.code, ran.stderr.lines().count()),
            (code, 1),
            "{}",
            ran.stderr
        );
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
    }
}

/// One setting for all four, none told. Each must find the landmarks of the true numbers, and their
/// trajectory to 5 mm.
#[test]
fn public_graphs_are_solved_without_an_error() {
    let noise = Noise {
        sensor: SensorNoise {
            range_m: 0.0,
            range_growth: 0.0,
            bearing_rad: 0.0,
        },
        drift: DriftNoise {
            position: 0.0,
            heading: 0.0,
            turn: 0.0,
            bend: 0.0,
        },
        factor: 1.0,
    };
    for name in ["carpark", "objects766", "trees400", "trees1000"] {
        let Some(file) = shared(&format!("data/graphs/{name}.g2o")) else {
            return;
        };
        let graph = Graph::of_recording(&read_g2o(&file).unwrap(), &noise).unwrap();
        let found = solve(
            &graph,
            SolveSettings {
                sweeps: 2,
                ..SolveSettings::with_seed(1)
            },
            &|_| {},
        )
        .unwrap();
        let ids = graph.observations.iter().map(|one| one.landmark.unwrap());
        let truth = Topology::canonical(&ids.collect::<Vec<_>>());
        assert_eq!(Topology::canonical(&found.map.labels), truth, "{name}");
        let known = optimum_of(&graph.with_noise(found.noise), truth.labels()).unwrap();
        assert!(
            (known.ln_posterior - found.map.ln_posterior).abs() < 1e-3,
            "{name}"
        );
        for (a, b) in known.poses.iter().zip(&found.map.poses) {
            assert!((a.x_m - b.x_m).hypot(a.y_m - b.y_m) < 0.005, "{name}");
        }
    }
}
