//! A chain with what attends it: it is recorded, held to its limits, saved, told to stop, and may be
//! led further than it was first meant to go.

use std::sync::atomic::{AtomicBool, Ordering};

use super::checkpoint::Checkpoints;
use super::exact::ExactTables;
use super::finish::Finished;
use super::limits::{FailureKind, Limits, Watch, bytes_of_draws};
use super::sample::SampledChain;
use crate::chain::{
    self, Observer, Position, SavedPosition, Start, TemperingReport, Trace, TraceRecorder,
};
use crate::dataset::DataSet;
use crate::model::Model;
use crate::rng::Purpose;
use crate::sampler::{State, StepInfo};
use crate::settings::Settings;

/// Which chain.
pub(super) struct ChainOf<'a> {
    pub settings: &'a Settings,
    pub data: &'a DataSet,
    /// Its number on these data, from 0.
    pub number: u64,
    pub purpose: Purpose,
}

/// How it is attended.
pub(super) struct Attendance<'a> {
    pub limits: Limits,
    pub checkpoints: Option<Checkpoints>,
    /// Any of them ends the chain.
    pub stops: &'a [&'a AtomicBool],
    /// Hears of a checkpoint that cannot be used.
    pub note: &'a dyn Fn(&str),
    /// Threads that it may use.
    pub n_threads: usize,
}

/// Threads for each of so many chains: those that are left over if every chain has one.
pub(super) fn threads_of_chain(n_chains: usize) -> usize {
    (rayon::current_num_threads() / n_chains.max(1)).max(1)
}

/// Why a chain has no outcome.
pub(super) enum Ended {
    /// It was told to stop.
    Stopped,
    /// It cannot be run, or met a limit.
    Failed {
        kind: FailureKind,
        /// What the kind alone does not say.
        what: String,
    },
}

impl Ended {
    pub fn failed(kind: FailureKind, what: impl ToString) -> Self {
        let what = what.to_string();
        Self::Failed { kind, what }
    }
}

/// A chain that stands somewhere.
pub(super) struct Attended<'a> {
    of: ChainOf<'a>,
    model: Model,
    start: Start,
    attendant: Attendant<'a>,
    /// Where it stands; nowhere before its first step.
    position: Option<SavedPosition>,
}

impl<'a> Attended<'a> {
    /// At its start, or where its checkpoint stands.
    pub fn new(of: ChainOf<'a>, how: Attendance<'a>) -> Result<Self, Ended> {
        let (settings, data) = (of.settings, of.data);
        let unusable = |error| Ended::failed(FailureKind::Data, error);
        let start = data.start(&settings.init(), of.number).map_err(unusable)?;
        let model = data.model(settings).map_err(unusable)?;
        if let Some(bytes) = how
            .limits
            .max_bytes
            .filter(|most| bytes_of_draws(&model, &settings.sampler(model.n_detections())) > *most)
        {
            return Err(Ended::failed(FailureKind::MemoryLimit { bytes }, ""));
        }
        let saved = match how.checkpoints.as_ref().map(Checkpoints::load) {
            None => None,
            Some(Ok(saved)) => saved,
            Some(Err(what)) => {
                (how.note)(&what);
                None
            }
        };
        let mut watch = Watch::new(how.limits);
        let (recorder, position) = match saved {
            Some(saved) => {
                watch.seconds_before = saved.seconds;
                (saved.recorder, Some(saved.position))
            }
            None => {
                let most = settings.count("max_topologies") as usize;
                (TraceRecorder::new(most), None)
            }
        };
        let attendant = Attendant {
            recorder,
            watch,
            checkpoints: how.checkpoints,
            stops: how.stops,
            n_threads: how.n_threads,
        };
        Ok(Self {
            of,
            model,
            start,
            attendant,
            position,
        })
    }

    /// Proposals made so far.
    pub fn n_steps(&self) -> u64 {
        self.position.as_ref().map_or(0, SavedPosition::step)
    }

