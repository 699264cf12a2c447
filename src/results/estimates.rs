//! What `ptm sample` makes of its topologies: whether the chains converged, and which one topology
//! stands for all, with how far the posterior spreads about it and how far it is from the truth.

use serde::{Deserialize, Serialize};

use super::convergence::{
    Convergence, Coupled, Diagnosis, Doubt, Judged, QuantityDiagnosis, most_elsewhere,
};
use super::pool::DENSE_LIMIT;
use super::word::{Word, word};
use crate::chain::TopologyCount;
use crate::diagnostics::co_clustering::co_clustering;
use crate::diagnostics::credible_ball::credible_ball;
use crate::diagnostics::loss::Loss;
use crate::diagnostics::moments::Moments;
use crate::diagnostics::point_estimate::{mean_loss, point_estimate};
use crate::diagnostics::recovery::Truth;
use crate::diagnostics::undefined::Undefined;
use crate::partition::Topology;

/// Topologies, the most sampled ones, that the estimates are made from: each is compared with every
/// finalist. What they leave out is stated.
const MAX_ROWS: usize = 10_000;
/// Labels of all those topologies: of ten thousand detections only the two thousand most sampled ones are
/// compared, which takes some seconds.
const MAX_LABELS: usize = 20_000_000;
/// Share of the draws that a credible ball holds.
const LEVEL: f64 = 0.95;
/// Topologies at each edge of a ball that are written.
const N_EDGE: usize = 3;

/// A number, or the word for why it is undefined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The number; null if it is undefined.
    pub value: Option<f64>,
    /// `defined`, or why not: `constant`, `stuck-disagree`, `too-rare`, `too-short`, `too-few`,
    /// `not-finite`, `different-maps`, `atom` or `not-judged`.
    #[serde(deserialize_with = "word")]
    pub state: Word,
}

impl From<Result<f64, Undefined>> for Measured {
    fn from(value: Result<f64, Undefined>) -> Self {
        Self {
            value: value.ok(),
            state: value.err().map_or("defined", |reason| reason.name()),
        }
    }
}

/// Diagnostics of one number along the chains.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct QuantitySummary {
    /// Rank-normalised split R-hat.
    pub r_hat: Measured,
    /// Effective draws for the bulk.
    pub ess_bulk: Measured,
    /// Effective draws for the tails.
    pub ess_tail: Measured,
    /// Draws that are worth an independent one.
    pub autocorrelation_time: Measured,
    /// The mean.
    pub mean: Measured,
    /// Its Monte Carlo standard error.
    pub mcse: Measured,
}

impl QuantitySummary {
    fn new(found: &QuantityDiagnosis) -> Self {
        Self {
            r_hat: found.r_hat.into(),
            ess_bulk: found.ess_bulk.into(),
            ess_tail: found.ess_tail.into(),
            autocorrelation_time: found.autocorrelation_time.into(),
            mean: found.mean.into(),
            mcse: found.mcse.into(),
        }
    }
}

/// A quantity that the verdict rests on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JudgedSummary {
    /// Which, in words.
    pub quantity: String,
    /// Its mean over all draws.
    pub mean: f64,
    /// Rank-normalised split R-hat.
    pub r_hat: Measured,
    /// Effective draws of all chains.
    pub ess: Measured,
}

impl JudgedSummary {
    fn new(found: &Judged) -> Self {
        Self {
            quantity: found.quantity.to_string(),
            mean: found.mean,
            r_hat: found.r_hat.into(),
            ess: found.ess.into(),
        }
    }
}

/// What chains from several starts show of other modes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct StartsSummary {
    /// Distinct topologies that the chains started from.
    pub initial_topologies: usize,
    /// Probes sent out.
    pub probes: usize,
    /// Probes that came to where their chain went.
    pub probes_came: usize,
    /// If all starts ended here: the share of starts that may end elsewhere, by a 95 % bound.
    pub most_elsewhere: f64,
}

/// Whether the chains have converged, by what numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConvergenceSummary {
    /// `mixes`, `at-rest`, `exact` or `not-shown`.
    #[serde(deserialize_with = "word")]
    pub verdict: Word,
    /// What speaks against it, in sentences.
    pub doubts: Vec<String>,
    /// If the exact posterior decides: the largest difference of a probability to it.
    pub exact_difference: Option<f64>,
    /// What the verdict rests on: all that the chains are unsure of.
    pub judged: Vec<JudgedSummary>,
    /// From how many starts.
    pub starts: StartsSummary,
    /// Pairs of coupled chains, where any were sent out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling: Option<CouplingSummary>,
    /// Proposals left out of every chain.
    pub first_proposal: u64,
    /// Steps from one state that was looked at to the next.
    pub stride: u64,
    /// Of M.
    pub n_sets: QuantitySummary,
    /// Of ln target.
    pub ln_target: QuantitySummary,
    /// Of the indicator of the MAP topology.
    pub at_map: QuantitySummary,
    /// Of the variation of information to the MAP topology, nats.
    pub map_distance: QuantitySummary,
    /// Effective independent topologies of all chains.
    pub ess_topologies: f64,
    /// The largest total variation between the topology frequencies of two chains.
    pub topology_distance: Measured,
    /// What it stays below 95 times in 100 for chains that sample one law.
    pub topology_distance_null_95: Measured,
    /// The largest difference of a co-clustering probability between two chains.
    pub co_clustering_largest: Measured,
    /// The mean difference.
    pub co_clustering_mean: Measured,
    /// Estimated mass of topologies never drawn.
    pub unseen_mass: Measured,
    /// Topologies that hold 95 % of the draws.
    pub n_topologies_95: Measured,
}

