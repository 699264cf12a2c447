//! What is kept of a chain: everything that tables and figures need, and of its trace a bounded
//! series ([`ChainSeries`]).

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use serde::{Deserialize, Serialize};

use super::ExactComparison;
use super::checks::{ChainChecks, Noted};
use super::coupling::CouplingOutcome;
use super::journey::Journey;
use super::limits::FailureKind;
use super::probes::ProbeOutcome;
use super::series::ChainSeries;
use crate::chain::{Run, Sums, TemperingReport, TopologyId, Trace};
use crate::diagnostics::burn_in::{BurnIn, mser};
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::ess::ess_bulk;
use crate::diagnostics::information::variation_of_information;
use crate::diagnostics::recovery::Truth;
use crate::diagnostics::trace_bins::{TraceBins, bin};
use crate::partition::Topology;
use crate::sampler::{MoveKind, SwapCounts};
use crate::settings::{BurnInRule, Settings};

/// Topologies kept for each chain, by falling count.
const N_TOP: usize = 10;
/// MSER looks at every step of chains up to this length, and at so many evenly spaced ones of longer chains.
const MAX_MSER_VALUES: u64 = 1 << 20;
/// Bins of the dimensionality trace: about what a figure's width resolves.
const N_BINS: u64 = 400;

/// A chain's record in the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChainRecord {
    /// The identity of the chain.
    pub key: String,
    /// What became of it.
    pub status: ChainStatus,
}

impl ChainRecord {
    /// Whether the chain has no result.
    pub fn has_failed(&self) -> bool {
        matches!(self.status, ChainStatus::Failed { .. })
    }
}

impl ChainRecord {
    /// Gives back what a reader of lists of unknown length has asked for in advance, up to half of a record.
    pub(super) fn shrink(&mut self) {
        if let ChainStatus::Done(outcome) = &mut self.status {
            outcome.moves.shrink_to_fit();
            outcome.top.shrink_to_fit();
            outcome.probes.shrink_to_fit();
            outcome.series.shrink();
        }
    }

    /// Whether the chain was cut off and goes on when it is given more time.
    pub(super) fn may_go_on(&self) -> bool {
        matches!(
            self.status,
            ChainStatus::Failed {
                kind: FailureKind::TimeLimit { .. },
                ..
            }
        )
    }
}

/// What became of a chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChainStatus {
    /// It ran to its end.
    Done(Box<ChainOutcome>),
    /// It did not.
    Failed {
        /// What kind of failure.
        kind: FailureKind,
        /// Why, in words.
        reason: String,
    },
}

/// Counts of one kind of move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveRow {
    /// merge, split, …
    pub kind: String,
    /// Proposed, the impossible ones included.
    pub proposed: u64,
    /// Accepted.
    pub accepted: u64,
    /// Not possible from where the chain stood.
    pub impossible: u64,
}

/// One of the topologies that a chain visited most.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopTopology {
    /// Canonical labels, as in `0,0,1`.
    pub labels: String,
    /// M.
    pub n_sets: u64,
    /// Proposals after burn-in that ended there.
    pub count: u64,
    /// `count` over all proposals after burn-in.
    pub frequency: f64,
    /// Whether it is the truth; `None` if no truth is known.
    pub is_truth: Option<bool>,
}

/// Where quantities of a chain settled, in proposals, by MSER-5; `never-settled`, `too-short` or `truncated` where there is no
/// place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MserBurnIns {
    /// M.
    pub n_sets: Noted,
    /// ln target.
    pub ln_target: Noted,
    /// The variation of information to the chain's MAP topology, that after the burn-in of the other two (or as it is set).
    /// `truncated` if the table of topologies was full, so that how far away some were is not known.
    pub map_distance: Noted,
}

impl From<BurnIn> for Noted {
    fn from(found: BurnIn) -> Self {
        let (value, state) = match found {
            BurnIn::Settled(n) => (Some(n as f64), "defined"),
            BurnIn::NeverSettled => (None, "never-settled"),
            BurnIn::TooShort => (None, "too-short"),
        };
        Self {
            value,
            state: state.to_owned(),
        }
    }
}

