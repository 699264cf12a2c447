//! What `ptm exact` found, in the form of its JSON.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::exact::{Ended, ExactSettings, Posterior, TRUSTED};
use crate::settings::{Section, Settings, Value};

/// An exact posterior. Its JSON form is the contract of `ptm exact --json`.
#[derive(Clone, Debug, Serialize)]
pub struct ExactResult {
    /// Every setting of the model, the seed and the tolerance, defaults included.
    pub settings: BTreeMap<String, Value>,
    /// By falling probability, then by labels; the first is the MAP topology.
    pub partitions: Vec<PartitionRow>,
    /// E\[M\]; null if the table is no answer.
    pub expected_number_of_sets: Option<f64>,
    /// N×N: the probability that two detections share a set; null if the table is no answer.
    pub co_clustering: Option<Vec<Vec<f64>>>,
    /// How far the table may be from the posterior.
    pub accuracy: Accuracy,
}

/// One partition.
#[derive(Clone, Debug, Serialize)]
pub struct PartitionRow {
    /// Canonical labels.
    pub labels: Vec<u32>,
    /// Posterior probability; null if the table is no answer.
    pub probability: Option<f64>,
    /// ln P(T) + ln ∫exp(−E−Pen), less the constants that the model leaves out.
    pub ln_unnormalised: f64,
    /// Monte Carlo standard error of `ln_unnormalised`.
    pub se: f64,
    /// Effective number of draws behind it; null where nothing had to be drawn.
    pub effective_draws: Option<f64>,
    /// Pareto k of the weights, for the likeliest; above 0.7 they are not to be trusted. Null where the
    /// weights do not vary or sets crowd so that runs down a ladder take their place.
    pub pareto_k: Option<f64>,
    /// Whether those are enough for `se` to mean anything.
    pub reliable: bool,
}

/// A table that may be further off than this is no answer: its probabilities are neither shown nor written.
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
    /// Draws that the tolerance takes, as far as these can tell; null if it is reached.
    pub draws_needed: Option<f64>,
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
    let error = posterior.error;
    let is_answer = error.total() <= MAX_SHOWN_ERROR;
    let rows = posterior.topologies.iter().map(|row| PartitionRow {
        labels: row.topology.labels().to_vec(),
        probability: is_answer.then_some(row.probability),
        ln_unnormalised: row.ln_unnormalised,
        se: row.se,
        effective_draws: row.effective_draws,
        pareto_k: row.pareto_k,
        reliable: row.is_reliable(),
    });
    ExactResult {
        settings: map,
        partitions: rows.collect(),
        expected_number_of_sets: is_answer.then(|| posterior.expected_n_sets()),
        co_clustering: is_answer.then(|| posterior.co_clustering()),
        accuracy: Accuracy {
            tolerance: exact.tolerance,
            total_variation: error.total(),
            reached: posterior.ended == Ended::Reached,
            monte_carlo: error.monte_carlo,
            cuts: error.cuts,
            unseen: error.unseen,
            draws: posterior.n_draws,
            draws_needed: match posterior.ended {
                Ended::Reached => None,
                Ended::OutOfDraws { n_draws_needed } | Ended::OutOfReach { n_draws_needed } => {
                    Some(n_draws_needed)
                }
            },
            least_effective_draws: TRUSTED,
        },
    }
}
