//! What `ptm sample` found: the chains of one data set, pooled.

use std::collections::BTreeMap;

use serde::Serialize;

use super::convergence::{Diagnosis, Doubt, diagnose};
pub use super::estimates::{
    AgainstTruth, Ball, ConvergenceSummary, CouplingSummary, Estimate, JudgedSummary, Measured,
    QuantitySummary, StartsSummary,
};
use super::pool::Pool;
pub use super::pool::{CoClustering, RepresentativeRow, TopologyRow};
use crate::dataset::DataSet;
use crate::diagnostics::pareto::pareto_k;
use crate::exact::WeightSums;
use crate::model::Draws;
use crate::partition::{Partition, Topology};
use crate::rng::Generator;
use crate::run::{
    ChainChecks, ChainOutcome, Judgement, SampledChain, TemperingOutcome, chain_purpose,
};
use crate::settings::{Settings, Value};

/// A pooled sample. Its JSON form is the contract of `ptm sample --json`.
#[derive(Clone, Debug, Serialize)]
pub struct SampleResult {
    /// Every setting, defaults included.
    pub settings: BTreeMap<String, Value>,
    /// Labelled faults that are switched on, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub incorrect: Vec<&'static str>,
    /// Distinct topologies counted, those that `topologies` leaves out among them.
    pub n_topologies: usize,
    /// By falling count, then by labels; the first is the MAP topology.
    pub topologies: Vec<TopologyRow>,
    /// Mean of M over all counted proposals.
    pub expected_number_of_sets: f64,
    /// Probability that two detections share a set.
    pub co_clustering: CoClustering,
    /// Whether the topology counts of a chain were truncated.
    pub truncated: bool,
    /// Counts are from every so many proposals: 1 unless a chain was too long for a full trace.
    pub trace_stride: u64,
    /// How good R importance samples are at the MAP topology; null with estimator `explicit`.
    pub importance: Option<Importance>,
    /// Whether the chains have converged, by what numbers.
    pub convergence: Option<ConvergenceSummary>,
    /// One topology that stands for the posterior: MAP, and those of least expected loss.
    pub estimates: Vec<Estimate>,
    /// Topologies that stand for the posterior together, by falling weight: one where there is one
    /// answer.
    pub representatives: Vec<RepresentativeRow>,
    /// Chain by chain.
    pub chains: Vec<ChainSummary>,
    /// Wall time of sampling, s.
    pub seconds: f64,
    /// Proposals of all chains over `seconds`.
    pub proposals_per_second: f64,
}

/// Importance weights of eq. 5 at the MAP topology, from draws of their own.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Importance {
    /// Draws that this is from.
    pub draws: usize,
    /// What R weighted samples are worth: R · (Σw)²/(S Σw²).
    pub effective_samples: f64,
    /// Pareto k of the weights; null if they do not vary. Above 0.7 ln Ẑ is no estimate of the
    /// integral (the chain is exact all the same, but it may stick).
    pub pareto_k: Option<f64>,
}

/// Draws for the diagnosis of the weights.
const N_IMPORTANCE_DRAWS: usize = 4000;
/// Draws of single detections that are held at once: 100 MB with what is computed of them.
const MAX_HELD_DRAWS: usize = 4_000_000;

fn importance(topology: &Topology, data: &DataSet, settings: &Settings) -> Option<Importance> {
    // Explicit locations are no draws of an estimate.
    if !settings.estimator(data.detections.len()).draws_locations() {
        return None;
    }
    let model = data.model(settings).ok()?;
    let partition = Partition::from_labels(topology.labels());
    let n_at_once = (MAX_HELD_DRAWS / model.n_detections().max(1)).clamp(1, N_IMPORTANCE_DRAWS);
    let mut draws = Draws::new(model.n_detections(), n_at_once);
    let purpose = chain_purpose(settings, data, 0).text("use", "importance diagnosis");
    let mut rng = purpose.generator();
    let mut ln_weights = Vec::with_capacity(N_IMPORTANCE_DRAWS);
    while ln_weights.len() < N_IMPORTANCE_DRAWS {
        let sets = partition.sets().iter().map(Vec::as_slice);
        draws.ln_mean_exp(&model, sets, &mut rng);
        ln_weights.extend_from_slice(draws.ln_weights());
    }
    let mut sums = WeightSums::default();
    sums.add(&ln_weights);
    Some(Importance {
        draws: ln_weights.len(),
        effective_samples: settings.count("importance_samples") as f64 * sums.effective()
            / sums.n(),
        pareto_k: pareto_k(&ln_weights),
    })
}

