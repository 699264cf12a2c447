//! MRCLAM folders.

use super::super::mrclam::{Files, Text};
use super::super::read_mrclam;
use super::super::recording::ORIGIN;
use super::super::truth::Truth;

pub(super) fn text(path: &str, text: &str) -> Text {
    Text {
        path: path.to_owned(),
        text: text.to_owned(),
    }
}

/// Subject 6 is barcode 63 and subject 1 is barcode 6: a reader that took barcodes for subjects would
/// show it.
pub(super) fn folder() -> Files {
    Files {
        barcodes: text(
            "B",
            "# Subject  Barcode\r\n  1 \t 6\r\n 6 \t  63\r\n7\t 9.0 # new\r\n",
        ),
        odometry: text(
            "O",
            "# t v w\n100.0 \t 1.0 \t 0.0\n\n101.0 1.0 0.5\n102.0 0.0 0.0\n110 0 0",
        ),
        measurements: text(
            "M",
            "100.5 63 2.0 0.1\n100.5\t6\t1.0\t0.0\n100.5 99 3.0 0.2\n101.5 9 4.0 -0.3\n99.0 63 2 0\n111 63 2 0\n",
        ),
        landmarks: Some(text("L", "6 1 2 0.1 0.1\n7 3 4 0.1 0.1\n")),
        poses: Some(text("G", "100 5 5 3.0\n100.4 5 7 -3.0\n")),
    }
}

#[test]
fn an_mrclam_folder_is_one_stream() {
    let recording = folder().parse().expect("a good folder");
    let times: Vec<f64> = recording.stops.iter().map(|stop| stop.time_s).collect();
    assert_eq!(times, [0.0, 0.5, 1.0, 1.5, 2.0, 10.0]);
    let landmarks: Vec<Vec<_>> = recording
        .stops
        .iter()
        .map(|stop| stop.seen.iter().map(|seen| seen.landmark).collect())
        .collect();
    assert_eq!(landmarks[1], [Some(6), None]);
    assert_eq!(landmarks[3], [Some(7)]);
    let notes: Vec<(usize, &str)> = recording
        .notes
        .iter()
        .map(|n| (n.count.expect("counted"), n.what.as_str()))
        .collect();
    assert_eq!(
        notes,
        [
            (1, "sightings of other robots dropped"),
            (2, "sightings without odometry dropped"),
            (1, "sightings of unknown barcodes kept as clutter"),
            (1, "pauses of the odometry above 2 s, velocities held"),
        ]
    );
    // 1 s straight at 1 m/s, then an arc of 0.5 rad with radius 2 m; then the robot stands.
    let end = recording
        .stops
        .iter()
        .fold(ORIGIN, |pose, stop| pose.then(stop.increment.relative));
    let expected = (1.0 + 2.0 * 0.5f64.sin(), 2.0 * (1.0 - 0.5f64.cos()));
    assert!(
        (end.x_m - expected.0).abs() + (end.y_m - expected.1).abs() < 1e-12,
        "{end:?}"
    );
    assert!((end.heading_rad - 0.5).abs() < 1e-12);
}

#[test]
fn true_places_are_seen_from_the_true_pose_at_the_start() {
    let truth = folder().parse().expect("good").truth.expect("has one");
    // Half-way between headings 3 and −3 lies π, not 0.
    let pose = truth.pose_at(0.2).expect("between two");
    assert!((pose.y_m - 6.0).abs() < 1e-12 && pose.heading_rad.cos() < -0.999_999);
    let places = truth.landmarks_in_frame_m(0.2, ORIGIN).expect("known");
    assert!(
        (places[&6][0] - 4.0).abs() < 1e-9 && (places[&6][1] - 4.0).abs() < 1e-9,
        "{places:?}"
    );
    assert_eq!(truth.pose_at(-1.0), None);
    assert_eq!(truth.pose_at(0.5), None);
}

#[test]
fn without_ground_truth_subjects_above_five_are_landmarks() {
    let files = Files {
        landmarks: None,
        poses: None,
        ..folder()
    };
    let with = folder().parse().expect("good");
    let without = files.parse().expect("good");
    assert_eq!(without.stops, with.stops);
    assert_eq!(without.truth, Some(Truth::default()));
}

