//! `ptm import` as a user meets it: recordings of each format, and what is refused.
//!
//! The public recordings are not part of the project. Where they lie beside the checkout, in
//! `../shared/data`, they are imported too; where not, those tests say so and pass.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]
#![allow(
    clippy::print_stdout,
    reason = "a skipped test says so, and figures measured on recordings are worth seeing"
)]

mod common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use common::{Bench, rows};
use topometric::detections::Detections;
use topometric::diagnostics::agreement::adjusted_rand_index;
use topometric::diagnostics::consistency::{errors_against, nees};
use topometric::import::{
    DriftNoise, Format, Noise, PRESET_KEYS, Recording, SensorNoise, dead_reckon, read_mrclam,
    read_range_bearing, read_truth,
};
use topometric::partition::Topology;
use topometric::tracker::{TrackerSettings, track};

const CSV: &str = "t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id\n";

/// A bench with a small recording of each format: a landmark 5 m ahead, seen while 1 m is driven.
fn bench() -> Bench {
    let bench = Bench::new();
    let (mut csv, mut graph, mut measurements) = (CSV.to_owned(), String::new(), String::new());
    for k in 0..=4 {
        let (x, range) = (0.25 * f64::from(k), 5.0 - 0.25 * f64::from(k));
        csv += &format!("{k},{x},0,0,{range},0,3\n");
        measurements += &format!("{k}.0 63 {range} 0.0\n");
        graph += &format!("EDGE_SE2_XY {k} 90 {range} 0 100 0 100\n");
        if k < 4 {
            graph += &format!("EDGE_SE2 {k} {} 0.25 0 0 100 0 0 100 0 100\n", k + 1);
        }
    }
    bench.write("a.csv", csv);
    bench.write("a.g2o", graph);
    bench.write("hall/Barcodes.dat", "# Subject Barcode\n1 5\n6 63\n");
    bench.write("hall/Robot2_Odometry.dat", "# t v w\n0 0.25 0\n4 0.25 0\n");
    bench.write("hall/Robot2_Measurement.dat", measurements);
    bench.write("hall/Robot2_Groundtruth.dat", "0 1 1 1.5707963267948966\n");
    bench.write("hall/Landmark_Groundtruth.dat", "6 1 6 0 0\n");
    bench
}

#[test]
fn each_format_gives_the_landmark_where_it_is() {
    for (input, landmark) in [("a.csv", 3), ("a.g2o", 90), ("hall", 6)] {
        let bench = bench();
        let said = bench.ok(&["import", input]);
        assert!(
            said.starts_with("5 of 5 sightings, 1 detections\n"),
            "{said}"
        );
        let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
        let row = detections.iter().next().unwrap();
        assert_eq!(row.landmark, Some(landmark));
        let [x, y] = row.position_m;
        assert!(
            (x - 5.0).abs() < 1e-6 && y.abs() < 1e-6,
            "{input}: {x}, {y}"
        );
        assert!(bench.exists("detections.png"));
        let known = said.contains("against true places: NEES mean 0.00 (honest: 2)");
        assert_eq!(known, input == "hall", "{said}");
    }
}

#[test]
fn sightings_say_which_detection_they_became() {
    let bench = bench();
    bench.write(
        "two.csv",
        format!("{CSV}0,0,0,0,5,0,3\n1,0,0,0,5,0,3\n1,0,0,0,9,0.5,-1\n"),
    );
    bench.ok(&[
        "import",
        "two.csv",
        "--sightings",
        "seen.csv",
        "--min-sightings",
        "2",
    ]);
    assert_eq!(
        bench.read("seen.csv").lines().next(),
        Some("t,x,y,detection,landmark")
    );
    let rows = rows(&bench.read("seen.csv"));
    let of = |name: &str| -> Vec<&str> { rows.iter().map(|row| row[name].as_str()).collect() };
    assert_eq!(of("detection"), ["0", "0", ""]);
    assert_eq!(
        (of("landmark"), of("t")),
        (vec!["3", "3", ""], vec!["0", "1", "1"])
    );
    assert_eq!((of("x")[0], of("y")[0]), ("5", "0"));
}

#[test]
fn drift_before_a_group_is_in_its_covariance_unless_asked_not() {
    let bench = bench();
    let variance = |arguments: &[&str]| {
        bench.ok(&[&["import", "a.csv"], arguments].concat());
        let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
        let c = detections.covariances_m2().unwrap()[0];
        c.xx + c.yy
    };
    let whole = variance(&[]);
    assert!(whole > variance(&["--covariance", "seen"]));
    assert!(whole < variance(&["--bend-noise", "0.1"]));
    assert!(whole < variance(&["--noise", "2"]));
    assert!(whole < variance(&["--every", "2"]));
}

