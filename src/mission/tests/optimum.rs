//! The optimum of a graph.

use super::*;
use crate::mission::optimum::{chi_square, optimise, optimum};

#[test]
fn nothing_near_the_optimum_fits_better() {
    let graph = crowded();
    let labels = [0, 1, 0, 1, 0, 1, 2];
    let reach = Reach::of(&graph.observations);
    let found = optimum(graph.part(), &graph.dead_reckoned(), &labels, reach, 60)
        .expect("positive definite");
    assert_eq!(found.poses[0], graph.start);
    assert_eq!(found.degrees_of_freedom(), 8);
    for k in 1..3 {
        for axis in 0..3 {
            let at = |step: f64| {
                let mut poses = found.poses.clone();
                let pose = &mut poses[k];
                *[&mut pose.x_m, &mut pose.y_m, &mut pose.heading_rad][axis] += step;
                chi_square(graph.part(), &poses, &labels)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!(slope.abs() < 1e-5, "pose {k}, axis {axis}: {slope}");
            assert!(at(1e-2) > found.chi_square && at(-1e-2) > found.chi_square);
        }
    }
}

#[test]
fn the_integral_is_that_of_dense_algebra_where_the_graph_is_linear() {
    let mut graph = crowded();
    for edge in &mut graph.odometry {
        edge.information[(2, 2)] = 1e12;
    }
    let off = |labels: &[u32]| {
        let mut poses = graph.dead_reckoned();
        let found = optimise(graph.part(), &mut poses, labels, 60).expect("positive definite");
        let (chi_square, ln_determinants) = found;
        let m = f64::from(labels.iter().max().map_or(0, |&most| most + 1));
        let ln_found = -0.5 * chi_square + ln_determinants + m * std::f64::consts::TAU.ln();
        ln_found - ln_integral(&graph, labels)
    };
    let all = all_partitions(&graph);
    let first = off(&all[0]);
    for labels in &all {
        assert!((off(labels) - first).abs() < 1e-5, "{labels:?}");
    }
}
