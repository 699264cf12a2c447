//! Whether the chains on one data set agree, and whether they are long enough to say so.
//!
//! Numbers are of the chains' records ([`ChainSeries`](crate::run::ChainSeries)), cut at the largest
//! burn-in of any of them, so that they are the same after a resume. A world counts as converged if
//! its chains **mix** (R-hat and ESS of M and ln target within their thresholds, topologies as far
//! apart as chance explains), or if they came to **rest** at one and the same topology. Every other
//! has its doubts listed by name.

use std::collections::HashMap;
use std::fmt;

use rand::Rng;

use crate::diagnostics::chains::{Chains, Stretch};
pub use crate::diagnostics::co_clustering::CoClusteringDifference;
use crate::diagnostics::co_clustering::{Pairs, co_clustering_difference};
use crate::diagnostics::ess::{MIN_ESS_PER_CHAIN, ess_bulk, ess_tail};
use crate::diagnostics::mass::{NumberHolding, number_holding};
use crate::diagnostics::mcse;
use crate::diagnostics::r_hat::{MAX_R_HAT, r_hat};
pub use crate::diagnostics::topology_distance::Distance;
use crate::diagnostics::topology_distance::{TopologyDistance, topology_distance};
use crate::diagnostics::topology_ess::topology_ess;
use crate::diagnostics::undefined::Undefined;
use crate::diagnostics::unseen_mass::{UnseenMass, spaced_counts, unseen_mass};
use crate::run::{ChainOutcome, topology_identity};

/// Chains whose topologies are less likely than this to be so far apart by chance disagree. Not 5 %:
/// of the hundreds of worlds of a sweep whose chains have converged, one in twenty would be called
/// unconverged. The null is simulated 400 times, so p-values are known to 0.005 there.
pub const MIN_P_VALUE: f64 = 0.01;
/// Chains that each spend this share of their draws at one and the same topology are at rest there:
/// their frequencies of topologies are then within a total variation of 0.05 of each other, though
/// too little happens for an ESS.
pub const REST_SHARE: f64 = 0.95;
/// The share of the draws that a number of topologies is given for.
const HOLDING: f64 = 0.95;

/// Diagnostics of one number that changes along the chains.
#[derive(Clone, Copy, Debug)]
pub struct QuantityDiagnosis {
    /// Rank-normalised split R-hat, the larger of location and spread.
    pub r_hat: Result<f64, Undefined>,
    /// Effective draws for the bulk, of all chains together.
    pub ess_bulk: Result<f64, Undefined>,
    /// Effective draws for the 5 % and 95 % tails, the smaller.
    pub ess_tail: Result<f64, Undefined>,
    /// Draws that are worth an independent one: those of all chains over `ess_bulk`.
    pub autocorrelation_time: Result<f64, Undefined>,
    /// The mean with its Monte Carlo standard error.
    pub mean: Result<mcse::Estimate, Undefined>,
}

impl QuantityDiagnosis {
    fn new(chains: Result<Chains, Undefined>) -> Self {
        let of = |value: &dyn Fn(&Chains) -> Result<f64, Undefined>| {
            chains.as_ref().map_err(|reason| *reason).and_then(value)
        };
        let bulk = chains.as_ref().map_err(|reason| *reason).and_then(ess_bulk);
        Self {
            r_hat: of(&|chains| Ok(r_hat(chains)?.value())),
            ess_bulk: bulk.map(|bulk| bulk.ess),
            ess_tail: of(&|chains| Ok(ess_tail(chains).value()?.ess)),
            autocorrelation_time: bulk.map(|bulk| bulk.autocorrelation_time()),
            mean: chains
                .as_ref()
                .map_err(|reason| *reason)
                .and_then(mcse::mean),
        }
    }

    /// What speaks against its convergence. A number that never changes says nothing either way.
    fn doubts(&self, name: &'static str, n_chains: usize) -> Vec<Doubt> {
        let least = MIN_ESS_PER_CHAIN * n_chains as f64;
        let r_hat = self
            .r_hat
            .map(|value| (value > MAX_R_HAT).then_some(Doubt::RHat { name, value }));
        let ess = |ess: Result<f64, Undefined>| {
            ess.map(|value| (value < least).then_some(Doubt::Ess { name, value, least }))
        };
        let judged = [r_hat, ess(self.ess_bulk), ess(self.ess_tail)];
        let doubt = |judged| match judged {
            Ok(doubt) => doubt,
            Err(Undefined::Constant { .. }) => None,
            Err(reason) => Some(Doubt::Undefined { name, reason }),
        };
        let mut doubts: Vec<Doubt> = judged.into_iter().filter_map(doubt).collect();
        // Bulk and tail are one doubt, and so is one reason for two of the three.
        doubts.dedup_by(|a, b| a.word() == b.word());
        doubts
    }
}

