//! What a chain did, run by run: it stands still between two accepted moves.

use super::topologies::{TopologyIx, TopologyTable};
use super::{Observer, TopologyCount};
use crate::sampler::{MoveKind, Outcome, State, StepInfo};

/// A stretch of steps over which the state did not change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// First step of the stretch; the state stood after it.
    pub first_step: u64,
    /// The topology, by its index in the trace's table.
    pub topology: TopologyIx,
    /// M, its number of sets.
    pub n_sets: u32,
    /// ln P(T) + ln Ẑ(T).
    pub ln_target: f64,
}

/// How often a kind of move was proposed, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MoveCounts {
    /// Proposed, the impossible ones included.
    pub proposed: u64,
    /// Accepted.
    pub accepted: u64,
    /// Not possible from where the chain stood.
    pub impossible: u64,
}

/// A chain's trace. Run k lasts until the first step of run k + 1, the last one until `n_steps`.
pub struct Trace {
    /// Runs in order; the first starts at step 0. Empty if the chain made no step.
    pub runs: Vec<Run>,
    /// Number of steps done.
    pub n_steps: u64,
    /// Counts for every kind of move, parallel to [`MoveKind::ALL`].
    pub moves: [MoveCounts; MoveKind::ALL.len()],
    /// Steps whose importance draws were evaluated.
    pub n_evaluated: u64,
    /// Steps that began with a posterior value of 0 (`--arithmetic linear`).
    pub n_underflowed: u64,
    /// The topologies visited.
    pub topologies: TopologyTable,
}

impl Trace {
    /// Runs with their number of steps, from step `burn_in` on.
    pub fn dwell_times(&self, burn_in: u64) -> impl Iterator<Item = (&Run, u64)> {
        let ends = self
            .runs
            .iter()
            .skip(1)
            .map(|run| run.first_step)
            .chain([self.n_steps]);
        self.runs.iter().zip(ends).filter_map(move |(run, end)| {
            let start = run.first_step.max(burn_in);
            (end > start).then(|| (run, end - start))
        })
    }

    /// A value of each step's state, step by step.
    pub fn expand(&self, value: impl Fn(&Run) -> f64) -> Vec<f64> {
        let mut series = Vec::with_capacity(self.n_steps as usize);
        for (run, dwell) in self.dwell_times(0) {
            series.resize(series.len() + dwell as usize, value(run));
        }
        series
    }

    /// Topologies with their counts from step `burn_in` on, by falling count, then by labels.
    /// Steps at topologies that the table has dropped are missing from it.
    pub fn frequencies(&self, burn_in: u64) -> Vec<TopologyCount> {
        let mut counts = std::collections::HashMap::new();
        for (run, dwell) in self.dwell_times(burn_in) {
            *counts.entry(run.topology).or_insert(0) += dwell;
        }
        let mut rows: Vec<TopologyCount> = counts
            .into_iter()
            .filter_map(|(index, count)| {
                Some(TopologyCount {
                    topology: self.topologies.get(index)?.clone(),
                    count,
                })
            })
            .collect();
        rows.sort_unstable_by(|a, b| {
            b.count
                .cmp(&a.count)
                .then_with(|| a.topology.cmp(&b.topology))
        });
        rows
    }

    /// Accepted / proposed over all kinds of moves; `None` before the first step.
    pub fn acceptance_rate(&self) -> Option<f64> {
        let accepted: u64 = self.moves.iter().map(|counts| counts.accepted).sum();
        (self.n_steps > 0).then(|| accepted as f64 / self.n_steps as f64)
    }
}

/// Records a trace.
pub struct TraceRecorder {
    trace: Trace,
    topology: TopologyIx,
}

impl TraceRecorder {
    /// Holds at most `max_topologies` distinct topologies.
    pub fn new(max_topologies: usize) -> Self {
        let trace = Trace {
            runs: Vec::new(),
            n_steps: 0,
            moves: Default::default(),
            n_evaluated: 0,
            n_underflowed: 0,
            topologies: TopologyTable::new(max_topologies),
        };
        Self { trace, topology: 0 }
    }

    /// The trace so far.
    pub fn finish(self) -> Trace {
        self.trace
    }
}

impl Observer for TraceRecorder {
    fn start(&mut self, state: &State) {
        self.topology = self.trace.topologies.index(state.partition());
    }

    fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
        let trace = &mut self.trace;
        let counts = &mut trace.moves[info.kind as usize];
        counts.proposed += 1;
        counts.accepted += u64::from(info.outcome == Outcome::Accepted);
        counts.impossible += u64::from(info.outcome == Outcome::Impossible);
        trace.n_evaluated += u64::from(info.evaluated);
        trace.n_underflowed += u64::from(info.underflowed);
        trace.n_steps = step + 1;
        let moved = info.outcome == Outcome::Accepted;
        if moved {
            self.topology = trace.topologies.index(state.partition());
        }
        trace.topologies.visit(self.topology, 1);
        if moved || step == 0 {
            trace.runs.push(Run {
                first_step: step,
                topology: self.topology,
                n_sets: state.partition().n_sets() as u32,
                ln_target: state.ln_target(),
            });
        }
    }
}
