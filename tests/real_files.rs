//! Files as users have them, given to `ptm`: other separators and encodings, missing and additional
//! columns, other dialects of graphs, and numbers in other units.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use std::io::Write;

use common::{Bench, Ran};
use topometric::detections::Detections;

/// Two landmarks, each detected twice.
const FOUR: &str = "x,y,landmark\n0,0,-1\n10,0,-1\n0.1,0,1\n10.1,0,2\n";
const HEADER: &str = "t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id";

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A round of radius 2 m about the origin, on which a landmark at (1, 0) is always seen.
fn round(time: impl Fn(f64) -> String, heading: f64, bearing: f64) -> String {
    let mut text = format!("{HEADER}\n");
    for k in 0..100 {
        let turned = f64::from(k) * 0.05;
        let (x, y) = (2.0 * turned.cos(), 2.0 * turned.sin());
        let ahead = turned + std::f64::consts::FRAC_PI_2;
        let (dx, dy) = (1.0 - x, -y);
        let seen = (dy.atan2(dx) - ahead)
            .sin()
            .atan2((dy.atan2(dx) - ahead).cos());
        text += &format!(
            "{},{x},{y},{},{},{},7\n",
            time(f64::from(k) * 0.1),
            ahead * heading,
            dx.hypot(dy),
            seen * bearing
        );
    }
    text
}

/// What was said in one line, and why it ended.
fn refused(ran: &Ran) -> (i32, &str) {
    assert_eq!(ran.stdout, "");
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    (
        ran.code,
        ran.stderr.trim_end().strip_prefix("ptm: ").unwrap(),
    )
}

fn sample(bench: &Bench, file: &str) -> Ran {
    bench.run(&["sample", file, "--samples", "50", "--json", "out.json"])
}

#[test]
fn every_command_reads_packed_detections_whatever_they_are_called() {
    let bench = Bench::new();
    bench.write("a.csv", gzip(FOUR.as_bytes()));
    bench.write("a.gz", gzip(FOUR.as_bytes()));
    let sweep = "[data]\ndetections = \"a.gz\"\n[run]\nsamples = 20\nchains = 1\n[design]\nkind = \"grid\"\n\
                 [design.factors]\npenalty_radius = [3]\n";
    bench.write("s.toml", sweep);
    bench.write(
        "t.toml",
        sweep.replace("detections = \"a.gz\"", "world = \"square-ring\""),
    );
    for arguments in [
        &["sample", "a.csv", "--samples", "50"][..],
        &["sample", "a.gz", "--samples", "50"],
        &["evaluate", "a.csv", "--samples", "50"],
        &["tune", "a.csv", "--no-simulation"],
        &["exact", "a.gz", "--tolerance", "0.2"],
        &["sweep", "s.toml", "--out", "s"],
        &["sweep", "t.toml", "--data", "a.csv", "--out", "t"],
    ] {
        let ran = bench.run(arguments);
        assert_eq!(ran.code, 0, "{arguments:?}: {}", ran.stderr);
        assert!(!ran.stderr.contains("noted"), "{}", ran.stderr);
    }
}

#[test]
fn what_is_left_out_or_put_up_with_is_named_once() {
    let bench = Bench::new();
    for (name, text, notes) in [
        ("upper.csv", "X,Y,LANDMARK\n0,0,1\n5,0,2\n", &[][..]),
        (
            "index.csv",
            ",x,y\n0,0,0\n1,5,0\n",
            &["1 column left out: one without a name"],
        ),
        (
            "more.csv",
            "x,y,score,notes\n0,0,1,\"a, b\"\n5,0,1,\n",
            &["2 columns left out: score, notes"],
        ),
        (
            "german.csv",
            "x;y\n0,5;0\n5,25;-1,5\n",
            &["fields separated by semicolons, decimals with commas"],
        ),
        (
            "tabs.tsv",
            "x\ty\n0\t0\n5\t0\n",
            &["fields separated by tabs"],
        ),
    ] {
        bench.write(name, text);
        let ran = sample(&bench, name);
        assert_eq!(ran.code, 0, "{name}: {}", ran.stderr);
        let said: Vec<&str> = ran
            .stderr
            .lines()
            .filter(|l| l.starts_with("noted: "))
            .collect();
        let expected: Vec<String> = notes
            .iter()
            .map(|note| format!("noted: {name}: {note}"))
            .collect();
        assert_eq!(said, expected);
        let quiet = bench.run(&["-q", "sample", name, "--samples", "50"]);
        assert_eq!((quiet.code, quiet.stderr.as_str()), (0, ""));
    }
    bench.write(
        "s.toml",
        "[run]\nsamples = 20\n[design]\nkind = \"grid\"\n[design.factors]\nsigma_o = [1, 2]\n",
    );
    let ran = bench.run(&["sweep", "s.toml", "--data", "more.csv", "--out", "s"]);
    assert_eq!(ran.stderr.matches("noted: ").count(), 1, "{}", ran.stderr);
}

