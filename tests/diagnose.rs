//! `ptm diagnose` as a user meets it: chains of our own give what `ptm sample` said, and files that
//! will not do are refused in one line.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::Bench;
use serde_json::Value;

/// Twelve detections of four landmarks near one another.
fn crowd() -> String {
    let rows = (0..12).map(|i| {
        let (landmark, copy) = (f64::from(i / 3), f64::from(i % 3));
        let y = 0.4 * copy * (copy - 1.5);
        format!("{},{y}\n", 1.6 * landmark + 0.3 * copy)
    });
    format!("x,y\n{}", rows.collect::<String>())
}

fn json(bench: &Bench, name: &str) -> Value {
    serde_json::from_str(&bench.read(name)).unwrap()
}

/// Two JSON values, numbers up to rounding.
fn assert_near(a: &Value, b: &Value, what: &str) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|x| x.as_f64().unwrap());
            assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{what}: {a} {b}");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{what}");
            a.iter().zip(b).for_each(|(a, b)| assert_near(a, b, what));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{what}");
            a.iter().for_each(|(key, a)| assert_near(a, &b[key], key));
        }
        _ => assert_eq!(a, b, "{what}"),
    }
}

#[test]
fn a_trace_of_ours_is_judged_as_sample_judged_it() {
    let bench = Bench::new();
    bench.write("crowd.csv", crowd());
    let settings = "--penalty-radius 1.5 --penalty-height 20 --exact-up-to 0 --samples 4000";
    let mut sample = vec!["-q", "sample", "crowd.csv", "--json", "sample.json"];
    sample.extend(["--trace", "trace.parquet", "--figure", "figure.png"]);
    sample.extend(settings.split(' '));
    bench.ok(&sample);
    let diagnose = ["diagnose", "trace.parquet", "--json", "found.json"];
    let said = bench.ok(&[&diagnose[..], &["--top", "100000"]].concat());
    let head = "4 chains of 4000 draws of 12 items\n";
    assert!(said.starts_with(head), "{said}");
    let (ours, found) = (json(&bench, "sample.json"), json(&bench, "found.json"));
    for key in [
        "expected_number_of_sets",
        "co_clustering",
        "topologies",
        "estimates",
    ] {
        assert_near(&ours[key], &found[key], key);
    }
    let judged = ours["convergence"]["judged"].as_array().unwrap();
    assert!(judged.len() > 5, "{judged:?}");
    for key in [
        "judged",
        "first_proposal",
        "n_sets",
        "ln_target",
        "at_map",
        "unseen_mass",
    ] {
        assert_near(&ours["convergence"][key], &found["convergence"][key], key);
    }
    let chains = |own: &Value| own["chains"].as_array().unwrap().clone();
    for (ours, found) in chains(&ours).iter().zip(chains(&found)) {
        assert_eq!(ours["burn_in"], found["burn_in"]);
    }
}

/// The page is one file that says what the terminal says, and escapes what a file is called.
#[test]
fn a_page_and_a_picture_hold_the_diagnosis() {
    let bench = Bench::new();
    let modes = ["0,0,1,1", "0,1,1,1"];
    let mut place = 1_u64;
    let rows: String = (0..1600)
        .map(|row| {
            // A multiplicative generator: which mode a draw is of.
            place = place * 48_271 % 2_147_483_647;
            format!("{},{}\n", row / 400, modes[(place % 3 % 2) as usize])
        })
        .collect();
    bench.write("a<b>&c.csv", format!("chain,a,b,c,d\n{rows}"));
    let flags = ["--figure", "found.png", "--page", "found.html"];
    let said = bench.ok(&[&["diagnose", "a<b>&c.csv"], &flags[..]].concat());
    assert!(said.contains("picture     found.png") && said.contains("page        found.html"));
    let png = std::fs::read(bench.path("found.png")).unwrap();
    assert_eq!(&png[1..4], b"PNG");
    bench.ok(&["-q", "diagnose", "a<b>&c.csv", "--figure", "found.svg"]);
    assert!(bench.read("found.svg").starts_with("<svg"));
    let page = bench.read("found.html");
    for words in [
        "a&lt;b&gt;&amp;c.csv",
        "4 chains of 400 draws of 4 items.",
        "Converged?",
        "<svg",
        "What the verdict rests on",
        "Several answers",
        "0,0,1,1",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("a<b>") && !page.contains("<script"));
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"));
}

