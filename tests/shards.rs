//! A sweep on several machines: shards that share a folder and nothing else, and what merging makes of them.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::collections::BTreeMap;

use common::{Bench, SMALL_SWEEP, files, ran};

/// What must be the same however the sweep was run.
fn fixed(bench: &Bench, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&bench.path(folder));
    found.retain(|name, _| {
        !name.starts_with("timings.") && name != "run.json" && !name.starts_with("shards/")
    });
    let journal = found.get_mut("journal.jsonl").unwrap();
    let mut lines: Vec<&[u8]> = journal.split_inclusive(|&byte| byte == b'\n').collect();
    lines.sort_unstable();
    *journal = lines.concat();
    found
}

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "single"]);
    bench
}

fn shard(bench: &Bench, shard: &str) {
    let out = bench.ok(&["sweep", "small.toml", "--out", "out", "--shard", shard]);
    assert!(out.starts_with(&format!("shard {shard}: ")), "{out}");
    assert!(!bench.exists("out/index.html"), "the report is the merge's");
}

#[test]
fn shards_merge_into_the_bytes_of_a_single_run() {
    let bench = bench();
    // Three machines at once, in a folder that is not there yet.
    let start = |k: u32| {
        let shard = format!("{k}/3");
        let arguments = [
            "-q",
            "sweep",
            "small.toml",
            "--out",
            "out",
            "--shard",
            &shard,
        ];
        bench.command(&arguments).spawn().unwrap()
    };
    for mut child in [start(1), start(2), start(3)] {
        assert!(child.wait().unwrap().success());
    }
    let merged = bench.run(&["merge", "out"]);
    assert_eq!(merged.code, 0, "{}", merged.stderr);
    assert_eq!(merged.stderr, "16 of 16 chains have a record\n");
    assert_eq!(fixed(&bench, "out"), fixed(&bench, "single"));
    // Where and when is in run.json, and every chain has its time.
    let run: serde_json::Value = serde_json::from_str(&bench.read("out/run.json")).unwrap();
    let mut shards: Vec<&str> = run["starts"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["shard"].as_str().unwrap())
        .collect();
    shards.sort_unstable();
    assert_eq!(shards, ["1/3", "2/3", "3/3"]);
    assert_eq!(run["sweep_text"], SMALL_SWEEP);
    let timed = common::rows(&bench.read("out/timings.csv"));
    assert!(timed.len() == 16 && timed.iter().all(|row| !row["seconds"].is_empty()));

    // Merging again changes nothing, run.json included; and so does a shard that is run again.
    let before = files(&bench.path("out"));
    bench.ok(&["-q", "merge", "out"]);
    assert!(files(&bench.path("out")) == before, "merge is idempotent");
    let again = bench.ok(&["sweep", "small.toml", "--out", "out", "--shard", "2/3"]);
    assert!(again.contains("5 chains, 0 of them failed"), "{again}");
    assert_eq!(bench.read("out/shards/2-of-3.2.jsonl"), "");
    // Nor has a plain run anything left to do.
    let plain = bench.run(&["sweep", "small.toml", "--out", "out"]);
    assert!(
        plain.stderr.contains("16 chains were finished earlier"),
        "{}",
        plain.stderr
    );
    assert_eq!(fixed(&bench, "out"), fixed(&bench, "single"));
}