/// One thing that speaks against convergence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// A single chain has nothing to be compared with.
    OneChain,
    /// R-hat above [`MAX_R_HAT`].
    RHat {
        /// Of what.
        name: &'static str,
        /// How large.
        value: f64,
    },
    /// Fewer effective draws than [`MIN_ESS_PER_CHAIN`] for each chain.
    Ess {
        /// Of what.
        name: &'static str,
        /// How many, in all chains.
        value: f64,
        /// How many there should be.
        least: f64,
    },
    /// What it would be judged by is undefined.
    Undefined {
        /// Of what.
        name: &'static str,
        /// Why.
        reason: Undefined,
    },
    /// Topologies further apart than chance explains.
    Topologies {
        /// The largest total variation between two chains.
        distance: f64,
        /// 95 % quantile of the null.
        null_95: f64,
    },
    /// Nothing changes, though the chains are not at rest at one topology that they came to.
    Still,
    /// Chains from other starts that have converged by themselves as well are elsewhere.
    Starts {
        /// In what.
        name: &'static str,
        /// Nested R-hat; `None` where all stand still.
        value: Option<f64>,
        /// What it stays below if the starts are forgotten.
        most: f64,
    },
}

impl Doubt {
    /// One word, for tables.
    pub fn word(&self) -> String {
        match self {
            Self::OneChain => "one-chain".to_owned(),
            Self::RHat { name, .. } => format!("r-hat of {name}"),
            Self::Ess { name, .. } => format!("ess of {name}"),
            Self::Undefined { name, reason } => format!("{} {name}", reason.name()),
            Self::Topologies { .. } => "topologies".to_owned(),
            Self::Still => "still".to_owned(),
            Self::Starts { name, .. } => format!("starts of {name}"),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneChain => write!(f, "one chain has nothing to be compared with"),
            Self::RHat { name, value } => {
                write!(f, "R-hat of {name} is {value:.3} (at most {MAX_R_HAT})")
            }
            Self::Ess { name, value, least } => {
                write!(f, "ESS of {name} is {value:.0} (at least {least:.0})")
            }
            Self::Undefined { name, reason } => write!(f, "{name} is {reason}"),
            Self::Topologies { distance, null_95 } => write!(
                f,
                "topologies of two chains are {distance:.2} apart (by chance up to {null_95:.2})"
            ),
            Self::Still => write!(f, "the chains stand still where they started, or apart"),
            Self::Starts {
                name,
                value: Some(value),
                most,
            } => write!(
                f,
                "chains from another start converged elsewhere: nested R-hat of {name} is {value:.3} (at most {most:.3})"
            ),
            Self::Starts {
                name, value: None, ..
            } => {
                write!(
                    f,
                    "chains from another start came to rest at another {name}"
                )
            }
        }
    }
}

/// Whether chains have converged.
#[derive(Clone, Debug, PartialEq)]
pub enum Convergence {
    /// They mix, and agree.
    Mixes,
    /// Each came by itself to one and the same topology, and hardly leaves it.
    AtRest,
    /// It is not shown.
    Not(Vec<Doubt>),
}

impl Convergence {
    /// Whether they have.
    pub fn is_shown(&self) -> bool {
        !matches!(self, Self::Not(_))
    }

    /// `mixes`, `at-rest` or `not-shown`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mixes => "mixes",
            Self::AtRest => "at-rest",
            Self::Not(_) => "not-shown",
        }
    }
}

