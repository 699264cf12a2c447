//! Whether the chains on one data set agree, and whether they are long enough to say so.
//!
//! Numbers are of the chains' records ([`ChainSeries`](crate::run::ChainSeries)), cut at the largest
//! burn-in of any of them, so that they are the same after a resume. The rule is in `judge.rs`.

mod coupled;
mod doubt;
mod judge;
mod material;
mod pooled;
mod quantity;

use std::collections::{HashMap, HashSet};

use rand::Rng;

use crate::diagnostics::chains::{Chains, Stretch};
pub use crate::diagnostics::co_clustering::CoClusteringDifference;
use crate::diagnostics::co_clustering::{Pairs, co_clustering_difference};
use crate::diagnostics::ess::MIN_ESS_PER_CHAIN;
use crate::diagnostics::mass::{NumberHolding, number_holding};
pub use crate::diagnostics::topology_distance::Distance;
use crate::diagnostics::topology_distance::{TopologyDistance, topology_distance};
use crate::diagnostics::topology_ess::topology_ess;
use crate::diagnostics::undefined::Undefined;
use crate::diagnostics::unseen_mass::{UnseenMass, spaced_counts, unseen_mass};
use crate::run::{ChainOutcome, PosteriorTopology, topology_identity};

pub use coupled::Coupled;
pub use doubt::{Convergence, Doubt};
pub use judge::{LEAST_DRAWS, LEAST_HOLDS, LEAST_REST, REST_SHARE};
pub(super) use material::{Material, material, n_sets};
pub(super) use pooled::pooled_topologies;
pub use quantity::{Quantity, QuantityDiagnosis};

/// Chains whose topologies are less likely than this to be so far apart by chance disagree. Not 5 %:
/// of the hundreds of worlds of a sweep whose chains have converged, one in twenty would be called
/// unconverged. The null is simulated 400 times, so p-values are known to 0.005 there.
pub const MIN_P_VALUE: f64 = 0.01;
/// The share of the draws that a number of topologies is given for.
const HOLDING: f64 = 0.95;

/// A quantity that the verdict rests on.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Which.
    pub quantity: Quantity,
    /// Its mean over all draws.
    pub mean: f64,
    /// Rank-normalised split R-hat.
    pub r_hat: Result<f64, Undefined>,
    /// Effective draws of all chains together.
    pub ess: Result<f64, Undefined>,
}

/// Probes of all chains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Probes {
    /// Sent out.
    pub n: usize,
    /// Of them, those that came to where their chain went.
    pub n_came: usize,
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
    /// Distinct topologies that the chains started from.
    pub n_initial_topologies: usize,
    /// What the verdict rests on, where anything is material.
    pub judged: Vec<Judged>,
    /// Short chains from random starts.
    pub probes: Probes,
    /// Pairs of coupled chains, where any were sent out.
    pub coupled: Option<Coupled>,
    /// The verdict of all this.
    pub convergence: Convergence,
    /// The verdict without what the exact posterior says.
    pub by_rule: Convergence,
}

impl Diagnosis {
    /// Starts that ended where the chains are, those of probes included.
    pub fn n_starts_that_ended_here(&self) -> usize {
        self.n_initial_topologies + self.probes.n_came
    }
}

/// The share of starts that may end elsewhere although `k` of k independent ones ended here: the upper
/// end of a one-sided 95 % interval, 1 − .05^(1/k) (Clopper & Pearson 1934).
pub fn most_elsewhere(k: usize) -> f64 {
    1.0 - libm::pow(0.05, 1.0 / k.max(1) as f64)
}

