//! What a chain did, run by run: it stands still between two accepted moves.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::snapshots::{Snapshot, Snapshots};
use super::topologies::{TopologyId, TopologyTable};
use super::windows::{ChainSums, PairSteps, Windows};
use super::{Observer, TemperingReport, TopologyCount};
use crate::partition::Partition;
use crate::sampler::{MoveKind, Outcome, State, StepInfo};

/// A stretch of steps over which the state did not change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// First step of the stretch; the state stood after it.
    pub first_step: u64,
    /// The topology, by its identity in the trace's table.
    pub topology: TopologyId,
    /// M, its number of sets.
    pub n_sets: u32,
    /// ln P(T) + ln Ẑ(T).
    pub ln_target: f64,
}

/// How often a kind of move was proposed, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MoveCounts {
    /// Proposed, the impossible ones included.
    pub proposed: u64,
    /// Accepted.
    pub accepted: u64,
    /// Not possible from where the chain stood.
    pub impossible: u64,
}

/// Runs held at most. Beyond them the trace is thinned: it keeps every second step, then every fourth, and so
/// on, exactly, so that any number of steps fits.
pub const MAX_RUNS: usize = 1 << 19;
/// A trace of more detections than this has a quarter of them: it moves all the time, and a run of it
/// says little.
const MANY_DETECTIONS: usize = 2000;

/// A chain's trace. Run k lasts until the first step of run k + 1, the last one until `n_steps`.
#[derive(Clone, Serialize, Deserialize)]
pub struct Trace {
    /// Runs in order; the first starts at step 0. Empty if the chain made no step.
    pub runs: Vec<Run>,
    /// Runs are right at steps 0, `stride`, 2·`stride`, …, and are taken to hold in between; 1 unless the
    /// trace had to be thinned.
    pub stride: u64,
    /// Number of steps done.
    pub n_steps: u64,
    /// Counts for every kind of move, parallel to [`MoveKind::ALL`].
    pub moves: [MoveCounts; MoveKind::ALL.len()],
    /// Steps whose importance draws were evaluated.
    pub n_evaluated: u64,
    /// Steps that began with a posterior value of 0 (`--arithmetic linear`).
    pub n_underflowed: u64,
    /// How the ladder did, if the chain was tempered.
    pub tempering: Option<TemperingReport>,
    /// The topologies visited.
    pub topologies: TopologyTable,
    /// Sums of a chain whose runs are thinned or whose topologies do not all fit.
    windows: Option<Windows>,
    /// States of such a chain at even steps.
    snapshots: Option<Snapshots>,
}