impl ConvergenceSummary {
    /// With its doubts in these words.
    pub(super) fn new(found: &Diagnosis, words: fn(&Doubt) -> String) -> Self {
        let distance = found.topologies.as_ref().map_err(|reason| *reason);
        let difference = found.co_clustering.as_ref().map_err(|reason| *reason);
        Self {
            verdict: found.convergence.name(),
            doubts: found.convergence.doubts().iter().map(words).collect(),
            exact_difference: match found.convergence {
                Convergence::Exact { largest } => Some(largest),
                _ => None,
            },
            judged: found.judged.iter().map(JudgedSummary::new).collect(),
            starts: StartsSummary {
                initial_topologies: found.n_initial_topologies,
                probes: found.probes.n,
                probes_came: found.probes.n_came,
                most_elsewhere: most_elsewhere(found.n_starts_that_ended_here()),
            },
            coupling: found.coupled.as_ref().map(CouplingSummary::new),
            first_proposal: found.first_step,
            stride: found.stride,
            n_sets: QuantitySummary::new(&found.n_sets),
            ln_target: QuantitySummary::new(&found.ln_target),
            at_map: QuantitySummary::new(&found.at_map),
            map_distance: QuantitySummary::new(&found.map_distance),
            ess_topologies: found.ess_topologies,
            topology_distance: distance.map(|d| d.total_variation.largest).into(),
            topology_distance_null_95: distance.map(|d| d.total_variation.null_95).into(),
            co_clustering_largest: difference.map(|d| d.largest).into(),
            co_clustering_mean: difference.map(|d| d.mean).into(),
            unseen_mass: found.unseen.map(|unseen| unseen.mass).into(),
            n_topologies_95: found.n_holding.map(|holding| holding.n as f64).into(),
        }
    }
}

/// How far chains may be from the posterior, by pairs of coupled chains.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CouplingSummary {
    /// Proposals that one chain of a pair is ahead.
    pub lag: u64,
    /// Pairs.
    pub pairs: usize,
    /// Pairs that met.
    pub met: usize,
    /// Proposals of the chain ahead when the last pair met; null if none did.
    pub last_met: Option<u64>,
    /// Up to this share of pairs may meet later than all of these, or never (95 %); null unless all
    /// met.
    pub most_later: Option<f64>,
    /// The mean over pairs of what bounds the total variation to the posterior after the burn-in;
    /// null unless all met.
    pub total_variation_after_burn_in: Option<f64>,
    /// Its standard error.
    pub total_variation_se: Option<f64>,
    /// Proposals after which that mean is at most 0.01; null unless all of a hundred pairs or more
    /// met.
    pub proposals_until_near: Option<u64>,
}

impl CouplingSummary {
    fn new(found: &Coupled) -> Self {
        Self {
            lag: found.lag,
            pairs: found.n_pairs,
            met: found.n_met,
            last_met: found.last_met,
            most_later: found.after_burn_in.map(|_| most_elsewhere(found.n_pairs)),
            total_variation_after_burn_in: found.after_burn_in.map(|bound| bound.value),
            total_variation_se: found.after_burn_in.map(|bound| bound.se),
            proposals_until_near: found.until_near,
        }
    }
}

/// One topology for the posterior.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Estimate {
    /// `map`, `binder` or `vi`.
    #[serde(deserialize_with = "word")]
    pub kind: Word,
    /// Canonical labels.
    pub labels: Vec<u32>,
    /// M.
    pub n_sets: usize,
    /// Share of the draws at it; 0 if it was found by moving detections only.
    pub frequency: f64,
    /// The distance that the next three are in: `binder` (share of pairs) or `vi` (nats).
    #[serde(deserialize_with = "word")]
    pub loss: Word,
    /// Mean distance to the draws.
    pub expected_loss: f64,
    /// Its Monte Carlo standard error.
    pub expected_loss_se: f64,
    /// The smallest ball about it with 95 % of the draws.
    pub credible_ball: Ball,
    /// Share of the draws at the topologies that all this is from.
    pub from_share: f64,
    /// How far it is from the truth; null if that is not known.
    pub truth: Option<AgainstTruth>,
}

