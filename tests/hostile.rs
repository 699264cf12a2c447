//! Nothing in a file makes a reader panic, hang or swallow memory: what `just fuzz` does for hours, for a moment.
//!
//! Readers of recordings have theirs in `src/import/tests/bytes.rs`.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, SMALL_SWEEP};
use proptest::prelude::*;
use topometric::detections::Detections;
use topometric::run::Contents;
use topometric::sweep::Sweep;
use topometric::world::World;

/// One line, and short enough to read whatever was in the file.
fn readable(error: &impl ToString) {
    let text = error.to_string();
    assert!(!text.contains('\n') && text.len() < 2000, "{text}");
}

fn sweep(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match Sweep::parse(&text, "f", "f", None) {
        Ok(sweep) => assert!(!sweep.cells.is_empty()),
        Err(error) => readable(&error),
    }
}

fn world(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match World::from_toml(&text, "f") {
        Ok(world) => assert!(!world.walls().is_empty()),
        Err(error) => readable(&error),
    }
}

fn detections(bytes: &[u8]) {
    match Detections::from_csv_reader(bytes, "f") {
        Ok(read) => {
            let text = read.to_csv_string();
            let back = Detections::from_csv_reader(text.as_bytes(), "g").expect("our own file");
            assert_eq!(back, read);
        }
        Err(error) => readable(&error),
    }
}

/// Gives the number of records, if the bytes are a journal.
fn journal(bytes: &[u8]) -> Option<usize> {
    match Contents::parse(bytes, "f") {
        Ok(contents) => {
            let (whole, torn) = bytes.split_at(contents.good_length);
            assert!(!torn.contains(&b'\n'));
            let n = whole.iter().filter(|&&byte| byte == b'\n').count();
            assert_eq!(contents.records.len(), n);
            Some(n)
        }
        Err(error) => {
            readable(&error);
            None
        }
    }
}

const WORLD: &str = "outer = [[[-10, -10], [45, -10], [45, 45], [-10, 45]]]
obstacles = [[[10, 10], [25, 10], [25, 25], [10, 25]]]
waypoints = [[0, 0], [35, 0], [35, 35], [0, 35]]
";
const CSV: &str = "x,y,cov_xx,cov_xy,cov_yy,first_seen,last_seen,corner,landmark
0,1,1,0,1,0,2.5,open,3
2,2,1,0.5,1,3,4,closed,
";

/// What a text is broken with: numbers at the edge, separators, halves of syntax.
fn splinter() -> impl Strategy<Value = Vec<u8>> {
    let words = vec![
        "1e308",
        "-1e308",
        "1e-320",
        "-0",
        "NaN",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "0x7f",
        "18446744073709551616",
        "-9223372036854775809",
        "1_000",
        "\r\n",
        "\n",
        "\r",
        "\u{feff}",
        "\"",
        "\"\"",
        "'",
        "'''",
        ",",
        ",,",
        "[",
        "[[",
        "]",
        "]]",
        "{",
        "}",
        "=",
        "#",
        "\0",
        "é",
        "\\u",
        "x",
        "= [1, 2]",
        "[design.factors]\n",
        "cells",
        "true",
        "1979-05-27",
        "[0, 0], [0, 0]",
        ";",
    ];
    prop_oneof![
        4 => prop::sample::select(words).prop_map(|word| word.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 1..6),
    ]
}

/// A good text with some of it replaced.
fn broken(good: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let cut = (any::<prop::sample::Index>(), 0..12_usize, splinter());
    prop::collection::vec(cut, 1..6).prop_map(move |cuts| {
        let mut bytes = good.as_bytes().to_vec();
        for (place, length, splinter) in cuts {
            let from = place.index(bytes.len() + 1);
            let to = (from + length).min(bytes.len());
            bytes.splice(from..to, splinter);
        }
        bytes
    })
}

/// Two records, as a sweep writes them.
fn records() -> Vec<u8> {
    let bench = Bench::new();
    let cells = "[[design.cells]]\nsamples = 20\n[[design.cells]]\nmin_sightings = 1000000\n";
    let head = "[run]\nsamples = 20\nchains = 1\n[design]\nkind = \"list\"\n";
    bench.write("s.toml", head.to_owned() + cells);
    assert_eq!(bench.run(&["-q", "sweep", "s.toml", "--out", "o"]).code, 2);
    bench.read("o/journal.jsonl").into_bytes()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_sweep_files_are_refused(bytes in broken(SMALL_SWEEP)) {
        sweep(&bytes);
    }

    #[test]
    fn broken_world_files_are_refused(bytes in broken(WORLD)) {
        world(&bytes);
    }

    #[test]
    fn broken_detections_are_refused(bytes in broken(CSV)) {
        detections(&bytes);
    }

    #[test]
    fn any_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        sweep(&bytes);
        world(&bytes);
        detections(&bytes);
        journal(&bytes);
    }
}