#[test]
fn what_it_says_contradicts_nothing() {
    let bench = Bench::new();
    // Two chains in each of two modes of two sets: M is the same in all.
    let modes = ["0,0,1,1", "0,1,0,1"];
    let rows = (0..4).flat_map(|chain| (0..300).map(move |_| chain));
    let rows: String = rows
        .map(|chain| format!("{chain},{}\n", modes[chain % 2]))
        .collect();
    bench.write("modes.csv", format!("chain,a,b,c,d\n{rows}"));
    let said = bench.ok(&["diagnose", "modes.csv"]);
    assert!(said.contains("converged   NOT shown"), "{said}");
    // One chain is never enough, nor are a few draws.
    bench.write("one.csv", "a,b\n1,1\n1,2\n");
    let said = bench.ok(&["diagnose", "one.csv"]);
    let head = "1 chain of 2 draws of 2 items\n";
    assert!(said.starts_with(head), "{said}");
    assert!(said.contains("converged   NOT shown: "), "{said}");
    let said = bench.ok(&["diagnose", "one.csv", "one.csv", "--burn-in", "0"]);
    assert!(said.contains("converged   NOT shown: "), "{said}");
}

/// Chains of others have no setting `init` and make no proposals.
#[test]
fn doubts_advise_what_others_can_do() {
    let bench = Bench::new();
    let modes = ["0,0,1,1", "0,1,1,1"];
    let mut place = 1_u64;
    let rows: String = (0..1600)
        .map(|row| {
            place = place * 48_271 % 2_147_483_647;
            let mode = if row % 400 == 0 { 0 } else { place % 3 % 2 };
            format!("{},{}\n", row / 400, modes[mode as usize])
        })
        .collect();
    bench.write("same.csv", format!("chain,a,b,c,d\n{rows}"));
    let said = bench.ok(&[
        "diagnose",
        "same.csv",
        "--json",
        "found.json",
        "--page",
        "found.html",
    ]);
    let doubt = "all chains begin with the same topology; start them at topologies that differ";
    let found = json(&bench, "found.json");
    let doubts = found["convergence"]["doubts"].as_array().unwrap();
    assert!(doubts[0].as_str().unwrap().starts_with(doubt), "{doubts:?}");
    assert!(bench.read("found.html").contains(doubt));
    assert!(!said.contains("init"), "{said}");
}

#[test]
fn what_will_not_do_is_refused_in_one_line() {
    let bench = Bench::new();
    bench.write("a.csv", "a,b\n1,1\n");
    bench.write("b.csv", "a,b,c\n1,1,2\n");
    bench.write("empty.csv", "a,b\n");
    bench.write("broken.parquet", "PAR1 and no more");
    let cases: [(&[&str], i32, &str); 6] = [
        (
            &["a.csv", "b.csv"],
            65,
            "b.csv, line 2: got 3 labels, expected 2 as in the draws before",
        ),
        (
            &["empty.csv"],
            65,
            "empty.csv: got no draw, expected at least one",
        ),
        (
            &["broken.parquet"],
            65,
            "broken.parquet: got Parquet that cannot be read (",
        ),
        (&["none.csv"], 1, "none.csv: cannot be read"),
        (
            &["a.csv", "--burn-in", "half"],
            1,
            "--burn-in: got \"half\", expected auto or a whole number of draws",
        ),
        (&["a.csv", "--json", "a.csv"], 1, "a.csv"),
    ];
    for (arguments, code, expected) in cases {
        let ran = bench.run(&[&["diagnose"], arguments].concat());
        assert_eq!(ran.code, code, "{}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{}", ran.stderr);
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    }
    assert_eq!(bench.read("a.csv"), "a,b\n1,1\n");
}
