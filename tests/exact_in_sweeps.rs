//! A sweep's distance to the exact posterior: a correct chain is within its null, a faulty one far above.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, rows};

/// Four detections under a low penalty, where both proposals mix, and their stationary laws differ.
const SWEEP: &str = "\
[run]
samples = 400000
chains = 1
burn_in = \"1000\"
[model]
sigma_o = 0.5
sigma_t = 0.6
penalty_radius = 1.5
penalty_height = 1
[sampler]
estimator = \"fresh\"
moves = \"split-merge=1\"
importance_samples = 4
[design]
kind = \"grid\"
[design.factors]
split = [\"uniform\", \"prefix-cut\"]
";
const DETECTIONS: &str = "x,y\n0,0\n0.4,0.3\n1.4,-0.2\n1.6,0.5\n";

#[test]
fn a_wrong_proposal_is_far_from_the_exact_posterior_and_the_report_says_so() {
    let bench = Bench::new();
    bench.write("sweep.toml", SWEEP);
    bench.write("few.csv", DETECTIONS);
    bench.ok(&[
        "-q",
        "sweep",
        "sweep.toml",
        "--data",
        "few.csv",
        "--out",
        "out",
    ]);
    let chains = rows(&bench.read("out/chains.csv"));
    let number = |row: &std::collections::BTreeMap<String, String>, name: &str| -> f64 {
        row[name].parse().unwrap()
    };
    for row in &chains {
        let (distance, high) = (
            number(row, "exact_distance"),
            number(row, "exact_distance_high"),
        );
        let wrong = row["split"] == "prefix-cut";
        assert_eq!(row["exact_differs"], wrong.to_string(), "{distance} {high}");
        // The null is no mere formality: it is of the size of the distance, and far below the fault's.
        assert!(high < 0.05 && number(row, "exact_distance_expected") < high);
        if wrong {
            assert!(distance > 3.0 * high, "{distance} {high}");
        }
    }
    assert_eq!(chains.len(), 2);
    let report = bench.read("out/report.md");
    assert!(report.contains("NOT drawn from the posterior"), "{report}");
}

#[test]
fn what_is_not_compared_says_why_and_is_not_zero() {
    let bench = Bench::new();
    let none = SWEEP.replace("chains = 1", "chains = 1\nexact_up_to = 3");
    bench.write("sweep.toml", none.replace("400000", "2000"));
    bench.write("few.csv", DETECTIONS);
    bench.ok(&[
        "-q",
        "sweep",
        "sweep.toml",
        "--data",
        "few.csv",
        "--out",
        "out",
    ]);
    for row in rows(&bench.read("out/chains.csv")) {
        assert_eq!(row["exact_distance"], "");
        assert_eq!(row["exact_differs"], "");
        assert_eq!(row["exact_reason"], "4 detections, and exact_up_to is 3");
    }
    let report = bench.read("out/report.md");
    assert!(!report.contains("exact posterior:"), "{report}");
}
