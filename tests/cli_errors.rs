//! Bad input gives one line on standard error, the right exit code, nothing on standard output and
//! no file.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, SMALL_SWEEP, pairs_csv};

/// A bench with one good file of each kind.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("good.csv", pairs_csv(4));
    bench.write("good.toml", SMALL_SWEEP);
    bench
}

/// Runs every command line and writes down exit code and message, after checking what holds for all.
fn transcript(bench: &Bench, command_lines: &[&str]) -> String {
    let before = bench.files();
    let mut text = String::new();
    for line in command_lines {
        let arguments: Vec<&str> = line.split(' ').collect();
        let ran = bench.run(&arguments);
        assert_eq!(ran.stdout, "", "{line}");
        assert_eq!(ran.stderr.lines().count(), 1, "{line}: {}", ran.stderr);
        let message = ran.stderr.trim_end().strip_prefix("ptm: ").unwrap();
        assert_eq!(bench.files(), before, "{line} left something behind");
        text.push_str(&format!("{line}\n  {}: {message}\n", ran.code));
    }
    text
}

#[test]
fn bad_flags() {
    let lines = [
        "sample good.csv --bad 1",
        "sample good.csv --sigma-o",
        "sample good.csv --sigma-o 0",
        "sample good.csv --sigma-o nan",
        "sample good.csv --penalty-height -1",
        "sample good.csv --samples 0",
        "sample good.csv --chains 1000000000000",
        "sample good.csv --importance-samples 1000000000000",
        "sample good.csv --moves gibbs=1",
        "sample good.csv --moves split-merge=0",
        "sample good.csv --moves reassign=1",
        "sample good.csv --moves anchors=1,refresh=0",
        "sample good.csv --split prefix-cut",
        "sample good.csv --estimator common --arithmetic linear",
        "sample good.csv --estimator explicit --split prefix-cut",
        "sample good.csv --estimator explicit --optimum bfgs",
        "sample good.csv --estimator fresh --temperatures 3",
        "sample good.csv --estimator explicit --moves anchors",
        "sample good.csv --estimator common --moves flip,site",
        "sample good.csv --prior poisson:-1",
        "sample good.csv --optimum lbfgs",
        "sample good.csv --optimum bfgs --model covariance",
        "exact good.csv --optimum newton --sigma-o 2000",
        "sample good.csv --corner-kinds confusion:0.7",
        "sample good.csv --corner-kinds confusion:0.1",
        "sample good.csv --threads 0",
        "sample good.csv --threads 100000",
        "sample good.csv --init truths",
        "sample",
        "sampel",
        "simulate --replicate 0",
        "simulate --world nowhere",
        "completions basic",
        "-q -v plan good.toml",
    ];
    insta::assert_snapshot!(transcript(&bench(), &lines), @r#"
    sample good.csv --bad 1
      1: unexpected argument '--bad' found; to pass '--bad' as a value, use '-- --bad'
    sample good.csv --sigma-o
      1: a value is required for '--sigma-o <SIGMA_O>' but none was supplied; ptm --help shows what there is
    sample good.csv --sigma-o 0
      1: --sigma-o: got 0, expected a number > 0 (m)
    sample good.csv --sigma-o nan
      1: --sigma-o: got nan, expected a number > 0 (m); it has to be finite
    sample good.csv --penalty-height -1
      1: --penalty-height: got -1, expected a number >= 0 (nats)
    sample good.csv --samples 0
      1: --samples: got 0, expected a whole number from 1 to 1000000000000
    sample good.csv --chains 1000000000000
      1: --chains: got 1000000000000, expected a whole number from 1 to 1000000
    sample good.csv --importance-samples 1000000000000
      1: --importance-samples: got 1000000000000, expected a whole number from 1 to 1000000
    sample good.csv --moves gibbs=1
      1: --moves: got "gibbs=1", expected moves out of split-merge, reassign, pair-reassign, anchors, refresh, sequential-allocation, restricted-gibbs, site, flip, slice, group, cut, as in split-merge=0.5,reassign=0.5
    sample good.csv --moves split-merge=0
      1: --moves: got "split-merge=0", expected at least one weight above 0
    sample good.csv --moves reassign=1
      1: --moves: got "reassign=1", expected split-merge, anchors, sequential-allocation, restricted-gibbs or site among the moves: the others alone do not reach every topology
    sample good.csv --moves anchors=1,refresh=0
      1: moves: got refresh=0 with estimator common, expected a weight above 0, or no refresh at all to have 0.2: without it the draws would stay as they are
    sample good.csv --split prefix-cut
      1: split: got prefix-cut with estimator common, expected uniform, or estimator fresh, which the report's program had
    sample good.csv --estimator common --arithmetic linear
      1: arithmetic: got linear with estimator common, expected log, or estimator fresh, which the report's program had
    sample good.csv --estimator explicit --split prefix-cut
      1: split: got prefix-cut with estimator explicit, expected uniform, or estimator fresh, which the report's program had
    sample good.csv --estimator explicit --optimum bfgs
      1: optimum: got bfgs with estimator explicit, expected closed-form, or estimator common or fresh, which an optimiser can check
    sample good.csv --estimator fresh --temperatures 3
      1: temperatures: got 3 with estimator fresh, expected 1, or estimator common or explicit: only draws or locations that are kept have a weight at another temperature
    sample good.csv --estimator explicit --moves anchors
      1: moves: got anchors with estimator explicit, expected auto, or moves out of split-merge, site, flip, slice, group, cut
    sample good.csv --estimator common --moves flip,site
      1: moves: got site with estimator common, expected auto, or moves out of split-merge, reassign, pair-reassign, anchors, refresh, sequential-allocation, restricted-gibbs
    sample good.csv --prior poisson:-1
      1: --prior: got "poisson:-1", expected uniform, poisson:λ or dirichlet-process:α with a number > 0
    sample good.csv --optimum lbfgs
      1: --optimum: got "lbfgs", expected closed-form, bfgs or newton
    sample good.csv --optimum bfgs --model covariance
      1: optimum: got bfgs with model covariance, expected closed-form, or model metric: no other model has a choice of optimiser
    exact good.csv --optimum newton --sigma-o 2000
      1: optimum: got newton with sigma_o/sigma_t 2e3, expected closed-form, or a ratio between 1/1000 and 1000
    sample good.csv --corner-kinds confusion:0.7
      1: --corner-kinds: got "confusion:0.7", expected off, confusion:P or confusion:P,Q with probabilities above 0 and up to 0.5 (P of an open corner seen as closed, Q of a closed one seen as open)
    sample good.csv --corner-kinds confusion:0.1
      65: model: got corner_kinds confusion:0.1 and detections without any kind, expected the column corner (open or closed) where it is known; add it, or use corner_kinds off
    sample good.csv --threads 0
      1: --threads: got 0, expected a whole number from 1 to 1024
    sample good.csv --threads 100000
      1: --threads: got 100000, expected a whole number from 1 to 1024
    sample good.csv --init truths
      1: --init: got "truths", expected apart, singletons, one-cluster, random, truth or file:PATH
    sample
      1: the following required arguments were not provided: <FILE>; ptm --help shows what there is
    sampel
      1: unrecognized subcommand 'sampel'; a similar subcommand exists: 'sample'
    simulate --replicate 0
      1: --replicate: got 0, expected a whole number >= 1
    simulate --world nowhere
      1: world: got "nowhere", expected square-ring, office, office:ROWSxCOLUMNS or a path ending in .toml; write office if that is meant
    completions basic
      1: invalid value 'basic' for '<SHELL>' [possible values: bash, elvish, fish, powershell, zsh]; a similar value exists: 'bash'
    -q -v plan good.toml
      1: the argument '--quiet' cannot be used with '--verbose...'; ptm --help shows what there is
    "#);
}

#[test]
fn bad_detections() {
    let bench = bench();
    let files: [(&str, &[u8]); 13] = [
        ("empty.csv", b""),
        ("blank.csv", b"\n\n"),
        ("header.csv", b"x,y\n"),
        ("no-y.csv", b"x\n1\n"),
        ("z.csv", b"x,z\n1,2\n"),
        ("nan.csv", b"x,y\n0,0\nNaN,1\n"),
        ("inf.csv", b"x,y\n0,1e309\n"),
        ("text.csv", b"x,y\n0,zero\n"),
        ("short.csv", b"x,y,landmark\n0,0\n"),
        ("cov.csv", b"x,y,cov_xx,cov_xy,cov_yy\n0,0,1,2,1\n"),
        (
            "huge-cov.csv",
            b"x,y,cov_xx,cov_xy,cov_yy\n0,0,1e300,0,1e300\n",
        ),
        ("half-cov.csv", b"x,y,cov_xx\n0,0,1\n"),
        ("latin.csv", b"x,y\n0,\xe9\n"),
    ];
    let mut lines = vec!["sample missing.csv".to_owned(), "sample .".to_owned()];
    for (name, content) in files {
        bench.write(name, content);
        lines.push(format!("sample {name}"));
    }
    bench.write("untold.csv", "x,y\n0,0\n1,1\n");
    bench.write("labels.txt", "0,0,1");
    bench.write("words.txt", "none");
    for start in ["file:labels.txt", "file:words.txt", "file:missing.txt"] {
        lines.push(format!("sample good.csv --init {start}"));
    }
    lines.push("sample untold.csv --init truth".to_owned());
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(transcript(&bench, &lines), @r#"
    sample missing.csv
      1: missing.csv: cannot be read (No such file or directory (os error 2)); check the path and its permissions
    sample .
      1: .: cannot be read (Is a directory (os error 21)); check the path and its permissions
    sample empty.csv
      65: empty.csv, line 1: got a blank file, expected a header with the columns x,y; add one
    sample blank.csv
      65: blank.csv, line 1: got a blank file, expected a header with the columns x,y; add one
    sample header.csv
      65: header.csv: got no detections, expected at least one row below the header; add a row for each
    sample no-y.csv
      65: no-y.csv, line 1: got x in the header, expected the columns x,y; add the column y (m)
    sample z.csv
      65: z.csv, line 1: got x,z in the header, expected the columns x,y; add the column y (m)
    sample nan.csv
      65: nan.csv, line 3, column x: got "NaN", expected a finite number; correct the value or remove the row
    sample inf.csv
      65: inf.csv, line 2, column y: got "1e309", expected a finite number; correct the value or remove the row
    sample text.csv
      65: text.csv, line 2, column y: got "zero", expected a number; correct the value or remove the row
    sample short.csv
      65: short.csv, line 2: got 2 fields, expected 3 as in the header; write one field per column, separated by commas, with a decimal point
    sample cov.csv
      65: cov.csv, line 2, column cov_xx,cov_xy,cov_yy: got 1,2,1 with determinant -3, expected a positive definite covariance (cov_xx > 0, determinant > 0); correct the values, or remove the three columns to do without covariances
    sample huge-cov.csv
      65: huge-cov.csv, line 2, column cov_xx,cov_xy,cov_yy: got 1e300,0,1e300 with determinant inf, expected a positive definite covariance (cov_xx > 0, determinant > 0); correct the values, or remove the three columns to do without covariances
    sample half-cov.csv
      65: half-cov.csv, line 1: got cov_xx without cov_xy,cov_yy in the header, expected cov_xx,cov_xy,cov_yy all three or none; add cov_xy,cov_yy or remove cov_xx
    sample latin.csv
      65: latin.csv, line 2: got bytes that are not UTF-8, expected UTF-8 text; save the file as UTF-8
    sample good.csv --init file:labels.txt
      65: init: labels.txt: got 3 labels, expected 4; write one for each detection
    sample good.csv --init file:words.txt
      65: init: words.txt: label 0: got "none", expected a whole number; write one label per detection, as in 0,0,1,2
    sample good.csv --init file:missing.txt
      1: init: missing.txt: cannot be read (No such file or directory (os error 2)); check the path
    sample untold.csv --init truth
      1: init: got truth, but no detection's landmark is known; choose another start
    "#);
}

/// As root every folder can be written, so what cannot be written is a path below a file.
#[test]
fn outputs_that_cannot_be_written_or_would_replace_each_other() {
    let lines = [
        "sample good.csv --json good.toml/out.json",
        "sample good.csv --trace good.toml/out.parquet",
        "sample good.csv --figure good.toml/out.png",
        "sample good.csv --json good.csv",
        "sample good.csv --json ./out --trace out",
        "simulate --out good.toml/out.csv",
        "simulate --out a.png",
        "sweep good.toml --out good.csv/report",
        "sweep good.toml --out good.csv",
        "sample good.csv --map good.toml",
        "evaluate good.csv --out good.toml/a",
        "report good.csv",
        "report missing",
    ];
    insta::assert_snapshot!(transcript(&bench(), &lines), @"
    sample good.csv --json good.toml/out.json
      1: good.toml/out.json: cannot be written (Not a directory (os error 20)); choose another place
    sample good.csv --trace good.toml/out.parquet
      1: good.toml/out.parquet: cannot be written (Not a directory (os error 20)); choose another place
    sample good.csv --figure good.toml/out.png
      1: good.toml/out.png: cannot be written (Not a directory (os error 20)); choose another place
    sample good.csv --json good.csv
      1: good.csv: is already the place of another file of this run; choose another
    sample good.csv --json ./out --trace out
      1: out: is already the place of another file of this run; choose another
    simulate --out good.toml/out.csv
      1: good.toml/out.csv: cannot be written (Not a directory (os error 20)); choose another place
    simulate --out a.png
      1: a.png: is already the place of another file of this run; choose another
    sweep good.toml --out good.csv/report
      1: good.csv is a file, not a folder; give the path of a folder
    sweep good.toml --out good.csv
      1: good.csv is a file, not a folder; give the path of a folder
    sample good.csv --map good.toml
      1: good.toml is a file, not a folder; give the path of a folder
    evaluate good.csv --out good.toml/a
      1: good.toml is a file, not a folder; give the path of a folder
    report good.csv
      1: good.csv is a file, not a folder; give the path of a folder
    report missing
      1: missing/run.json: got no such file (No such file or directory (os error 2)), expected the run.json of a sweep; give the folder of a report
    ");
}

#[test]
fn bad_sweeps() {
    let bench = bench();
    let changed = |old: &str, new: &str| {
        assert!(SMALL_SWEEP.contains(old), "{old}");
        SMALL_SWEEP.replace(old, new)
    };
    let many_levels: Vec<String> = (1..=100).map(|level| level.to_string()).collect();
    let many_levels = many_levels.join(",");
    let keys = [
        "penalty_radius",
        "penalty_height",
        "sigma_o",
        "sigma_t",
        "noise",
        "laps",
    ];
    let trillion: String = keys
        .map(|key| format!("{key} = [{many_levels}]\n"))
        .concat();
    let (head, _) = SMALL_SWEEP.split_once("penalty_radius").unwrap();
    let sweeps = [
        ("no-toml", "x,y\n0,0\n".to_owned()),
        ("bom-no-toml", "\u{feff}a b = 3\n".to_owned()),
        (
            "unknown-key",
            changed("importance_samples", "importance_sample"),
        ),
        ("unknown-table", changed("[sampler]", "[smapler]")),
        (
            "unknown-factor",
            changed("penalty_radius", "penalty_radios"),
        ),
        (
            "wrong-table",
            changed("importance_samples = 5", "noise = 5"),
        ),
        (
            "zero-sigma",
            changed("importance_samples = 5", "[model]\nsigma_o = 0"),
        ),
        ("zero-level", changed("[1, 10]", "[0, 10]")),
        ("twice", changed("[1, 10]", "[1, 1.0]")),
        ("no-level", changed("[1, 10]", "[]")),
        ("no-factor", changed("penalty_radius", "chains")),
        ("no-design", "[run]\nsamples = 3\n".to_owned()),
        ("kind", changed("\"grid\"", "\"gird\"")),
        ("array", changed("samples = 300", "samples = [300]")),
        ("trillion", format!("{head}{trillion}")),
        (
            "chains",
            changed("chains = 2", "chains = 1000000")
                .replace("replicates = 2", "replicates = 1000000"),
        ),
        ("world", changed("noise = 0.8", "world = \"nowhere.toml\"")),
        (
            "no-data",
            changed("noise = 0.8", "detections = \"missing.csv\""),
        ),
        (
            "world-and-csv",
            changed("noise = 0.8", "detections = \"good.csv\"").replace("penalty_radius", "noise"),
        ),
    ];
    let mut lines = vec!["sweep missing.toml --out out".to_owned()];
    for (name, content) in &sweeps {
        bench.write(&format!("{name}.toml"), content);
        lines.push(format!("sweep {name}.toml --out out"));
    }
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(transcript(&bench, &lines), @r#"
    sweep missing.toml --out out
      1: missing.toml: cannot be read (No such file or directory (os error 2)); give the path of a sweep file, as in sweeps/noisy.toml
    sweep no-toml.toml --out out
      65: no-toml.toml:1:2: key with no value, expected `=`
    sweep bom-no-toml.toml --out out
      65: bom-no-toml.toml:1:3: key with no value, expected `=`
    sweep unknown-key.toml --out out
      65: unknown-key.toml: [sampler] importance_sample: no such setting; did you mean importance_samples?
    sweep unknown-table.toml --out out
      65: unknown-table.toml:5:2: unknown field `smapler`, expected one of `title`, `description`, `needs_data`, `only_cells`, `data`, `model`, `sampler`, `run`, `design`
    sweep unknown-factor.toml --out out
      65: unknown-factor.toml: [design.factors] penalty_radios: no such setting; did you mean penalty_radius?
    sweep wrong-table.toml --out out
      65: wrong-table.toml: [sampler] noise: belongs into [data]; move it there
    sweep zero-sigma.toml --out out
      65: zero-sigma.toml: [model] sigma_o: got 0, expected a number > 0 (m)
    sweep zero-level.toml --out out
      65: zero-level.toml: [design.factors] penalty_radius: got 0, expected a number > 0 (m)
    sweep twice.toml --out out
      65: twice.toml: [design] penalty_radius: got the level 1 twice; name each once
    sweep no-level.toml --out out
      65: no-level.toml: [design] penalty_radius: got no level, expected a list of at least one
    sweep no-factor.toml --out out
      65: no-factor.toml: [design.factors] chains: cannot differ between cells; set it once, in [run]
    sweep no-design.toml --out out
      65: no-design.toml:1:1: missing field `design`
    sweep kind.toml --out out
      65: kind.toml: [design] kind: got "gird", expected grid, one-at-a-time, list, latin-hypercube, sobol, morris, sobol-indices; did you mean grid?
    sweep array.toml --out out
      65: array.toml: [run] samples: got array [300], expected a number or a text
    sweep trillion.toml --out out
      65: trillion.toml: [design] got 1000000000000 cells, expected at most 1000000; name fewer levels or points
    sweep chains.toml --out out
      65: chains.toml: [design] got 4000000000000 chains (cells x replicates x chains), expected at most 10000000; ask for fewer
    sweep world.toml --out out
      65: world.toml: [data] world: cannot read the world from nowhere.toml: No such file or directory (os error 2); check the path and its permissions
    sweep no-data.toml --out out
      65: no-data.toml: [data] detections: missing.csv: cannot be read (No such file or directory (os error 2)); check the path and its permissions
    sweep world-and-csv.toml --out out
      65: world-and-csv.toml: [design] noise: a setting of simulated worlds, but [data] detections names a CSV; leave the factor out or simulate a world
    "#);
    assert!(!bench.exists("out"), "no half-written report");
}

#[test]
fn folders_of_others_are_left_alone() {
    let bench = bench();
    bench.write("other.toml", SMALL_SWEEP.replace("seed = 5", "seed = 6"));
    bench.ok(&["-q", "sweep", "good.toml", "--out", "done"]);
    bench.ok(&[
        "-q",
        "sweep",
        "good.toml",
        "--data",
        "good.csv",
        "--out",
        "on-csv",
    ]);
    bench.write("better.csv", pairs_csv(6));
    bench.write("mine/figures/holiday.png", "precious");
    let lines = [
        "sweep other.toml --out done",
        "sweep good.toml --data better.csv --out on-csv",
        "sweep good.toml --out mine",
        "sweep good.toml --out mine --force",
        "report mine",
        "report done --cell c999",
        "report done --cell",
    ];
    insta::assert_snapshot!(transcript(&bench, &lines), @"
    sweep other.toml --out done
      1: done: the folder holds another sweep or other data (good); choose another with --out, or take it over with --force, which keeps 0 of the 16 chains of this sweep and leaves 16 other chains out of the tables
    sweep good.toml --data better.csv --out on-csv
      1: on-csv: the folder holds another run of this sweep, on good.csv; choose another with --out, or take it over with --force, which keeps 0 of the 8 chains of this sweep and leaves 8 other chains out of the tables
    sweep good.toml --out mine
      1: mine: the folder holds files that are no sweep's; choose another with --out
    sweep good.toml --out mine --force
      1: mine: the folder holds files that are no sweep's; choose another with --out
    report mine
      1: mine/run.json: got no such file (No such file or directory (os error 2)), expected the run.json of a sweep; give the folder of a report
    report done --cell c999
      1: --cell: got c999, expected one of c001 to c004
    report done --cell
      1: a value is required for '--cell <ID>' but none was supplied; ptm --help shows what there is
    ");
    // What was refused is still whole, and --force replaces all of it.
    bench.ok(&["-q", "sweep", "good.toml", "--out", "done"]);
    let key = |bench: &Bench| bench.read("done/chains.csv");
    let before = key(&bench);
    bench.ok(&["-q", "sweep", "other.toml", "--out", "done", "--force"]);
    assert_ne!(key(&bench), before);
    assert!(bench.read("done/sweep.toml").contains("seed = 6"));
}

#[test]
fn a_damaged_journal_is_refused_in_one_line() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "good.toml", "--out", "done"]);
    let journal = bench.read("done/journal.jsonl");
    bench.write(
        "done/journal.jsonl",
        journal.replacen("\"done\"", "\"DONE\"", 1),
    );
    let lines = ["sweep good.toml --out done", "report done"];
    insta::assert_snapshot!(transcript(&bench, &lines), @"
    sweep good.toml --out done
      65: done/journal.jsonl:1: got a damaged record, expected what a sweep wrote; move the file away and run the sweep again, or restore it
    report done
      65: done/journal.jsonl:1: got a damaged record, expected what a sweep wrote; move the file away and run the sweep again, or restore it
    ");
}

/// `ptm … | head` is no bug, and a full disk is the user's to clear.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_takes_nothing() {
    let bench = bench();
    let arguments = ["sample", "good.csv", "--samples", "50", "--json", "-"];
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let output = bench.command(&arguments).stdout(full).output().unwrap();
    let ran = common::ran(&output);
    assert_eq!(ran.code, 1);
    insta::assert_snapshot!(ran.stderr.trim_end(), @"ptm: standard output: cannot be written (No space left on device (os error 28)); choose another place");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = bench.command(&arguments).stdout(writer).output().unwrap();
    let ran = common::ran(&output);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
}

/// What was written is what a message repeats, in flags of settings and of commands.
#[test]
fn numbers_are_repeated_as_they_were_written() {
    let lines = [
        "sample good.csv --samples 1e4.5",
        "sample good.csv --samples 10_000",
        "sample good.csv --sigma-o 1,5",
        "sample good.csv --sigma-o 1e400",
        "sample good.csv --burn-in 1_000",
        "sample good.csv --top 2.50",
        "sample good.csv --threads 1e4",
        "exact good.csv --tolerance nan",
        "exact good.csv --max-draws -1e3",
        "sweep good.toml --shards 1_0",
        "sweep good.toml --max-seconds 1,5",
        "simulate --replicate 0.5",
        "plan string.toml",
        "plan float.toml",
        "plan level.toml",
        "plan points.toml",
    ];
    let bench = bench();
    let sweep = |base: &str, design: &str| format!("{base}\n[design]\n{design}\n");
    let grid = "kind = 'grid'\n[design.factors]\nsigma_o = [1]";
    bench.write("string.toml", sweep("[run]\nsamples = '1e4'", grid));
    bench.write("float.toml", sweep("[run]\nsamples = 1_0.50e0", grid));
    bench.write(
        "level.toml",
        sweep("", "kind = 'grid'\n[design.factors]\nsamples = [1e4, 2.50]"),
    );
    bench.write(
        "points.toml",
        sweep(
            "",
            "kind = 'sobol'\npoints = 1e-1\n[design.factors]\nsigma_o = {low = 1, high = 2}",
        ),
    );
    insta::assert_snapshot!(transcript(&bench, &lines), @r#"
    sample good.csv --samples 1e4.5
      1: --samples: got 1e4.5, expected a whole number from 1 to 1000000000000
    sample good.csv --samples 10_000
      1: --samples: got 10_000, expected a whole number from 1 to 1000000000000; write 10000
    sample good.csv --sigma-o 1,5
      1: --sigma-o: got 1,5, expected a number > 0 (m); write 1.5 with a decimal point
    sample good.csv --sigma-o 1e400
      1: --sigma-o: got 1e400, expected a number > 0 (m); no number may be above 1.8e308
    sample good.csv --burn-in 1_000
      1: --burn-in: got "1_000", expected auto or a whole number of proposals; write 1000
    sample good.csv --top 2.50
      1: --top: got 2.50, expected a whole number
    sample good.csv --threads 1e4
      1: --threads: got 1e4, expected a whole number from 1 to 1024
    exact good.csv --tolerance nan
      1: --tolerance: got nan, expected a number > 0; it has to be finite
    exact good.csv --max-draws -1e3
      1: --max-draws: got -1e3, expected a number > 0
    sweep good.toml --shards 1_0
      1: --shards: got 1_0, expected a whole number >= 1; write 10
    sweep good.toml --max-seconds 1,5
      1: --max-seconds: got 1,5, expected a number > 0; write 1.5 with a decimal point
    simulate --replicate 0.5
      1: --replicate: got 0.5, expected a whole number >= 1
    plan string.toml
      65: string.toml: [run] samples: got "1e4", expected a whole number from 1 to 1000000000000; write 1e4 without quotes
    plan float.toml
      65: float.toml: [run] samples: got 1_0.50e0, expected a whole number from 1 to 1000000000000
    plan level.toml
      65: level.toml: [design.factors] samples: got 2.50, expected a whole number from 1 to 1000000000000
    plan points.toml
      65: points.toml: [design] points: got 1e-1, expected a whole number
    "#);
}

/// Whole numbers in scientific notation, wherever there are whole numbers.
#[test]
fn counts_in_scientific_notation_are_taken() {
    let bench = bench();
    let sweep = "[run]\nsamples = 1e3\nburn_in = 1e2\nchains = 2.0\n[design]\nkind = 'grid'\n\
                 [design.factors]\nmin_sightings = [1e0, 0.2e1]\n";
    bench.write("counts.toml", sweep);
    let planned = bench.run(&["plan", "counts.toml", "--threads", "1e0"]);
    assert_eq!(planned.code, 0, "{}", planned.stderr);
    let arguments = "sample good.csv --samples 1e3 --chains 1e0 --burn-in 1e1 --top 1e0 --json -";
    let sampled = bench.run(&arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(sampled.code, 0, "{}", sampled.stderr);
    assert!(
        sampled.stdout.contains("\"samples\":1000"),
        "{}",
        sampled.stdout
    );
}

/// A world or a CSV that a sweep file names is told with the file, the section and the key.
#[test]
fn what_a_sweep_file_names_is_told_with_its_place() {
    let bench = bench();
    let grid = |factors: &str| format!("[design]\nkind = 'grid'\n[design.factors]\n{factors}\n");
    bench.write("factor.toml", grid("world = ['nowhere']"));
    bench.write(
        "base.toml",
        format!("[data]\nworld = 'none.toml'\n{}", grid("sigma_o = [1]")),
    );
    bench.write(
        "csv.toml",
        format!("[data]\ndetections = 'no.csv'\n{}", grid("sigma_o = [1]")),
    );
    bench.write(
        "list.toml",
        "[design]\nkind = 'list'\n[[design.cells]]\nworld = 'office:0x1'\n[[design.cells]]\nlaps = 2\n",
    );
    bench.write("afile", "");
    let lines = [
        "plan factor.toml",
        "sweep base.toml",
        "plan csv.toml",
        "plan list.toml",
        "plan factor.toml --data no.csv",
        "sweep good.toml --out afile",
    ];
    insta::assert_snapshot!(transcript(&bench, &lines), @r#"
    plan factor.toml
      65: factor.toml: [design.factors] world: got "nowhere", expected square-ring, office, office:ROWSxCOLUMNS or a path ending in .toml; write office if that is meant
    sweep base.toml
      65: base.toml: [data] world: cannot read the world from none.toml: No such file or directory (os error 2); check the path and its permissions
    plan csv.toml
      65: csv.toml: [data] detections: no.csv: cannot be read (No such file or directory (os error 2)); check the path and its permissions
    plan list.toml
      65: list.toml: [design.cells] world: got "office:0x1", expected office:ROWSxCOLUMNS with whole numbers from 1 to 100; write for instance office:2x5
    plan factor.toml --data no.csv
      1: no.csv: cannot be read (No such file or directory (os error 2)); check the path and its permissions
    sweep good.toml --out afile
      1: afile is a file, not a folder; give the path of a folder
    "#);
}
