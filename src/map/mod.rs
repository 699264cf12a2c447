//! The topometric map drawn from a topology: one node per set, edges from the order of the mission.
//!
//! A node stands at the mean of its members' x\*, which in the metric model is the mean of their
//! positions. An edge joins the sets of consecutive detections; self-edges are dropped, and how often
//! an edge was walked is its weight.

mod posterior;
mod write;

pub use posterior::{Node, PosteriorMap};
pub use write::MapFormat;

use std::collections::BTreeMap;

use crate::partition::Topology;

/// An edge between two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The node with the smaller number.
    pub first: usize,
    /// The other node.
    pub second: usize,
    /// How often the mission walked it, in either direction.
    pub weight: usize,
}

/// Nodes and edges.
#[derive(Clone, Debug, PartialEq)]
pub struct TopometricMap {
    /// Position of every set's node, m.
    pub nodes_m: Vec<[f64; 2]>,
    /// Edges by their nodes.
    pub edges: Vec<Edge>,
}

impl TopometricMap {
    /// The map of a topology of detections at these positions, in mission order.
    pub fn new(topology: &Topology, positions_m: &[[f64; 2]]) -> Self {
        let labels = topology.labels();
        assert_eq!(
            labels.len(),
            positions_m.len(),
            "a topology of these detections"
        );
        let mut sums = vec![([0.0; 2], 0.0); topology.n_sets()];
        for (&label, z) in labels.iter().zip(positions_m) {
            let (sum, n) = &mut sums[label as usize];
            sum[0] += z[0];
            sum[1] += z[1];
            *n += 1.0;
        }
        let mut weights = BTreeMap::new();
        for pair in labels.windows(2) {
            let (a, b) = (pair[0].min(pair[1]) as usize, pair[0].max(pair[1]) as usize);
            if a != b {
                *weights.entry((a, b)).or_insert(0) += 1;
            }
        }
        Self {
            nodes_m: sums
                .into_iter()
                .map(|(sum, n)| sum.map(|total| total / n))
                .collect(),
            edges: weights
                .into_iter()
                .map(|((first, second), weight)| Edge {
                    first,
                    second,
                    weight,
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_means_and_edges_follow_the_mission() {
        let topology = Topology::canonical(&[0, 1, 1, 0, 1]);
        let positions_m = [[0.0, 0.0], [4.0, 0.0], [6.0, 0.0], [0.0, 2.0], [5.0, 3.0]];
        let map = TopometricMap::new(&topology, &positions_m);
        assert_eq!(map.nodes_m, vec![[0.0, 1.0], [5.0, 1.0]]);
        assert_eq!(
            map.edges,
            vec![Edge {
                first: 0,
                second: 1,
                weight: 3
            }]
        );
    }
}