impl Trace {
    /// Runs with their number of steps, from step `burn_in` on.
    pub fn dwell_times(&self, burn_in: u64) -> impl Iterator<Item = (&Run, u64)> {
        let ends = self
            .runs
            .iter()
            .skip(1)
            .map(|run| run.first_step.min(self.n_steps))
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

    /// A value of the state at every k-th step, with the least k that gives at most `max_values` of them.
    pub fn sample(&self, max_values: u64, value: impl Fn(&Run) -> f64) -> (Vec<f64>, u64) {
        let every = self.n_steps.div_ceil(max_values).max(1);
        let mut series = Vec::with_capacity((self.n_steps / every + 1) as usize);
        for (run, dwell) in self.dwell_times(0) {
            let end = (run.first_step + dwell).div_ceil(every) as usize;
            series.resize(end.max(series.len()), value(run));
        }
        (series, every)
    }

    /// Topologies with their counts from step `burn_in` on, by falling count, then by labels.
    /// Steps at topologies that the table has dropped are missing from it; if it holds none, each
    /// snapshot counts once.
    pub fn frequencies(&self, burn_in: u64) -> Vec<TopologyCount> {
        let mut counts = HashMap::new();
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
        if let (true, Some(snapshots)) = (rows.is_empty(), &self.snapshots) {
            let states = snapshots.after(burn_in, self.n_steps);
            rows.extend(states.map(|(state, _)| TopologyCount {
                topology: state.topology.clone(),
                count: 1,
            }));
        }
        rows.sort_unstable_by(|a, b| {
            b.count
                .cmp(&a.count)
                .then_with(|| a.topology.cmp(&b.topology))
        });
        rows
    }

    /// States at even steps, of a chain whose runs are thinned or whose topologies do not all fit.
    pub fn snapshots(&self) -> Option<&Snapshots> {
        self.snapshots.as_ref()
    }

    /// Snapshots of the trace while it is whole, of its steps before this one.
    fn whole_snapshots(&self, n_detections: usize, n_steps: u64) -> Snapshots {
        let mut place = 0;
        Snapshots::new(n_detections, n_steps, |step| {
            let stands = |run: &Run| run.first_step <= step;
            while self.runs.get(place + 1).is_some_and(stands) {
                place += 1;
            }
            let run = &self.runs[place];
            let topology = self.topologies.get(run.topology);
            Snapshot {
                topology: topology
                    .expect("a whole trace holds its topologies")
                    .clone(),
                id: run.topology,
                n_sets: run.n_sets,
                ln_target: run.ln_target,
            }
        })
    }

    /// Windows over the trace while it is whole; `None` if it is empty.
    fn whole_windows(&self) -> Option<Windows> {
        let topology = |run: &Run| {
            let topology = self.topologies.get(run.topology);
            topology.expect("a whole trace holds its topologies")
        };
        let first = self.runs.first()?;
        let mut windows = Windows::new(topology(first), first.n_sets, first.ln_target);
        for pair in self.runs.windows(2) {
            windows.state(pair[1].first_step, pair[1].n_sets, pair[1].ln_target);
            if pair[0].topology != pair[1].topology {
                windows.stand_at(topology(&pair[1]), pair[1].first_step);
            }
        }
        Some(windows)
    }

    /// Exact sums from step `burn_in` on, however long the chain. Of a chain that is thinned or whose topologies did not all
    /// fit they are of the windows that lie wholly after it.
    pub fn sums(&self, burn_in: u64) -> ChainSums {
        if let Some(windows) = &self.windows
            && windows.first_after(burn_in) < self.n_steps
        {
            return windows.after(burn_in);
        }
        let mut sums = ChainSums::default();
        for (run, dwell) in self.dwell_times(burn_in) {
            sums.n_sets.add(f64::from(run.n_sets), dwell);
            sums.ln_target.add(run.ln_target, dwell);
        }
        sums.pairs = pair_steps(&self.frequencies(burn_in));
        sums
    }

    /// The first so many steps; `None` of a trace that is not whole any more.
    #[must_use]
    pub fn cut_to(mut self, n_steps: u64) -> Option<Self> {
        if n_steps < self.n_steps {
            if self.windows.is_some() || self.stride > 1 {
                return None;
            }
            self.runs.retain(|run| run.first_step < n_steps);
            self.n_steps = n_steps;
        }
        Some(self)
    }

    /// Accepted / proposed over all kinds of moves; `None` before the first step.
    pub fn acceptance_rate(&self) -> Option<f64> {
        let accepted: u64 = self.moves.iter().map(|counts| counts.accepted).sum();
        (self.n_steps > 0).then(|| accepted as f64 / self.n_steps as f64)
    }
}

/// Steps that each pair of detections spent in one set. A set stands through many topologies, so its
/// pairs are counted once, and those of one detection after another in an array: chains that come
/// from one cluster have sets of a thousand.
fn pair_steps(rows: &[TopologyCount]) -> PairSteps {
    let mut steps_of: HashMap<Vec<u32>, u64> = HashMap::new();
    for row in rows {
        for members in row.topology.sets() {
            *steps_of.entry(members).or_default() += row.count;
        }
    }
    let sets: Vec<(Vec<u32>, u64)> = steps_of.into_iter().collect();
    let n_detections = rows.first().map_or(0, |row| row.topology.labels().len());
    // For each detection, its sets and its place in each.
    let mut places = vec![Vec::new(); n_detections];
    for (set, (members, _)) in (0_u32..).zip(&sets) {
        for (place, &i) in (0_u32..).zip(members) {
            places[i as usize].push((set, place));
        }
    }
    let (mut pairs, mut steps_with, mut met) = (PairSteps::new(), vec![0; n_detections], vec![]);
    for (i, places) in (0..).zip(&places) {
        for &(set, place) in places {
            let (members, steps) = &sets[set as usize];
            for &j in &members[place as usize + 1..] {
                if steps_with[j as usize] == 0 {
                    met.push(j);
                }
                steps_with[j as usize] += steps;
            }
        }
        for j in met.drain(..) {
            pairs.insert((i, j), std::mem::take(&mut steps_with[j as usize]));
        }
    }
    pairs
}

/// A topology with its ln target.
pub(super) type Place<'a> = (&'a Partition, f64);

/// Records a trace.
#[derive(Clone, Serialize, Deserialize)]
pub struct TraceRecorder {
    trace: Trace,
    topology: TopologyId,
    /// Steps at the present topology that its entry does not count yet.
    visits: u64,
    /// How many of them there are when its labels are to be kept.
    labels_after: Option<u64>,
    max_runs: usize,
}

impl TraceRecorder {
    /// Holds at most `max_topologies` distinct topologies.
    pub fn new(max_topologies: usize) -> Self {
        let trace = Trace {
            runs: Vec::new(),
            stride: 1,
            n_steps: 0,
            moves: Default::default(),
            n_evaluated: 0,
            n_underflowed: 0,
            tempering: None,
            topologies: TopologyTable::new(max_topologies),
            windows: None,
            snapshots: None,
        };
        Self {
            trace,
            topology: 0,
            visits: 0,
            labels_after: None,
            max_runs: MAX_RUNS,
        }
    }

    /// The trace without what is summed up at its end: visits to the present topology, and windows.
    pub(crate) fn so_far(&self) -> &Trace {
        &self.trace
    }

