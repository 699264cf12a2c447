//! What `ptm exact` found, in the form of its JSON.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::exact::{ExactSettings, Posterior, TRUSTED};
use crate::settings::{Section, Settings, Value};

/// An exact posterior. Its JSON form is the contract of `ptm exact --json`.
#[derive(Clone, Debug, Serialize)]
pub struct ExactResult {
    /// Every setting of the model, the seed and the tolerance, defaults included.
    pub settings: BTreeMap<String, Value>,
    /// By falling probability, then by labels; the first is the MAP topology.
    pub partitions: Vec<PartitionRow>,
    /// E\[M\].
    pub expected_number_of_sets: f64,
    /// N×N: the probability that two detections share a set.
    pub co_clustering: Vec<Vec<f64>>,
    /// How far the table may be from the posterior.
    pub accuracy: Accuracy,
}

/// One partition.
#[derive(Clone, Debug, Serialize)]
pub struct PartitionRow {
    /// Canonical labels.
    pub labels: Vec<u32>,
    /// Posterior probability.
    pub probability: f64,
    /// ln P(T) + ln ∫exp(−E−Pen), less the constants that the model leaves out.
    pub ln_unnormalised: f64,
    /// Monte Carlo standard error of `ln_unnormalised`.
    pub se: f64,
    /// Effective number of draws behind it; null where nothing had to be drawn.
    pub effective_draws: Option<f64>,
    /// Pareto k of the weights, for the likeliest; above 0.7 they are not to be trusted.
    pub pareto_k: Option<f64>,
    /// Whether those are enough for `se` to mean anything.
    pub reliable: bool,
}

/// A table that may be further off than this is no answer: its probabilities are not shown as such.
pub const MAX_SHOWN_ERROR: f64 = 0.1;

/// Estimated total variation between the table and the posterior, and what it is made of.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Accuracy {
    /// What was asked for.
    pub tolerance: f64,
    /// The sum of the three below.
    pub total_variation: f64,
    /// Whether it is below the tolerance.
    pub reached: bool,
    /// Monte Carlo error.
    pub monte_carlo: f64,
    /// Neglected by integrating sets apart that can hardly meet.
    pub cuts: f64,
    /// Mass that partitions may have whose draws all hit the penalty.
    pub unseen: f64,
    /// Draws of locations.
    pub draws: f64,
    /// Partitions of fewer effective draws are not `reliable`.
    pub least_effective_draws: f64,
}

/// The result in the form of its JSON.
pub fn exact_result(
    posterior: &Posterior,
    settings: &Settings,
    exact: &ExactSettings,
) -> ExactResult {
    let recorded = |name: &str, section: Section| {
        section == Section::Model || matches!(name, "seed" | "detections")
    };
    let mut map: BTreeMap<String, Value> = settings
        .iter()
        .filter(|(key, _)| recorded(key.name, key.section))
        .map(|(key, value)| (key.name.to_owned(), value.clone()))
        .collect();
    map.insert("tolerance".to_owned(), Value::Number(exact.tolerance));
    map.insert("max_draws".to_owned(), Value::Number(exact.max_draws));
    let rows = posterior.topologies.iter().map(|row| PartitionRow {
        labels: row.topology.labels().to_vec(),
        probability: row.probability,
        ln_unnormalised: row.ln_unnormalised,
        se: row.se,
        effective_draws: row.effective_draws,
        pareto_k: row.pareto_k,
        reliable: row.is_reliable(),
    });
    let error = posterior.error;
    ExactResult {
        settings: map,
        partitions: rows.collect(),
        expected_number_of_sets: posterior.expected_n_sets(),
        co_clustering: posterior.co_clustering(),
        accuracy: Accuracy {
            tolerance: exact.tolerance,
            total_variation: error.total(),
            reached: error.total() <= exact.tolerance,
            monte_carlo: error.monte_carlo,
            cuts: error.cuts,
            unseen: error.unseen,
            draws: posterior.n_draws,
            least_effective_draws: TRUSTED,
        },
    }
}
