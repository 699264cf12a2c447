//! g2o files.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Matrix2;

use super::super::ImportError;
use super::super::g2o::parse;
use super::super::recording::{ORIGIN, Recording};
use crate::input::Source;
use crate::sighting::Pose;

const UNIT: &str = "1 0 0 1 0 1";

/// Poses 10, 11, 15 with landmarks between them in number; lines in no order.
fn graph() -> String {
    format!(
        "\u{feff}EDGE_SE2_XY 11 12 0 2 4 0 1\r\nPARAMS_SE2OFFSET 0 0 0 0\nEDGE_SE2 11 15 1 0 0 {UNIT}\n\
         # note\nVERTEX_XY 12 3 4\nFIX 10\nVERTEX_SE2 15 9 9 9\nVERTEX_SE2 10 8 8 8\n\
         EDGE_SE2 10 15 7 7 7 {UNIT}\nEDGE_SE2 10 11 2 0 1.5707963267948966 100 0 0 25 0 4\n\
         VERTEX_SE2 11 7 7 7\nEDGE_BEARING_SE2_XY 10 12 0.5 1\nEDGE_BEARING_SE2_XY 11 12 0.5 1\n\
         VERTEX_SWITCH 90 1\nEDGE_SE2_XY 15 12 1 1 2 1 2\n"
    )
}

fn read_graph(text: &str) -> Result<Recording, ImportError> {
    parse(Source::from_reader(text.as_bytes(), Path::new("a.g2o"))?)
}