/// Of the chains on one data set, all of the same length; `None` without any.
pub fn diagnose(chains: &[&ChainOutcome], rng: &mut impl Rng) -> Option<Diagnosis> {
    let all = || chains.iter().map(|chain| &chain.series);
    let first_step = all().map(|series| series.first_step).max()?;
    let end_step = all().map(|series| series.end_step()).max()?;
    let stretches = |value: &dyn Fn(&ChainOutcome) -> Vec<Stretch>| {
        Chains::new(&chains.iter().map(|chain| value(chain)).collect::<Vec<_>>())
    };
    let PosteriorTopology {
        labels: map_labels,
        is_truth: map_is_truth,
        ..
    } = pooled_topologies(chains).into_iter().next()?;
    let map = topology_identity(&map_labels.parse().ok()?);
    let (indices, identities) = common_indices(chains, first_step);
    let map_index = identities.get(map.as_str()).copied();
    let n_sets = QuantityDiagnosis::new(&n_sets(chains, first_step));
    let ln_target = QuantityDiagnosis::new(&stretches(&|chain| {
        let series = &chain.series;
        series.stretches(&series.ln_target, first_step).collect()
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
        at_map: QuantityDiagnosis::new(&Chains::new(&at_map)),
        map_distance: QuantityDiagnosis::new(&map_distance),
        ess_topologies,
        topologies,
        co_clustering: co_clustering_difference(&pairs, n_detections, &at_least_one),
        unseen: unseen(&indices, &ess, end_step - first_step),
        n_holding: number_holding(&pooled, HOLDING, ess_topologies),
        map_labels,
        map_is_truth,
        n_initial_topologies: n_initial_topologies(chains),
        judged: judged(material(chains, first_step, &indices)),
        probes: probes(chains),
        coupled: coupled::coupled(chains, first_step),
        convergence: Convergence::Mixes,
        by_rule: Convergence::Mixes,
    };
    diagnosis.by_rule = judge::judge_by_rule(&diagnosis, chains);
    diagnosis.convergence = judge::judge(&diagnosis, chains);
    if diagnosis.convergence.is_shown() {
        diagnosis.set_aside();
    }
    Some(diagnosis)
}

impl Diagnosis {
    /// A verdict that is shown does not rest on what is not material. Numbers of it that would read
    /// as speaking against the verdict are left out, with that reason.
    fn set_aside(&mut self) {
        let least = MIN_ESS_PER_CHAIN * self.n_chains as f64;
        let is_judged = |quantity| self.judged.iter().any(|own| own.quantity == quantity);
        if !is_judged(Quantity::NSets) {
            self.n_sets.set_aside(least);
        }
        self.ln_target.set_aside(least);
        self.at_map.set_aside(least);
        self.map_distance.set_aside(least);
        let is_apart = |found: &TopologyDistance| found.total_variation.p_value < MIN_P_VALUE;
        if self.topologies.as_ref().is_ok_and(is_apart) {
            self.topologies = Err(Undefined::NotJudged);
        }
        // Tails are shown for every quantity and judged for none.
        if self.n_sets.ess_tail.is_ok_and(|ess| ess < least) {
            self.n_sets.ess_tail = Err(Undefined::NotJudged);
        }
    }
}

fn n_initial_topologies(chains: &[&ChainOutcome]) -> usize {
    let starts: HashSet<&str> = chains
        .iter()
        .map(|chain| chain.journey.start.as_str())
        .collect();
    starts.len()
}

fn probes(chains: &[&ChainOutcome]) -> Probes {
    let all = || chains.iter().flat_map(|chain| &chain.probes);
    Probes {
        n: all().count(),
        n_came: all().filter(|probe| probe.came()).count(),
    }
}

fn judged(material: Result<Vec<Material>, Undefined>) -> Vec<Judged> {
    let judged = |own: Material| {
        let mean = own.chains.mean();
        let found = QuantityDiagnosis::new(&Ok(own.chains));
        Judged {
            quantity: own.quantity,
            mean,
            r_hat: found.r_hat,
            ess: found.ess_bulk,
        }
    };
    // Too few draws for any statistic are too few for a verdict, which says so by itself.
    material
        .unwrap_or_default()
        .into_iter()
        .map(judged)
        .collect()
}

/// Topologies by their number, with their steps.
type TopologyStretches = Vec<(u32, u64)>;

/// Each chain's topologies in one numbering, with that numbering.
pub(super) fn common_indices<'a>(
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
pub(super) mod tests;