#[test]
fn gaps_duplicates_and_contradictions_are_found() {
    let bench = bench();
    shard(&bench, "1/3");
    let gaps = bench.run(&["merge", "out"]);
    assert_eq!(gaps.code, 75);
    insta::assert_snapshot!(gaps.stderr, @"
    6 of 16 chains have a record
    ptm: out: 10 chains have no record, those of shards 2/3 (5), 3/3 (5); run these again, as `ptm submit` does by itself, then merge again
    ");
    assert!(!bench.exists("out/index.html"));
    // Another machine was thought dead, and both have run the shard.
    shard(&bench, "2/3");
    let journal = bench.read("out/shards/2-of-3.1.jsonl");
    bench.write("out/shards/2-of-3.2.jsonl", &journal);
    // A third was killed while it wrote.
    bench.write("out/shards/2-of-3.3.jsonl", &journal[..journal.len() - 7]);
    shard(&bench, "3/3");
    let merged = bench.run(&["merge", "out"]);
    assert_eq!(merged.code, 0, "{}", merged.stderr);
    assert!(
        merged
            .stderr
            .contains("out/shards/2-of-3.3.jsonl: the last record ends after "),
        "{}",
        merged.stderr
    );
    assert!(
        merged.stderr.contains(
            "16 of 16 chains have a record; 9 results are there more than once, the same each time"
        ),
        "{}",
        merged.stderr
    );
    assert_eq!(fixed(&bench, "out"), fixed(&bench, "single"));

    // A result that is another one, with a checksum that fits.
    let line = journal.lines().next().unwrap();
    let (_, json) = line.split_once(' ').unwrap();
    let other = json.replacen("\"n_steps\":300", "\"n_steps\":301", 1);
    assert_ne!(json, other);
    let crc = crc32fast::hash(other.as_bytes());
    bench.write("out/shards/2-of-3.2.jsonl", format!("{crc:08x} {other}\n"));
    let wrong = bench.run(&["merge", "out"]);
    assert_eq!(wrong.code, 65);
    assert!(
        wrong.stderr.contains("out/shards/2-of-3.2.jsonl: chain ")
            && wrong
                .stderr
                .contains("has another result than in out/shards/2-of-3.1.jsonl"),
        "{}",
        wrong.stderr
    );
    // And one whose checksum does not.
    bench.write(
        "out/shards/2-of-3.2.jsonl",
        journal.replacen("\"n_steps\":300", "\"n_steps\":301", 1),
    );
    let damaged = bench.run(&["merge", "out"]);
    assert_eq!(damaged.code, 65);
    assert!(
        damaged
            .stderr
            .contains("out/shards/2-of-3.2.jsonl:1: got a damaged record"),
        "{}",
        damaged.stderr
    );
}

#[test]
fn schedulers_are_listened_to() {
    let bench = bench();
    let run = |arguments: &[&str], variables: &[(&str, &str)]| {
        let mut command =
            bench.command(&[&["sweep", "small.toml", "--out", "out"], arguments].concat());
        ran(&command.envs(variables.iter().copied()).output().unwrap())
    };
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "7"),
        ("SLURM_ARRAY_TASK_MIN", "7"),
        ("SLURM_ARRAY_TASK_MAX", "8"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
    ];
    assert!(run(&[], &slurm).stdout.starts_with("shard 1/2: 8 chains"));
    assert!(
        run(&["--shards", "2"], &[("JOB_COMPLETION_INDEX", "1")])
            .stdout
            .starts_with("shard 2/2: 8 chains")
    );
    let lost = run(&[], &[("HQ_TASK_ID", "1")]);
    assert_eq!(lost.code, 1);
    assert!(
        lost.stderr.contains("HQ_TASK_ID: is set"),
        "{}",
        lost.stderr
    );
    assert_eq!(run(&["--shards", "2"], &[]).code, 1);
    assert_eq!(bench.run(&["-q", "merge", "out"]).code, 0);
    assert_eq!(fixed(&bench, "out"), fixed(&bench, "single"));
}

#[test]
fn what_is_submitted_is_what_is_missing() {
    let bench = bench();
    shard(&bench, "2/5");
    shard(&bench, "3/5");
    let said = bench.ok(&[
        "submit",
        "--slurm",
        "small.toml",
        "--shards",
        "5",
        "--out",
        "out",
        "--dry-run",
        "--sbatch=--partition=long",
    ]);
    // Shards 1, 4 and 5, that is numbers 0, 3 and 4.
    assert!(
        said.contains(" --array=0,3-4 ") && said.contains(" --requeue --signal=B:TERM@60 "),
        "{said}"
    );
    assert!(
        said.contains(" --open-mode=append ") && said.contains(" --partition=long "),
        "{said}"
    );
    assert!(said.contains(" --dependency=afterany:"), "{said}");
    // The script is what runs: shard 5 is number 4.
    let output = std::process::Command::new("sh")
        .arg(bench.path("out/slurm/shard.sh"))
        .arg("1")
        .env("SLURM_ARRAY_TASK_ID", "3")
        .current_dir(bench.path(""))
        .output()
        .unwrap();
    let shard_5 = ran(&output);
    assert_eq!((shard_5.code, shard_5.stderr.as_str()), (0, ""));
    assert!(bench.exists("out/shards/5-of-5.1.jsonl"));
    // Where there is no Slurm, that is said, and not that all went well.
    let mut command = bench.command(&[
        "submit",
        "--slurm",
        "small.toml",
        "--shards",
        "5",
        "--out",
        "out",
    ]);
    let failed = ran(&command.env("PATH", "/nowhere").output().unwrap());
    assert_eq!(failed.code, 1);
    assert!(
        failed.stderr.contains("scontrol: cannot be run"),
        "{}",
        failed.stderr
    );
}

