//! A chain that takes too long, needs too much or panics is a row with its reason; the rest goes on.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use common::{Bench, SMALL_SWEEP, rows};
use topometric::dataset::DataSet;
use topometric::diagnostics::recovery::Truth;
use topometric::results::sample::judgement;
use topometric::run::{self, ChainStatus, FailureKind, Journal, Plan, RunOptions, Silent};
use topometric::sweep::Sweep;

/// One chain for each list of keys.
fn listed(cells: &[&str]) -> String {
    let cells = cells
        .iter()
        .map(|keys| format!("[[design.cells]]\n{keys}\n"));
    let head = "[sampler]\nestimator = \"common\"\n[run]\nchains = 1\nseed = 3\n[design]\nkind = \"list\"\n";
    head.to_owned() + &cells.collect::<String>()
}

fn reasons(bench: &Bench) -> Vec<String> {
    let rows = rows(&bench.read("out/chains.csv"));
    rows.iter().map(|row| row["reason"].clone()).collect()
}

fn n_records(bench: &Bench) -> usize {
    bench.read("out/journal.jsonl").lines().count()
}

#[test]
fn a_chain_that_takes_too_long_is_a_row_and_runs_again_when_it_may_take_longer() {
    let bench = Bench::new();
    // A thousand million proposals take minutes at least, 300 take a millisecond.
    bench.write("s.toml", listed(&["samples = 300", "samples = 1000000000"]));
    let sweep = |more: &[&str]| {
        let ran = bench.run(&[&["sweep", "s.toml", "--out", "out"], more].concat());
        assert_eq!(ran.code, 2, "{}", ran.stderr);
        ran
    };
    sweep(&["--max-seconds", "0.5"]);
    let limited = |limit: &str| {
        format!("time limit: not done after {limit} s; raise --max-seconds or lower samples")
    };
    assert_eq!(reasons(&bench), [String::new(), limited("0.5")]);
    assert!(
        bench
            .read("out/cells/c002.html")
            .contains("time limit: not done after 0.5 s")
    );
    assert_eq!(n_records(&bench), 2);
    // Under the same limit, or less, it would fail again.
    for limit in ["0.5", "0.4"] {
        let again = sweep(&["--max-seconds", limit]);
        assert!(
            again.stderr.contains("2 chains were finished earlier"),
            "{}",
            again.stderr
        );
        assert_eq!(n_records(&bench), 2);
    }
    let more = sweep(&["--max-seconds", "0.6"]);
    assert!(
        more.stderr.contains("1 chains were finished earlier"),
        "{}",
        more.stderr
    );
    assert_eq!(reasons(&bench), [String::new(), limited("0.6")]);
    sweep(&["--max-seconds", "0.3", "--retry-failed"]);
    assert_eq!(reasons(&bench), [String::new(), limited("0.3")]);
    assert_eq!(n_records(&bench), 4);
}

#[test]
fn a_chain_that_needs_too_much_memory_is_a_row() {
    let bench = Bench::new();
    let free = "penalty_height = 0\nsigma_o = 30\nsigma_t = 30";
    bench.write(
        "s.toml",
        listed(&[
            "samples = 300",
            // Its draws alone are half a gigabyte.
            "samples = 300\nimportance_samples = 1000000",
            // Without a penalty it hardly ever stays where it is, and its trace grows and grows.
            &format!("samples = 1000000\n{free}"),
        ]),
    );
    let arguments = ["sweep", "s.toml", "--out", "out", "--max-memory", "4"];
    let ran = bench.run(&arguments);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    let limited = "memory limit: needs more than 4 MB; raise --max-memory or lower importance_samples or max_topologies";
    assert_eq!(reasons(&bench), ["", limited, limited]);
    // The same again, and with more it is run.
    assert_eq!(bench.run(&arguments).code, 2);
    assert_eq!(n_records(&bench), 3);
    let more = ["sweep", "s.toml", "--out", "out", "--max-memory", "400"];
    assert_eq!(bench.run(&more).code, 2);
    assert_eq!(reasons(&bench)[2], "");
    assert_eq!(n_records(&bench), 5);
}

#[test]
fn a_panic_in_one_chain_is_a_row_and_the_rest_goes_on() {
    let sweep = Sweep::parse(SMALL_SWEEP, "small.toml", "small", None).unwrap();
    let mut plan = Plan::new(&sweep).unwrap();
    let options = RunOptions::default();
    let run = |plan: &mut Plan| {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::open(folder.path()).unwrap();
        let never = AtomicBool::new(false);
        let result = run::execute(
            &sweep,
            plan,
            &journal,
            &options,
            (&judgement, &Silent),
            &never,
        )
        .unwrap();
        drop(journal);
        let again = Journal::read_only(folder.path()).unwrap();
        for (task, record) in plan.tasks.iter().zip(&result.records) {
            assert_eq!(again.get(&task.key), record.as_ref(), "what is on disk");
        }
        result.records
    };
    let sound = run(&mut plan);
    // A truth of more detections than there are is nothing that a reader lets through, so no code has to
    // bear it.
    let mut other = DataSet::clone(plan.data_sets[1].as_ref().unwrap());
    other.truth = Truth::new(&[Some(1); 40]);
    plan.data_sets[1] = Ok(Arc::new(other));
    let records = run(&mut plan);
    assert_eq!(records.len(), sound.len());
    let mut n_failed = 0;
    for (task, (record, sound)) in plan.tasks.iter().zip(records.iter().zip(&sound)) {
        if task.data != 1 {
            assert_eq!(record, sound);
            continue;
        }
        n_failed += 1;
        match &record.as_ref().unwrap().status {
            ChainStatus::Failed {
                kind: FailureKind::Panic,
                reason,
            } => assert!(
                reason.starts_with("panic: ") && !reason.contains('\n'),
                "{reason}"
            ),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(n_failed, 8);
}
