//! Convergence and verdicts as the tables and pages show them, and what `ptm sample` says of them.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, SMALL_SWEEP, pairs_csv, rows};

/// An empty number has a word beside it, and a number none but `defined`.
#[test]
fn no_number_is_blank_without_a_word() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let found = rows(&bench.read("out/convergence.csv"));
    assert_eq!(found.len(), 8, "four cells on two worlds");
    let mut words = std::collections::BTreeSet::new();
    for row in &found {
        for (name, word) in row.iter().filter(|(name, _)| name.ends_with("_state")) {
            let value = &row[name.strip_suffix("_state").unwrap()];
            assert_eq!(
                value.is_empty(),
                word != "defined",
                "{name}: {value:?} {word:?}"
            );
            words.insert(word.clone());
        }
        assert!(
            row.values()
                .any(|value| ["mixes", "at-rest", "exact", "not-shown"].contains(&value.as_str()))
        );
        let is_shown = row["convergence"] != "not-shown";
        assert_eq!(row["doubts"] == "none", is_shown);
        let verdict = match (is_shown, row["map_is_truth"].as_str()) {
            (true, "yes") => "recovered and converged",
            (true, "no") => "converged to a wrong map",
            (false, "no") if row["verdict"] != "recovered by luck" => "not converged",
            (false, _) => "recovered by luck",
            other => panic!("{other:?}"),
        };
        assert_eq!(row["verdict"], verdict);
    }
    // 300 proposals are too few to have it all.
    assert!(words.len() > 1 && words.contains("defined"), "{words:?}");
    let cells = rows(&bench.read("out/cells.csv"));
    for cell in &cells {
        let own = found.iter().filter(|row| row["cell"] == cell["cell"]);
        let shown = own.filter(|row| row["convergence"] != "not-shown").count();
        assert_eq!(cell["n_worlds_converged"], shown.to_string());
        assert!(
            bench
                .read("out/index.html")
                .contains(&format!("{shown} of 2"))
        );
        assert_eq!(
            (&cell["n_failed"], &cell["n_missing"]),
            (&"0".to_owned(), &"0".to_owned())
        );
    }
}

/// Half a run: what was not run yet is counted, and named in every place.
#[test]
fn what_is_missing_is_said() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let journal = bench.read("out/journal.jsonl");
    let cells = rows(&bench.read("out/chains.csv"));
    let first: Vec<&String> = cells
        .iter()
        .filter(|r| r["cell"] == "c001")
        .map(|r| &r["key"])
        .collect();
    let kept = |line: &&str| first[..3].iter().any(|key| line.contains(key.as_str()));
    let lines: Vec<&str> = journal.split_inclusive('\n').filter(kept).collect();
    assert_eq!(lines.len(), 3);
    bench.write("out/journal.jsonl", lines.concat());
    bench.ok(&["-q", "report", "out"]);
    let cells = rows(&bench.read("out/cells.csv"));
    let missing: Vec<&str> = cells
        .iter()
        .map(|cell| cell["n_missing"].as_str())
        .collect();
    assert_eq!(missing, ["1", "4", "4", "4"]);
    for cell in &cells[1..] {
        assert_eq!(
            (cell["verdict"].as_str(), cell["n_worlds_missing"].as_str()),
            ("missing", "2")
        );
        assert_eq!(cell["converged_share"], "");
    }
    // A world with one chain of two has nothing to compare it with.
    let worlds = rows(&bench.read("out/convergence.csv"));
    assert_eq!(worlds[1]["doubts"], "one-chain");
    assert_eq!(worlds[1]["topology_distance_state"], "too-few");
    assert_eq!(
        (
            worlds[2]["verdict"].as_str(),
            worlds[2]["n_sets_r_hat_state"].as_str()
        ),
        ("missing", "no-chain")
    );
    assert!(bench.read("out/report.md").contains("0 failed, 4 missing"));
    assert!(bench.exists("out/figures/run-status.png"));
}

