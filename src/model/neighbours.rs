//! The neighbour graph of the detections: who could share a set with whom, from z alone.
//!
//! Detections i and j are neighbours if each is among the other's 64 nearest within
//! 1.5 radii of the penalty; in the covariance model by d_ij. The graph is symmetric and does not depend on the
//! topology, which is what moves that choose by it need to be reversible. Each edge holds what the pair pays
//! for being in different sets, about −ln E[exp(−f(|x_i − x_j|))]: either f(d_ij), or the way out of the radius,
//! (D − d_ij)²/(2σ_o²), as x_i − x_j has the variance σ_o² for two detections by themselves.
//!
//! The *doubt* about a pair is exp(−c − t) within [0.01, 1], c what it pays for being apart and t =
//! a·g/(a + 2g)·d_ij² for being together. Copies of one landmark have little, landmarks far apart
//! have little, and what lies between has most. Moves draw pairs by it.

use super::Model;
use super::locations::Reach;
use super::penalty::Penalty;

/// Radii of the penalty within which neighbours lie: pairs that pay none can still be one landmark.
const REACH: f64 = 1.5;
/// Bounds memory and time in dense data. It shapes proposals and nothing else.
const MAX_NEIGHBOURS: usize = 64;
/// The least doubt about a pair.
const LEAST_DOUBT: f64 = 0.01;

/// A symmetric graph; row i holds the neighbours of detection i in rising order.
#[derive(Clone, Debug, Default)]
pub struct Neighbours {
    start: Vec<u32>,
    to: Vec<u32>,
    cost: Vec<f64>,
    doubt: Vec<f64>,
    /// Sums of the doubt over all edges up to each.
    doubt_up_to: Vec<f64>,
}

impl Neighbours {
    /// Of a model's detections.
    pub fn of(model: &Model) -> Self {
        let n = model.n_detections();
        let nearest = nearest(model);
        let lists = |i: u32, j: u32| nearest[i as usize].iter().any(|&(_, other)| other == j);
        let mut graph = Self::empty();
        for i in 0..n as u32 {
            let mut row: Vec<(u32, f64)> = nearest[i as usize]
                .iter()
                .filter(|&&(_, j)| lists(j, i))
                .map(|&(u2, j)| (j, u2))
                .collect();
            row.sort_unstable_by_key(|&(j, _)| j);
            for (j, u2) in row {
                graph.push_edge(j, cost_apart(model, u2), doubt(model, u2));
            }
            graph.end_row();
        }
        graph
    }

    fn empty() -> Self {
        Self {
            start: vec![0],
            ..Self::default()
        }
    }

    fn push_edge(&mut self, to: u32, cost: f64, doubt: f64) {
        self.to.push(to);
        self.cost.push(cost);
        self.doubt.push(doubt);
        let before = self.doubt_up_to.last().copied().unwrap_or(0.0);
        self.doubt_up_to.push(before + doubt);
    }

    fn end_row(&mut self) {
        self.start.push(self.to.len() as u32);
    }

    /// The graph among some of the detections, in this order; `place` gives where one stands among
    /// them, rising with its number.
    #[must_use]
    pub fn part(&self, chosen: &[u32], place: impl Fn(u32) -> Option<u32>) -> Self {
        let mut graph = Self::empty();
        for &i in chosen {
            for edge in self.edges(i) {
                if let Some(j) = place(self.to[edge]) {
                    graph.push_edge(j, self.cost[edge], self.doubt[edge]);
                }
            }
            graph.end_row();
        }
        graph
    }

    fn edges(&self, i: u32) -> std::ops::Range<usize> {
        self.start[i as usize] as usize..self.start[i as usize + 1] as usize
    }

    /// The neighbours of detection i, and what it costs to be in another set than each, nats.
    pub fn of_detection(&self, i: u32) -> (&[u32], &[f64]) {
        let edges = self.edges(i);
        (&self.to[edges.clone()], &self.cost[edges])
    }

    /// An ordered pair of neighbours with probability proportional to the doubt about it, for u
    /// uniform on (0, 1); `None` if nobody has a neighbour.
    pub fn doubtful_pair(&self, u: f64) -> Option<[u32; 2]> {
        let total = *self.doubt_up_to.last()?;
        let edge = self.doubt_up_to.partition_point(|sum| *sum <= u * total);
        let edge = edge.min(self.to.len() - 1);
        let row = self.start.partition_point(|start| *start as usize <= edge) - 1;
        Some([row as u32, self.to[edge]])
    }
}

/// What a pair at (d/D)² = u² pays for being in different sets, nats.
fn cost_apart(model: &Model, u2: f64) -> f64 {
    let Penalty {
        shape,
        radius_m,
        height,
    } = *model.penalty();
    let way_out = radius_m * (1.0 - u2.sqrt()).max(0.0);
    let (observation_precision, _) = model.precisions();
    let leaves = 0.5 * observation_precision * way_out * way_out;
    leaves.min(height * Penalty::share(shape, u2))
}

