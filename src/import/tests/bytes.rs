//! Nothing in a file makes a reader panic.

use std::fmt::Write as _;
use std::path::Path;

use proptest::prelude::*;

use super::super::mrclam::Files;
use super::super::recording::Recording;
use super::super::truth::parse_truth;
use super::super::{Format, ImportError, dead_reckon, g2o, range_bearing, read_range_bearing};
use super::honesty::{NOISE, TRACKER};
use super::mrclam::{folder, text};
use crate::input::Source;
use crate::sighting::Sighting;
use crate::tracker::track;

/// Lines that look like something: tags, numbers of all kinds, separators.
fn soup() -> impl Strategy<Value = Vec<u8>> {
    let word = prop_oneof![
        4 => (-3i64..12).prop_map(|n| n.to_string()),
        2 => any::<f64>().prop_map(|x| x.to_string()),
        1 => (-2.0..2.0f64).prop_map(|x| x.to_string()),
        3 => prop::sample::select(vec![
            "VERTEX_SE2", "VERTEX_XY", "EDGE_SE2", "EDGE_SE2_XY", "EDGE_BEARING_SE2_XY", "FIX", "PARAMS", "#",
            "ODOMETRY", "EDGE2", "LANDMARK", "BR", "PARAMS_SE2OFFSET", "EDGE_SE2_POINTXY_OFFSET", "EDGE_SE2_OFFSET", "EDGE3",
            "nan", "inf", "1e300", "-0", "1e-300", "\u{feff}", "t,robot_x", ",", "\"", "\r", "é",
        ]).prop_map(str::to_owned),
    ];
    let ends = prop::sample::select(vec![" ", "\t", ",", "\n", "\r\n", "\n"]);
    prop::collection::vec((word, ends), 0..80).prop_map(|words| {
        words
            .iter()
            .map(|(word, end)| format!("{word}{end}"))
            .collect::<String>()
            .into_bytes()
    })
}

/// Rows of as many numbers as a table has columns, most of them good.
fn table(columns: usize) -> impl Strategy<Value = String> {
    let number = prop_oneof![
        6 => (0i64..10).prop_map(|n| n.to_string()),
        2 => (-5.0..5.0f64).prop_map(|x| x.to_string()),
        1 => prop::sample::select(vec!["1e308", "-1e308", "1e-308", "0", "9e15"]).prop_map(str::to_owned),
    ];
    let row = prop::collection::vec(number, columns);
    prop::collection::vec(row, 1..8).prop_map(|rows| {
        rows.iter()
            .map(|row| format!("{}\n", row.join(" ")))
            .collect()
    })
}

fn source(bytes: &[u8]) -> Result<Source<'_>, ImportError> {
    Ok(Source::from_reader(bytes, Path::new("f"))?)
}

fn csv(bytes: &[u8]) -> Result<Recording, ImportError> {
    range_bearing::read(source(bytes)?).map(|(recording, _)| recording)
}

fn graph(bytes: &[u8]) -> Result<Recording, ImportError> {
    g2o::parse(source(bytes)?)
}

/// All the way to detections or a refusal.
fn follow(recording: Result<Recording, ImportError>) {
    match recording {
        Ok(recording) => {
            let sightings: Vec<Sighting> = dead_reckon(&recording, &NOISE);
            if let Err(error) = track(&sightings, &TRACKER) {
                assert!(!error.to_string().contains('\n'));
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}

proptest! {
    #[test]
    fn no_bytes_make_a_reader_panic(
        bytes in prop_oneof![prop::collection::vec(any::<u8>(), 0..400), soup()],
        other in soup(),
    ) {
        let lossy = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        follow(csv(&bytes));
        follow(graph(&bytes));
        let _ = source(&bytes).and_then(|source| parse_truth(source, &[(0.0, Some(1))]));
        let _ = source(&bytes).and_then(|mut source| Format::of_source(&mut source));
        let files = folder();
        follow(Files { odometry: text("f", &lossy(&bytes)), ..files.clone() }.parse());
        follow(Files { measurements: text("f", &lossy(&bytes)), ..files.clone() }.parse());
        follow(Files { barcodes: text("f", &lossy(&bytes)), ..files.clone() }.parse());
        follow(Files { landmarks: Some(text("f", &lossy(&bytes))), poses: Some(text("f", &lossy(&other))), ..files }.parse());
        let path = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(path.path(), [&[0x1f, 0x8b], bytes.as_slice()].concat()).expect("written");
        let _ = read_range_bearing(path.path()).expect_err("no gzip");
    }

    #[test]
    fn no_numbers_make_the_way_to_detections_panic(
        odometry in table(3),
        measurements in table(4),
        rows in table(7),
        increments in table(9),
        seen in table(5),
    ) {
        let files = Files {
            odometry: text("f", &odometry),
            measurements: text("f", &measurements),
            barcodes: text("f", "1 0\n6 1\n7 2\n8 3\n"),
            landmarks: None,
            poses: Some(text("f", &odometry.replace('\n', " 0\n"))),
        };
        follow(files.parse());
        let header = "t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id\n";
        let csv = format!("{header}{}", rows.replace(' ', ","));
        follow(self::csv(csv.as_bytes()));
        let mut lines = String::new();
        for (ix, row) in increments.lines().enumerate() {
            writeln!(lines, "EDGE_SE2 {} {} {row}", 100 + ix, 101 + ix).expect("a String takes any text");
        }
        for (ix, row) in seen.lines().enumerate() {
            writeln!(lines, "EDGE_SE2_XY {} {} {row}", 100 + ix % 2, 7 + ix % 3).expect("a String takes any text");
        }
        follow(graph(lines.as_bytes()));
    }
}
