//! The topologies of several chains together.

use std::collections::HashMap;

use crate::run::{ChainOutcome, PosteriorTopology};

/// The topologies among the most visited of each chain, by their mean share; of equals the first by
/// its labels.
pub(in crate::results) fn pooled_topologies(chains: &[&ChainOutcome]) -> Vec<PosteriorTopology> {
    let mut found: HashMap<&str, PosteriorTopology> = HashMap::new();
    for top in chains.iter().flat_map(|chain| &chain.top) {
        let own = found
            .entry(&top.labels)
            .or_insert_with(|| PosteriorTopology {
                labels: top.labels.clone(),
                n_sets: top.n_sets,
                probability: 0.0,
                is_truth: top.is_truth,
            });
        own.probability += top.frequency / chains.len() as f64;
    }
    let mut rows: Vec<PosteriorTopology> = found.into_values().collect();
    rows.sort_by(|a, b| {
        let by_share = b.probability.total_cmp(&a.probability);
        by_share.then_with(|| a.labels.cmp(&b.labels))
    });
    rows
}