/// MAP, Binder and VI estimates against the truth, and the numbers of convergence.
#[test]
fn samples_carry_estimates_and_convergence() {
    let bench = Bench::new();
    bench.write("pairs.csv", pairs_csv(8));
    let flags = [
        "pairs.csv",
        "--samples",
        "20000",
        "--chains",
        "3",
        "--penalty-radius",
        "5",
    ];
    let json = bench.sample(&flags);
    let estimates = json["estimates"].as_array().unwrap();
    let kinds: Vec<&str> = estimates
        .iter()
        .map(|e| e["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["map", "binder", "vi"]);
    assert_eq!(estimates[0]["labels"], json["topologies"][0]["labels"]);
    assert_eq!(
        estimates[0]["frequency"],
        json["topologies"][0]["frequency"]
    );
    for estimate in estimates {
        let number = |name: &str| estimate[name].as_f64().unwrap();
        assert!(number("expected_loss") >= 0.0 && number("expected_loss_se") >= 0.0);
        assert!(estimate["credible_ball"]["mass"].as_f64().unwrap() >= 0.95);
        let truth = &estimate["truth"];
        // Pairs 20 m apart are easy: every estimate is the truth.
        assert_eq!(truth["recovered"], true, "{estimate}");
        for (name, value) in [
            ("adjusted_rand_index", 1.0),
            ("variation_of_information", 0.0),
            ("v_measure", 1.0),
            ("pair_precision", 1.0),
            ("pair_recall", 1.0),
            ("n_sets_error", 0.0),
            ("n_known", 8.0),
        ] {
            assert_eq!(truth[name].as_f64(), Some(value), "{name}");
        }
    }
    // The VI estimate has the least mean VI of all, the MAP topology included.
    assert!(estimates[2]["expected_loss"].as_f64() <= estimates[0]["expected_loss"].as_f64());
    let convergence = &json["convergence"];
    let verdict = convergence["verdict"].as_str().unwrap();
    assert!(["mixes", "at-rest", "exact", "not-shown"].contains(&verdict));
    let doubts = convergence["doubts"].as_array().unwrap();
    assert_eq!(doubts.is_empty(), verdict != "not-shown");
    for name in ["r_hat", "ess_bulk", "ess_tail", "mean", "mcse"] {
        let measured = &convergence["n_sets"][name];
        assert_eq!(
            measured["value"].is_null(),
            measured["state"] != "defined",
            "{name}"
        );
    }
    let said = bench.ok(&[&["sample"][..], &flags].concat());
    for name in ["converged ", "starts ", "MAP ", "Binder ", "VI "] {
        assert!(
            said.lines().any(|line| line.starts_with(name)),
            "{name}\n{said}"
        );
    }

    // One chain, and no truth.
    bench.write(
        "plain.csv",
        pairs_csv(8)
            .replace(",landmark", "")
            .lines()
            .map(|line| {
                let cut = line
                    .match_indices(',')
                    .nth(1)
                    .map_or(line.len(), |(at, _)| at);
                format!("{}\n", &line[..cut])
            })
            .collect::<String>(),
    );
    let json = bench.sample(&["plain.csv", "--samples", "2000", "--chains", "1"]);
    assert!(json["estimates"][0]["truth"].is_null());
    assert_eq!(json["convergence"]["verdict"], "not-shown");
    assert_eq!(json["convergence"]["topology_distance"]["state"], "too-few");
}

/// The split of a cell's worlds stands wherever its verdict does, and nothing is trusted without proof: two worlds
/// are too few for any cell, so none is green.
#[test]
fn a_cell_says_how_its_worlds_split_and_is_not_trusted_by_a_plurality() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    let said = bench.ok(&["sweep", "small.toml", "--out", "out"]);
    let index = bench.read("out/index.html");
    let report = bench.read("out/report.md");
    for cell in rows(&bench.read("out/cells.csv")) {
        let split = &cell["worlds_by_verdict"];
        assert!(split.contains("2 worlds "), "{split}");
        assert_ne!(cell["verdict"], "recovered and converged");
        let page = bench.read(&format!("out/cells/{}.html", cell["cell"]));
        assert!(!page.contains("trust it"), "{}", cell["cell"]);
        // After the word, the worlds that it is of.
        let verdict = &cell["verdict"];
        let of_worlds = if verdict == "undecided" {
            format!("undecided: {split}")
        } else {
            format!(
                "{verdict}: {}",
                split.replacen(&format!(" {verdict}"), "", 1)
            )
        };
        for text in [&page, &index, &report] {
            assert!(text.contains(&of_worlds), "{of_worlds}");
        }
        assert!(!said.contains(&format!("{verdict}  ")), "{said}");
    }
    // What the effects rest on is said with the test.
    assert!(report.contains("p\u{a0}=\u{a0}") || report.contains("at every level"));
}

/// Every landmark is seen once, so nothing tells the noise.
#[test]
fn tune_says_that_it_does_not_decide() {
    let bench = Bench::new();
    let rows: Vec<String> = (0..9)
        .map(|i| format!("{},{}\n", 10 * (i % 3), 10 * (i / 3)))
        .collect();
    bench.write("once.csv", format!("x,y\n{}", rows.concat()));
    let ran = bench.run(&["tune", "once.csv", "--no-simulation", "--json", "tune.json"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stdout.contains("NOT decided "), "{}", ran.stdout);
    let has_line = |word: &str| ran.stdout.lines().any(|line| line.starts_with(word));
    assert!(has_line("try ") && !has_line("use "), "{}", ran.stdout);
    let found: serde_json::Value = serde_json::from_str(&bench.read("tune.json")).unwrap();
    assert_eq!(found["decided"], false);
    assert!(!found["doubts"].as_array().unwrap().is_empty());
    // No interval from a number to itself, in words or in numbers.
    for line in ran.stdout.lines() {
        if let Some((low, high)) = line.split_once(" to ") {
            let low = low.rsplit('(').next().unwrap();
            let high = high.split(')').next().unwrap();
            assert_ne!(low, high, "{line}");
        }
    }
}