#[test]
fn a_manifest_for_kubernetes_runs_every_shard_once() {
    let bench = Bench::new();
    let text = bench.ok(&[
        "submit",
        "--kubernetes",
        "small.toml",
        "--shards",
        "250",
        "--image",
        "registry/ptm:1",
        "--claim",
        "sweeps",
        "--out",
        "reports/small",
    ]);
    let job: serde_json::Value = serde_json::from_str(&text).unwrap();
    let spec = &job["spec"];
    assert_eq!(
        (&job["apiVersion"], &job["kind"], &spec["completionMode"]),
        (&"batch/v1".into(), &"Job".into(), &"Indexed".into())
    );
    assert_eq!(
        (&spec["completions"], &spec["parallelism"]),
        (&250.into(), &100.into())
    );
    let container = &spec["template"]["spec"]["containers"][0];
    let words: Vec<&str> = container["args"]
        .as_array()
        .unwrap()
        .iter()
        .map(|word| word.as_str().unwrap())
        .collect();
    assert_eq!(
        words,
        [
            "sweep",
            "small.toml",
            "--out",
            "reports/small",
            "--shards",
            "250",
            "--threads",
            "1"
        ]
    );
    assert_eq!(
        container["volumeMounts"][0]["name"],
        spec["template"]["spec"]["volumes"][0]["name"]
    );
    assert_eq!(
        bench
            .run(&["submit", "--kubernetes", "small.toml", "--shards", "3"])
            .code,
        1
    );
    assert_eq!(
        bench.run(&["submit", "small.toml", "--shards", "3"]).code,
        1
    );
}

#[test]
fn a_plan_says_why_each_chain_would_run() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    let explain = || bench.ok(&["plan", "--explain", "small.toml", "--out", "out"]);
    insta::assert_snapshot!(explain(), @r"
    c001  4 run: new
    c002  4 run: new
    c003  4 run: new
    c004  4 run: new
    16 of 16 chains would run in out
    ");
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    // Comments and order are nobody's business.
    let turned = "# a remark\n".to_owned() + &SMALL_SWEEP.replace("[1, 10]", "[10, 1]");
    bench.write("small.toml", turned);
    insta::assert_snapshot!(explain(), @r"
    c001  4 kept
    c002  4 kept
    c003  4 kept
    c004  4 kept
    0 of 16 chains would run in out
    ");
    // One value changes, one chain more for each world.
    let edited = SMALL_SWEEP
        .replace("[1, 10]", "[1, 12]")
        .replace("chains = 2", "chains = 3");
    bench.write("small.toml", edited);
    insta::assert_snapshot!(explain(), @r"
    c001  4 kept; 2 run: new: more worlds or chains than before
    c002  4 kept; 2 run: new: more worlds or chains than before
    c003  6 run: changed penalty_radius 10 -> 12
    c004  6 run: changed penalty_radius 10 -> 12
    16 of 24 chains would run in out
    the folder holds another sweep or other data: ptm sweep wants --force, and keeps what is the same
    ");
    let edited = bench.run(&["sweep", "small.toml", "--out", "out", "--force"]);
    assert_eq!(edited.code, 0);
    assert!(
        edited
            .stderr
            .contains("8 chains were finished earlier and are kept"),
        "{}",
        edited.stderr
    );
    assert_eq!(bench.read("out/journal.jsonl").lines().count(), 16 + 16);
    // Failures say so.
    bench.write(
        "small.toml",
        SMALL_SWEEP.replace("samples = 300", "samples = 1000000000"),
    );
    assert_eq!(
        bench
            .run(&[
                "sweep",
                "small.toml",
                "--out",
                "slow",
                "--max-seconds",
                "0.01"
            ])
            .code,
        2
    );
    let said = bench.ok(&["plan", "--explain", "small.toml", "--out", "slow"]);
    assert!(
        said.contains("c001  4 run: failed before: time limit: not done after 0.01 s"),
        "{said}"
    );
    let said = bench.ok(&[
        "plan",
        "--explain",
        "small.toml",
        "--out",
        "slow",
        "--max-seconds",
        "0.01",
    ]);
    assert!(said.contains("c001  4 kept, failed: time limit"), "{said}");
}
