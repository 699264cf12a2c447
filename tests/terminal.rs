//! What reaches the terminal, and what happens when nobody reads it.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::process::Stdio;

use common::{Bench, SMALL_SWEEP, pairs_csv, ran};

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("good.csv", pairs_csv(4));
    bench.write("small.toml", SMALL_SWEEP);
    bench
}

fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[cfg(target_os = "linux")]
fn full() -> Stdio {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    full.unwrap().into()
}

#[cfg(target_os = "linux")]
#[test]
fn standard_error_that_takes_nothing_changes_nothing() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "quiet"]);
    let lines: [(&[&str], i32); 5] = [
        (&["sweep", "small.toml", "--out", "out"], 0),
        (&["sweep", "small.toml", "--out", "out"], 0),
        (&["report", "out"], 0),
        (&["sample", "good.csv", "--bad"], 1),
        (
            &[
                "-v",
                "sample",
                "good.csv",
                "--samples",
                "100",
                "--figure",
                "f.png",
            ],
            0,
        ),
    ];
    for make in [full, closed] {
        let _ = std::fs::remove_dir_all(bench.path("out"));
        for (arguments, code) in lines {
            let status = bench
                .command(arguments)
                .stderr(make())
                .stdout(Stdio::null())
                .status();
            assert_eq!(status.unwrap().code(), Some(code), "{arguments:?}");
        }
        assert_eq!(bench.read("out/chains.csv"), bench.read("quiet/chains.csv"));
        assert!(bench.exists("out/index.html"));
    }
}

#[test]
fn who_closes_standard_output_has_read_enough_and_every_file_is_written() {
    let bench = bench();
    let lines: [&[&str]; 4] = [
        &[
            "sample",
            "good.csv",
            "--samples",
            "100",
            "--figure",
            "f.png",
            "--json",
            "s.json",
        ],
        &["exact", "good.csv", "--json", "e.json"],
        &["tune", "good.csv", "--no-simulation", "--json", "t.json"],
        &["sweep", "--print-keys"],
    ];
    for arguments in lines {
        let mut command = bench.command(arguments);
        let command = command.env("RUST_BACKTRACE", "1").stdout(closed());
        let ran = ran(&command.output().unwrap());
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{arguments:?}");
    }
    for file in ["s.json", "e.json", "t.json"] {
        assert!(bench.read(file).ends_with("}\n"), "{file}");
    }
}

/// ESC and CSI of C1 in a name, a header, a value, a key and a flag.
#[test]
fn what_a_message_repeats_commands_no_terminal() {
    let bench = bench();
    let evil = "\u{1b}[2J\u{9b}31m\u{7f}\u{202e}";
    let (csv, folder) = (format!("{evil}.csv"), format!("{evil}.d"));
    bench.write(&csv, pairs_csv(4));
    bench.write("header.csv", format!("x,y,{evil}\n1,2,3\n3,4,5\n"));
    bench.write("value.csv", format!("x,y\n1,{evil}\n"));
    bench.write("key.toml", format!("[data]\n\"{evil}\" = 1\n"));
    bench.write(
        "world.toml",
        format!("[data]\nworld = \"{}\"\n", evil.escape_debug()),
    );
    bench.write(
        "titled.toml",
        SMALL_SWEEP.replace("Small", "\\u001b[2J\\u009b"),
    );
    let lines: [&[&str]; 12] = [
        &["sample", &csv, "--samples", "100", "--map", &folder],
        &["exact", &csv],
        &["exact", &csv, "--json", "-"],
        &["tune", &csv, "--no-simulation"],
        &[
            "sample",
            "header.csv",
            "--samples",
            "100",
            "--figure",
            "f.png",
        ],
        &["sample", "value.csv"],
        &["sample", "good.csv", evil],
        &["sample", "good.csv", "--init", evil],
        &["sweep", "key.toml"],
        &["sweep", "world.toml"],
        &["plan", "titled.toml"],
        &["report", evil],
    ];
    for arguments in lines {
        let ran = bench.run(arguments);
        for text in [ran.stdout, ran.stderr] {
            let raw = |c: &char| (c.is_control() && *c != '\n' && *c != '\t') || *c == '\u{202e}';
            assert_eq!(text.chars().find(raw), None, "{arguments:?}: {text:?}");
        }
    }
}
