//! What the tests of this room share, and its golden values and properties.

mod golden;
mod properties;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

use super::chains::Stretch;
use crate::chain::TopologyCount;
use crate::partition::Topology;
use crate::rng::Purpose;

/// A file of `tests/golden/`; its README says what made it.
pub(super) fn golden(name: &str) -> Value {
    let text = match name {
        "chains" => include_str!("../../../tests/golden/chains.json"),
        "partitions" => include_str!("../../../tests/golden/partitions.json"),
        "functions" => include_str!("../../../tests/golden/functions.json"),
        _ => panic!("no golden values of {name}"),
    };
    serde_json::from_str(text).expect("a golden file is JSON")
}

/// A stored number; what JSON cannot hold is stored as text.
pub(super) fn number(value: &Value) -> f64 {
    match value.as_str() {
        Some(text) => text.parse().expect("nan or inf"),
        None => value.as_f64().expect("a number"),
    }
}

/// A stationary AR(1) with unit innovations.
pub(super) fn ar1(phi: f64, n: usize, seed: u64) -> Vec<f64> {
    let mut rng = Purpose::new("ar1", seed).generator();
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut at = normal() / (1.0 - phi * phi).sqrt();
    std::iter::repeat_with(|| {
        at = phi * at + normal();
        at
    })
    .take(n)
    .collect()
}

/// A stationary chain of 0 and 1, stretch by stretch: times to leave are geometric.
pub(super) fn two_state(up: f64, down: f64, n: u64, seed: u64) -> Vec<Stretch> {
    let mut rng = Purpose::new("two-state", seed).generator();
    let mut at = u8::from(rng.random::<f64>() < up / (up + down));
    let (mut left, mut stretches) = (n, Vec::new());
    while left > 0 {
        let rate: f64 = if at == 1 { down } else { up };
        let stay = 1.0 + ((1.0 - rng.random::<f64>()).ln() / (-rate).ln_1p()).floor();
        let stay = (stay as u64).min(left);
        stretches.push((f64::from(at), stay));
        left -= stay;
        at = 1 - at;
    }
    stretches
}

/// Counts of at most `n_topologies` topologies scattered about a random one, by falling count.
pub(super) fn random_posterior(
    n_detections: usize,
    n_topologies: usize,
    seed: u64,
) -> Vec<TopologyCount> {
    let mut rng = Purpose::new("posterior", seed).generator();
    let n_labels = n_detections as u32 / 2 + 1;
    let centre: Vec<u32> = (0..n_detections)
        .map(|_| rng.random_range(0..n_labels))
        .collect();
    let mut counts = std::collections::BTreeMap::new();
    for _ in 0..n_topologies {
        let mut labels = centre.clone();
        for _ in 0..rng.random_range(0..n_detections / 2) {
            labels[rng.random_range(0..n_detections)] = rng.random_range(0..=n_labels);
        }
        *counts.entry(Topology::canonical(&labels)).or_insert(0) += rng.random_range(1..100);
    }
    let rows = counts
        .into_iter()
        .map(|(topology, count)| TopologyCount { topology, count });
    let mut rows: Vec<TopologyCount> = rows.collect();
    rows.sort_by(|a, b| {
        b.count
            .cmp(&a.count)
            .then_with(|| a.topology.cmp(&b.topology))
    });
    rows
}