/// Every byte of a journal changed, and every length: found, but for a last line that has lost its end.
#[test]
fn a_mutated_or_truncated_journal_is_never_skipped() {
    let bytes = records();
    assert_eq!(journal(&bytes), Some(2));
    let second = bytes.iter().position(|&byte| byte == b'\n').unwrap() + 1;
    for place in 0..bytes.len() {
        for bit in [0, 5] {
            let mut wrong = bytes.clone();
            wrong[place] ^= 1 << bit;
            let torn = place == bytes.len() - 1;
            assert_eq!(journal(&wrong), torn.then_some(1), "byte {place}");
        }
        let n = usize::from(place >= second);
        assert_eq!(journal(&bytes[..place]), Some(n), "length {place}");
    }
    // Lines of records that are none, with checksums that fit.
    for json in ["{}", "null", "[[[[", "{\"key\":1,\"status\":{}}", "\u{0}"] {
        let line = format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
        assert_eq!(journal(line.as_bytes()), None, "{json}");
    }
    let deep = "[".repeat(100_000);
    let line = format!("{:08x} {deep}\n", crc32fast::hash(deep.as_bytes()));
    assert_eq!(journal(line.as_bytes()), None);
}

#[test]
fn extreme_files_are_read_or_refused_in_a_line() {
    let columns = vec!["z"; 1_000_000].join(",");
    let wide = format!("x,y,{columns}\n1,2\n");
    let deep = "[".repeat(100_000);
    let keys: String = (0..100_000).map(|k| format!("k{k} = 1\n")).collect();
    let long = "9".repeat(1_000_000);
    let texts: Vec<Vec<u8>> = vec![
        wide.into(),
        format!("x,y\n{long},1\n").into(),
        format!("{}\n", "x".repeat(1_000_000)).into(),
        b"\xff\xfex\0,\0y\0".to_vec(),
        b"x,y\r\n1,2\r\n\"3\",\"4\"\r\n".to_vec(),
        "\u{feff}x,y\n-0,1e308\n".into(),
        b"x,y\nNaN,1\n".to_vec(),
        b"x,y\n1,\xff\n".to_vec(),
        b"x,y\n\"1,2\n".to_vec(),
        format!("[design]\nkind = {deep}").into(),
        format!("[model]\n{keys}").into(),
        format!("[model]\nsigma_o = {long}\n").into(),
        format!("[model]\nsigma_{} = 1\n", "o".repeat(100_000)).into(),
        format!("outer = {deep}").into(),
    ];
    let bench = Bench::new();
    for bytes in &texts {
        detections(bytes);
        sweep(bytes);
        world(bytes);
        // And as a user meets them: a line that can be read, however long what it cites.
        bench.write("f", bytes);
        bench.write("f.toml", bytes);
        for arguments in [
            &["sample", "f", "--samples", "10"][..],
            &["plan", "f"],
            &["simulate", "--world", "./f.toml"],
        ] {
            let ran = bench.run(arguments);
            assert!([0, 65].contains(&ran.code), "{arguments:?}: {}", ran.stderr);
            assert!(
                ran.code == 0 || ran.stderr.lines().count() == 1,
                "{}",
                ran.stderr
            );
            assert!(ran.stderr.chars().count() < 1300, "{}", ran.stderr);
        }
    }
    // CRLF, a byte order mark and quoted fields are nothing wrong.
    for good in [&texts[4], &texts[5]] {
        let read = Detections::from_csv_reader(&good[..], "f");
        assert!(read.is_ok() || String::from_utf8_lossy(good).contains("1e308"));
    }
}

#[test]
fn a_grid_of_a_million_million_cells_is_refused_with_its_size() {
    let bench = Bench::new();
    let levels: Vec<String> = (1..=100).map(|k| k.to_string()).collect();
    let levels = levels.join(", ");
    let factors: String = [
        "sigma_o",
        "sigma_t",
        "penalty_radius",
        "penalty_height",
        "laps",
        "max_range",
    ]
    .map(|name| format!("{name} = [{levels}]\n"))
    .concat();
    bench.write(
        "big.toml",
        format!("[design]\nkind = \"grid\"\n[design.factors]\n{factors}"),
    );
    let ran = bench.run(&["sweep", "big.toml", "--out", "out"]);
    assert_eq!(ran.code, 65);
    assert!(
        ran.stderr
            .contains("got 1000000000000 cells, expected at most 1000000"),
        "{}",
        ran.stderr
    );
    assert!(!bench.exists("out"));
}
