//! Graphs that other programs than g2o write: iSAM, gtsam, TORO, g2o's tutorial, and sensors with
//! offsets.

use std::path::Path;

use nalgebra::{Matrix2, Matrix3};

use super::super::g2o::parse;
use super::super::recording::{Recording, Seen};
use super::super::{ImportError, Stated, information_doubt};
use crate::input::Source;
use crate::sighting::Pose;

fn read(text: &str) -> Result<Recording, ImportError> {
    parse(Source::from_reader(text.as_bytes(), Path::new("a.txt"))?)
}

fn good(text: &str) -> Recording {
    read(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn refusal(text: &str) -> String {
    read(text).expect_err(text).to_string()
}

fn seen(recording: &Recording) -> Vec<Seen> {
    let stops = recording.stops.iter();
    stops.flat_map(|stop| stop.seen.iter().copied()).collect()
}

/// The covariance in the plane of what a sighting states.
fn in_plane(seen: &Seen) -> Matrix2<f64> {
    let [range_std, bearing_std, correlation] = seen.stated.expect("stated");
    let (sin, cos) = seen.bearing_rad.sin_cos();
    let j = Matrix2::new(cos, -seen.range_m * sin, sin, seen.range_m * cos);
    let shared = correlation * range_std * bearing_std;
    let polar = Matrix2::new(range_std.powi(2), shared, shared, bearing_std.powi(2));
    j * polar * j.transpose()
}

const ISAM: &str = "ODOMETRY 0 1 1.0 0.0 0.0 10000 0 0 10000 0 250000\n\
                    ODOMETRY 1 2 1.0 0.0 0.1 10000 0 0 10000 0 250000\n\
                    LANDMARK 0 0 5.0 2.0 25 0 25\n\
                    LANDMARK 2 0 3.1 1.6 25 0 25\n\
                    LANDMARK 2 2 1.0 1.0 25 3 16\n";

#[test]
fn landmarks_of_isam_have_numbers_of_their_own() {
    let recording = good(ISAM);
    assert_eq!(recording.stops.len(), 3);
    let landmarks: Vec<_> = seen(&recording).iter().map(|one| one.landmark).collect();
    assert_eq!(landmarks, [Some(0), Some(0), Some(2)]);
    assert!((in_plane(&seen(&recording)[0])[(0, 0)] - 0.04).abs() < 1e-12);
    // The same graph by the tags of g2o, where the landmarks are vertices 10 and 12.
    let g2o = ISAM
        .replace("ODOMETRY", "EDGE_SE2")
        .replace("LANDMARK 0 0", "EDGE_SE2_XY 0 10")
        .replace("LANDMARK 2 0", "EDGE_SE2_XY 2 10")
        .replace("LANDMARK 2 2", "EDGE_SE2_XY 2 12");
    let g2o = good(&g2o);
    for (a, b) in recording.stops.iter().zip(&g2o.stops) {
        assert_eq!(a.increment, b.increment);
        let without = |seen: &Seen| Seen {
            landmark: None,
            ..*seen
        };
        let of = |seen: &[Seen]| seen.iter().map(without).collect::<Vec<_>>();
        assert_eq!(of(&a.seen), of(&b.seen));
    }
    // cityTrees: vertices and edges of g2o, landmarks by LANDMARK2, whose vertices share numbers
    // with poses.
    let trees = ISAM
        .replace("ODOMETRY", "EDGE_SE2")
        .replace("LANDMARK", "LANDMARK2");
    let trees = format!("VERTEX_SE2 0 0 0 0\nVERTEX_XY 0 5 2\nVERTEX_XY 2 3 2\n{trees}");
    assert_eq!(good(&trees), recording);
    let both = format!("{ISAM}EDGE_SE2_XY 1 9 1 0 1 0 1\n");
    assert_eq!(
        refusal(&both),
        "a.txt, line 6: got a sighting by EDGE_SE2_XY and one by LANDMARK or BR, expected landmarks \
         that are all vertices, or none; correct the numbers of the vertices"
    );
}

#[test]
fn bearings_and_ranges_of_gtsam_are_taken_as_stated() {
    let text = "ODOMETRY 0 1 1 0 0 1 0 0 1 0 1\nBR 1 0 0.5 4 0.02 0.1\n";
    let seen = seen(&good(text))[0];
    assert_eq!((seen.bearing_rad, seen.range_m), (0.5, 4.0));
    assert_eq!(
        (seen.stated, seen.landmark),
        (Some([0.1, 0.02, 0.0]), Some(0))
    );
    for (from, to, column) in [
        ("0.5", "30", "bearing"),
        (" 4 ", " 0 ", "range"),
        ("0.02", "0", "standard deviation"),
    ] {
        let refused = refusal(&text.replace(from, to));
        assert!(
            refused.starts_with(&format!("a.txt, line 2, column {column}: got")),
            "{refused}"
        );
    }
}

#[test]
fn edge2_is_read_in_the_order_of_rows_or_of_toro() {
    let covariance = |information: &str| {
        let text = format!("EDGE2 0 1 1 0 0 {information}\nLANDMARK 1 0 1 0 1 0 1\n");
        let recording = good(&text);
        let n_notes = recording.notes.len();
        (
            recording.stops[1].increment.covariance.expect("stated"),
            n_notes,
        )
    };
    let expected = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.25, 0.2, 0.1));
    for (information, n_notes) in [("4 0 0 5 0 10", 0), ("4 0 5 10 0 0", 1)] {
        let (found, n) = covariance(information);
        assert!((found - expected).norm() < 1e-12, "{found}");
        assert_eq!(n, n_notes);
    }
    // Tags whose order is known are not guessed.
    let text = "EDGE_SE2 0 1 1 0 0 4 0 5 10 0 0\nLANDMARK 1 0 1 0 1 0 1\n";
    assert_eq!(
        refusal(text),
        "a.txt, line 1: got the information 4 0 5 10 0 0, expected a positive definite one (xx xy \
         xθ yy yθ θθ), as the pose is reached by this edge; correct the line"
    );
}