/// One chain.
#[derive(Clone, Debug, Serialize)]
pub struct ChainSummary {
    /// Proposals that it made.
    pub n_steps: u64,
    /// Counts by kind of move.
    pub moves: BTreeMap<String, MoveSummary>,
    /// Proposals left out at the start, or null.
    pub burn_in: Option<u64>,
    /// How that came about.
    pub burn_in_reason: String,
    /// Accepted over proposed.
    pub acceptance_rate: f64,
    /// Whether this chain's MAP topology is the truth, where that is known.
    pub recovered: Option<bool>,
    /// Share of its draws at the truth.
    pub truth_mass: Option<f64>,
    /// Adjusted Rand index of its MAP topology with the truth.
    pub adjusted_rand_index: Option<f64>,
    /// How its ladder of temperatures did, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tempering: Option<TemperingOutcome>,
    /// Holds, drift and the noise of its estimates.
    pub checks: ChainChecks,
}

/// Counts of one kind of move.
#[derive(Clone, Debug, Serialize)]
pub struct MoveSummary {
    /// Proposed, the impossible ones included.
    pub proposed: u64,
    /// Accepted.
    pub accepted: u64,
    /// Not possible from where the chain stood.
    pub impossible: u64,
}

/// What the chains of these data come to when they are looked at.
pub fn judgement(
    outcomes: &[&ChainOutcome],
    data: &DataSet,
    settings: &Settings,
) -> Option<Judgement> {
    let diagnosis = diagnose(outcomes, &mut null_rng(data, settings))?;
    let r_hats = diagnosis.judged.iter().filter_map(|own| own.r_hat.ok());
    let ess = diagnosis.judged.iter().filter_map(|own| own.ess.ok());
    Some(Judgement {
        has_converged: diagnosis.convergence.is_shown(),
        r_hat: r_hats.max_by(f64::total_cmp),
        ess: ess.min_by(f64::total_cmp),
    })
}

/// Random numbers of the null that the distance of topologies is compared with.
fn null_rng(data: &DataSet, settings: &Settings) -> Generator {
    let chain = chain_purpose(settings, data, 0);
    chain.text("use", "null of a world").generator()
}

/// The pooled sample of chains that took so many seconds, probes included. `stage` hears what is
/// computed next.
pub fn pool(
    chains: &[SampledChain],
    data: &DataSet,
    settings: &Settings,
    seconds: f64,
    stage: &dyn Fn(&str),
) -> SampleResult {
    let pool = Pool::new(
        chains,
        data.truth.as_ref(),
        &mut null_rng(data, settings),
        stage,
    );
    stage("importance weights at the MAP topology");
    let outcomes = || chains.iter().map(|chain| &chain.outcome);
    let of_probes =
        |chain: &SampledChain| -> u64 { chain.outcome.probes.iter().map(|own| own.n_steps).sum() };
    let n_proposals: u64 = chains
        .iter()
        .map(|own| own.trace.n_steps + of_probes(own))
        .sum();
    let in_words = |found: &Diagnosis| ConvergenceSummary::new(found, Doubt::to_string);
    SampleResult {
        settings: settings
            .iter()
            .map(|(key, value)| (key.name.to_owned(), value.clone()))
            .collect(),
        incorrect: settings.faults(),
        expected_number_of_sets: pool.mean_n_sets(),
        n_topologies: pool.rows.len(),
        co_clustering: pool.co_clustering(data.detections.len()),
        topologies: pool.topologies(),
        importance: (pool.rows.first()).and_then(|row| importance(&row.topology, data, settings)),
        convergence: pool.diagnosis.as_ref().map(in_words),
        estimates: pool.estimates,
        representatives: pool.representatives,
        trace_stride: chains.iter().map(|own| own.trace.stride).max().unwrap_or(1),
        truncated: outcomes().any(|outcome| outcome.count_error_bound > 0),
        chains: outcomes().map(chain_summary).collect(),
        seconds,
        proposals_per_second: n_proposals as f64 / seconds,
    }
}

fn chain_summary(outcome: &ChainOutcome) -> ChainSummary {
    let moves = outcome.moves.iter().map(|row| {
        let counts = MoveSummary {
            proposed: row.proposed,
            accepted: row.accepted,
            impossible: row.impossible,
        };
        (row.kind.clone(), counts)
    });
    ChainSummary {
        n_steps: outcome.n_steps,
        moves: moves.collect(),
        burn_in: outcome.burn_in,
        burn_in_reason: outcome.burn_in_reason.clone(),
        acceptance_rate: outcome.acceptance_rate,
        recovered: outcome.recovered,
        truth_mass: outcome.truth_mass,
        adjusted_rand_index: outcome.adjusted_rand_index,
        tempering: outcome.tempering.clone(),
        checks: outcome.checks.clone(),
    }
}
