//! What the documents say of the program is what the program says of itself.

mod common;

#[test]
fn the_documented_keys_are_the_keys() {
    let documented = include_str!("../docs/sweep.md");
    let table = topometric::settings::keys_table();
    assert!(
        documented.ends_with(&table),
        "docs/sweep.md ends with an old table: replace it by what `ptm sweep --print-keys` prints"
    );
}

#[test]
fn the_schema_beside_the_documents_is_the_schema() {
    let written = format!("{:#}\n", topometric::sweep::schema());
    assert!(
        include_str!("../docs/sweep.schema.json") == written,
        "docs/sweep.schema.json is old: replace it by what `ptm sweep --print-schema` prints"
    );
}

/// Every column that a sweep writes is described, and every verdict and doubt has its advice.
#[test]
fn the_documented_columns_and_verdicts_are_the_columns_and_verdicts() {
    let bench = common::Bench::new();
    bench.write("small.toml", common::SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    bench.ok(&[
        "-q",
        "export",
        "out",
        "--cell",
        "c001",
        "--out",
        "draws.csv",
    ]);
    let documented = include_str!("../docs/tables.md");
    let keys = topometric::settings::keys_table();
    let tables = [
        "chains",
        "cells",
        "convergence",
        "topologies",
        "timings",
        "effects",
        "contrasts",
        "interactions",
    ];
    let screening = common::SMALL_SWEEP
        .replace("kind = \"grid\"", "kind = \"morris\"\ntrajectories = 2")
        .replace("[1, 10]", "{ low = 1, high = 10 }");
    bench.write("screening.toml", screening);
    bench.ok(&["-q", "sweep", "screening.toml", "--out", "screening"]);
    let files = tables.map(|table| format!("out/{table}.csv"));
    let others = ["draws.csv", "screening/indices.csv"];
    for file in files.iter().map(String::as_str).chain(others) {
        let text = bench.read(file);
        for column in text.lines().next().unwrap_or_default().split(',') {
            let counted = ["_proposed", "_accepted", "_impossible"];
            let column = match counted.iter().find(|end| column.ends_with(*end)) {
                Some(end) => format!("MOVE{end}"),
                None => column.trim_end_matches("_state").to_owned(),
            };
            let is_key = keys.contains(&format!("| `{column}` |"));
            assert!(
                is_key || documented.contains(&format!("`{column}`")),
                "docs/tables.md says nothing of {column} in {file}"
            );
        }
    }
    let advice = include_str!("../docs/convergence.md");
    let page = bench.read("out/index.html");
    for verdict in topometric::results::CellVerdict::ALL {
        let row = format!("| {} |", verdict.words());
        assert!(advice.contains(&row), "docs/convergence.md: {row}");
    }
    let doubts = page.split("By doubt").nth(1).unwrap_or_default();
    let kinds: Vec<&str> = doubts
        .split("<tr><td><code>")
        .skip(1)
        .filter_map(|row| row.split("</code>").next())
        .collect();
    assert!(kinds.len() >= 10, "{kinds:?}");
    for kind in kinds {
        assert!(
            advice.contains(&format!("| `{kind}`")),
            "docs/convergence.md: {kind}"
        );
    }
}