/// How a ladder of temperatures did once it stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemperingOutcome {
    /// β of every rung, from 1 to 0.
    pub inverse_temperatures: Vec<f64>,
    /// Share of swaps rejected between neighbours.
    pub rejected: Vec<f64>,
    /// Their sum, an estimate of the communication barrier Λ (Syed et al. 2022): about 2Λ rungs serve best.
    pub barrier: f64,
    /// Journeys of replicas from the coldest rung to the hottest and back.
    pub round_trips: u64,
}

/// Summary of a chain that ran to its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChainOutcome {
    /// N.
    pub n_detections: u64,
    /// True landmarks among the detections of known truth.
    pub n_landmarks: Option<u64>,
    /// Proposals.
    pub n_steps: u64,
    /// By kind of move.
    pub moves: Vec<MoveRow>,
    /// Accepted / proposed over all kinds.
    pub acceptance_rate: f64,
    /// Share of proposals whose importance draws were evaluated.
    pub evaluated_share: f64,
    /// Share of proposals made from a posterior value of 0; `None` in log arithmetic.
    pub underflow_share: Option<f64>,
    /// Proposals left out at the start; `None` if the chain never settled.
    pub burn_in: Option<u64>,
    /// How that came about.
    pub burn_in_reason: String,
    /// Where MSER says that each quantity settled, whatever the burn-in was set to.
    pub mser: MserBurnIns,
    /// Mean of M after burn-in.
    pub mean_n_sets: f64,
    /// Standard deviation of M after burn-in.
    pub sd_n_sets: f64,
    /// M at the end.
    pub last_n_sets: u64,
    /// Mean of ln P(T) + ln Ẑ(T) after burn-in.
    pub mean_ln_target: f64,
    /// Effective draws of M after burn-in, of this chain by itself and of all its steps; `None` where undefined.
    pub ess_n_sets: Option<f64>,
    /// The same of ln target.
    pub ess_ln_target: Option<f64>,
    /// Distinct topologies after burn-in.
    pub n_topologies: u64,
    /// By how much a count may be too small; 0 unless truncated.
    pub count_error_bound: u64,
    /// Most visited topologies after burn-in.
    pub top: Vec<TopTopology>,
    /// Whether the MAP topology is the truth; `None` if no truth is known.
    pub recovered: Option<bool>,
    /// Share of proposals after burn-in that ended at the truth.
    pub truth_mass: Option<f64>,
    /// Proposals until the chain first stood at the truth; `None` if it never did or no truth is known. Of a thinned trace, the
    /// first time that it shows.
    pub first_at_truth: Option<u64>,
    /// Adjusted Rand index of the MAP topology with the truth.
    pub adjusted_rand_index: Option<f64>,
    /// Share of detections of unknown truth.
    pub unknown_share: Option<f64>,
    /// Detections of unknown truth that the MAP topology merges with known ones.
    pub n_unknown_merged: Option<u64>,
    /// How far its frequencies after burn-in are from the exact posterior.
    pub exact: ExactComparison,
    /// How its ladder of temperatures did, if it has one.
    pub tempering: Option<TemperingOutcome>,
    /// The dimensionality trace.
    pub n_sets_bins: TraceBins,
    /// What the trace says of the chain by itself.
    #[serde(default)]
    pub checks: ChainChecks,
    /// How it came to its MAP topology.
    pub journey: Journey,
    /// Short chains from random topologies, which should come to the same place.
    pub probes: Vec<ProbeOutcome>,
    /// When a pair of coupled chains from its start met, if one was sent.
    #[serde(default)]
    pub coupling: Option<CouplingOutcome>,
    /// What is needed to compare it with other chains.
    pub series: ChainSeries,
}