/// A credible ball.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Ball {
    /// Share of the draws asked for.
    pub level: f64,
    /// Share inside.
    pub mass: f64,
    /// Largest distance inside.
    pub radius: f64,
    /// Lower end of a 95 % interval of the radius.
    pub radius_low: f64,
    /// Upper end; null where the draws cannot tell it.
    pub radius_high: Option<f64>,
    /// Sampled topologies inside.
    pub n_topologies: usize,
    /// Labels of up to three at the radius.
    pub horizontal: Vec<Vec<u32>>,
    /// Of those with the fewest sets inside, up to three of the farthest.
    pub upper: Vec<Vec<u32>>,
    /// Of those with the most sets inside, up to three of the farthest.
    pub lower: Vec<Vec<u32>>,
}

/// An estimate against the truth, over the detections of known truth.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AgainstTruth {
    /// Whether it is the truth.
    pub recovered: bool,
    /// 1 for the truth, 0 on average at random.
    pub adjusted_rand_index: f64,
    /// Nats; 0 for the truth.
    pub variation_of_information: f64,
    /// 1 if no set mixes landmarks.
    pub homogeneity: f64,
    /// 1 if no landmark is split.
    pub completeness: f64,
    /// Harmonic mean of the two.
    pub v_measure: f64,
    /// Share of the found pairs that are true; null if no pair was found.
    pub pair_precision: Option<f64>,
    /// Share of the true pairs that were found; null if there is none.
    pub pair_recall: Option<f64>,
    /// Sets found − landmarks.
    pub n_sets_error: i64,
    /// Detections that this rests on.
    pub n_known: usize,
}

impl AgainstTruth {
    pub(super) fn new(truth: &Truth, topology: &Topology) -> Self {
        let found = truth.agreement(topology);
        Self {
            recovered: truth.is_recovered_by(topology),
            adjusted_rand_index: found.adjusted_rand_index,
            variation_of_information: found.variation_of_information,
            homogeneity: found.v_measure.homogeneity,
            completeness: found.v_measure.completeness,
            v_measure: found.v_measure.v_measure(),
            pair_precision: found.pairs.precision(),
            pair_recall: found.pairs.recall(),
            n_sets_error: found.n_sets_error,
            n_known: found.n_known,
        }
    }
}

/// MAP, Binder and VI estimates from topologies by falling count and the effective number of draws
/// behind them. Above 1,000 detections, whose matrix is not made, the MAP topology only.
pub(super) fn estimates(rows: &[TopologyCount], truth: Option<&Truth>, ess: f64) -> Vec<Estimate> {
    let total: u64 = rows.iter().map(|row| row.count).sum();
    let n_detections = rows
        .first()
        .map_or(1, |row| row.topology.labels().len().max(1));
    let rows = &rows[..rows.len().min(MAX_ROWS).min(MAX_LABELS / n_detections)];
    let used: u64 = rows.iter().map(|row| row.count).sum();
    let Some(map) = rows.first() else {
        return Vec::new();
    };
    let estimate = |kind, loss, topology: &Topology, moments: Moments| {
        let ball = credible_ball(topology, rows, loss, LEVEL, ess).ok()?;
        let edge = |topologies: &[Topology]| {
            let labels = topologies.iter().map(|t| t.labels().to_vec());
            labels.take(N_EDGE).collect()
        };
        let count = rows.iter().find(|row| row.topology == *topology);
        Some(Estimate {
            kind,
            labels: topology.labels().to_vec(),
            n_sets: topology.n_sets(),
            frequency: count.map_or(0.0, |row| row.count as f64 / total as f64),
            loss: match loss {
                Loss::Binder => "binder",
                Loss::VariationOfInformation => "vi",
            },
            expected_loss: moments.mean,
            expected_loss_se: moments.sd / ess.sqrt(),
            credible_ball: Ball {
                level: LEVEL,
                mass: ball.mass,
                radius: ball.radius,
                radius_low: ball.radius_interval.0,
                radius_high: ball.radius_interval.1,
                n_topologies: ball.n_topologies,
                horizontal: edge(&ball.horizontal),
                upper: edge(&ball.upper),
                lower: edge(&ball.lower),
            },
            from_share: used as f64 / total as f64,
            truth: truth.map(|truth| AgainstTruth::new(truth, topology)),
        })
    };
    let vi = Loss::VariationOfInformation;
    let of_map = mean_loss(&map.topology, rows, vi);
    let mut found: Vec<Estimate> = estimate("map", vi, &map.topology, of_map)
        .into_iter()
        .collect();
    if map.topology.labels().len() <= DENSE_LIMIT
        && let Some(matrix) = co_clustering(rows)
    {
        for (kind, loss) in [("binder", Loss::Binder), ("vi", vi)] {
            let best = point_estimate(rows, &matrix, loss, ess).ok();
            found.extend(best.and_then(|best| {
                let moments = mean_loss(&best.topology, rows, loss);
                estimate(kind, loss, &best.topology, moments)
            }));
        }
    }
    found
}
