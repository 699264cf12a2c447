//! What other programs make of our files: a browser of the report, ArviZ of the draws. Each is skipped, and
//! says so, where the program is missing.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a skipped test must say so")]

mod common;

use std::path::Path;
use std::process::Command;

use common::{Bench, SMALL_SWEEP, rows};

/// Runs a script of `tests/scripts` with the first of these Pythons that there is; its output if it succeeded,
/// `None`, said aloud, if there is no Python.
fn python(script: &str, arguments: &[&Path]) -> Option<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/scripts")
        .join(script);
    let own = std::env::var("PTM_PYTHON").ok();
    let names = own.iter().map(String::as_str).chain(["python3", "python"]);
    for name in names {
        let Ok(output) = Command::new(name).arg(&path).args(arguments).output() else {
            continue;
        };
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let complained = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{script}: {said}{complained}");
        if said.contains("SKIPPED") {
            eprintln!("{script}: {said}");
        }
        return Some(said);
    }
    eprintln!("SKIPPED: {script}: no Python");
    None
}

/// Links, pictures, sorting and filters, light and dark, 390 px and 1600 px wide, without a complaint.
#[test]
fn a_browser_has_nothing_to_complain_of() {
    let bench = Bench::new();
    let text = SMALL_SWEEP.replace("title = \"Small\"", "title = \"A <b>title</b> & more\"");
    bench.write("small.toml", text.replace("[1, 10]", "[1, 3, 10]"));
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    python("browser.py", &[&bench.path("out")]);
}

/// A list with labels that are markup, failed chains among them, and more cells than are shown at once.
#[test]
fn a_browser_takes_hostile_labels_and_many_cells() {
    let bench = Bench::new();
    let cell = |k: usize| {
        let label = match k {
            0 => "</script><script>alert(1)</script>".to_owned(),
            1 => "<img src=http://example.invalid/x.png>".to_owned(),
            k => format!("a & b {k}"),
        };
        let failing = if k == 3 {
            "min_sightings = 1000000\n"
        } else {
            ""
        };
        format!(
            "[[design.cells]]\nlabel = '{label}'\nsigma_o = {}\n{failing}",
            1.0 + k as f64
        )
    };
    let cells: String = (0..130).map(cell).collect();
    let head = "[run]\nsamples = 20\nchains = 1\n[design]\nkind = \"list\"\n";
    bench.write("many.toml", head.to_owned() + &cells);
    let ran = bench.run(&["-q", "sweep", "many.toml", "--out", "out"]);
    assert_eq!(ran.code, 2, "one cell fails: {}", ran.stderr);
    python("browser.py", &[&bench.path("out")]);
}

/// R-hat, ESS and means of the exported draws are those of our own table.
#[test]
fn arviz_reads_the_draws() {
    let bench = Bench::new();
    let sweep = SMALL_SWEEP
        .replace("samples = 300", "samples = 900")
        .replace("chains = 2", "chains = 4");
    bench.write("small.toml", &sweep);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let found = rows(&bench.read("out/convergence.csv"));
    let moves = |row: &&std::collections::BTreeMap<String, String>| {
        row["n_sets_ess_bulk_state"] == "defined" && row["world"] == "1"
    };
    let cell = &found.iter().find(moves).unwrap()["cell"];
    bench.ok(&["-q", "export", "out", "--cell", cell, "--out", "draws.json"]);
    let said = python(
        "arviz_check.py",
        &[&bench.path("draws.json"), &bench.path("out")],
    );
    if let Some(said) = said {
        assert!(
            said.contains("ArviZ agrees") || said.contains("SKIPPED"),
            "{said}"
        );
    }

    // The same draws in long form.
    bench.ok(&["-q", "export", "out", "--cell", cell, "--out", "draws.csv"]);
    let long = rows(&bench.read("draws.csv"));
    let json: serde_json::Value = serde_json::from_str(&bench.read("draws.json")).unwrap();
    let attrs = &json["attrs"];
    let chains = json["posterior"]["n_sets"].as_array().unwrap();
    assert_eq!(chains.len(), 4);
    let first: Vec<_> = long
        .iter()
        .filter(|row| row["world"] == "1" && row["chain"] == "2")
        .collect();
    let draws = chains[1].as_array().unwrap();
    assert_eq!(first.len(), draws.len());
    for (row, draw) in first.iter().zip(draws) {
        assert_eq!(row["n_sets"], draw.to_string());
    }
    let left_out = attrs["proposals_left_out"].as_u64().unwrap();
    assert_eq!(first[0]["proposal"], (left_out + 1).to_string());
    assert_eq!(first.last().unwrap()["proposal"], "900");
    // Parquet holds the same, and a name without an ending is refused before anything is read.
    bench.ok(&["-q", "export", "out", "--out", "draws.parquet"]);
    assert_eq!(
        &std::fs::read(bench.path("draws.parquet")).unwrap()[..4],
        b"PAR1"
    );
    assert_eq!(bench.run(&["export", "out", "--out", "draws"]).code, 1);
    assert_eq!(bench.run(&["export", "out", "--out", "draws.json"]).code, 1);
}

/// The recipe of the documentation for draws of a trace, with pandas and NumPy.
#[test]
fn the_recipe_for_traces_works() {
    let bench = Bench::new();
    bench.write("pairs.csv", common::pairs_csv(4));
    let arguments = "-q sample pairs.csv --samples 2e3 --trace trace.parquet --json out.json";
    bench.ok(&arguments.split(' ').collect::<Vec<_>>());
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tables.md");
    let said = python("trace_recipe.py", &[&bench.path("trace.parquet"), &docs]);
    if let Some(said) = said {
        assert!(said.contains("works") || said.contains("SKIPPED"), "{said}");
    }
}

/// The schema of sweep files takes every shipped one, and refuses slips that the program refuses.
#[test]
fn the_schema_takes_the_shipped_sweeps_and_no_slips() {
    let bench = Bench::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let slips = [
        ("sigma_0 = 1", "model"),
        ("sigma_o = 0", "model"),
        ("sigma_o = \"1\"", "model"),
        ("samples = 0", "run"),
        ("samples = 2.5", "run"),
        ("sigma_o = 1", "run"),
    ];
    for (number, (line, section)) in slips.iter().enumerate() {
        let head = format!("[{section}]");
        let file = format!("slip{number}.toml");
        let text = if SMALL_SWEEP.contains(&head) {
            SMALL_SWEEP.replace(&head, &format!("{head}\n{line}"))
        } else {
            SMALL_SWEEP.replace("[design]", &format!("{head}\n{line}\n[design]"))
        };
        let text = text.replace(
            "samples = 300\n",
            if *section == "run" {
                ""
            } else {
                "samples = 300\n"
            },
        );
        bench.write(&file, text);
        assert_ne!(bench.run(&["plan", &file]).code, 0, "{line}");
    }
    let (schema, sweeps) = (root.join("docs/sweep.schema.json"), root.join("sweeps"));
    let said = python("schema_check.py", &[&schema, &sweeps, &bench.path("")]);
    if let Some(said) = said {
        assert!(
            said.contains("agrees") || said.contains("SKIPPED"),
            "{said}"
        );
    }
}