/// Diagnostics of the chains on one data set.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Chains.
    pub n_chains: usize,
    /// Steps left out of every chain: the largest burn-in of any.
    pub first_step: u64,
    /// Steps kept of each.
    pub n_steps: u64,
    /// Largest stride of the records; 1 if every state was kept.
    pub stride: u64,
    /// Number of sets M.
    pub n_sets: QuantityDiagnosis,
    /// ln P(T) + ln Ẑ(T).
    pub ln_target: QuantityDiagnosis,
    /// Indicator of the MAP topology of all chains together.
    pub at_map: QuantityDiagnosis,
    /// Variation of information to the MAP topology, where all chains have the same.
    pub map_distance: QuantityDiagnosis,
    /// Effective independent topologies of all chains together, a chain that has none taken as one.
    pub ess_topologies: f64,
    /// Distances between the chains' topology frequencies.
    pub topologies: Result<TopologyDistance, Undefined>,
    /// Differences between the chains' co-clustering matrices.
    pub co_clustering: Result<CoClusteringDifference, Undefined>,
    /// Mass of the topologies that were never drawn.
    pub unseen: Result<UnseenMass, Undefined>,
    /// Topologies that hold 95 % of the draws.
    pub n_holding: Result<NumberHolding, Undefined>,
    /// The MAP topology of all chains together, among the most visited of each: canonical labels.
    pub map_labels: String,
    /// Whether that is the truth; `None` if no truth is known.
    pub map_is_truth: Option<bool>,
    /// The verdict of all this.
    pub convergence: Convergence,
}

/// Of the chains on one data set, all of the same length; `None` without any.
pub fn diagnose(chains: &[&ChainOutcome], rng: &mut impl Rng) -> Option<Diagnosis> {
    let all = || chains.iter().map(|chain| &chain.series);
    let first_step = all().map(|series| series.first_step).max()?;
    let end_step = all().map(|series| series.end_step()).max()?;
    let stretches = |value: &dyn Fn(&ChainOutcome) -> Vec<Stretch>| {
        Chains::new(&chains.iter().map(|chain| value(chain)).collect::<Vec<_>>())
    };
    let (map_labels, map_is_truth) = pooled_map(chains)?;
    let map = topology_identity(&map_labels.parse().ok()?);
    let (indices, identities) = common_indices(chains, first_step);
    let map_index = identities.get(map.as_str()).copied();
    let n_sets = QuantityDiagnosis::new(stretches(&|chain| {
        let series = &chain.series;
        let kept = series.stretches(&series.n_sets, first_step);
        kept.map(|(m, n)| (f64::from(m), n)).collect()
    }));
    let ln_target = QuantityDiagnosis::new(stretches(&|chain| {
        let series = &chain.series;
        let kept = series.stretches(&series.ln_target, first_step);
        kept.map(|(x, n)| (f64::from(x), n)).collect()
    }));
    let is_map = |&(index, n): &(u32, u64)| (f64::from(u8::from(Some(index) == map_index)), n);
    let at_map: Vec<Vec<Stretch>> = (indices.iter())
        .map(|chain| chain.iter().map(is_map).collect())
        .collect();

    let of_own_map = |chain: &ChainOutcome| {
        let series = &chain.series;
        let distances: Vec<f64> = (0..series.lengths.len())
            .map(|k| series.distance_to_map(k))
            .collect();
        series.stretches(&distances, first_step).collect()
    };
    let has_map = |chain: &&ChainOutcome| {
        let own = chain.top.first();
        own.is_some_and(|top| top.labels == map_labels)
    };
    let map_distance = if chains.iter().all(has_map) {
        stretches(&of_own_map)
    } else {
        Err(Undefined::DifferentMaps)
    };

    let ess: Vec<Result<f64, Undefined>> = indices
        .iter()
        .map(|chain| topology_ess(chain).map(|ess| ess.ess))
        .collect();
    let at_least_one: Vec<f64> = ess.iter().map(|ess| ess.unwrap_or(1.0).max(1.0)).collect();
    let ess_topologies = at_least_one.iter().sum();
    let counts: Vec<Vec<u64>> = indices
        .iter()
        .map(|chain| {
            let mut counts = vec![0; identities.len()];
            chain
                .iter()
                .for_each(|&(index, n)| counts[index as usize] += n);
            counts
        })
        .collect();
    let topologies = topology_distance(&counts, &at_least_one, rng);
    let n_detections = chains[0].n_detections as usize;
    let pairs: Vec<&Pairs> = all().map(|series| series.together.as_slice()).collect();
    let pooled: Vec<u64> = (0..identities.len())
        .map(|index| counts.iter().map(|chain| chain[index]).sum())
        .collect();
    let mut diagnosis = Diagnosis {
        n_chains: chains.len(),
        first_step,
        n_steps: end_step - first_step,
        stride: all().map(|series| series.stride).max()?,
        n_sets,
        ln_target,
        at_map: QuantityDiagnosis::new(Chains::new(&at_map)),
        map_distance: QuantityDiagnosis::new(map_distance),
        ess_topologies,
        topologies,
        co_clustering: co_clustering_difference(&pairs, n_detections, &at_least_one),
        unseen: unseen(&indices, &ess, end_step - first_step),
        n_holding: number_holding(&pooled, HOLDING, ess_topologies),
        map_labels,
        map_is_truth,
        convergence: Convergence::Mixes,
    };
    diagnosis.convergence = judge(&diagnosis, chains);
    Some(diagnosis)
}

