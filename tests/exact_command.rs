//! `ptm exact` at its edges: too many detections, tables that are not known, degenerate data.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::Bench;
use serde_json::Value;

/// Detections `gap_m` apart on a line.
fn line(n: usize, gap_m: f64) -> String {
    let rows = (0..n).map(|i| format!("{},0\n", i as f64 * gap_m));
    format!("x,y\n{}", rows.collect::<String>())
}

#[test]
fn too_many_detections_are_refused_with_the_bell_number() {
    let bench = Bench::new();
    for (n, bell, advice) in [
        (11, "678570", "--allow-large"),
        (13, "27644437", "ptm sample"),
    ] {
        bench.write("line.csv", line(n, 100.0));
        let refused = bench.run(&["exact", "line.csv"]);
        assert_eq!(refused.code, 1, "{}", refused.stderr);
        assert!(refused.stderr.contains(bell) && refused.stderr.contains(advice));
        assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    }
    let refused = bench.run(&["exact", "line.csv", "--allow-large"]);
    assert_eq!(refused.code, 1);
    assert!(
        !refused.stderr.contains("--allow-large"),
        "{}",
        refused.stderr
    );
}

#[test]
fn what_is_not_known_is_not_shown_as_if_it_were() {
    let bench = Bench::new();
    bench.write("near.csv", line(6, 0.5));
    let settings = "--sigma-o 0.5 --penalty-radius 3 --penalty-height 50 --max-draws 1000";
    let mut arguments = vec!["exact", "near.csv", "--json", "out.json"];
    arguments.extend(settings.split(' '));
    let ran = bench.run(&arguments);
    assert_eq!(ran.code, 2);
    assert!(ran.stderr.contains("raise --max-draws"), "{}", ran.stderr);
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    assert!(!ran.stdout.contains("sets M"), "{}", ran.stdout);
    assert!(
        ran.stdout.contains("not known well enough"),
        "{}",
        ran.stdout
    );
    assert!(!ran.stdout.contains(" %  M = "), "{}", ran.stdout);
    let json: Value = serde_json::from_str(&bench.read("out.json")).unwrap();
    assert_eq!(json["accuracy"]["reached"], false);
    assert!(json["accuracy"]["draws_needed"].as_f64().unwrap() > 1000.0);
    assert_eq!(json["partitions"][0]["probability"], Value::Null);
    assert_eq!(json["co_clustering"], Value::Null);
    assert_eq!(json["settings"]["max_draws"], 1000.0);
}

/// Data that a formula might divide by: an answer that is all numbers, or one line.
#[test]
fn degenerate_detections_give_an_answer_or_one_line() {
    let bench = Bench::new();
    let header = "x,y,cov_xx,cov_xy,cov_yy\n";
    let good = [
        ("one", "1,2,1,0,1\n"),
        ("coincident", "1,2,1,0,1\n1,2,1,0,1\n1,2,0.5,0.1,2\n"),
        ("same covariance", "1,2,2,0.5,1\n3,2,2,0.5,1\n9,9,2,0.5,1\n"),
        ("thin", "1,2,1,0.999,1\n2,2,1,-0.999,1\n"),
    ];
    let bad = [
        ("singular", "1,2,1,1,1\n"),
        ("zero", "1,2,0,0,0\n"),
        ("indefinite", "1,2,1,3,1\n"),
        ("negative", "1,2,-1,0,1\n"),
        ("not a number", "1,2,NaN,0,1\n"),
    ];
    for command in ["exact", "sample"] {
        for model in ["metric", "covariance"] {
            for height in ["0", "100", "1e6"] {
                for (what, rows) in good {
                    bench.write("d.csv", format!("{header}{rows}"));
                    let mut arguments = vec![command, "d.csv", "--model", model];
                    arguments.extend(["--penalty-height", height, "--json", "-"]);
                    if command == "exact" {
                        arguments.extend(["--max-draws", "1e6"]);
                    } else {
                        arguments.extend(["--samples", "500"]);
                    }
                    let ran = bench.run(&arguments);
                    let json: Value = serde_json::from_str(&ran.stdout).unwrap();
                    let falls_short = json["accuracy"]["reached"] == false;
                    let code = if falls_short { 2 } else { 0 };
                    assert_eq!(ran.code, code, "{what}: {}", ran.stderr);
                    if json["accuracy"]["total_variation"].as_f64() > Some(0.1) {
                        assert_eq!(json["partitions"][0]["probability"], Value::Null);
                        continue;
                    }
                    let (list, share) = if command == "exact" {
                        ("partitions", "probability")
                    } else {
                        ("topologies", "frequency")
                    };
                    // JSON has no NaN: it would be null here.
                    let shares = json[list].as_array().unwrap().iter();
                    let total: f64 = shares.map(|row| row[share].as_f64().expect(what)).sum();
                    assert!((total - 1.0).abs() < 1e-9, "{what}: {total}");
                    assert!(json["expected_number_of_sets"].is_f64(), "{what}");
                }
            }
        }
        for (what, rows) in bad {
            bench.write("d.csv", format!("{header}{rows}"));
            let ran = bench.run(&[command, "d.csv", "--model", "covariance"]);
            assert_eq!(ran.code, 65, "{what}: {}", ran.stderr);
            assert_eq!(ran.stderr.lines().count(), 1, "{what}: {}", ran.stderr);
            assert!(ran.stdout.is_empty(), "{what}");
        }
    }
}
