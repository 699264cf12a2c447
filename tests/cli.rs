//! Black-box tests of `ptm` doing what it should.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, pairs_csv, rows};
use serde_json::Value;

fn count(value: &Value) -> u64 {
    value.as_u64().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The contract of `--json` that scripts depend on.
fn check_contract(json: &Value, n_detections: usize, n_steps: u64) {
    let keys: Vec<&str> = json
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    for key in [
        "settings",
        "topologies",
        "expected_number_of_sets",
        "co_clustering",
        "chains",
        "seconds",
        "proposals_per_second",
    ] {
        assert!(keys.contains(&key), "{key} is missing");
    }
    for key in [
        "sigma_o",
        "penalty_shape",
        "moves",
        "init",
        "samples",
        "burn_in",
        "seed",
    ] {
        assert!(!json["settings"][key].is_null(), "settings.{key}");
    }
    let chains = json["chains"].as_array().unwrap();
    let mut n_counted = 0;
    for chain in chains {
        assert!(chain["burn_in"].is_u64() || !chain["burn_in_reason"].as_str().unwrap().is_empty());
        n_counted += n_steps - chain["burn_in"].as_u64().unwrap_or(0);
        let moves = chain["moves"].as_object().unwrap();
        let proposed: u64 = moves
            .values()
            .map(|counts| count(&counts["proposed"]))
            .sum();
        assert_eq!(
            proposed, n_steps,
            "rejections and impossible moves included"
        );
        for (kind, counts) in moves {
            assert!(
                [
                    "merge",
                    "split",
                    "reassign",
                    "pair-reassign",
                    "anchors",
                    "refresh",
                    "sequential-allocation",
                    "restricted-gibbs",
                    "site",
                    "flip",
                    "slice",
                    "group",
                    "cut"
                ]
                .contains(&kind.as_str()),
                "{kind}"
            );
            let (accepted, impossible) = (count(&counts["accepted"]), count(&counts["impossible"]));
            assert!(accepted + impossible <= count(&counts["proposed"]));
        }
    }
    let topologies = json["topologies"].as_array().unwrap();
    let labels = |row: &Value| -> Vec<u64> {
        row["labels"]
            .as_array()
            .unwrap()
            .iter()
            .map(count)
            .collect()
    };
    let total: u64 = topologies.iter().map(|row| count(&row["count"])).sum();
    assert_eq!(total, n_counted);
    let mut mean = 0.0;
    for row in topologies {
        assert_eq!(labels(row).len(), n_detections);
        assert_eq!(
            number(&row["frequency"]),
            count(&row["count"]) as f64 / total as f64
        );
        let n_sets = labels(row).iter().max().unwrap() + 1;
        mean += n_sets as f64 * number(&row["frequency"]);
    }
    assert!((mean - number(&json["expected_number_of_sets"])).abs() < 1e-9);
    for pair in topologies.windows(2) {
        let order = count(&pair[1]["count"]).cmp(&count(&pair[0]["count"]));
        assert!(order.then(labels(&pair[0]).cmp(&labels(&pair[1]))).is_lt());
    }
    let matrix = json["co_clustering"].as_array().unwrap();
    assert_eq!(matrix.len(), n_detections);
    for (i, row) in matrix.iter().enumerate() {
        assert_eq!(row[i], 1.0);
        for (j, probability) in row.as_array().unwrap().iter().enumerate() {
            let together = |topology: &&Value| labels(topology)[i] == labels(topology)[j];
            let expected = topologies.iter().filter(together);
            let expected: f64 = expected
                .map(|topology| number(&topology["frequency"]))
                .sum();
            assert_eq!(*probability, matrix[j][i]);
            assert!((number(probability) - expected).abs() < 1e-9);
        }
    }
    let answers = json["representatives"].as_array().unwrap();
    let weights: Vec<f64> = answers.iter().map(|own| number(&own["weight"])).collect();
    assert!(
        (weights.iter().sum::<f64>() - 1.0).abs() < 1e-9,
        "{weights:?}"
    );
    assert!(weights.is_sorted_by(|a, b| a >= b), "{weights:?}");
    assert!(answers.iter().all(|own| labels(own).len() == n_detections));
    assert!(number(&json["seconds"]) >= 0.0 && number(&json["proposals_per_second"]) > 0.0);
}

#[test]
fn json_on_standard_output_keeps_the_contract() {
    let bench = Bench::new();
    bench.write("a.csv", pairs_csv(8));
    let moves = "split-merge=0.8,refresh=0.2";
    let json = bench.sample(&[
        "a.csv",
        "--samples",
        "2000",
        "--chains",
        "3",
        "--moves",
        moves,
    ]);
    check_contract(&json, 8, 2000);
    assert_eq!(json["chains"].as_array().unwrap().len(), 3);
    assert_eq!(
        json["topologies"][0]["labels"],
        serde_json::json!([0, 0, 1, 1, 2, 2, 3, 3])
    );
    assert_eq!(bench.files(), ["a.csv"], "--json - writes nothing else");
    // The refresh that the estimator common adds is recorded.
    let added = bench.sample(&[
        "a.csv",
        "--samples",
        "100",
        "--moves",
        "split-merge=4,anchors=1",
    ]);
    assert_eq!(
        added["settings"]["moves"],
        "split-merge=0.6666666666666667,anchors=0.16666666666666669,refresh=0.16666666666666669"
    );
    assert_eq!(added["trace_stride"], 1);
    // A chain is a function of its seed: all but the wall time is the same again.
    let timeless = |mut json: Value| {
        json["seconds"].take();
        json["proposals_per_second"].take();
        json
    };
    let again = [
        "a.csv",
        "--samples",
        "2000",
        "--chains",
        "3",
        "--moves",
        moves,
        "--threads",
        "1",
    ];
    assert_eq!(timeless(bench.sample(&again)), timeless(json.clone()));
    let other = [&again[..], &["--seed", "2"]].concat();
    assert_ne!(bench.sample(&other)["chains"], json["chains"]);
}

#[test]
fn json_to_a_file_with_top_trace_and_figure() {
    let bench = Bench::new();
    bench.write("d ä/a b.csv", pairs_csv(8));
    let stdout = bench.ok(&[
        "sample",
        "d ä/a b.csv",
        "--samples",
        "500",
        "--json",
        "o.json",
        "--top",
        "2",
        "--trace",
        "t.parquet",
        "--figure",
        "f ü.png",
        "--penalty-height",
        "1",
    ]);
    assert!(stdout.contains("picture     f ü.png"));
    let json: Value = serde_json::from_str(&bench.read("o.json")).unwrap();
    assert_eq!(json["topologies"].as_array().unwrap().len(), 2);
    assert_eq!(
        &std::fs::read(bench.path("t.parquet")).unwrap()[..4],
        b"PAR1"
    );
    assert_eq!(&std::fs::read(bench.path("f ü.png")).unwrap()[1..4], b"PNG");
    // Without --figure the picture goes beside nothing of the user's: into the current folder.
    bench.ok(&["sample", "d ä/a b.csv", "--samples", "50"]);
    assert!(bench.exists("a b-sample.png"));
}

#[test]
fn the_summary_fits_a_terminal_and_quiet_and_verbose_are_heeded() {
    let bench = Bench::new();
    let name = format!("{}.csv", "long name ".repeat(15));
    bench.write(&name, pairs_csv(300));
    let few = [
        "--samples",
        "60",
        "--chains",
        "6",
        "--importance-samples",
        "2",
    ];
    let run = |flags: &[&str]| bench.run(&[&["sample", &name][..], &few, flags].concat());
    let plain = run(&[]);
    assert_eq!((plain.code, plain.stderr.as_str()), (0, ""));
    assert!(plain.stdout.lines().count() <= 24);
    // A pipe is no terminal: lines are whole, as far as they are no longer than a table may be.
    let lines = plain.stdout.lines();
    let widest = lines.map(|line| line.chars().count()).max().unwrap();
    assert!((100..=1000).contains(&widest), "{widest}: {}", plain.stdout);
    let quiet = run(&["--quiet"]);
    assert_eq!(
        (quiet.code, quiet.stdout + &quiet.stderr),
        (0, String::new())
    );
    let verbose = run(&["-v"]);
    assert!(verbose.stderr.contains("penalty_radius=10\n"));
    let faulty = run(&[
        "--estimator",
        "fresh",
        "--arithmetic",
        "linear",
        "--split",
        "prefix-cut",
    ]);
    assert_eq!(faulty.stderr.matches("INCORRECT").count(), 2);
    assert_eq!(faulty.stdout.matches("INCORRECT").count(), 2);
}

#[test]
fn small_and_odd_data() {
    let bench = Bench::new();
    let data: [(&str, &str, usize); 8] = [
        ("one", "x,y\n3,4\n", 1),
        ("two", "x,y\n0,0\n50,0\n", 2),
        ("same", "x,y\n1,1\n1,1\n1,1\n1,1\n", 4),
        ("bom-crlf", "\u{feff}x,y\r\n0,0\r\n-0,1\r\n", 2),
        ("far", "x,y\n1e308,0\n-1e308,0\n0,-0\n", 3),
        ("near", "x,y\n0,0\n1e-300,0\n5e-324,0\n", 3),
        ("truth", "x,y,landmark\n0,0,\n1,0,7\n2,0,\n", 3),
        ("extra", "y,corner,x\n0,open,1\n2,,3\n", 2),
    ];
    let extremes: [&[&str]; 9] = [
        &[],
        &[
            "--estimator",
            "fresh",
            "--moves",
            "sequential-allocation=1,restricted-gibbs=1",
        ],
        &["--optimum", "bfgs"],
        &["--sigma-o", "1e-6", "--sigma-t", "1e6"],
        &["--sigma-o", "1e6", "--sigma-t", "1e-6"],
        &["--penalty-radius", "1e-9", "--penalty-height", "1e6"],
        &[
            "--penalty-radius",
            "1e9",
            "--penalty-height",
            "0",
            "--penalty-shape",
            "cubic",
        ],
        &["--burn-in", "99", "--init", "one-cluster"],
        &[
            "--estimator",
            "fresh",
            "--arithmetic",
            "linear",
            "--split",
            "prefix-cut",
            "--init",
            "random",
        ],
    ];
    for (name, content, n) in data {
        let file = format!("{name}.csv");
        bench.write(&file, content);
        for flags in extremes {
            let common = [file.as_str(), "--samples", "100", "--chains", "1"];
            let json = bench.sample(&[&common[..], flags].concat());
            check_contract(&json, n, 100);
            assert!(
                !json["expected_number_of_sets"].is_null(),
                "{name} {flags:?}"
            );
        }
        let figure = format!("{name}.png");
        bench.ok(&["-q", "sample", &file, "--samples", "1", "--figure", &figure]);
        assert!(bench.exists(&figure));
    }
    // With one detection neither move can ever be made.
    let one = bench.sample(&["one.csv", "--samples", "100", "--chains", "1"]);
    for kind in ["merge", "split"] {
        let counts = &one["chains"][0]["moves"][kind];
        assert_eq!(counts["impossible"], counts["proposed"]);
    }
}

#[test]
fn many_detections_and_a_full_table_of_topologies() {
    let bench = Bench::new();
    bench.write("many.csv", pairs_csv(300));
    let many = bench.sample(&["many.csv", "--samples", "200", "--importance-samples", "2"]);
    check_contract(&many, 300, 200);
    // Weak penalty: hundreds of topologies, of which 16 are held. What was dropped is not counted.
    bench.write("few.csv", "x,y\n0,0\n1,0\n0,1\n1,1\n2,0\n2,1\n");
    let weak = [
        "few.csv",
        "--samples",
        "3000",
        "--chains",
        "1",
        "--penalty-height",
        "1",
    ];
    let full = bench.sample(
        &[
            &weak[..],
            &["--max-topologies", "16", "--trace", "t.parquet"],
        ]
        .concat(),
    );
    assert_eq!(full["truncated"], true);
    let rows = full["topologies"].as_array().unwrap();
    assert!(rows.len() <= 16 && !rows.is_empty());
    let whole = bench.sample(&weak);
    assert_eq!(whole["truncated"], false);
    assert_eq!(
        full["expected_number_of_sets"], whole["expected_number_of_sets"],
        "exact in any case"
    );
    // But for what is computed of the topologies that are held.
    let without_checks = |sample: &Value, settled: &str| -> Vec<Value> {
        let chains = sample["chains"].as_array().unwrap().clone();
        let bare = chains.into_iter().map(|mut chain| {
            let fields = chain.as_object_mut().unwrap();
            assert!(fields.remove("checks").is_some());
            assert_eq!(fields.remove("burn_in_reason").unwrap(), settled);
            chain
        });
        bare.collect()
    };
    assert_eq!(
        without_checks(&full, "MSER on M and ln target"),
        without_checks(
            &whole,
            "MSER on M, ln target and distance to the MAP topology"
        ),
        "the table changes nothing in the chain"
    );
}

#[test]
fn a_simulated_mission_can_be_sampled() {
    let bench = Bench::new();
    let out = bench.ok(&[
        "simulate", "--out", "w.csv", "--noise", "0.5", "--seed", "4",
    ]);
    assert!(out.contains("detections: w.csv") && out.contains("map: w.png"));
    let n = rows(&bench.read("w.csv")).len();
    let json = bench.sample(&["w.csv", "--samples", "300", "--chains", "1"]);
    check_contract(&json, n, 300);
    assert!(json["chains"][0]["recovered"].is_boolean());
    // Replicates differ, the same one is the same again.
    let first = bench.read("w.csv");
    bench.ok(&[
        "-q", "simulate", "--out", "w.csv", "--noise", "0.5", "--seed", "4",
    ]);
    assert_eq!(bench.read("w.csv"), first);
    bench.ok(&[
        "-q",
        "simulate",
        "--out",
        "v.csv",
        "--noise",
        "0.5",
        "--seed",
        "4",
        "--replicate",
        "2",
    ]);
    assert_ne!(bench.read("v.csv"), first);
}

#[test]
fn the_perfect_world_has_sixteen_detections_in_eight_coincident_pairs() {
    let bench = Bench::new();
    let perfect = ["--noise", "0", "--missed-rate", "0", "--false-rate", "0"];
    bench.ok(&[&["-q", "simulate", "--out", "w.csv"][..], &perfect].concat());
    let rows = rows(&bench.read("w.csv"));
    assert_eq!(rows.len(), 16);
    let mut places: Vec<(&str, [f64; 2])> = rows
        .iter()
        .map(|row| {
            (
                row["landmark"].as_str(),
                [row["x"].parse().unwrap(), row["y"].parse().unwrap()],
            )
        })
        .collect();
    places.sort_by(|a, b| a.0.cmp(b.0));
    for pair in places.chunks(2) {
        let [(a, p), (b, q)] = pair else {
            panic!("an odd one")
        };
        assert_eq!(a, b);
        assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-9, "{p:?} {q:?}");
    }
    places.dedup_by_key(|place| place.0);
    assert_eq!(places.len(), 8);
}

