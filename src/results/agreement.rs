//! How the chains on one data set compare, for a picture.

use std::collections::HashMap;

use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::co_clustering::probability;
use crate::diagnostics::ess::ess_bulk;
pub use crate::diagnostics::rank_ecdf::RankEcdf;
use crate::diagnostics::rank_ecdf::rank_ecdfs;
use crate::diagnostics::undefined::Undefined;
use crate::partition::Topology;
use crate::run::ChainOutcome;

/// Points of a line at most: what a panel resolves.
const MAX_POINTS: usize = 300;

/// Detections in a matrix at most: beyond, one would be less than a pixel.
pub const MAX_DETECTIONS: usize = 300;

/// One topology, and its share in each chain; 0 where it is not among a chain's most visited.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedTopology {
    /// Canonical labels.
    pub labels: String,
    /// Whether it is the truth; `None` if that is not known.
    pub is_truth: Option<bool>,
    /// Chain by chain.
    pub shares: Vec<f64>,
}

/// Chains side by side.
#[derive(Clone, Debug)]
pub struct ChainsSideBySide {
    /// Ranks of M.
    pub n_sets: Result<Vec<RankEcdf>, Undefined>,
    /// Ranks of ln target.
    pub ln_target: Result<Vec<RankEcdf>, Undefined>,
    /// The topologies of the largest mean share, by falling share.
    pub topologies: Vec<SharedTopology>,
    /// Detections in an order that keeps the sets of the first topology together; the first [`MAX_DETECTIONS`] of them.
    pub order: Vec<usize>,
    /// Mean over chains of the share of draws that puts two detections into one set, in that order.
    pub together: Vec<Vec<f64>>,
    /// The largest difference of that share between two chains, in that order.
    pub apart: Vec<Vec<f64>>,
}

/// Of the chains on one data set, with so many topologies; `None` without any.
pub fn side_by_side(chains: &[&ChainOutcome], n_topologies: usize) -> Option<ChainsSideBySide> {
    let topologies = shared(chains, n_topologies);
    let first: Topology = topologies.first()?.labels.parse().ok()?;
    let mut order: Vec<usize> = (0..first.labels().len()).collect();
    order.sort_by_key(|&i| (first.labels()[i], i));
    order.truncate(MAX_DETECTIONS);
    let share = |chain: &ChainOutcome, i: usize, j: usize| {
        if i == j {
            return 1.0;
        }
        probability(&chain.series.together, (i as u32, j as u32))
    };
    let matrix = |value: &dyn Fn(Vec<f64>) -> f64| -> Vec<Vec<f64>> {
        let of = |i: usize, j: usize| value(chains.iter().map(|c| share(c, i, j)).collect());
        let row = |&i: &usize| order.iter().map(|&j| of(i, j)).collect();
        order.iter().map(row).collect()
    };
    let spread = |shares: Vec<f64>| {
        let high = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - shares.iter().copied().fold(f64::INFINITY, f64::min)
    };
    Some(ChainsSideBySide {
        n_sets: ranks(chains, |chain, from| {
            let series = &chain.series;
            let kept = series.stretches(&series.n_sets, from);
            kept.map(|(m, n)| (f64::from(m), n)).collect()
        }),
        ln_target: ranks(chains, |chain, from| {
            let series = &chain.series;
            let kept = series.stretches(&series.ln_target, from);
            kept.collect()
        }),
        together: matrix(&|shares| shares.iter().sum::<f64>() / shares.len() as f64),
        apart: matrix(&spread),
        topologies,
        order,
    })
}

fn ranks(
    chains: &[&ChainOutcome],
    values: impl Fn(&ChainOutcome, u64) -> Vec<Stretch>,
) -> Result<Vec<RankEcdf>, Undefined> {
    let first_step = chains.iter().map(|chain| chain.series.first_step).max();
    let first_step = first_step.unwrap_or(0);
    let stretches: Vec<Vec<Stretch>> = chains.iter().map(|c| values(c, first_step)).collect();
    let draws = Chains::new(&stretches)?;
    if let Some(reason @ Undefined::Constant { .. }) = draws.standstill() {
        return Err(reason);
    }
    let ess = |own: &Vec<Stretch>| {
        let own = Chains::new(std::slice::from_ref(own)).ok()?;
        Some(ess_bulk(&own).ok()?.ess)
    };
    let ess: Vec<Option<f64>> = stretches.iter().map(ess).collect();
    Ok(rank_ecdfs(&draws, &ess, MAX_POINTS))
}

fn shared(chains: &[&ChainOutcome], n: usize) -> Vec<SharedTopology> {
    let mut found: HashMap<&str, SharedTopology> = HashMap::new();
    for (place, chain) in chains.iter().enumerate() {
        for top in &chain.top {
            let entry = found.entry(&top.labels).or_insert_with(|| SharedTopology {
                labels: top.labels.clone(),
                is_truth: top.is_truth,
                shares: vec![0.0; chains.len()],
            });
            entry.shares[place] = top.frequency;
        }
    }
    let mut rows: Vec<SharedTopology> = found.into_values().collect();
    let total = |row: &SharedTopology| row.shares.iter().sum::<f64>();
    rows.sort_by(|a, b| {
        let by_share = total(b).total_cmp(&total(a));
        by_share.then_with(|| a.labels.cmp(&b.labels))
    });
    rows.truncate(n);
    rows
}