/// The summary of a finished trace of at least one step, of a chain that started at `start`.
pub fn summarise(
    trace: &Trace,
    start: &Topology,
    truth: Option<&Truth>,
    settings: &Settings,
) -> ChainOutcome {
    let (burn_in, burn_in_reason, mser) = burn_in(trace, settings);
    let cut = burn_in.unwrap_or(settings.least_burn_in());
    let n_counted = (trace.n_steps - cut) as f64;
    let frequencies = trace.frequencies(cut);
    let map = frequencies.first().map(|row| &row.topology);
    let of_map =
        |value: fn(&Truth, &Topology) -> u64| truth.zip(map).map(|(truth, map)| value(truth, map));
    let top = frequencies.iter().take(N_TOP).map(|row| TopTopology {
        labels: row.topology.to_string(),
        n_sets: row.topology.n_sets() as u64,
        count: row.count,
        frequency: row.count as f64 / n_counted,
        is_truth: truth.map(|truth| truth.is_recovered_by(&row.topology)),
    });
    let truth_mass = truth.map(|truth| {
        let at_truth = frequencies
            .iter()
            .filter(|row| truth.is_recovered_by(&row.topology));
        at_truth.map(|row| row.count).sum::<u64>() as f64 / n_counted
    });
    let sums = trace.sums(cut);
    let sd = |sums: &Sums| sums.sd().expect("at least one step is kept after burn-in");
    let share = |count: u64| count as f64 / trace.n_steps as f64;
    let linear = settings.text("arithmetic") == "linear";
    let bins = bin(
        trace.dwell_times(0).map(|(run, dwell)| (run.n_sets, dwell)),
        trace.n_steps,
        N_BINS,
    );
    let series = ChainSeries::new(trace, cut, &frequencies, &sums);
    ChainOutcome {
        n_detections: start.labels().len() as u64,
        n_landmarks: truth.map(|truth| truth.n_landmarks() as u64),
        n_steps: trace.n_steps,
        moves: move_rows(trace),
        acceptance_rate: trace.acceptance_rate().expect("at least one step was done"),
        evaluated_share: share(trace.n_evaluated),
        underflow_share: linear.then(|| share(trace.n_underflowed)),
        burn_in,
        burn_in_reason,
        mser,
        mean_n_sets: sums.n_sets.mean,
        sd_n_sets: sd(&sums.n_sets),
        last_n_sets: trace.runs.last().map_or(0, |run| u64::from(run.n_sets)),
        mean_ln_target: sums.ln_target.mean,
        ess_n_sets: ess(trace, cut, |run| f64::from(run.n_sets)),
        ess_ln_target: ess(trace, cut, |run| run.ln_target),
        n_topologies: frequencies.len() as u64,
        count_error_bound: trace.topologies.error_bound(),
        top: top.collect(),
        recovered: truth
            .zip(map)
            .map(|(truth, map)| truth.is_recovered_by(map)),
        truth_mass,
        first_at_truth: truth.and_then(|truth| first_at(trace, truth)),
        adjusted_rand_index: truth
            .zip(map)
            .and_then(|(truth, map)| truth.adjusted_rand_index(map)),
        unknown_share: truth.map(|truth| truth.unknown_share()),
        n_unknown_merged: of_map(|truth, map| truth.n_unknown_merged(map) as u64),
        exact: ExactComparison::Not {
            reason: "not asked for".to_owned(),
        },
        n_sets_bins: bins,
        tempering: trace.tempering.as_ref().map(tempering),
        checks: ChainChecks::new(trace, cut, &series),
        journey: Journey::new(trace, start, map),
        probes: Vec::new(),
        coupling: None,
        series,
    }
}

fn tempering(report: &TemperingReport) -> TemperingOutcome {
    let rejected: Vec<f64> = report
        .swaps
        .iter()
        .map(SwapCounts::rejected_share)
        .collect();
    TemperingOutcome {
        inverse_temperatures: report.inverse_temperatures.clone(),
        barrier: rejected.iter().sum(),
        rejected,
        round_trips: report.round_trips,
    }
}

