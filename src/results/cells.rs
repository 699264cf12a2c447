//! One cell: means over its chains, and its recovery rate.

use std::collections::HashSet;

use super::distance::{CellDistance, cell_distance};
use super::fault::{Faults, walks_at_random};
use super::verdict::{CellVerdict, WorldsByVerdict};
use super::{ChainResult, Verdict, WorldResult};
use crate::diagnostics::estimate_noise::EstimateNoise;
use crate::diagnostics::rate::{Rate, recovery_rate};
use crate::run::{ChainOutcome, Stop};
use crate::sweep::Sweep;

/// A cell's results. Means are over the chains that ran to their end; `None` if there is none, or if
/// the quantity is undefined for all of them.
#[derive(Clone, Debug)]
pub struct CellResult {
    /// The cell, by its index.
    pub cell: usize,
    /// Replicates that it was given, repeats too.
    pub n_replicates: u64,
    /// Where it stands under a stopping rule; `None` without one.
    pub stop: Option<Stop>,
    /// Chains that have a record.
    pub n_chains: usize,
    /// Chains that failed.
    pub n_failed: usize,
    /// Chains that have not been run yet.
    pub n_missing: usize,
    /// What to make of it.
    pub verdict: CellVerdict,
    /// Its worlds by verdict, less those that repeat another.
    pub worlds: WorldsByVerdict,
    /// Chains that never settled.
    pub n_never_settled: usize,
    /// Share of pairs of chains on one world that have the same MAP topology; `None` with one chain a
    /// world. A chain that stands still has settled by itself; only others can tell that it is stuck.
    pub map_agreement: Option<f64>,
    /// Distinct MAP topologies of the chains on the first world.
    pub n_maps_first_world: usize,
    /// Chains whose topology counts were truncated.
    pub n_truncated: usize,
    /// Share of worlds (or of chains, on a single data set) whose MAP topology is the truth.
    pub recovery: Option<Rate>,
    /// Acceptance rate.
    pub acceptance_rate: Option<f64>,
    /// Acceptance rate of merges.
    pub merge_acceptance: Option<f64>,
    /// Acceptance rate of splits.
    pub split_acceptance: Option<f64>,
    /// Burn-in of the chains that settled.
    pub burn_in: Option<f64>,
    /// M after burn-in.
    pub n_sets: Option<f64>,
    /// Standard deviation of M within a chain.
    pub sd_n_sets: Option<f64>,
    /// N.
    pub n_detections: Option<f64>,
    /// True landmarks.
    pub n_landmarks: Option<f64>,
    /// Share of draws at the MAP topology.
    pub map_frequency: Option<f64>,
    /// Share of draws at the truth.
    pub truth_mass: Option<f64>,
    /// Adjusted Rand index of the MAP topology with the truth.
    pub adjusted_rand_index: Option<f64>,
    /// Share of detections of unknown truth.
    pub unknown_share: Option<f64>,
    /// Detections of unknown truth that the MAP topology merges with known ones.
    pub n_unknown_merged: Option<f64>,
    /// Share of proposals made from a posterior value of 0 (`--arithmetic linear`).
    pub underflow_share: Option<f64>,
    /// Whether most of its chains accepted whatever came, from posterior values that had underflowed to 0.
    pub walks_at_random: bool,
    /// Whose fault its failures are; `None` if its posterior was not asked for, or no truth is known.
    pub faults: Option<Faults>,
    /// Noise of the log estimate of its chains: whether R suffices. `None` where no penalty is felt, or no chain
    /// moved.
    pub noise: Option<EstimateNoise>,
    /// Share of a chain that its longest stretch without an accepted move takes.
    pub longest_hold: Option<f64>,
    /// How far its chains are from the exact posterior.
    pub exact: CellDistance,
}

impl CellResult {
    /// Share of its worlds on which the chains are shown to have converged, among those with chains;
    /// `None` without any. A recovery rate is worth as much as this.
    pub fn converged_share(&self) -> Option<f64> {
        let n_judged = self.worlds.n_judged();
        (n_judged > 0).then(|| self.worlds.n_converged() as f64 / n_judged as f64)
    }

    /// "not converged: 3 of 5 worlds, 2 recovered and converged".
    pub fn verdict_words(&self) -> String {
        self.worlds.verdict_words()
    }
}

