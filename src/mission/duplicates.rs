//! Landmarks that a detector reports twice in one scan.
//!
//! The posterior lets no landmark be seen twice in a scan. A detector that does so anyway gives
//! itself away: of pairs within a scan many agree to be one place, and none lie a little further
//! apart. Only then are such pairs fused, each into one sighting with the information of both,
//! which leaves the optimum of the graph where it is.

use nalgebra::Vector2;

use super::graph::{Graph, Observation};
use super::linear::scans;

/// Pairs within this, squared and in standard deviations, may be one: 99.9 % of χ² with two degrees
/// of freedom.
const GATE: f64 = 13.8;
/// Pairs from there to here are those that ought to be missing.
const BEYOND: f64 = 60.0;
/// Of true duplicates the median would be 1.39; landmarks that stand close together give more.
const MOST_MEDIAN: f64 = 2.0;
/// Pairs beyond the gate, for each pair within.
const MOST_BEYOND: f64 = 0.1;
/// Fewer pairs prove nothing.
const LEAST_PAIRS: usize = 5;

/// A graph without duplicates.
#[derive(Clone, Debug)]
pub(super) struct Fused {
    pub graph: Graph,
    /// For each sighting of the graph as it was, its number now.
    pub place_of: Vec<usize>,
    /// ln of the density of the differences within fused pairs, relative to its peak: −½ Σ d².
    pub ln_differences: f64,
}

impl Fused {
    /// What all sightings have, of values for those that are left.
    pub fn of_all<T: Copy>(&self, of_left: &[T]) -> Vec<T> {
        self.place_of.iter().map(|&s| of_left[s]).collect()
    }
}

/// The graph as it is.
pub(super) fn unfused(graph: &Graph) -> Fused {
    fuse_pairs(graph, &[])
}

/// Fuses duplicates where the data say that there may be some; `None` if not.
pub(super) fn fuse(graph: &Graph) -> Option<Fused> {
    let pairs = duplicates(&graph.observations)?;
    Some(fuse_pairs(graph, &pairs))
}

/// Fuses the sightings of one scan that have one label.
pub(super) fn fuse_by_label(graph: &Graph, labels: &[u32]) -> Fused {
    let mut pairs = Vec::new();
    for scan in scans(&graph.observations) {
        for t in scan.first..scan.end {
            let first = (scan.first..t).find(|&s| labels[s] == labels[t]);
            pairs.extend(first.map(|s| (s, t)));
        }
    }
    fuse_pairs(graph, &pairs)
}

/// Fuses each second sighting into the first, which is none of the second ones.
fn fuse_pairs(graph: &Graph, pairs: &[(usize, usize)]) -> Fused {
    let all = &graph.observations;
    let mut partner = vec![None; all.len()];
    for &(s, t) in pairs {
        partner[t] = Some(s);
    }
    let mut fused: Vec<Observation> = Vec::with_capacity(all.len());
    let mut place_of = vec![0; all.len()];
    let mut ln_differences = 0.0;
    for (s, one) in all.iter().enumerate() {
        if let Some(first) = partner[s] {
            place_of[s] = place_of[first];
            let into = &mut fused[place_of[first]];
            ln_differences -= 0.5 * square_distance(into, one);
            *into = both(into, one);
        } else {
            place_of[s] = fused.len();
            fused.push(*one);
        }
    }
    Fused {
        graph: Graph {
            observations: fused,
            ..graph.clone()
        },
        place_of,
        ln_differences,
    }
}

/// Pairs that are one, the nearest first and each sighting once; `None` if the detector makes no
/// duplicates.
fn duplicates(all: &[Observation]) -> Option<Vec<(usize, usize)>> {
    let mut near: Vec<(f64, usize, usize)> = Vec::new();
    let mut n_beyond = 0;
    for scan in scans(all) {
        for s in scan.first..scan.end {
            for t in s + 1..scan.end {
                let square_distance = square_distance(&all[s], &all[t]);
                if square_distance < GATE {
                    near.push((square_distance, s, t));
                } else if square_distance < BEYOND {
                    n_beyond += 1;
                }
            }
        }
    }
    near.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let median = near.get(near.len() / 2)?.0;
    let are_some = near.len() >= LEAST_PAIRS
        && median < MOST_MEDIAN
        && f64::from(n_beyond) <= MOST_BEYOND * near.len() as f64;
    if !are_some {
        return None;
    }
    let mut is_taken = vec![false; all.len()];
    near.retain(|&(_, s, t)| {
        let is_free = !is_taken[s] && !is_taken[t];
        if is_free {
            (is_taken[s], is_taken[t]) = (true, true);
        }
        is_free
    });
    Some(near.into_iter().map(|(_, s, t)| (s, t)).collect())
}

/// How far apart two sightings of one scan are, in standard deviations of both, squared.
pub(super) fn square_distance(s: &Observation, t: &Observation) -> f64 {
    let covariance = |one: &Observation| one.weight().try_inverse();
    let (Some(of_s), Some(of_t)) = (covariance(s), covariance(t)) else {
        return f64::INFINITY;
    };
    let apart = Vector2::from(s.at_m) - Vector2::from(t.at_m);
    let inverse = (of_s + of_t).try_inverse();
    inverse.map_or(f64::INFINITY, |inverse| apart.dot(&(inverse * apart)))
}

fn both(s: &Observation, t: &Observation) -> Observation {
    let all = s.weight() + t.weight();
    let sum = s.weight() * Vector2::from(s.at_m) + t.weight() * Vector2::from(t.at_m);
    let mean = all.try_inverse().map(|inverse| inverse * sum);
    Observation {
        at_m: mean.map_or(s.at_m, Into::into),
        information: [all.m11, all.m12, all.m22],
        ..*s
    }
}