#[test]
fn a_graph_is_walked_by_growing_number_of_pose() {
    let recording = read_graph(&graph()).expect("a good graph");
    assert_eq!(recording.stops.len(), 3);
    assert_eq!(recording.stops[1].increment.relative.x_m, 2.0);
    let covariance = recording.stops[1].increment.covariance.expect("stated");
    let diagonal = [0.01, 0.04, 0.25];
    assert!(
        (0..3).all(|k| (covariance[(k, k)] - diagonal[k]).abs() < 1e-12),
        "{covariance}"
    );
    let landmarks: Vec<_> = recording.stops.iter().map(|stop| stop.seen.len()).collect();
    assert_eq!(landmarks, [0, 1, 1]);
    // Ahead in the second pose's axes is north of the start: (0, 2) to the left lies west.
    let seen = recording.stops[1].seen[0];
    assert!((seen.bearing_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let notes: Vec<(Option<usize>, &str)> = recording
        .notes
        .iter()
        .map(|n| (n.count, n.what.as_str()))
        .collect();
    assert_eq!(
        notes,
        [
            (Some(2), "EDGE_BEARING_SE2_XY left out"),
            (Some(1), "VERTEX_SWITCH left out"),
            (Some(1), "EDGE_SE2 off the chain (loop closures) left out"),
        ]
    );
}

#[test]
fn a_stated_information_comes_back_as_the_covariance_in_the_plane() {
    let recording = read_graph(&graph()).expect("a good graph");
    let seen = recording.stops[2].seen[0];
    let [range_std, bearing_std, correlation] = seen.stated.expect("stated");
    let (sin, cos) = seen.bearing_rad.sin_cos();
    let r = seen.range_m;
    let j = Matrix2::new(cos, -r * sin, sin, r * cos);
    let shared = correlation * range_std * bearing_std;
    let polar = Matrix2::new(range_std.powi(2), shared, shared, bearing_std.powi(2));
    let expected = Matrix2::new(2.0, 1.0, 1.0, 2.0)
        .try_inverse()
        .expect("positive");
    assert!((j * polar * j.transpose() - expected).norm() < 1e-12);
}

#[test]
fn edges_walked_backwards_lead_to_the_same_place_with_the_same_error() {
    let forward = format!(
        "EDGE_SE2 1 2 2 1 0.5 100 3 2 25 1 4\nEDGE_SE2 2 3 1 0 0 {UNIT}\nEDGE_SE2_XY 3 9 1 0 1 0 1\n"
    );
    let there = read_graph(&forward).expect("good").stops[1].increment;
    // The inverse of (2, 1, 0.5), with the information as an exact change of variables gives it.
    let z = Pose {
        x_m: 2.0,
        y_m: 1.0,
        heading_rad: 0.5,
    };
    let back = z.to(ORIGIN);
    let (sin, cos) = 0.5f64.sin_cos();
    let adjoint = nalgebra::Matrix3::new(cos, -sin, 1.0, sin, cos, -2.0, 0.0, 0.0, 1.0);
    let covariance = there.covariance.expect("stated");
    let turned = (adjoint * covariance * adjoint.transpose())
        .try_inverse()
        .expect("positive");
    let mut edge = format!(
        "EDGE_SE2 2 1 {} {} {}",
        back.x_m, back.y_m, back.heading_rad
    );
    for (i, j) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
        write!(edge, " {}", turned[(i, j)]).expect("a String takes any text");
    }
    let backward = forward.replacen("EDGE_SE2 1 2 2 1 0.5 100 3 2 25 1 4", &edge, 1);
    let again = read_graph(&backward).expect("good").stops[1].increment;
    assert!((again.relative.x_m - 2.0).abs() + (again.relative.y_m - 1.0).abs() < 1e-12);
    assert!((again.covariance.expect("stated") - covariance).norm() < 1e-9);
}

#[test]
fn numbers_in_no_order_are_walked_by_first_arrival() {
    // 7 → 2 → 5 → 1, a closure 1 → 7, and the first line is not the first pose.
    let text = format!(
        "EDGE_SE2 2 5 2 0 0 {UNIT}\nEDGE_SE2 7 2 1 0 0 {UNIT}\nEDGE_SE2 5 1 3 0 0 {UNIT}\nEDGE_SE2_XY 1 90 1 0 1 0 1\n"
    );
    let steps = |text: &str| -> Vec<f64> {
        let recording = read_graph(text).expect("a good graph");
        recording
            .stops
            .iter()
            .map(|stop| stop.increment.relative.x_m)
            .collect()
    };
    assert_eq!(steps(&text), [0.0, 1.0, 2.0, 3.0]);
    let closed = format!("EDGE_SE2 7 2 1 0 0 {UNIT}\n{text}EDGE_SE2 1 7 9 0 0 {UNIT}\n");
    assert_eq!(steps(&closed), [0.0, 1.0, 2.0, 3.0]);
}

#[test]
fn what_is_wrong_in_a_graph_is_named_with_its_line() {
    let good = format!(
        "VERTEX_SE2 1 0 0 0\nVERTEX_SE2 2 0 0 0\nEDGE_SE2 1 2 1 0 0 {UNIT}\nEDGE_SE2_XY 1 9 1 0 1 0 1\n"
    );
    assert!(read_graph(&good).is_ok());
    let cases = [
        (
            "EDGE_SE2_XY 1 9 1 0 1 0",
            "a.g2o, line 5: got 7 fields, expected 8: EDGE_SE2_XY, pose, landmark, x, y, and 3 of the information; correct the line",
        ),
        (
            "EDGE_SE2_XY 1 9 1 nan 1 0 1",
            "a.g2o, line 5, column values: got \"nan\", expected a finite number; correct the row",
        ),
        (
            "EDGE_SE2_XY 1 9 1 0 1 2 1",
            "a.g2o, line 5, column information: got \"1 2 1\", expected a positive definite information (xx xy yy); correct the row",
        ),
        (
            "EDGE_SE2_XY 1 2 1 0 1 0 1",
            "a.g2o, line 5: got a sighting of vertex 2, which is a pose, expected a landmark; correct the numbers of the vertices",
        ),
        (
            "EDGE_SE2_XY 3 9 1 0 1 0 1",
            "a.g2o, line 5: got a sighting from vertex 3, expected a pose that a VERTEX_SE2 or EDGE_SE2 names; correct the numbers of the vertices",
        ),
        (
            "EDGE_SE2 1 1 1 0 0 1 0 0 1 0 1",
            "a.g2o, line 5, column to: got \"1\", expected another pose than the edge starts from; correct the row",
        ),
        (
            "VERTEX_SE2 2 0 0 0",
            "a.g2o, line 5, column id: got \"2\", expected each vertex once; correct the row",
        ),
        (
            "VERTEX_SE2 3 0 0 0",
            "a.g2o: got no EDGE_SE2 between the poses 2 and 3, expected odometry that joins all poses to one path; add the edge, or cut the file there",
        ),
        (
            "VERTEX_SE2 x 0 0 0",
            "a.g2o, line 5, column id: got \"x\", expected a whole number; correct the row",
        ),
        (
            "FIX one",
            "a.g2o, line 5, column id: got \"one\", expected a whole number; correct the row",
        ),
        (
            "1 2 3",
            "a.g2o, line 5, column tag: got \"1\", expected a tag, such as EDGE_SE2_XY; correct the row",
        ),
        (
            "VERTEX_XY 4 0 0\nEDGE_SE2 2 4 1 0 0 1 0 0 1 0 1",
            "a.g2o, line 6: got odometry of vertex 4, which is a VERTEX_XY, expected two poses; correct the numbers of the vertices",
        ),
        (
            "EDGE_SE2 2 3 1 0 0 0 0 0 0 0 0",
            "a.g2o, line 5: got the information 0 0 0 0 0 0, expected a positive definite one (xx xy xθ yy yθ θθ), as the pose is reached by this edge; correct the line",
        ),
    ];
    for (line, expected) in cases {
        let error = read_graph(&format!("{good}{line}\n")).expect_err(line);
        assert_eq!(error.to_string(), expected, "{line}");
    }
    let error = |text: &str| read_graph(text).expect_err("nothing").to_string();
    assert_eq!(
        error(""),
        "a.g2o: got no sightings by EDGE_SE2_XY, LANDMARK or the like, expected at least one; check the file"
    );
    assert_eq!(
        error("VERTEX_SWITCH 0 1\n"),
        "a.g2o: got no sightings by EDGE_SE2_XY, LANDMARK or the like, 1 VERTEX_SWITCH left out, expected at least one; check the file"
    );
}
