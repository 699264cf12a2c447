//! How far a chain is from an exact posterior, and how far a correct one may be.

use std::collections::HashMap;

use topometric::chain::{self, Trace};
use topometric::exact::ExactTopology;
use topometric::partition::Topology;

/// Total variation between a chain's frequencies from step `first` on and an exact posterior.
pub fn total_variation(trace: &Trace, first: u64, exact: &[ExactTopology]) -> f64 {
    let counts: HashMap<Topology, u64> = trace
        .frequencies(first)
        .into_iter()
        .map(|row| (row.topology, row.count))
        .collect();
    let n = (trace.n_steps - first) as f64;
    let apart = exact.iter().map(|row| {
        let frequency = counts.get(&row.topology).copied().unwrap_or(0) as f64 / n;
        (frequency - row.probability).abs()
    });
    apart.sum::<f64>() / 2.0
}

/// What that of a correct chain stays below: the mean under multinomial counts at the
/// chain's effective sample size is at most ½ Σ √(p(1−p)/n), and it varies by less than 1/(2√n) (each
/// of n independent draws moves it by at most 1/n: bounded differences); four of those are added, and the
/// Monte Carlo error of the enumeration. The effective sample size is the smaller of those of the indicator
/// of the likeliest topology and of M.
pub fn threshold(trace: &Trace, first: u64, exact: &[ExactTopology]) -> f64 {
    let top = exact
        .iter()
        .max_by(|a, b| a.probability.total_cmp(&b.probability))
        .expect("not empty");
    let top_ix =
        |run: &chain::Run| f64::from(trace.topologies.get(run.topology) == Some(&top.topology));
    let n_sets = |run: &chain::Run| f64::from(run.n_sets);
    let first = first as usize;
    let ess = effective_sample_size(&trace.expand(top_ix)[first..])
        .min(effective_sample_size(&trace.expand(n_sets)[first..]));
    let rows = exact.iter();
    let mean: f64 = rows
        .map(|row| (row.probability * (1.0 - row.probability) / ess).sqrt())
        .sum();
    let monte_carlo: f64 = exact.iter().map(|row| row.probability * row.se).sum();
    (mean + 4.0 / ess.sqrt() + monte_carlo) / 2.0
}

/// By batch means: a batch mean has variance σ²·B/ESS, B = 100 batches.
pub fn effective_sample_size(series: &[f64]) -> f64 {
    const N_BATCHES: usize = 100;
    let n = series.len() as f64;
    let mean = series.iter().sum::<f64>() / n;
    let variance = series.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    let size = series.len() / N_BATCHES;
    let batches = series.chunks_exact(size);
    let of_means = batches
        .map(|batch| (batch.iter().sum::<f64>() / size as f64 - mean).powi(2))
        .sum::<f64>();
    N_BATCHES as f64 * variance / (of_means / N_BATCHES as f64)
}