#[test]
fn version_help_completions_and_plan() {
    let bench = Bench::new();
    assert_eq!(
        bench.ok(&["--version"]),
        format!("ptm {}\n", env!("CARGO_PKG_VERSION"))
    );
    let verbose = bench.ok(&["--version", "-v", "--threads", "2"]);
    assert!(verbose.contains("\ncpu path: ") && verbose.contains("\nthreads: 2\n"));
    let help = bench.ok(&["--help"]);
    assert!(help.contains("Exit codes: 0 done;") && help.contains("simulate"));
    let help = bench.ok(&["sample", "--help"]);
    for flag in [
        "--sigma-o",
        "--moves",
        "--burn-in",
        "--penalty-shape",
        "INCORRECT",
    ] {
        assert!(help.contains(flag), "{flag}");
    }
    assert!(
        bench
            .ok(&["completions", "bash"])
            .contains("complete -F _ptm")
    );
    let plain = bench.ok(&["compare", "--help"]);
    assert!(plain.starts_with("Example: ptm compare "), "{plain}");
    bench.ok(&["-q", "man", "man"]);
    for page in ["ptm.1", "ptm-sweep.1", "ptm-compare.1"] {
        let text = bench.read(&format!("man/{page}"));
        assert!(
            text.contains(".SH NAME") && text.contains(".SH OPTIONS"),
            "{text}"
        );
        std::fs::remove_file(bench.path(&format!("man/{page}"))).unwrap();
    }
    std::fs::remove_dir_all(bench.path("man")).unwrap();
    bench.write("e.toml", bench.ok(&["sweep", "--print-example"]));
    let plan = bench.ok(&["plan", "e.toml", "-v", "--threads", "2"]);
    assert!(
        plan.contains("cells      4\n") && plan.contains("proposals  1,032,000 at most\n"),
        "{plan}"
    );
    // As many chains of the six posteriors as of the cells.
    assert!(
        plan.contains("\nchains     24 ") && plan.contains("\nreference  24 "),
        "{plan}"
    );
    assert_eq!(plan.matches(" key ").count(), 48);
    assert_eq!(bench.files(), ["e.toml"], "a plan writes nothing");
}