    /// The trace so far.
    pub fn finish(mut self) -> Trace {
        self.count_visits();
        if let Some(windows) = &mut self.trace.windows {
            windows.finish(self.trace.n_steps);
        }
        self.trace
    }

    /// Of a chain that starts at a partition.
    pub(super) fn begin(&mut self, partition: &Partition) {
        if partition.n_detections() > MANY_DETECTIONS {
            self.max_runs /= 4;
        }
        self.stand_at(partition);
    }

    fn count_visits(&mut self) {
        self.trace.topologies.visit(self.topology, self.visits);
        self.visits = 0;
    }

    fn stand_at(&mut self, partition: &Partition) {
        self.topology = self.trace.topologies.enter(partition);
        self.labels_after = self.trace.topologies.visits_to_labels(self.topology);
    }

    /// Keeps sums from when the trace is no longer whole.
    fn window(&mut self, step: u64, (partition, ln_target): Place<'_>, n_new_sets: u32) {
        let trace = &mut self.trace;
        let overflows = trace.topologies.is_full(partition.n_detections());
        if trace.windows.is_none() && (overflows || trace.runs.len() + 1 >= self.max_runs) {
            trace.windows = trace.whole_windows();
            trace.snapshots = Some(trace.whole_snapshots(partition.n_detections(), step));
        }
        if let Some(windows) = &mut trace.windows {
            windows.state(step, partition.n_sets() as u32, ln_target);
            let new = partition.sets().iter().rev().take(n_new_sets as usize);
            windows.sets(step, new.map(Vec::as_slice));
        }
    }

    /// Where the chain stands after a step. If it has moved, how many sets that brought: the last
    /// ones of the partition.
    pub(super) fn stand(&mut self, step: u64, place: Place<'_>, moved: Option<u32>) {
        let (partition, ln_target) = place;
        self.trace.n_steps = step;
        if let Some(n_new_sets) = moved
            && step > 0
        {
            self.window(step, place, n_new_sets);
        }
        if moved.is_some() && partition.hash() != self.topology {
            self.count_visits();
            self.stand_at(partition);
        }
        // A move of locations alone changes nothing that a run tells.
        let run = (self.topology, ln_target.to_bits());
        let last = self.trace.runs.last();
        let differs = last.is_none_or(|last| (last.topology, last.ln_target.to_bits()) != run);
        if (moved.is_some() && differs) || step == 0 {
            self.push(Run {
                first_step: step,
                topology: self.topology,
                n_sets: partition.n_sets() as u32,
                ln_target,
            });
        }
        self.stay(place, 1);
    }

    /// Stays where it stands for so many steps more.
    pub(super) fn stay(&mut self, place: Place<'_>, n_steps: u64) {
        let (first, visits) = (self.trace.n_steps, self.visits);
        let end = first + n_steps;
        self.visits += n_steps;
        self.trace.n_steps = end;
        let is_passed = |after: u64| visits < after && after <= visits + n_steps;
        if self.labels_after.is_some_and(is_passed) {
            let topologies = &mut self.trace.topologies;
            topologies.keep_labels(self.topology, place.0);
        }
        if let Some(snapshots) = &mut self.trace.snapshots {
            let mut step = first.next_multiple_of(snapshots.every());
            while step < end {
                snapshots.push(Snapshot {
                    topology: place.0.topology(),
                    id: self.topology,
                    n_sets: place.0.n_sets() as u32,
                    ln_target: place.1,
                });
                step = (step + 1).next_multiple_of(snapshots.every());
            }
        }
    }

    fn push(&mut self, run: Run) {
        let trace = &mut self.trace;
        let run = Run {
            first_step: run.first_step.next_multiple_of(trace.stride),
            ..run
        };
        match trace.runs.last_mut() {
            // The run before held at no step that is kept.
            Some(last) if last.first_step == run.first_step => *last = run,
            _ => trace.runs.push(run),
        }
        while trace.runs.len() >= self.max_runs {
            trace.stride *= 2;
            for run in &mut trace.runs {
                run.first_step = run.first_step.next_multiple_of(trace.stride);
            }
            // Of runs that begin at one step the last is right.
            trace.runs.reverse();
            trace.runs.dedup_by_key(|run| run.first_step);
            trace.runs.reverse();
        }
    }
}

impl Observer for TraceRecorder {
    fn start(&mut self, state: &State) {
        self.begin(state.partition());
    }

    fn tempered(&mut self, report: &TemperingReport) {
        self.trace.tempering = Some(report.clone());
    }

    fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
        let trace = &mut self.trace;
        let counts = &mut trace.moves[info.kind as usize];
        counts.proposed += 1;
        counts.accepted += u64::from(info.outcome == Outcome::Accepted);
        counts.impossible += u64::from(info.outcome == Outcome::Impossible);
        trace.n_evaluated += u64::from(info.evaluated);
        trace.n_underflowed += u64::from(info.underflowed);
        let moved = info.outcome == Outcome::Accepted;
        let place = (state.partition(), state.ln_target());
        self.stand(step, place, moved.then_some(info.n_new_sets));
    }
}

#[cfg(test)]
mod tests;