#[test]
fn a_sensor_with_an_offset_sees_from_where_it_sits() {
    // On the robot's left, looking left: a metre ahead of it is two metres to the robot's left.
    let offset = "PARAMS_SE2OFFSET 3 0.5 1 1.5707963267948966\n";
    let edge = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
    let sighting = "EDGE_SE2_POINTXY_OFFSET 1 9 3 1 0.5 4 1 2\n";
    for text in [
        format!("{offset}{edge}{sighting}"),
        format!("{sighting}{edge}{offset}"),
        format!("{offset}{edge}{sighting}")
            .replace("PARAMS_SE2OFFSET", "TUTORIAL_PARAMS_SE2_OFFSET")
            .replace("EDGE_SE2 ", "TUTORIAL_EDGE_SE2 ")
            .replace("EDGE_SE2_POINTXY_OFFSET", "TUTORIAL_EDGE_SE2_POINT_XY"),
    ] {
        let seen = seen(&good(&text))[0];
        assert!((seen.range_m - 2.0).abs() < 1e-12, "{seen:?}");
        assert!((seen.bearing_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let turn = Matrix2::new(0.0, -1.0, 1.0, 0.0);
        let information = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        let expected = turn * information.try_inverse().expect("positive") * turn.transpose();
        assert!((in_plane(&seen) - expected).norm() < 1e-12);
    }
    // Without turn or shift it is as if there was none, to the last bit.
    let none = format!("PARAMS_SE2OFFSET 3 0 0 0\n{edge}{sighting}");
    let plain = format!("{edge}EDGE_SE2_XY 1 9 1 0.5 4 1 2\n");
    assert_eq!(seen(&good(&none)), seen(&good(&plain)));
    let tutorial = format!("{edge}TUTORIAL_EDGE_SE2_POINT_XY 1 9 1 0.5 4 1 2\n");
    assert_eq!(good(&tutorial), good(&plain));
    assert_eq!(
        refusal(&format!("{edge}{sighting}")),
        "a.txt, line 2: got a sensor with the offset 3, expected a line PARAMS_SE2OFFSET 3 that says \
         where it sits; add the line, with 0 0 0 for a sensor at the robot's centre"
    );
    let indefinite = sighting.replace("4 1 2", "100 200 100");
    assert_eq!(
        refusal(&format!("{offset}{edge}{indefinite}")),
        "a.txt, line 3, column information: got \"100 200 100\", expected a positive definite \
         information (xx xy yy); correct the row"
    );
}

#[test]
fn odometry_between_sensors_with_offsets_moves_the_robot() {
    let pose = |x_m, y_m, heading_rad| Pose {
        x_m,
        y_m,
        heading_rad,
    };
    let (first, second) = (pose(0.5, 1.0, 0.3), pose(-0.2, 0.4, -1.1));
    let driven = pose(2.0, 0.3, 0.7);
    let from_sensor = first.to(pose(0.0, 0.0, 0.0).then(driven).then(second));
    let text = format!(
        "PARAMS_SE2OFFSET 0 0.5 1 0.3\nPARAMS_SE2OFFSET 1 -0.2 0.4 -1.1\n\
         EDGE_SE2_OFFSET 0 1 0 1 {} {} {} 100 0 0 25 0 400\nLANDMARK 1 0 1 0 1 0 1\n",
        from_sensor.x_m, from_sensor.y_m, from_sensor.heading_rad
    );
    let found = good(&text).stops[1].increment;
    let off = [
        found.relative.x_m - 2.0,
        found.relative.y_m - 0.3,
        found.relative.heading_rad - 0.7,
    ];
    assert!(off.iter().all(|d| d.abs() < 1e-12), "{off:?}");
    // A small error in the sensor's axes, followed to the robot's by moving the poses themselves.
    let moved = |error: [f64; 3]| {
        let [x, y, turn] = error;
        let with = first.then(from_sensor).then(pose(x, y, turn));
        let robot = driven.to(with.then(second.to(pose(0.0, 0.0, 0.0))));
        [robot.x_m, robot.y_m, robot.heading_rad]
    };
    let step = 1e-6;
    let columns = [0, 1, 2].map(|k| {
        let mut error = [0.0; 3];
        error[k] = step;
        moved(error).map(|value| value / step)
    });
    let j = Matrix3::from_fn(|row, column| columns[column][row]);
    let stated = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.01, 0.04, 0.0025));
    let expected = j * stated * j.transpose();
    let covariance = found.covariance.expect("stated");
    assert!(
        (covariance - expected).norm() < 1e-6,
        "{covariance} {expected}"
    );
}

