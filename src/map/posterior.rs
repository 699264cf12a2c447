//! A topology's map with what the posterior says of each of its parts.
//!
//! - A node is a set. It stands at the mean of its members' x\*, with the covariance of that mean under
//!   Q = N(X\*, Σ) (source report, eq. 4): (1/n²) Σ_{ij} Σ_ij, which in the metric model is σ_o²/(2n)·I.
//!   It says how sure the place is *given* the set and the model, σ_o included.
//! - Its probability is the share of draws in which exactly these detections are a set.
//! - An edge joins the sets of consecutive detections; its weight is how often the mission passed.
//! - Its support is the share of draws in which it exists: in which at least one of those passes
//!   leads from one landmark to another.

use std::collections::{BTreeMap, HashMap};

use super::TopometricMap;
use crate::model::Model;
use crate::partition::{Partition, Topology};

/// A node with its probability.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Where it is, m.
    pub position_m: [f64; 2],
    /// Of that place, under the model: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// Its detections, from 0, in the order of the mission.
    pub members: Vec<usize>,
    /// Share of draws in which they are a set.
    pub probability: f64,
}

/// An edge with its support.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// The node with the smaller number.
    pub first: usize,
    /// The other node.
    pub second: usize,
    /// How often the mission passed, in either direction.
    pub weight: usize,
    /// Share of draws in which it exists.
    pub support: f64,
}

/// A map with probabilities.
#[derive(Clone, Debug, PartialEq)]
pub struct PosteriorMap {
    /// By label.
    pub nodes: Vec<Node>,
    /// By their nodes.
    pub edges: Vec<Edge>,
}

impl PosteriorMap {
    /// The map of a topology, of detections at these positions (m, in the order of the mission), under
    /// a model of them, with draws of the posterior and how often each was drawn.
    pub fn new(
        topology: &Topology,
        positions_m: &[[f64; 2]],
        model: &Model,
        draws: &[(&Topology, u64)],
    ) -> Self {
        let labels = topology.labels();
        let total: u64 = draws.iter().map(|(_, count)| count).sum();
        let share = |count: u64| count as f64 / total.max(1) as f64;
        let offset_m = match (positions_m.first(), model.positions_m().first()) {
            (Some(z), Some(centred)) => [z[0] - centred[0], z[1] - centred[1]],
            _ => [0.0; 2],
        };
        let sets = Partition::from_labels(labels);
        let mut members_of: Vec<Vec<u32>> = vec![Vec::new(); topology.n_sets()];
        for (i, &label) in labels.iter().enumerate() {
            members_of[label as usize].push(i as u32);
        }
        let mut counts: HashMap<Vec<u32>, u64> =
            sets.sets().iter().map(|set| (sorted(set), 0)).collect();
        for (draw, count) in draws {
            for set in Partition::from_labels(draw.labels()).sets() {
                if let Some(seen) = counts.get_mut(&sorted(set)) {
                    *seen += count;
                }
            }
        }
        let node = |members: &Vec<u32>| {
            let (position_m, covariance_m2) = place(model, members, offset_m);
            Node {
                position_m,
                covariance_m2,
                probability: share(counts.get(members).copied().unwrap_or(0)),
                members: members.iter().map(|&i| i as usize).collect(),
            }
        };
        let nodes = members_of.iter().map(node).collect();
        Self::of_nodes(nodes, topology, positions_m, draws)
    }

    /// The map of a topology whose nodes are known, by label. The rest is as for [`PosteriorMap::new`].
    pub fn of_nodes(
        nodes: Vec<Node>,
        topology: &Topology,
        positions_m: &[[f64; 2]],
        draws: &[(&Topology, u64)],
    ) -> Self {
        let plain = TopometricMap::new(topology, positions_m);
        let labels = topology.labels();
        let total: u64 = draws.iter().map(|(_, count)| count).sum();
        let mut passes: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (i, pair) in labels.windows(2).enumerate() {
            let (a, b) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
            passes.entry((a as usize, b as usize)).or_default().push(i);
        }
        let support = |first: usize, second: usize| {
            let passes = &passes[&(first, second)];
            let exists = |draw: &Topology| {
                let labels = draw.labels();
                passes.iter().any(|&i| labels[i] != labels[i + 1])
            };
            let seen = draws.iter().filter(|(draw, _)| exists(draw));
            let seen: u64 = seen.map(|(_, count)| count).sum();
            seen as f64 / total.max(1) as f64
        };
        let edge = |edge: &super::Edge| Edge {
            first: edge.first,
            second: edge.second,
            weight: edge.weight,
            support: support(edge.first, edge.second),
        };
        Self {
            nodes,
            edges: plain.edges.iter().map(edge).collect(),
        }
    }
}