/// Effective draws, for the bulk.
fn ess(trace: &Trace, first: u64, value: impl Fn(&Run) -> f64) -> Option<f64> {
    let stretches = trace.dwell_times(first);
    let stretches = stretches.map(|(run, length)| -> Stretch { (value(run), length) });
    let chains = Chains::new(&[stretches.collect()]);
    chains
        .and_then(|chains| ess_bulk(&chains))
        .ok()
        .map(|found| found.ess)
}

/// Proposals until the chain first stood at the truth.
fn first_at(trace: &Trace, truth: &Truth) -> Option<u64> {
    let mut is_truth = HashMap::new();
    let mut at_truth = |run: &Run| {
        *is_truth.entry(run.topology).or_insert_with(|| {
            let topology = trace.topologies.get(run.topology);
            topology.is_some_and(|topology| truth.is_recovered_by(topology))
        })
    };
    let (first, _) = trace.dwell_times(0).find(|(run, _)| at_truth(run))?;
    Some(first.first_step + 1)
}

/// Kinds of moves that were proposed at all, in their fixed order.
fn move_rows(trace: &Trace) -> Vec<MoveRow> {
    let kinds = MoveKind::ALL
        .iter()
        .zip(&trace.moves)
        .filter(|(_, counts)| counts.proposed > 0);
    let row = |(kind, counts): (&MoveKind, &crate::chain::MoveCounts)| MoveRow {
        kind: kind.name().to_owned(),
        proposed: counts.proposed,
        accepted: counts.accepted,
        impossible: counts.impossible,
    };
    kinds.map(row).collect()
}

/// The latest of the burn-ins of M, of ln target and of the distance to the MAP topology; `None`, with the reason, if one of
/// them never settled. Nothing is left out then but what must be: there is no place to cut.
fn burn_in(trace: &Trace, settings: &Settings) -> (Option<u64>, String, MserBurnIns) {
    let settled = |value: &dyn Fn(&Run) -> f64| {
        let (series, every) = trace.sample(MAX_MSER_VALUES, value);
        match mser(&series) {
            BurnIn::Settled(n) => BurnIn::Settled(n * every),
            other => other,
        }
    };
    let of_n_sets = settled(&|run| f64::from(run.n_sets));
    let of_ln_target = settled(&|run| run.ln_target);
    let least = settings.least_burn_in();
    let cut = match (settings.burn_in(), of_n_sets, of_ln_target) {
        (BurnInRule::Fixed(n), ..) if n < trace.n_steps => n,
        (BurnInRule::Auto, BurnIn::Settled(a), BurnIn::Settled(b)) => a.max(b).max(least),
        _ => least,
    };
    let of_distance =
        distances_to_map(trace, cut).map(|distances| settled(&|run| distances[&run.topology]));
    let by = MserBurnIns {
        n_sets: of_n_sets.into(),
        ln_target: of_ln_target.into(),
        map_distance: of_distance.map_or_else(
            || Noted {
                value: None,
                state: "truncated".to_owned(),
            },
            Noted::from,
        ),
    };
    if let BurnInRule::Fixed(n) = settings.burn_in() {
        if n >= trace.n_steps {
            let reason = format!("burn_in of {n} leaves none of {} proposals", trace.n_steps);
            return (None, reason, by);
        }
        return (Some(n), "as set".to_owned(), by);
    }
    let mut found = vec![("M", of_n_sets), ("ln target", of_ln_target)];
    found.extend(of_distance.map(|own| ("distance to the MAP topology", own)));
    if found.iter().any(|(_, own)| *own == BurnIn::TooShort) {
        return (None, "too few proposals to tell".to_owned(), by);
    }
    let names = |of: &dyn Fn(BurnIn) -> bool| {
        let names = found.iter().filter(|(_, own)| of(*own));
        in_words(&names.map(|(name, _)| *name).collect::<Vec<_>>())
    };
    let never = names(&|own| own == BurnIn::NeverSettled);
    if !never.is_empty() {
        return (None, format!("{never} never settled"), by);
    }
    let places = found.iter().map(|(_, own)| match own {
        BurnIn::Settled(n) => *n,
        _ => 0,
    });
    let latest = places.max().unwrap_or(0);
    let reason = if latest < least {
        "the ladder of temperatures was tuned".to_owned()
    } else {
        format!("MSER on {}", names(&|_| true))
    };
    (Some(latest.max(least)), reason, by)
}