/// Gathers the chains of one cell, which has so many replicates and stands so under a stopping rule.
pub fn cell_result(
    sweep: &Sweep,
    cell: usize,
    chains: &[&ChainResult],
    own_worlds: &[&WorldResult],
    (n_replicates, stop): (u64, Option<Stop>),
) -> CellResult {
    let outcomes: Vec<&ChainOutcome> = chains.iter().filter_map(|chain| chain.outcome()).collect();
    let mean = |value: &dyn Fn(&ChainOutcome) -> Option<f64>| {
        let values: Vec<f64> = outcomes
            .iter()
            .filter_map(|outcome| value(outcome))
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let accepted = |kind: &'static str| {
        move |outcome: &ChainOutcome| {
            let row = outcome.moves.iter().find(|row| row.kind == kind)?;
            Some(row.accepted as f64 / row.proposed as f64)
        }
    };
    let noise: Vec<(f64, f64)> = (outcomes.iter())
        .filter_map(|outcome| {
            let checks = &outcome.checks;
            Some((checks.estimate_sd.value?, checks.estimate_sd_error?))
        })
        .collect();
    let verdicts: Vec<Verdict> = own_worlds.iter().map(|world| world.verdict).collect();
    // Replicates that repeat one world show that there is no other.
    let is_only_world = verdicts.len() == 1 && (n_replicates > 1 || !sweep.has_many_worlds());
    let by_verdict = WorldsByVerdict::new(&verdicts, is_only_world);
    CellResult {
        cell,
        n_replicates,
        stop,
        n_chains: chains.len(),
        n_failed: chains.len() - outcomes.len(),
        n_missing: own_worlds.iter().map(|world| world.n_missing).sum(),
        verdict: by_verdict.verdict(),
        worlds: by_verdict,
        n_never_settled: outcomes
            .iter()
            .filter(|outcome| outcome.burn_in.is_none())
            .count(),
        map_agreement: map_agreement(chains),
        n_maps_first_world: maps_of(chains, 0).iter().collect::<HashSet<_>>().len(),
        n_truncated: outcomes
            .iter()
            .filter(|outcome| outcome.count_error_bound > 0)
            .count(),
        recovery: recovery_rate(
            &outcomes_by_world(chains.iter().copied()),
            sweep.has_many_worlds(),
        ),
        acceptance_rate: mean(&|outcome| Some(outcome.acceptance_rate)),
        merge_acceptance: mean(&accepted("merge")),
        split_acceptance: mean(&accepted("split")),
        burn_in: mean(&|outcome| outcome.burn_in.map(|n| n as f64)),
        n_sets: mean(&|outcome| Some(outcome.mean_n_sets)),
        sd_n_sets: mean(&|outcome| Some(outcome.sd_n_sets)),
        n_detections: mean(&|outcome| Some(outcome.n_detections as f64)),
        n_landmarks: mean(&|outcome| outcome.n_landmarks.map(|n| n as f64)),
        map_frequency: mean(&|outcome| outcome.top.first().map(|top| top.frequency)),
        truth_mass: mean(&|outcome| outcome.truth_mass),
        adjusted_rand_index: mean(&|outcome| outcome.adjusted_rand_index),
        unknown_share: mean(&|outcome| outcome.unknown_share),
        n_unknown_merged: mean(&|outcome| outcome.n_unknown_merged.map(|n| n as f64)),
        underflow_share: mean(&|outcome| outcome.underflow_share),
        walks_at_random: outcomes.iter().filter(|own| walks_at_random(own)).count() * 2
            > outcomes.len(),
        faults: Faults::of(chains.iter().filter_map(|chain| chain.sorted)),
        noise: EstimateNoise::pooled(&noise),
        longest_hold: mean(&|outcome| {
            let n_kept = outcome.n_steps - outcome.series.first_step;
            Some(outcome.checks.longest_hold as f64 / n_kept as f64)
        }),
        exact: cell_distance(&outcomes),
    }
}

/// Whether each chain recovered the truth, by the world's number; repeats and unknown outcomes are
/// left out.
pub fn outcomes_by_world<'a>(chains: impl Iterator<Item = &'a ChainResult>) -> Vec<Vec<bool>> {
    let mut worlds = Vec::new();
    for chain in chains.filter(|chain| !chain.is_repeat) {
        let world = chain.replicate as usize;
        if let Some(recovered) = chain.outcome().and_then(|outcome| outcome.recovered) {
            if worlds.len() <= world {
                worlds.resize_with(world + 1, Vec::new);
            }
            worlds[world].push(recovered);
        }
    }
    worlds
}

/// MAP topologies of the chains on one world.
fn maps_of<'a>(chains: &[&'a ChainResult], replicate: u64) -> Vec<&'a str> {
    let on_world = chains.iter().filter(|chain| chain.replicate == replicate);
    on_world
        .filter_map(|chain| Some(chain.outcome()?.top.first()?.labels.as_str()))
        .collect()
}

fn map_agreement(chains: &[&ChainResult]) -> Option<f64> {
    let n_worlds = chains.iter().map(|chain| chain.replicate + 1).max()?;
    let (mut n_pairs, mut n_same) = (0_u64, 0_u64);
    for replicate in 0..n_worlds {
        let maps = maps_of(chains, replicate);
        for (place, first) in maps.iter().enumerate() {
            n_pairs += (maps.len() - place - 1) as u64;
            n_same += maps[place + 1..]
                .iter()
                .filter(|other| *other == first)
                .count() as u64;
        }
    }
    (n_pairs > 0).then(|| n_same as f64 / n_pairs as f64)
}