#[test]
fn what_is_wrong_in_a_folder_is_named_with_its_line() {
    let odometry = |line: &str| Files {
        odometry: text("O", &format!("# head\n100 0 0\n{line}\n")),
        ..folder()
    };
    let measured = |line: &str| Files {
        measurements: text("M", &format!("100.5 63 2 0\n\n{line}")),
        ..folder()
    };
    let barcodes = |line: &str| Files {
        barcodes: text("B", &format!("6 63\n{line}")),
        ..folder()
    };
    let landmarks = |line: &str| Files {
        landmarks: Some(text("L", &format!("6 1 2 0 0\n{line}"))),
        ..folder()
    };
    let poses = Files {
        poses: Some(text("G", "100 5 5\n")),
        ..folder()
    };
    let cases = [
        (
            odometry("101 1"),
            "O, line 3: got 2 fields, expected 3: time, forward velocity, angular velocity; correct the line",
        ),
        (
            odometry("101 1 nan"),
            "O, line 3, column angular velocity: got \"nan\", expected a finite number; correct the row",
        ),
        (
            odometry("1e999 1 0"),
            "O, line 3, column time: got \"1e999\", expected a finite number; correct the row",
        ),
        (
            measured("101 63.5 2 0"),
            "M, line 3, column barcode: got \"63.5\", expected a whole number; correct the row",
        ),
        (
            measured("101 63 0 0"),
            "M, line 3, column range: got \"0\", expected a range above 0 m; correct the row",
        ),
        (
            measured("101 63 2"),
            "M, line 3: got 3 fields, expected 4: time, barcode, range, bearing; correct the line",
        ),
        (
            barcodes("7 63"),
            "B, line 2, column barcode: got \"63\", expected a barcode that no other subject has; correct the row",
        ),
        (
            landmarks("6 1 2 0 0"),
            "L, line 2, column subject: got \"6\", expected each subject once; correct the row",
        ),
        (
            poses,
            "G, line 1: got 3 fields, expected 4: time, x, y, orientation; correct the line",
        ),
        (
            Files {
                odometry: text("O", "# nothing\n"),
                ..folder()
            },
            "O: got no line of odometry, expected at least one; give the whole file",
        ),
        (
            Files {
                measurements: text("M", "100.5 6 2 0\n"),
                ..folder()
            },
            "M: got no sightings of landmarks while there was odometry, 1 of robots, 0 at other times, expected at least one; check the file",
        ),
    ];
    for (files, expected) in cases {
        assert_eq!(files.parse().expect_err("faulty").to_string(), expected);
    }
}

#[test]
fn odometry_out_of_order_is_sorted_and_counted_and_of_equal_times_the_last_holds() {
    let files = Files {
        odometry: text("O", "102 0 0\n100 5 5\n100 1 0\n"),
        measurements: text("M", "101 63 2 0\n"),
        ..folder()
    };
    let recording = files.parse().expect("good");
    assert_eq!(
        recording.notes[0].what,
        "lines of odometry sorted into order of time"
    );
    assert_eq!(recording.stops[1].increment.relative.x_m, 1.0);
    assert_eq!(recording.stops[1].increment.relative.heading_rad, 0.0);
}

#[test]
fn the_robot_must_be_chosen_where_there_are_several() {
    let folder = tempfile::tempdir().expect("a folder");
    let refusal = |robot| {
        read_mrclam(folder.path(), robot)
            .expect_err("faulty")
            .to_string()
    };
    let place = folder.path().display();
    assert_eq!(
        refusal(None),
        format!(
            "{place}: got no file Robot<n>_Measurement.dat, expected a folder of UTIAS MRCLAM; give the folder that holds the .dat files, or a file"
        )
    );
    let write =
        |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("Robot3_Measurement.dat", "100.5 63 2 0\n");
    write("Robot3_Odometry.dat", "100 1 0\n101 1 0\n");
    assert!(refusal(None).contains("Barcodes.dat: cannot be read"));
    write("Barcodes.dat", "6 63\n");
    assert_eq!(
        read_mrclam(folder.path(), None)
            .expect("one robot")
            .n_seen(),
        1
    );
    assert_eq!(
        refusal(Some(2)),
        format!("--robot: got 2, expected one of the robots of {place}: 3; give another")
    );
    write("Robot4_Measurement.dat", "");
    assert!(refusal(None).starts_with("--robot: got nothing, expected one of"));
    assert_eq!(
        read_mrclam(folder.path(), Some(3))
            .expect("chosen")
            .n_seen(),
        1
    );
}
