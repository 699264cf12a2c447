//! Landmarks reported twice in a scan.

use super::*;
use crate::mission::duplicates::fuse;
use crate::mission::optimum::optimise;

/// Two poses that see six landmarks far from each other, each twice with an error of about one σ.
fn doubled() -> Graph {
    let mut graph = crowded();
    graph.observations = (0..12)
        .flat_map(|k| {
            let (pose, landmark) = (usize::from(k >= 6), f64::from(k % 6));
            let at = [8.0 * landmark - pose as f64, 3.0];
            let off = 0.3 * f64::from(k % 3);
            [
                seen(pose, at, [9.0, 0.0, 9.0]),
                seen(pose, [at[0] + off, at[1] - off], [4.0, 1.0, 9.0]),
            ]
        })
        .collect();
    graph
}

#[test]
fn duplicates_are_fused_only_where_there_are_some() {
    assert!(fuse(&crowded()).is_none());
    let fused = fuse(&doubled()).expect("duplicates");
    assert_eq!(fused.graph.observations.len(), 12);
    let expected: Vec<usize> = (0..24).map(|s| s / 2).collect();
    assert_eq!(fused.place_of, expected);
}

#[test]
fn fusing_leaves_the_optimum_where_it_is() {
    let graph = doubled();
    let fused = fuse(&graph).expect("duplicates").graph;
    let poses = graph.dead_reckoned();
    let labels: Vec<u32> = (0..12).map(|s| s % 6).collect();
    let twice: Vec<u32> = (0..24).map(|s| (s / 2) % 6).collect();
    let [one, two] = [(&fused, labels), (&graph, twice)].map(|(graph, labels)| {
        let mut poses = poses.clone();
        optimise(graph.part(), &mut poses, &labels, 60).expect("positive definite");
        poses
    });
    for (a, b) in one.iter().zip(&two) {
        assert!((a.x_m - b.x_m).abs() < 1e-9 && (a.y_m - b.y_m).abs() < 1e-9);
        assert!((a.heading_rad - b.heading_rad).abs() < 1e-9);
    }
}

#[test]
fn two_sightings_are_as_probable_as_their_mean_and_difference() {
    // The arm of a sighting counts as it was seen, so with unsure headings this holds to first order.
    let mut graph = doubled();
    for edge in &mut graph.odometry {
        edge.information[(2, 2)] = 1e10;
    }
    let fused = fuse(&graph).expect("duplicates");
    let twice: Vec<u32> = (0..24).map(|s| (s / 2) % 6).collect();
    let once: Vec<u32> = (0..12).map(|s| s % 6).collect();
    let apart = ln_integral(&fused.graph, &once) + fused.ln_differences;
    assert!((ln_integral(&graph, &twice) - apart).abs() < 1e-4);
}
