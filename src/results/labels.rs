//! What `ptm diagnose` found: chains of label vectors that another program drew.

use serde::{Deserialize, Serialize};

use super::convergence::{Diagnosis, Doubt};
use super::estimates::{ConvergenceSummary, Estimate};
use super::pool::{CoClustering, Pool, RepresentativeRow, TopologyRow};
use crate::labels::LabelChain;
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::run::{ChainOutcome, SampledChain, summarise};
use crate::settings::{BurnInRule, Settings};

/// The diagnosis. Its JSON form is the contract of `ptm diagnose --json`; keys that `ptm sample`
/// has too mean the same.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LabelsResult {
    /// Items of a draw, N.
    pub n_items: usize,
    /// Draws of each chain, weights counted in.
    pub n_draws: u64,
    /// Distinct topologies after burn-in.
    pub n_topologies: usize,
    /// By falling count, then by labels; the first is the MAP topology.
    pub topologies: Vec<TopologyRow>,
    /// Mean of M after burn-in.
    pub expected_number_of_sets: f64,
    /// Probability that two items share a set.
    pub co_clustering: CoClustering,
    /// Whether the topology counts of a chain were truncated.
    pub truncated: bool,
    /// Whether the chains have converged, by what numbers.
    pub convergence: Option<ConvergenceSummary>,
    /// One topology that stands for the posterior: MAP, and those of least expected loss.
    pub estimates: Vec<Estimate>,
    /// Topologies that stand for the posterior together, by falling weight: one where there is one
    /// answer.
    pub representatives: Vec<RepresentativeRow>,
    /// Chain by chain.
    pub chains: Vec<LabelChainSummary>,
    /// What each chain did, for pictures.
    #[serde(skip)]
    pub outcomes: Vec<ChainOutcome>,
}

/// One chain.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LabelChainSummary {
    /// Its file, and its name there.
    pub name: String,
    /// Draws left out at the start, or null.
    pub burn_in: Option<u64>,
    /// How that came about.
    pub burn_in_reason: String,
    /// Mean of M after burn-in.
    pub mean_n_sets: f64,
    /// Its most visited topology after burn-in.
    pub map_labels: String,
    /// Share of its draws there.
    pub map_frequency: f64,
}

/// Diagnoses chains of one length of at least one draw, with the verdict that chains of ours get.
pub fn diagnose_labels(
    chains: Vec<LabelChain>,
    burn_in: BurnInRule,
    stage: &dyn Fn(&str),
) -> LabelsResult {
    let mut settings = Settings::default();
    settings
        .set_text("burn_in", &burn_in.to_string())
        .expect("a rule as it is written");
    stage("each chain by itself");
    let mut names = Vec::new();
    let summarised = |chain: LabelChain| {
        names.push(chain.name);
        SampledChain {
            outcome: summarise(&chain.trace, &chain.start, None, &settings),
            trace: chain.trace,
        }
    };
    let chains: Vec<SampledChain> = chains.into_iter().map(summarised).collect();
    let outcomes = || chains.iter().map(|chain| &chain.outcome);
    let purpose = Purpose::new(SAMPLER_SEMANTICS, 0).text("use", "null of label chains");
    let pool = Pool::new(&chains, None, &mut purpose.generator(), stage);
    let n_items = outcomes().map(|own| own.n_detections).max().unwrap_or(0) as usize;
    let summary = |(name, chain): (String, &SampledChain)| {
        let outcome = &chain.outcome;
        let map = outcome.top.first();
        LabelChainSummary {
            name,
            burn_in: outcome.burn_in,
            burn_in_reason: outcome.burn_in_reason.clone(),
            mean_n_sets: outcome.mean_n_sets,
            map_labels: map.map_or_else(String::new, |map| map.labels.clone()),
            map_frequency: map.map_or(0.0, |map| map.frequency),
        }
    };
    let in_words = |found: &Diagnosis| ConvergenceSummary::new(found, Doubt::of_others);
    LabelsResult {
        n_items,
        n_draws: outcomes().map(|own| own.n_steps).max().unwrap_or(0),
        n_topologies: pool.rows.len(),
        topologies: pool.topologies(),
        expected_number_of_sets: pool.mean_n_sets(),
        co_clustering: pool.co_clustering(n_items),
        truncated: outcomes().any(|outcome| outcome.count_error_bound > 0),
        convergence: pool.diagnosis.as_ref().map(in_words),
        estimates: pool.estimates,
        representatives: pool.representatives,
        chains: names.into_iter().zip(&chains).map(summary).collect(),
        outcomes: chains.into_iter().map(|chain| chain.outcome).collect(),
    }
}

#[cfg(test)]
#[path = "labels_tests.rs"]
mod tests;