#[test]
fn negative_landmarks_are_unknown_and_names_stay_names() {
    let bench = Bench::new();
    bench.write("four.csv", FOUR);
    let detections = Detections::read_csv(bench.path("four.csv")).unwrap();
    assert_eq!(detections.truth(), [None, None, Some(1), Some(2)]);
    let csv = round(|t| t.to_string(), 1.0, 1.0).replace(",7\n", ",tree \"7\"\n");
    bench.write("named.csv", csv);
    bench.ok(&["import", "named.csv", "--sightings", "sightings.csv"]);
    let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
    assert_eq!(
        (detections.truth()[0], detections.landmark_name(0)),
        (Some(0), "tree \"7\"".into())
    );
    assert!(
        bench
            .read("detections.csv")
            .contains(",\"tree \"\"7\"\"\"\n")
    );
    assert!(
        bench
            .read("sightings.csv")
            .contains(",\"tree \"\"7\"\"\"\n")
    );
}

#[test]
fn recordings_without_identities_or_with_poses_alone_are_read() {
    let bench = Bench::new();
    let whole = round(|t| t.to_string(), 1.0, 1.0);
    let without: String = whole
        .lines()
        .map(|line| format!("{}\n", line.rsplit_once(',').unwrap().0))
        .collect();
    bench.write("noid.csv", without);
    let said = bench.ok(&["import", "noid.csv"]);
    assert!(said.contains("noted: no column true_landmark_id"), "{said}");
    // Poses in between, before and after change nothing but the noise of the odometry.
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    lines.insert(1, "-0.1,2,-0.1,1.5707963267948966,,,".to_owned());
    lines.insert(20, "1.75,-0.5,1.9,3.3,,,-1".to_owned());
    lines.push("99,0,0,0,NaN,NaN,".to_owned());
    bench.write("poses.csv", lines.join("\n"));
    let said = bench.ok(&["import", "poses.csv"]);
    assert!(said.starts_with("100 of 100 sightings, "), "{said}");
    bench.write("only.csv", format!("{HEADER}\n0,0,0,0,,,\n1,1,0,0,,,\n"));
    let ran = bench.run(&["import", "only.csv"]);
    assert_eq!(
        refused(&ran),
        (
            65,
            "only.csv: got no sightings, 2 poses without range and bearing, expected at least one; \
              check the file"
        )
    );
}

#[test]
fn numbers_in_other_units_are_refused_with_their_line() {
    let bench = Bench::new();
    let degrees = 180.0 / std::f64::consts::PI;
    let seconds = |t: f64| t.to_string();
    bench.write("good.csv", round(seconds, 1.0, 1.0));
    assert!(!bench.ok(&["import", "good.csv"]).contains("noted"));
    for (name, text, expected) in [
        (
            "bearing.csv",
            round(seconds, 1.0, degrees),
            "line 2, column bearing: got 90",
        ),
        (
            "heading.csv",
            round(seconds, degrees, 1.0),
            "line 2, column robot_theta: got the heading 90",
        ),
        (
            "ns.csv",
            round(|t| format!("{:.0}", (1.7e9 + t) * 1e9), 1.0, 1.0),
            "line 101, column t: got the time 1700000009900000000 and 100000000 between scans, \
             expected seconds; is it in nanoseconds?",
        ),
        (
            "us.csv",
            round(|t| format!("{:.0}", t * 1e6), 1.0, 1.0),
            "line 101, column t: got the time 9900000 and 100000 between scans, expected seconds; is \
             it in microseconds?",
        ),
    ] {
        bench.write(name, text);
        let ran = bench.run(&["import", name]);
        let (code, message) = refused(&ran);
        assert_eq!(code, 65);
        assert!(
            message.starts_with(&format!("{name}, {expected}")),
            "{message}"
        );
    }
    bench.write("ms.csv", round(|t| format!("{:.0}", t * 1e3), 1.0, 1.0));
    let ran = bench.run(&["import", "ms.csv"]);
    let (code, message) = refused(&ran);
    assert_eq!(code, 65);
    assert!(
        message.contains("is t in milliseconds, not seconds?"),
        "{message}"
    );
}

const GRAPH: &str = "ODOMETRY 0 1 1 0 0 10000 0 0 10000 0 250000\nODOMETRY 1 2 1 0 0 10000 0 0 10000 0 250000\n\
                     LANDMARK 0 0 5 2 25 0 25\nLANDMARK 2 0 3 2 25 0 25\nLANDMARK 2 1 1 -4 25 0 25\n";