/// Without a penalty nothing is estimated: `ptm exact` moves each ln π by ln P(O|T), and `ptm sample` goes where it says.
#[test]
fn corner_kinds_are_evidence_where_asked_for() {
    let bench = Bench::new();
    bench.write(
        "kinds.csv",
        "x,y,corner\n0,0,open\n0.5,0,closed\n0.2,0.4,open\n0.3,0.3,\n",
    );
    let exact = |flags: &[&str]| -> Value {
        let fixed = ["exact", "kinds.csv", "--penalty-height", "0", "--json", "-"];
        serde_json::from_str(&bench.ok(&[&fixed, flags].concat())).unwrap()
    };
    let on = ["--corner-kinds", "confusion:0.1,0.2"];
    let (with, without) = (exact(&on), exact(&[]));
    assert_eq!(with["settings"]["corner_kinds"], "confusion:0.1,0.2");
    assert_eq!(without["settings"]["corner_kinds"], "off");
    // By the number of open and of closed corners in a set.
    let likelihood = |n_open: i32, n_closed: i32| {
        0.5 * (0.9_f64.powi(n_open) * 0.1_f64.powi(n_closed)
            + 0.2_f64.powi(n_open) * 0.8_f64.powi(n_closed))
    };
    let rows = with["partitions"].as_array().unwrap();
    assert_eq!(rows.len(), 15);
    for row in rows {
        let same = |other: &&Value| other["labels"] == row["labels"];
        let plain = without["partitions"].as_array().unwrap();
        let plain = plain.iter().find(same).unwrap();
        let labels: Vec<u64> = row["labels"]
            .as_array()
            .unwrap()
            .iter()
            .map(count)
            .collect();
        let expected: f64 = (0..4)
            .map(|set| {
                let of = |i: usize| i32::from(labels[i] == set);
                likelihood(of(0) + of(2), of(1)).ln()
            })
            .sum();
        let moved = number(&row["ln_unnormalised"]) - number(&plain["ln_unnormalised"]);
        assert!(
            (moved - expected).abs() < 1e-9,
            "{labels:?}: {moved} {expected}"
        );
    }
    let sampled = |flags: &[&str]| {
        let fixed = ["kinds.csv", "--penalty-height", "0", "--samples", "100000"];
        bench.sample(&[&fixed, flags].concat())
    };
    let together = |json: &Value, i: usize, j: usize| number(&json["co_clustering"][i][j]);
    let chains = sampled(&on);
    for (i, j) in [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)] {
        // 200,000 proposals are some ten thousand independent ones: four standard errors of a share.
        let apart = together(&chains, i, j) - together(&with, i, j);
        assert!(apart.abs() < 0.02, "{i} {j}: {apart}");
    }
    assert!(together(&with, 0, 2) > together(&without, 0, 2) + 0.05);
    assert!(together(&with, 0, 1) < together(&without, 0, 1) - 0.03);
    assert_ne!(chains["chains"], sampled(&[])["chains"]);
}