/// "M, ln target and distance".
fn in_words(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The variation of information, nats, of every topology of the trace to the one visited most from step `cut` on; `None` if
/// some of them are not known any more.
fn distances_to_map(trace: &Trace, cut: u64) -> Option<HashMap<TopologyId, f64>> {
    let frequencies = trace.frequencies(cut);
    let map = &frequencies.first()?.topology;
    let mut distances = HashMap::new();
    for (run, _) in trace.dwell_times(0) {
        if let Entry::Vacant(entry) = distances.entry(run.topology) {
            let topology = trace.topologies.get(run.topology)?;
            entry.insert(variation_of_information(topology, map)?);
        }
    }
    Some(distances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{TopologyTable, TraceRecorder};
    use crate::partition::Partition;

    /// A trace of one step at each of these topologies of six detections, all of three sets and with one ln target: only how
    /// far they are from one another tells them apart.
    fn trace(at: impl Iterator<Item = usize>, room: usize) -> Trace {
        let labels: [[u32; 6]; 4] = [
            [0, 0, 1, 1, 2, 2],
            [0, 1, 0, 1, 2, 2],
            [0, 1, 2, 0, 1, 2],
            [0, 0, 0, 0, 1, 2],
        ];
        let mut trace = TraceRecorder::new(100).finish();
        let mut table = TopologyTable::new(room);
        for (step, place) in at.enumerate() {
            let partition = Partition::from_labels(&labels[place]);
            trace.runs.push(Run {
                first_step: step as u64,
                topology: table.enter(&partition),
                n_sets: partition.n_sets() as u32,
                ln_target: -1.0,
            });
            trace.n_steps += 1;
        }
        trace.topologies = table;
        trace
    }

    /// 200 steps far away, then 800 about topology 0.
    fn drifting() -> impl Iterator<Item = usize> {
        (0..1000).map(|step| match step {
            0..200 => 2 + step % 2,
            _ => usize::from(step % 7 == 0),
        })
    }

    #[test]
    fn only_the_distance_tells_how_long_this_chain_was_away() {
        let (found, reason, by) = burn_in(&trace(drifting(), 100), &Settings::default());
        assert_eq!(
            (by.n_sets.value, by.ln_target.value),
            (Some(0.0), Some(0.0))
        );
        assert_eq!(found, Some(200));
        assert_eq!(by.map_distance.value, Some(200.0));
        assert_eq!(
            reason,
            "MSER on M, ln target and distance to the MAP topology"
        );
        // A burn-in that is set stands, and what MSER says is said.
        let mut fixed = Settings::default();
        assert_eq!(fixed.set_text("burn_in", "30"), Ok(()));
        let (found, reason, by) = burn_in(&trace(drifting(), 100), &fixed);
        assert_eq!((found, reason.as_str()), (Some(30), "as set"));
        assert_eq!(by.map_distance.value, Some(200.0));
    }

    #[test]
    fn a_distance_that_never_settles_leaves_no_burn_in() {
        // It comes to the topology that it then stays at just after the first half.
        let at = (0..1000).map(|step| if step < 520 { 1 + step % 3 } else { 0 });
        let (found, reason, by) = burn_in(&trace(at, 100), &Settings::default());
        assert_eq!(
            (found, by.map_distance.state.as_str()),
            (None, "never-settled")
        );
        assert_eq!(reason, "distance to the MAP topology never settled");
    }

    #[test]
    fn without_all_topologies_the_other_two_decide() {
        let (found, reason, by) = burn_in(&trace(drifting(), 2), &Settings::default());
        assert_eq!(
            (found, by.map_distance.state.as_str()),
            (Some(0), "truncated")
        );
        assert_eq!(reason, "MSER on M and ln target");
    }
}