fn sorted(set: &[u32]) -> Vec<u32> {
    let mut members = set.to_vec();
    members.sort_unstable();
    members
}

/// Mean of the members' x\*, and its covariance P⁻¹/2 summed over all members and divided by n².
fn place(model: &Model, members: &[u32], offset_m: [f64; 2]) -> ([f64; 2], [f64; 3]) {
    let law = model.set_law(members);
    let n = members.len() as f64;
    let mut mean = offset_m;
    for m in &law.mean_m {
        mean[0] += m[0] / n;
        mean[1] += m[1] / n;
    }
    let inverse = law.precision.try_inverse();
    let inverse = inverse.expect("the precision of a set is positive definite");
    let sum = |row: usize, column: usize| {
        let rows = (row..inverse.nrows()).step_by(2);
        let cells = rows.flat_map(|r| (column..inverse.ncols()).step_by(2).map(move |c| (r, c)));
        cells.map(|cell| inverse[cell]).sum::<f64>() / (2.0 * n * n)
    };
    (mean, [sum(0, 0), sum(0, 1), sum(1, 1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, Penalty, PenaltyShape};

    #[test]
    fn parts_of_a_map_are_as_probable_as_their_draws() {
        let positions_m = [
            [10.0, 0.0],
            [14.0, 0.0],
            [16.0, 0.0],
            [10.0, 2.0],
            [15.0, 3.0],
        ];
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.0,
            height: 1.0,
        };
        let model = Model::from(MetricModel::new(&positions_m, 0.8, 1.3, penalty));
        let topology = Topology::canonical(&[0, 1, 1, 0, 1]);
        let split = Topology::canonical(&[0, 1, 2, 0, 1]);
        let merged = Topology::canonical(&[0, 0, 0, 0, 1]);
        let draws = [(&topology, 5), (&split, 3), (&merged, 2)];
        let map = PosteriorMap::new(&topology, &positions_m, &model, &draws);
        assert_eq!(map.nodes[0].members, [0, 3]);
        // {0, 3} is a set of the first two, {1, 2, 4} of the first only.
        assert_eq!(
            (map.nodes[0].probability, map.nodes[1].probability),
            (0.8, 0.5)
        );
        for (node, expected) in map.nodes.iter().zip([[10.0, 1.0], [15.0, 1.0]]) {
            let off = [0, 1].map(|axis| (node.position_m[axis] - expected[axis]).abs());
            assert!(off[0] < 1e-12 && off[1] < 1e-12, "{node:?}");
            // The whole set moves as one: σ_o²/(2n), whatever σ_t.
            let variance = 0.64 / (2.0 * node.members.len() as f64);
            let [xx, xy, yy] = node.covariance_m2;
            assert!((xx - variance).abs() < 1e-12 && (yy - variance).abs() < 1e-12 && xy == 0.0);
        }
        // Passes 0→1, 2→3 and 3→4: in `merged` only the last leads on.
        let [edge] = &map.edges[..] else {
            panic!("one edge: {map:?}")
        };
        assert_eq!(
            (edge.first, edge.second, edge.weight, edge.support),
            (0, 1, 3, 1.0)
        );
        let one = Topology::canonical(&[0; 5]);
        let map = PosteriorMap::new(
            &topology,
            &positions_m,
            &model,
            &[(&topology, 3), (&one, 1)],
        );
        assert_eq!(map.edges[0].support, 0.75);
    }
}
