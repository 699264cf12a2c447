//! Probes: short chains from random topologies that must come to where a chain went.
//!
//! Chains that agree may all have fallen into the same one of several modes. Each chain therefore
//! sends out probes, chains of a tenth of its length from random topologies. A probe **comes** if,
//! in its last half, it stands at least once as near to the chain's MAP topology as nine in ten of
//! the chain's own draws do. Nearness is the share of pairs of detections that two topologies
//! treat differently. A probe that does not come has found another mode, or is too short to leave
//! its start: either way the chain's draws do not show the whole posterior yet.
//!
//! The rule and its error rates are in `docs/verdicts.md`.

use serde::{Deserialize, Serialize};

use crate::chain::{self, Observer, Start, Trace};
use crate::diagnostics::pair_counts::PairCounts;
use crate::model::Model;
use crate::partition::Topology;
use crate::rng::Purpose;
use crate::sampler::{State, StepInfo};
use crate::settings::Settings;

/// A chain has so many times the proposals of each of its probes.
const CHAIN_PER_PROBE: u64 = 10;
/// Draws of the chain that tell how far its topologies lie from the MAP topology.
const MAX_DRAWS: u64 = 1000;
/// Looks at a probe in its last half: each costs time in proportion to N.
const MAX_LOOKS: u64 = 500;
/// Share of the chain's draws that lie within the bound.
const LEVEL: f64 = 0.9;

/// What became of one probe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProbeOutcome {
    /// Proposals that it made: fewer than it may if it came.
    pub n_steps: u64,
    /// The nearest that it came to the chain's MAP topology in its last half: share of pairs.
    pub nearest: f64,
    /// Nine in ten draws of the chain are at least as near.
    pub bound: f64,
}

impl ProbeOutcome {
    /// What is taken of a probe before it is sent: that it will come.
    pub(super) const AWAITED: Self = Self {
        n_steps: 0,
        nearest: 0.0,
        bound: 0.0,
    };

    /// Whether it came to where the chain went.
    pub fn came(&self) -> bool {
        self.nearest <= self.bound
    }
}

/// What a probe is sent out from.
pub(super) struct Sender<'a> {
    pub model: &'a Model,
    pub settings: &'a Settings,
    /// Purpose of the chain; those of its probes follow from it.
    pub purpose: &'a Purpose,
    pub trace: &'a Trace,
    pub burn_in: u64,
    pub map: &'a Topology,
}

impl Sender<'_> {
    /// As many probes as the settings say; `None` if they were told to stop.
    pub fn send(&self, stop: &dyn Fn() -> bool) -> Option<Vec<ProbeOutcome>> {
        let n = self.settings.count("probes");
        if n == 0 {
            return Some(Vec::new());
        }
        let bound = self.bound();
        (0..n)
            .map(|number| self.probe(number, bound, stop))
            .collect()
    }

    /// The distance within which nine in ten draws of the chain lie.
    fn bound(&self) -> f64 {
        let n_steps = self.trace.n_steps - self.burn_in;
        let n_draws = n_steps.min(MAX_DRAWS);
        if let Some(snapshots) = self.trace.snapshots() {
            let states = snapshots.after(self.burn_in, self.trace.n_steps);
            let distances = states.map(|(state, _)| distance(self.map, &state.topology));
            return nine_in_ten(distances.collect());
        }
        let (mut distances, mut end) = (Vec::new(), 0);
        for (run, dwell) in self.trace.dwell_times(self.burn_in) {
            let n_before = end * n_draws / n_steps;
            end += dwell;
            let n = end * n_draws / n_steps - n_before;
            let topology = self.trace.topologies.get(run.topology).filter(|_| n > 0);
            if let Some(topology) = topology {
                let apart = distance(self.map, topology);
                distances.extend((0..n).map(|_| apart));
            }
        }
        nine_in_ten(distances)
    }

    fn probe(&self, number: u64, bound: f64, stop: &dyn Fn() -> bool) -> Option<ProbeOutcome> {
        let settings = self.settings;
        let n_steps = self.trace.n_steps.div_ceil(CHAIN_PER_PROBE);
        let purpose = self
            .purpose
            .clone()
            .text("use", "probe")
            .number("probe", number);
        let mut watcher = Watcher {
            map: self.map,
            bound,
            first_look: n_steps / 2,
            every: (n_steps / 2).div_ceil(MAX_LOOKS).max(1),
            last_step: n_steps - 1,
            nearest: 1.0,
            seen: None,
            stop,
            is_stopped: false,
        };
        let (prior, sampler) = (
            settings.prior(),
            settings.sampler(self.model.n_detections()),
        );
        let reached = chain::run(
            self.model,
            prior,
            &sampler,
            &Start::Random,
            n_steps,
            &purpose,
            &mut watcher,
        );
        (!watcher.is_stopped).then_some(ProbeOutcome {
            n_steps: reached.step(),
            nearest: watcher.nearest,
            bound,
        })
    }
}

/// Looks at a probe now and then in its last half, and ends it when it has come.
struct Watcher<'a> {
    map: &'a Topology,
    bound: f64,
    first_look: u64,
    every: u64,
    last_step: u64,
    nearest: f64,
    /// Hash of the topology that was looked at last.
    seen: Option<u128>,
    stop: &'a dyn Fn() -> bool,
    is_stopped: bool,
}

impl Observer for Watcher<'_> {
    fn step(&mut self, step: u64, state: &State, _info: &StepInfo) {
        let is_due = step >= self.first_look
            && ((step - self.first_look).is_multiple_of(self.every) || step == self.last_step);
        if is_due && self.seen != Some(state.partition().hash()) {
            self.seen = Some(state.partition().hash());
            let apart = distance(self.map, &state.partition().topology());
            self.nearest = self.nearest.min(apart);
        }
    }

    fn wants_stop(&mut self) -> bool {
        self.is_stopped = (self.stop)();
        self.is_stopped || (self.seen.is_some() && self.nearest <= self.bound)
    }
}

/// Share of pairs that two topologies treat differently; 0 below two detections.
fn distance(a: &Topology, b: &Topology) -> f64 {
    PairCounts::new(a, b).disagreement().unwrap_or(0.0)
}

/// The least of some distances that nine in ten of them do not exceed.
fn nine_in_ten(mut distances: Vec<f64>) -> f64 {
    distances.sort_unstable_by(f64::total_cmp);
    let place = (LEVEL * distances.len() as f64).ceil() as usize;
    let found = distances.get(place.saturating_sub(1));
    found.copied().unwrap_or(0.0)
}