fn judge(diagnosis: &Diagnosis, chains: &[&ChainOutcome]) -> Convergence {
    if chains.len() < 2 {
        return Convergence::Not(vec![Doubt::OneChain]);
    }
    let rests = |chain: &&ChainOutcome| {
        let map = chain.top.first();
        chain.series.came_to_map
            && map.is_some_and(|m| m.labels == diagnosis.map_labels && m.frequency >= REST_SHARE)
    };
    if chains.iter().all(rests) {
        return Convergence::AtRest;
    }
    let mut doubts = diagnosis.n_sets.doubts("M", chains.len());
    doubts.extend(diagnosis.ln_target.doubts("ln target", chains.len()));
    match &diagnosis.topologies {
        Ok(found) if found.total_variation.p_value < MIN_P_VALUE => {
            doubts.push(Doubt::Topologies {
                distance: found.total_variation.largest,
                null_95: found.total_variation.null_95,
            });
        }
        Ok(_) => {}
        Err(reason) => doubts.push(Doubt::Undefined {
            name: "topologies",
            reason: *reason,
        }),
    }
    let is_still =
        |quantity: &QuantityDiagnosis| matches!(quantity.r_hat, Err(Undefined::Constant { .. }));
    if is_still(&diagnosis.n_sets) && is_still(&diagnosis.ln_target) {
        doubts.push(Doubt::Still);
    }
    if doubts.is_empty() {
        Convergence::Mixes
    } else {
        Convergence::Not(doubts)
    }
}

/// The topology visited most by all chains together, among the most visited of each.
fn pooled_map(chains: &[&ChainOutcome]) -> Option<(String, Option<bool>)> {
    let mut shares: HashMap<&str, (f64, Option<bool>)> = HashMap::new();
    for top in chains.iter().flat_map(|chain| &chain.top) {
        let entry = shares.entry(&top.labels).or_insert((0.0, top.is_truth));
        entry.0 += top.frequency;
    }
    let best = shares.into_iter().max_by(|a, b| {
        // Among equals the first by its labels.
        a.1.0.total_cmp(&b.1.0).then_with(|| b.0.cmp(a.0))
    });
    best.map(|(labels, (_, is_truth))| (labels.to_owned(), is_truth))
}

/// Topologies by their number, with their steps.
type TopologyStretches = Vec<(u32, u64)>;

/// Each chain's topologies in one numbering, with that numbering.
fn common_indices<'a>(
    chains: &[&'a ChainOutcome],
    first_step: u64,
) -> (Vec<TopologyStretches>, HashMap<&'a str, u32>) {
    let mut identities: HashMap<&str, u32> = HashMap::new();
    let of_chain = |chain: &&'a ChainOutcome| {
        let series = &chain.series;
        let kept = series.stretches(&series.topology, first_step);
        let common = kept.map(|(place, n)| {
            let next = identities.len() as u32;
            let identity = series.topologies[place as usize].as_str();
            (*identities.entry(identity).or_insert(next), n)
        });
        common.collect()
    };
    let indices = chains.iter().map(of_chain).collect();
    (indices, identities)
}

/// From draws of all chains, the largest autocorrelation time of any of them apart.
fn unseen(
    chains: &[TopologyStretches],
    ess: &[Result<f64, Undefined>],
    n_steps: u64,
) -> Result<UnseenMass, Undefined> {
    let mut stride: u64 = 1;
    for ess in ess {
        stride = stride.max((n_steps as f64 / (*ess)?).ceil() as u64);
    }
    unseen_mass(&spaced_counts(chains.iter().flatten().copied(), stride))
}

#[cfg(test)]
#[path = "convergence_tests.rs"]
pub(super) mod tests;