#[test]
fn dialects_of_graphs_are_told_by_their_content() {
    let bench = Bench::new();
    bench.write("isam.txt", GRAPH);
    bench.write(
        "isam.g2o",
        GRAPH
            .replace("LANDMARK", "LANDMARK2")
            .replace("ODOMETRY", "EDGE2"),
    );
    let tutorial = GRAPH
        .replace("ODOMETRY", "TUTORIAL_EDGE_SE2")
        .replace("LANDMARK 0 0 ", "TUTORIAL_EDGE_SE2_POINT_XY 0 10 0 ")
        .replace("LANDMARK 2 0 ", "TUTORIAL_EDGE_SE2_POINT_XY 2 10 0 ")
        .replace("LANDMARK 2 1 ", "EDGE_SE2_POINTXY_OFFSET 2 11 0 ");
    bench.write(
        "tutorial.txt",
        gzip(format!("{tutorial}PARAMS_SE2OFFSET 0 0 0 0\n").as_bytes()),
    );
    let mut texts = Vec::new();
    for arguments in [
        &["import", "isam.txt"][..],
        &["import", "isam.txt", "--format", "g2o"],
        &["import", "isam.txt", "--format", "isam"],
        &["import", "isam.g2o"],
        &["import", "tutorial.txt"],
    ] {
        let said = bench.ok(arguments);
        assert!(said.starts_with("3 of 3 sightings, 2 detections"), "{said}");
        assert!(!said.contains("noted") && !said.contains("DOUBT"), "{said}");
        let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
        texts.push(detections.positions_m());
        let expected = if arguments[1] == "tutorial.txt" {
            [10, 11]
        } else {
            [0, 1]
        };
        assert_eq!(detections.truth(), expected.map(Some));
    }
    assert!(texts.windows(2).all(|pair| pair[0] == pair[1]));
    bench.write("space.txt", "EDGE3 0 1 1 0 0 0 0 0\n");
    let ran = bench.run(&["import", "space.txt"]);
    assert_eq!(
        refused(&ran),
        (
            65,
            "space.txt, line 1, column tag: got \"EDGE3\", expected a graph in the plane (SE2); \
              project poses and landmarks to the ground first; correct the row"
        )
    );
}

#[test]
fn covariances_given_for_information_are_doubted_in_every_dialect() {
    let bench = Bench::new();
    let inverse = GRAPH.replace("10000 0 0 10000 0 250000", "0.0001 0 0 0.0001 0 0.000004");
    for (name, text) in [
        ("a.txt", inverse.clone()),
        ("a.g2o", inverse.replace("ODOMETRY", "EDGE_SE2")),
    ] {
        bench.write(name, text);
        let said = bench.ok(&["import", name]);
        let doubt = said
            .lines()
            .find(|line| line.starts_with("DOUBT: "))
            .unwrap();
        assert!(
            doubt.contains("covariances where their inverse, the information"),
            "{doubt}"
        );
    }
}

#[test]
fn files_that_are_no_text_or_without_end_are_refused_in_one_line() {
    let bench = Bench::new();
    let bomb = gzip(&[b"x,y\n".to_vec(), b"1.5,2.5\n".repeat(300_000)].concat());
    for (name, bytes, expected) in [
        (
            "zip.csv",
            b"PK\x03\x04\x14\0\0\0".to_vec(),
            "zip.csv: got a zip archive",
        ),
        (
            "parquet.csv",
            b"PAR1\x15\x04".to_vec(),
            "parquet.csv: got a Parquet file",
        ),
        ("zero.csv", vec![0; 5000], "zero.csv: got bytes of value 0"),
        (
            "bomb.csv",
            bomb,
            "bomb.csv: got more than 200000 detections, expected at most that",
        ),
        (
            "lat.csv",
            b"lat,lon\n48,11\n".to_vec(),
            "lat.csv, line 1: got lat,lon in the header, which",
        ),
    ] {
        bench.write(name, bytes);
        let ran = sample(&bench, name);
        let (code, message) = refused(&ran);
        assert_eq!(code, 65);
        assert!(message.starts_with(expected), "{message}");
    }
    if cfg!(unix) {
        let ran = sample(&bench, "/dev/zero");
        assert_eq!(refused(&ran).0, 65);
    }
}

#[test]
fn a_map_in_geojson_says_that_it_is_in_metres() {
    let bench = Bench::new();
    bench.write("four.csv", FOUR);
    bench.ok(&["sample", "four.csv", "--samples", "200", "--map", "m"]);
    let map: serde_json::Value = serde_json::from_str(&bench.read("m/map.geojson")).unwrap();
    assert_eq!(map["coordinate_units"], "metres");
    assert!(
        map["crs"]["properties"]["name"]
            .as_str()
            .unwrap()
            .starts_with("LOCAL_CS[")
    );
}