    /// Leads it on until it has made `n_steps` proposals.
    pub fn go_to(&mut self, n_steps: u64) -> Result<(), Ended> {
        if self.n_steps() >= n_steps {
            return Ok(());
        }
        let settings = self.of.settings;
        let (prior, sampler) = (
            settings.prior(),
            settings.sampler(self.model.n_detections()),
        );
        let (model, purpose, attendant) = (&self.model, &self.of.purpose, &mut self.attendant);
        attendant.watch.begin();
        let reached = match self.position.take() {
            Some(position) => chain::resume(
                model, prior, &sampler, position, n_steps, purpose, attendant,
            ),
            None => {
                let start = &self.start;
                chain::run(model, prior, &sampler, start, n_steps, purpose, attendant)
            }
        };
        attendant.watch.end();
        if let Some(kind) = attendant.watch.met {
            return Err(Ended::failed(kind, ""));
        }
        if reached.step() < n_steps {
            return Err(Ended::Stopped);
        }
        self.position = Some(reached);
        Ok(())
    }

    /// Its stretches so far; what the recorder sums up at the end of a trace is not in it yet.
    pub fn trace(&self) -> &Trace {
        self.attendant.recorder.so_far()
    }

    /// Its trace; it may be led further.
    pub fn trace_so_far(&self) -> Trace {
        self.attendant.recorder.clone().finish()
    }

    /// Its trace; it is at its end.
    fn take_trace(&mut self) -> Trace {
        let empty = TraceRecorder::new(0);
        std::mem::replace(&mut self.attendant.recorder, empty).finish()
    }

    /// Leads it to the `samples` of its settings and finishes it.
    pub fn sampled(mut self, tables: &ExactTables) -> Result<SampledChain, Ended> {
        self.go_to(self.of.settings.count("samples"))?;
        let trace = self.take_trace();
        // Limits are of the chain itself: its probes are a bounded part more.
        let finished = self.finished(&trace, tables);
        let outcome = finished.outcome(&|| self.is_told_to_stop());
        let outcome = outcome.ok_or(Ended::Stopped)?;
        Ok(SampledChain { trace, outcome })
    }

    /// What is made of its trace.
    pub fn finished<'b>(&'b self, trace: &'b Trace, tables: &'b ExactTables) -> Finished<'b> {
        Finished {
            trace,
            start: &self.start,
            model: &self.model,
            data: self.of.data,
            settings: self.of.settings,
            purpose: &self.of.purpose,
            tables,
        }
    }

    /// Whether it is told to stop.
    pub fn is_told_to_stop(&self) -> bool {
        self.attendant.is_told_to_stop()
    }
}

/// Records a chain, holds it to its limits, saves where it stands and ends it when it is told to.
struct Attendant<'a> {
    recorder: TraceRecorder,
    watch: Watch,
    checkpoints: Option<Checkpoints>,
    stops: &'a [&'a AtomicBool],
    n_threads: usize,
}

impl Attendant<'_> {
    fn is_told_to_stop(&self) -> bool {
        self.stops.iter().any(|stop| stop.load(Ordering::Relaxed))
    }
}

impl Observer for Attendant<'_> {
    fn start(&mut self, state: &State) {
        self.recorder.start(state);
    }
    fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
        self.recorder.step(step, state, info);
    }
    fn tempered(&mut self, report: &TemperingReport) {
        self.recorder.tempered(report);
    }
    fn pause(&mut self, position: &Position<'_>) {
        let ends = self.is_told_to_stop() || self.watch.is_out_of_time();
        if let Some(checkpoints) = &mut self.checkpoints
            && (ends || checkpoints.is_due())
        {
            checkpoints.save(position, &self.recorder, self.watch.seconds());
        }
    }
    fn wants_stop(&mut self) -> bool {
        self.watch.wants_stop() || self.is_told_to_stop()
    }
    fn n_threads(&self) -> usize {
        self.n_threads
    }
}
