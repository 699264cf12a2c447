//! A map as texts: the whole graph as g2o, the trajectory as TUM, the sightings as CSV.
//!
//! Numbers are written so that they are read again bit for bit.

use std::fmt::Write as _;

use super::graph::Graph;
use super::solution::SolvedMap;

/// The graph with the landmarks of a map: `VERTEX_SE2` for poses from 0 on, `VERTEX_XY` for
/// landmarks behind them, `FIX 0`, `EDGE_SE2` for odometry and `EDGE_SE2_XY` for every sighting.
/// g2o, GTSAM and `ptm` read it; the vertices stand at the optimum.
pub fn g2o(graph: &Graph, map: &SolvedMap) -> String {
    let mut text = String::new();
    for (k, pose) in map.poses.iter().enumerate() {
        let (x, y, heading) = (pose.x_m, pose.y_m, pose.heading_rad);
        let _ = writeln!(text, "VERTEX_SE2 {k} {x} {y} {heading}");
    }
    let n_poses = map.poses.len();
    for (m, [x, y]) in map.landmarks_m.iter().enumerate() {
        let _ = writeln!(text, "VERTEX_XY {} {x} {y}", n_poses + m);
    }
    text.push_str("FIX 0\n");
    for (k, edge) in graph.odometry.iter().enumerate() {
        let z = edge.relative;
        let i = &edge.information;
        let _ = writeln!(
            text,
            "EDGE_SE2 {k} {} {} {} {} {} {} {} {} {} {}",
            k + 1,
            z.x_m,
            z.y_m,
            z.heading_rad,
            i.m11,
            i.m12,
            i.m13,
            i.m22,
            i.m23,
            i.m33
        );
    }
    for (one, label) in graph.observations.iter().zip(&map.labels) {
        let landmark = n_poses + *label as usize;
        let ([x, y], [xx, xy, yy]) = (one.at_m, one.information);
        let pose = one.pose;
        let _ = writeln!(text, "EDGE_SE2_XY {pose} {landmark} {x} {y} {xx} {xy} {yy}");
    }
    text
}

/// The trajectory as `evo` reads it: time (s), x, y, z (m), quaternion x, y, z, w.
pub fn tum(graph: &Graph, map: &SolvedMap) -> String {
    let mut text = String::new();
    for (time_s, pose) in graph.times_s.iter().zip(&map.poses) {
        let (sin, cos) = libm::sincos(0.5 * pose.heading_rad);
        let _ = writeln!(text, "{time_s} {} {} 0 0 0 {sin} {cos}", pose.x_m, pose.y_m);
    }
    text
}

/// A row for each sighting: time (s), number of the pose, where it lies from the solved pose (m),
/// its landmark and the probability of that (nothing where none is known), and the landmark that
/// the recording names.
pub fn sightings_csv(graph: &Graph, map: &SolvedMap, probabilities: Option<&[f64]>) -> String {
    let mut text = String::from("t,pose,x,y,id,probability,landmark\n");
    let positions = map.sighted_m(graph);
    for (s, (one, [x, y])) in graph.observations.iter().zip(positions).enumerate() {
        let id = map.labels[s];
        let probability = probabilities.map_or_else(String::new, |all| all[s].to_string());
        let landmark = one.landmark.map_or_else(String::new, |id| id.to_string());
        let (time_s, pose) = (graph.times_s[one.pose], one.pose);
        let _ = writeln!(
            text,
            "{time_s},{pose},{x},{y},{id},{probability},{landmark}"
        );
    }
    text
}