#[test]
fn what_is_refused_is_refused_in_one_line() {
    let bench = bench();
    bench.write("bad.csv", format!("{CSV}0,0,0,0,1,0,3\n1,0,0,0,x,0,3\n"));
    bench.write("bad.g2o", "EDGE_SE2_XY 1 2 3\n");
    bench.write("bad/Robot1_Measurement.dat", "0 63 1 0\n");
    bench.write("bad/Robot1_Odometry.dat", "0 0\n");
    bench.write("bad/Barcodes.dat", "6 63\n");
    bench.write("empty/a.txt", "");
    bench.write(
        "far.csv",
        format!("{CSV}0,1e300,0,0,1,0,3\n1,-1e300,0,0,1,0,3\n"),
    );
    let before = bench.files();
    let lines = [
        "import nowhere.csv",
        "import bad.csv",
        "import bad.g2o",
        "import bad",
        "import empty",
        "import far.csv --min-sightings 1",
        "import a.csv --format g2o",
        "import hall --robot 1",
        "import a.csv --robot 1",
        "import a.g2o --truth a.csv",
        "import a.csv --truth a.csv",
        "import a.g2o --range-noise 1",
        "import a.g2o --bend-noise 1",
        "import a.csv --turn-noise -1",
        "import a.csv --every 0",
        "import a.csv --from 2 --until 2",
        "import a.csv --from nan",
        "import a.csv --from 9",
        "import a.csv --out a.csv",
        "import a.csv --covariance none",
        "import a.csv --align",
        "import a.csv --align=x",
        "import a.csv --align --covariance seen",
        "import a.csv --sightings detections.csv",
    ];
    let mut transcript = String::new();
    for line in lines {
        let ran = bench.run(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(ran.stdout, "", "{line}");
        assert_eq!(ran.stderr.lines().count(), 1, "{line}: {}", ran.stderr);
        assert_eq!(bench.files(), before, "{line} left something behind");
        let message = ran.stderr.trim_end().strip_prefix("ptm: ").unwrap();
        transcript += &format!("{line}\n  {}: {message}\n", ran.code);
    }
    insta::assert_snapshot!(transcript, @r#"
    import nowhere.csv
      1: nowhere.csv: cannot be read (No such file or directory (os error 2)); check the path and its permissions
    import bad.csv
      65: bad.csv, line 3, column range: got "x", expected a number; correct the value or remove the row
    import bad.g2o
      65: bad.g2o, line 1: got 4 fields, expected 8: EDGE_SE2_XY, pose, landmark, x, y, and 3 of the information; correct the line
    import bad
      65: bad/Robot1_Odometry.dat, line 1: got 2 fields, expected 3: time, forward velocity, angular velocity; correct the line
    import empty
      65: empty: got no file Robot<n>_Measurement.dat, expected a folder of UTIAS MRCLAM; give the folder that holds the .dat files, or a file
    import far.csv --min-sightings 1
      65: detection 2, column cov_xy: got NaN, expected a finite number; correct the value or remove the row
    import a.csv --format g2o
      65: a.csv, line 2, column tag: got "0,0,0,0,5,0,3", expected a tag, such as EDGE_SE2_XY; correct the row
    import hall --robot 1
      1: --robot: got 1, expected one of the robots of hall: 2; give another
    import a.csv --robot 1
      1: --robot: got 1, expected no such flag for range-bearing; only MRCLAM folders have robots
    import a.g2o --truth a.csv
      1: --truth: got a.csv, expected no such flag for g2o; it goes with a range-bearing CSV
    import a.csv --truth a.csv
      65: a.csv, line 1: got t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id in the header, expected the columns gt_x,gt_y,gt_theta,lm_x,lm_y; add the column gt_x (m)
    import a.g2o --range-noise 1
      1: --range-noise: got a value, expected no such flag for g2o, which states its noise; --noise scales it
    import a.g2o --bend-noise 1
      1: --bend-noise: got a value, expected no such flag for g2o, which states its noise; --noise scales it
    import a.csv --turn-noise -1
      1: --turn-noise: got -1, expected a finite number, 0 or above
    import a.csv --every 0
      1: --every: got 0, expected a whole number >= 1
    import a.csv --from 2 --until 2
      1: --until: got 2, expected a time after --from (2)
    import a.csv --from nan
      1: --from: got nan, expected a number; it has to be finite
    import a.csv --from 9
      1: tracker: got no group of at least 3 sightings out of 0, expected at least one; give another span of time (--from, --until), or raise --max-range
    import a.csv --out a.csv
      1: a.csv: is already the place of another file of this run; choose another
    import a.csv --covariance none
      1: invalid value 'none' for '--covariance <FRAME>' [possible values: start, seen]; ptm --help shows what there is
    import a.csv --align
      1: --align: got 1, expected at least 4 detections; bring more of them
    import a.csv --align=x
      1: --align: got "x", expected a whole number
    import a.csv --align --covariance seen
      1: --covariance: got seen, expected start beside --align, which tells drift from what the covariances hold of it
    import a.csv --sightings detections.csv
      1: detections.csv: is already the place of another file of this run; choose another
    "#);
}

/// The public recordings, or a word that they are not there.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data")
        .join(name);
    if !path.exists() {
        println!("skipped: no {}", path.display());
        return None;
    }
    Some(path)
}

fn preset(format: Format, key: &str) -> f64 {
    assert!(PRESET_KEYS.contains(&key));
    format.preset(key).unwrap()
}

/// Mean over windows of the mean NEES in each, with the defaults of the format.
fn mean_nees_of_windows(recording: &Recording, format: Format, window_s: f64, every: usize) -> f64 {
    let of = |key| preset(format, key);
    let [turn, bend] = format.turn_and_bend();
    let noise = Noise {
        sensor: SensorNoise {
            range_m: of("range_noise"),
            range_growth: of("range_noise_growth"),
            bearing_rad: of("bearing_noise"),
        },
        drift: DriftNoise {
            position: of("odometry_noise"),
            heading: of("heading_noise"),
            turn,
            bend,
        },
        factor: 1.0,
    };
    let tracker = TrackerSettings {
        gate_probability: 0.999,
        group_timeout_s: of("group_timeout_s"),
        min_sightings: of("min_sightings") as usize,
        odometry_noise: 0.0,
        heading_noise: 0.0,
        since_start: true,
    };
    let end_s = recording.stops.last().unwrap().time_s;
    let (mut sum, mut n) = (0.0, 0);
    for window in 0..(end_s / window_s) as usize {
        let from_s = window as f64 * window_s;
        let mut part = recording.clone();
        part.keep_window(from_s, from_s + window_s);
        part.thin(every, 3.0_f64.max(window_s));
        let sightings = dead_reckon(&part, &noise);
        let (Some(first), Some(truth)) = (part.stops.first(), part.truth.as_ref()) else {
            continue;
        };
        let places_m = truth.landmarks_in_frame_m(first.time_s, part.start);
        let (Some(places_m), Ok(detections)) = (places_m, track(&sightings, &tracker)) else {
            continue;
        };
        if let Some(found) = nees(&errors_against(&detections, &places_m)) {
            sum += found.mean;
            n += 1;
        }
    }
    assert!(n >= 5, "{n} windows");
    println!(
        "{n} windows of {window_s} s: mean NEES {}",
        sum / f64::from(n)
    );
    sum / f64::from(n)
}

/// Covariances neither too proud nor too humble: a window's NEES has mean 2 if they are honest. The band is
/// no test of a null law: the defaults were chosen on these recordings, which gave 1.9 to 3.0, and it is
/// there to see a change that spoils them.
fn is_honest(mean: f64) -> bool {
    (1.0..4.0).contains(&mean)
}

#[test]
fn both_robots_of_mrclam_6() {
    let Some(folder) = shared("mrclam_ds6") else {
        return;
    };
    for (robot, n_of_landmarks) in [(1, 1_535), (2, 3_239)] {
        let recording = read_mrclam(&folder, Some(robot)).unwrap();
        assert_eq!(recording.n_seen(), n_of_landmarks);
        assert!(is_honest(mean_nees_of_windows(
            &recording,
            Format::Mrclam,
            30.0,
            1
        )));
        assert!(is_honest(mean_nees_of_windows(
            &recording,
            Format::Mrclam,
            60.0,
            1
        )));
    }
    let bench = Bench::new();
    let folder = folder.to_str().unwrap();
    let refused = bench.run(&["import", folder]);
    assert_eq!(refused.code, 1);
    assert!(
        refused.stderr.ends_with(": 1, 2; give another\n"),
        "{}",
        refused.stderr
    );
    bench.ok(&["import", folder, "--robot", "2", "--until", "200"]);
    let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
    let mut landmarks = detections.truth().into_iter().flatten();
    assert!(detections.len() >= 15 && landmarks.all(|id| (6..=20).contains(&id)));
}

#[test]
fn the_simulated_graph_with_landmarks() {
    let Some(file) = shared("g2o/simulation-pose-landmark.g2o") else {
        return;
    };
    let bench = Bench::new();
    let said = bench.ok(&["import", file.to_str().unwrap()]);
    assert!(said.starts_with("257 of 257 sightings, "), "{said}");
    let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
    let mut landmarks: Vec<i64> = detections.truth().into_iter().flatten().collect();
    landmarks.sort_unstable();
    landmarks.dedup();
    assert_eq!(landmarks.len(), 36);
}

/// Adjusted Rand index of who is who, sighting by sighting: a sighting is what its detection is, one that is part of
/// none is alone.
fn index_of_sightings(sightings: &str, of_detection: &[u32]) -> f64 {
    let rows = rows(sightings);
    let found = rows.iter().enumerate().map(|(ix, row)| {
        let detection: Option<usize> = row["detection"].parse().ok();
        detection.map_or(1_000_000 + ix as u32, |detection| of_detection[detection])
    });
    let truth = rows
        .iter()
        .map(|row| row["landmark"].parse::<u32>().unwrap());
    let found = Topology::canonical(&found.collect::<Vec<_>>());
    let truth = Topology::canonical(&truth.collect::<Vec<_>>());
    adjusted_rand_index(&found, &truth).unwrap()
}

#[test]
fn the_simulated_graph_is_mapped_as_well_as_by_who_knows_the_truth() {
    let Some(file) = shared("g2o/simulation-pose-landmark.g2o") else {
        return;
    };
    let bench = Bench::new();
    let import = |align: &[&str]| {
        let file = file.to_str().unwrap();
        bench.ok(&[&["import", file, "--sightings", "sightings.csv"], align].concat());
    };
    let evaluate = || -> Vec<BTreeMap<String, String>> {
        bench.ok(&[
            "evaluate",
            "detections.csv",
            "--tune",
            "--samples",
            "30000",
            "--chains",
            "2",
        ]);
        rows(&bench.read("evaluation/scores.csv"))
    };
    let known = ["nearest-true-centroid", "ward-true-number", "dbscan-tuned"];
    let index = |scores: &[BTreeMap<String, String>], method: &str| -> f64 {
        let row = scores.iter().find(|row| row["method"] == method).unwrap();
        row["adjusted_rand_index"].parse().unwrap()
    };
    import(&[]);
    let best_of = |scores: &[BTreeMap<String, String>]| {
        known
            .iter()
            .map(|method| index(scores, method))
            .fold(0.0, f64::max)
    };
    let as_reckoned = best_of(&evaluate());
    import(&["--align"]);
    let scores = evaluate();
    let (found, best) = (index(&scores, "map"), best_of(&scores));
    // Whoever knows the truth does better too once the frame is straight.
    assert!(found > as_reckoned - 0.03, "{found} against {as_reckoned}");
    assert!(found > best - 0.03, "{found} against {best}");

    // The tracker's own errors counted: what it mixed counts as wrong.
    let tuned = bench.ok(&["tune", "detections.csv", "--no-simulation"]);
    let command = tuned
        .lines()
        .find(|line| line.contains("ptm sample"))
        .unwrap();
    let flags = command
        .split_whitespace()
        .skip(3)
        .chain(["--samples", "30000", "--chains", "2"]);
    let sample = bench.sample(&flags.collect::<Vec<_>>());
    let labels = sample["topologies"][0]["labels"].as_array().unwrap();
    let labels: Vec<u32> = labels
        .iter()
        .map(|label| label.as_u64().unwrap() as u32)
        .collect();
    let sightings = bench.read("sightings.csv");
    let found = index_of_sightings(&sightings, &labels);
    let detections = Detections::read_csv(bench.path("detections.csv")).unwrap();
    let truth: Vec<u32> = detections
        .truth()
        .iter()
        .map(|id| id.unwrap() as u32)
        .collect();
    let tracked = index_of_sightings(&sightings, &truth);
    println!("by sighting: {found:.3}, of the tracker alone {tracked:.3}");
    assert!(
        tracked < 1.0 && found > 0.8,
        "{found}, of the tracker alone {tracked}"
    );
}

#[test]
fn lost_in_the_woods_thinned() {
    let Some(folder) = shared("lost_in_the_woods") else {
        return;
    };
    let (mut recording, rows) = read_range_bearing(&folder.join("detections.csv.gz")).unwrap();
    assert_eq!(recording.n_seen(), 61_086);
    recording.truth = Some(read_truth(&folder.join("truth.csv.gz"), &rows).unwrap());
    let mean = mean_nees_of_windows(&recording, Format::RangeBearing, 120.0, 20);
    assert!(is_honest(mean), "{mean}");
}

#[test]
fn circles_with_clutter() {
    let Some(file) = shared("dlr_circles/detections_corrected.csv.gz") else {
        return;
    };
    let (recording, rows) = read_range_bearing(&file).unwrap();
    let n_clutter = rows
        .iter()
        .filter(|(_, landmark)| landmark.is_none())
        .count();
    assert_eq!((recording.n_seen(), n_clutter), (14_620, 436));
    let bench = Bench::new();
    let said = bench.ok(&["import", file.to_str().unwrap(), "--until", "300"]);
    assert!(said.contains("against true places: unknown"), "{said}");
}
