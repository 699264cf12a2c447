//! The posterior by enumeration of every set partition: what chains are checked against.
//!
//! ln π(T) = ln P(T) + Σ_S ln I₀(S) + ln E[exp(−Pen)], the first two in closed form and the last by
//! plain Monte Carlo with exact draws of X. Bell(N) partitions: for small N only.

use rand::Rng;

use crate::model::{Draws, MetricModel, Prior};
use crate::partition::{Partition, Partitions, Topology};

/// One topology of the posterior.
#[derive(Clone, Debug)]
pub struct ExactTopology {
    /// The topology.
    pub topology: Topology,
    /// Posterior probability.
    pub probability: f64,
    /// ln P(T) + Σ ln I₀ + ln E[exp(−Pen)], constants dropped.
    pub ln_unnormalised: f64,
    /// Monte Carlo standard error of `ln_unnormalised`.
    pub se: f64,
}

/// The posterior over all partitions of the model's detections, in the order of their restricted
/// growth strings, with `n_draws` draws of X for each.
pub fn enumerate(
    model: &MetricModel,
    prior: Prior,
    n_draws: usize,
    rng: &mut impl Rng,
) -> Vec<ExactTopology> {
    let n = model.n_detections();
    let prior = prior.table(n);
    let mut draws = Draws::new(n, n_draws);
    let mut rows: Vec<ExactTopology> = Partitions::of(n)
        .map(|topology| {
            let partition = Partition::from_labels(topology.labels());
            let sets = || partition.sets().iter().map(Vec::as_slice);
            let ln_gaussian: f64 = sets().map(|members| model.ln_gaussian(members)).sum();
            let ln_mean = draws.ln_mean_exp_penalty(model, sets(), rng);
            let ln_prior = prior.ln_prior(sets().map(<[u32]>::len));
            ExactTopology {
                topology,
                probability: 0.0,
                ln_unnormalised: ln_prior + ln_gaussian + ln_mean,
                se: relative_standard_error(draws.minus_penalties(), ln_mean),
            }
        })
        .collect();
    let largest = rows
        .iter()
        .map(|row| row.ln_unnormalised)
        .fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = rows
        .iter()
        .map(|row| libm::exp(row.ln_unnormalised - largest))
        .sum();
    for row in &mut rows {
        row.probability = libm::exp(row.ln_unnormalised - largest) / total;
    }
    rows
}

/// Standard error of the log of a mean of exp(values), by the delta method.
fn relative_standard_error(values: &[f64], ln_mean: f64) -> f64 {
    let n = values.len() as f64;
    let variance = values
        .iter()
        .map(|&x| (libm::exp(x - ln_mean) - 1.0).powi(2))
        .sum::<f64>()
        / (n - 1.0);
    (variance / n).sqrt()
}
