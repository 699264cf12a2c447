//! Where outputs go: links are followed, devices and FIFOs are written in place, and a place that
//! takes nothing is an error in one line.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(clippy::print_stderr, reason = "a skipped test must say so")]

mod common;

use std::os::unix::fs::{FileTypeExt, symlink};
use std::process::Command;

use common::{Bench, SMALL_SWEEP, pairs_csv, ran};

/// A bench with an input for every command that writes where it is told.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("good.csv", pairs_csv(4));
    bench.write("small.toml", SMALL_SWEEP);
    let mut csv = "t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id\n".to_owned();
    for k in 0..=4 {
        let (x, range) = (0.25 * f64::from(k), 5.0 - 0.25 * f64::from(k));
        csv += &format!("{k},{x},0,0,{range},0,3\n");
    }
    bench.write("recording.csv", csv);
    bench
}

/// Command lines with the flag of each output, and what its content begins with.
const OUTPUTS: [(&str, &str, &str); 13] = [
    (
        "sample good.csv --samples 200 --figure a.png",
        "--json",
        "{",
    ),
    (
        "sample good.csv --samples 200 --figure a.png",
        "--trace",
        "PAR1",
    ),
    ("sample good.csv --samples 200", "--figure", "\u{fffd}PNG"),
    ("simulate --map a.png", "--out", "x,y"),
    ("simulate --out a.csv", "--map", "\u{fffd}PNG"),
    ("import recording.csv --map a.png", "--out", "x,y"),
    ("import recording.csv --out a.csv", "--map", "\u{fffd}PNG"),
    ("import recording.csv --out a.csv", "--sightings", "t,x,y"),
    ("exact good.csv", "--json", "{"),
    ("tune good.csv --no-simulation", "--json", "{"),
    ("compare done done", "--json", "{"),
    ("export done --cell c001", "--out", "{"),
    ("export done", "--out", "PAR1"),
];

/// The name that an output must have, where its ending says what it is.
fn name(line: &str, begin: &str) -> String {
    match (line.starts_with("export"), begin) {
        (true, "{") => "place.json".to_owned(),
        (true, _) => "place.parquet".to_owned(),
        _ => "place".to_owned(),
    }
}

fn arguments<'a>(line: &'a str, flag: &'a str, name: &'a str) -> Vec<&'a str> {
    line.split(' ').chain([flag, name]).collect()
}

#[test]
fn every_output_follows_a_link_and_replaces_what_it_leads_to() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "done"]);
    for (line, flag, begin) in OUTPUTS {
        let name = name(line, begin);
        let link = bench.path(&name);
        bench.write("elsewhere/target", "what stood there before");
        let _ = std::fs::remove_file(&link);
        symlink("elsewhere/target", &link).unwrap();
        bench.ok(&arguments(line, flag, &name));
        assert!(link.is_symlink(), "{line} {flag}: the link was replaced");
        let written = std::fs::read(bench.path("elsewhere/target")).unwrap();
        let written = String::from_utf8_lossy(&written).into_owned();
        assert!(written.starts_with(begin), "{line} {flag}: {written:.20}");
        assert_eq!(
            std::fs::read_dir(bench.path("elsewhere")).unwrap().count(),
            1
        );
    }
}

#[test]
fn every_output_is_written_into_a_fifo() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "done"]);
    for (line, flag, begin) in OUTPUTS {
        let name = name(line, begin);
        let fifo = bench.path(&name);
        let _ = std::fs::remove_file(&fifo);
        assert!(
            Command::new("mkfifo")
                .arg(&fifo)
                .status()
                .unwrap()
                .success()
        );
        // One reader that opens it once, as `cat` does.
        let reader = std::thread::spawn({
            let fifo = fifo.clone();
            move || std::fs::read(fifo).unwrap()
        });
        bench.ok(&arguments(line, flag, &name));
        let written = String::from_utf8_lossy(&reader.join().unwrap()).into_owned();
        assert!(written.starts_with(begin), "{line} {flag}: {written:.20}");
        let kind = std::fs::symlink_metadata(&fifo).unwrap().file_type();
        assert!(kind.is_fifo(), "{line} {flag}: the FIFO was replaced");
    }
}

#[test]
fn a_device_stays_a_device() {
    let bench = bench();
    bench.ok(&["-q", "sweep", "small.toml", "--out", "done"]);
    // The numbers of /dev/null and of /dev/full.
    for (minor, code) in [("3", 0), ("7", 75)] {
        for (line, flag, begin) in OUTPUTS {
            let name = name(line, begin);
            let node = bench.path(&name);
            let _ = std::fs::remove_file(&node);
            let made = Command::new("mknod")
                .arg(&node)
                .args(["c", "1", minor])
                .output();
            if !made.is_ok_and(|made| made.status.success()) {
                eprintln!("SKIPPED: devices cannot be made here");
                return;
            }
            let ran = bench.run(&arguments(line, flag, &name));
            assert_eq!(ran.code, code, "{line} {flag}: {}", ran.stderr);
            let kind = std::fs::symlink_metadata(&node).unwrap().file_type();
            assert!(kind.is_char_device(), "{line} {flag}: it was replaced");
            if code == 75 {
                let said = ran.stderr.trim_end();
                assert!(
                    said.contains(": cannot be written (No space left on device"),
                    "{said}"
                );
                assert_eq!(said.lines().count(), 1, "{said}");
            }
        }
    }
}

#[test]
fn standard_output_by_name_is_the_open_stream() {
    let bench = bench();
    let file = std::fs::File::create(bench.path("all")).unwrap();
    let arguments = ["exact", "good.csv", "--json", "/dev/stdout"];
    let output = bench.command(&arguments).stdout(file).output().unwrap();
    assert_eq!(ran(&output).code, 0);
    let all = bench.read("all");
    let (summary, json) = all.split_at(all.find("\n{").unwrap());
    assert!(summary.starts_with("good.csv: 4 detections"), "{summary}");
    serde_json::from_str::<serde_json::Value>(json).unwrap();
}

#[test]
fn a_limit_on_the_size_of_files_is_try_again() {
    let bench = bench();
    let ptm = assert_cmd::cargo::cargo_bin!("ptm");
    let lines = [
        "sample good.csv --samples 200 --figure a.png",
        "sweep small.toml --out limited",
    ];
    for line in lines {
        let script = format!("ulimit -f 1; exec \"$0\" {line}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).arg(ptm);
        let ran = ran(&shell.current_dir(bench.path("")).output().unwrap());
        assert_eq!(ran.code, 75, "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains("File too large"), "{}", ran.stderr);
    }
    bench.ok(&["-q", "sweep", "small.toml", "--out", "limited"]);
}