#[test]
fn graphs_in_space_are_refused_by_their_first_line() {
    for line in [
        "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1",
        "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1",
        "EDGE3 0 1 0 0 0 0 0 0",
        "VERTEX3 0 0 0 0 0 0 0",
        "VERTEX_TRACKXYZ 0 0 0 0",
        "EDGE_SE3_TRACKXYZ 0 1 0 0 0",
        "POINT3 0 1 0 0 0",
    ] {
        let tag = line.split(' ').next().expect("a tag");
        assert_eq!(
            refusal(&format!("{line}\n")),
            format!(
                "a.txt, line 1, column tag: got {tag:?}, expected a graph in the plane (SE2); project \
                 poses and landmarks to the ground first; correct the row"
            )
        );
    }
}

#[test]
fn covariances_in_place_of_information_are_doubted() {
    let stated = Stated {
        heading_std_rad: 0.5,
        precision_m: 1.0,
        extent_m: 10.0,
    };
    let recording = good(ISAM);
    assert_eq!(information_doubt(&recording, &stated), None);
    for (doubtful, word) in [
        (
            Stated {
                heading_std_rad: 500.0,
                ..stated
            },
            "the heading is known to 500 rad only",
        ),
        (
            Stated {
                precision_m: 11.0,
                ..stated
            },
            "places are known to 11.0 m",
        ),
    ] {
        let doubt = information_doubt(&recording, &doubtful).expect("a doubt");
        assert!(doubt.starts_with(word) && doubt.ends_with('?'), "{doubt}");
    }
    let inverse = good(&ISAM.replace("10000 0 0 10000 0 250000", "0.01 0 0 0.01 0 4"));
    let doubt = information_doubt(&inverse, &stated).expect("a doubt");
    assert!(
        doubt.starts_with("a step of 1.00 m is known to 10.00 m only"),
        "{doubt}"
    );
    // A recording that states nothing has nothing to mistake.
    let mut unstated = inverse;
    unstated
        .stops
        .iter_mut()
        .for_each(|stop| stop.increment.covariance = None);
    assert_eq!(information_doubt(&unstated, &stated), None);
}

#[test]
fn headings_in_degrees_are_noted() {
    let text = ISAM
        .replace("0.1 10000", "5.7 10000")
        .replace("0.0 0.0 10000", "0.0 12.5 10000");
    let notes = good(&text).notes;
    assert_eq!(notes.len(), 1);
    assert_eq!(
        notes[0].to_string(),
        "1 headings of odometry beyond 2π: are they in degrees?"
    );
}