/// The doubt about a pair at (d/D)² = u².
fn doubt(model: &Model, u2: f64) -> f64 {
    let (a, g) = model.precisions();
    let radius_m = model.penalty().radius_m;
    let together = a * g / (a + 2.0 * g) * (u2 * radius_m * radius_m);
    libm::exp(-cost_apart(model, u2) - together).max(LEAST_DOUBT)
}

/// The nearest within reach of every detection, with (d/D)², nearest first.
fn nearest(model: &Model) -> Vec<Vec<(f64, u32)>> {
    let z = model.positions_m();
    let n = z.len();
    let inverse = model.penalty().inverse_square_radius();
    let reach_m = Reach::of(model).most_m * REACH;
    let mut by_x: Vec<u32> = (0..n as u32).collect();
    by_x.sort_unstable_by(|&i, &j| {
        z[i as usize][0]
            .total_cmp(&z[j as usize][0])
            .then(i.cmp(&j))
    });
    let mut nearest: Vec<Vec<(f64, u32)>> = vec![Vec::new(); n];
    let keep = |list: &mut Vec<(f64, u32)>| {
        list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        list.truncate(MAX_NEIGHBOURS);
    };
    for (place, &i) in by_x.iter().enumerate() {
        for &j in &by_x[place + 1..] {
            let d = [0, 1].map(|axis| z[j as usize][axis] - z[i as usize][axis]);
            if d[0] > reach_m {
                break;
            }
            if d[1].abs() > reach_m {
                continue;
            }
            let m = model.pair_whitening(i, j);
            let (u, v) = (m[0] * d[0] + m[1] * d[1], m[2] * d[1]);
            let u2 = (u * u + v * v) * inverse;
            if u2 < REACH * REACH {
                for (own, other) in [(i, j), (j, i)] {
                    let list = &mut nearest[own as usize];
                    list.push((u2, other));
                    if list.len() == 4 * MAX_NEIGHBOURS {
                        keep(list);
                    }
                }
            }
        }
    }
    nearest.iter_mut().for_each(keep);
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, PenaltyShape};

    fn line(n: usize, spacing_m: f64) -> Model {
        let positions_m: Vec<[f64; 2]> = (0..n).map(|i| [spacing_m * i as f64, 0.0]).collect();
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 2.0,
            height: 8.0,
        };
        MetricModel::new(&positions_m, 1.0, 1.0, penalty).into()
    }

    #[test]
    fn neighbours_lie_within_reach() {
        let neighbours = Neighbours::of(&line(10, 1.0));
        let (to, cost) = neighbours.of_detection(4);
        assert_eq!(to, [2, 3, 5, 6]);
        // At half the radius f is 6, and the way out costs 1/2.
        assert_eq!(cost, [0.0, 0.5, 0.5, 0.0]);
        assert_eq!(neighbours.of_detection(0).0, [1, 2]);
    }

    /// Pairs come as often as their doubt says, and none that is no edge.
    #[test]
    fn pairs_are_drawn_by_their_doubt() {
        let neighbours = Neighbours::of(&line(10, 1.0));
        let doubts = [1.0, 2.0].map(|d: f64| doubt(&line(2, 1.0), d * d / 4.0));
        // With a = g = 1 together costs d²/3; half a radius of 2 m has a way out of ½.
        assert!((doubts[0] - (-0.5_f64 - 1.0 / 3.0).exp()).abs() < 1e-12);
        assert!((doubts[1] - (-4.0_f64 / 3.0).exp()).abs() < 1e-12);
        let total = 18.0 * doubts[0] + 16.0 * doubts[1];
        let n = 100_000;
        let mut share = 0.0;
        for k in 0..n {
            let pair = neighbours.doubtful_pair((f64::from(k) + 0.5) / f64::from(n));
            let [i, j] = pair.expect("edges");
            assert!(neighbours.of_detection(i).0.contains(&j));
            share += f64::from(u8::from([i, j] == [4, 6])) / f64::from(n);
        }
        assert!((share - doubts[1] / total).abs() < 1e-4, "{share}");
        assert!(Neighbours::of(&line(1, 1.0)).doubtful_pair(0.5).is_none());
        let part = neighbours.part(&[4, 6], |j| {
            [4, 6].iter().position(|&k| k == j).map(|k| k as u32)
        });
        assert_eq!(part.doubtful_pair(0.1), Some([0, 1]));
        assert_eq!(part.doubtful_pair(0.9), Some([1, 0]));
    }

    #[test]
    fn dense_data_stays_bounded_and_symmetric() {
        let neighbours = Neighbours::of(&line(600, 1e-3));
        for i in 0..600 {
            let (to, _) = neighbours.of_detection(i);
            assert!(to.len() <= MAX_NEIGHBOURS);
            for &j in to {
                assert!(neighbours.of_detection(j).0.contains(&i));
            }
        }
        assert_eq!(neighbours.of_detection(300).0.len(), MAX_NEIGHBOURS);
    }
}
