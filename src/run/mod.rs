//! Cells × worlds × chains on rayon: every finished chain is on disk at once, and a chain that
//! fails is a row with its reason and never stops the sweep.

mod checkpoint;
mod checks;
mod claim;
mod exact;
mod explain;
mod finish;
mod folder;
mod journal;
mod journey;
mod limits;
mod lock;
mod outcome;
mod pairs;
mod plan;
mod probes;
mod queue;
mod rounds;
mod run_file;
mod sample;
mod series;
mod shard;
mod shard_files;

pub use checkpoint::tidy_checkpoints;
pub use checks::{ChainChecks, Noted, noise_of};
pub use claim::Claimant;
pub use exact::{
    ExactComparison, ExactDistance, ExactQuantity, ExactTables, exact_purpose, tables_of_one,
};
pub use explain::{Earlier, explain};
pub use folder::{FolderError, RunFolder};
pub use journal::{Contents, Journal, JournalError};
pub use journey::Journey;
pub use limits::{FailureKind, Limits};
pub use outcome::{
    ChainOutcome, ChainRecord, ChainStatus, MoveRow, MserBurnIns, TemperingOutcome, TopTopology,
};
pub use pairs::{PairSeries, UNSURE, rank};
pub use plan::{Plan, Task, chain_purpose};
pub use probes::ProbeOutcome;
pub use queue::{Standing, standing};
pub use rounds::{Round, Stop};
pub use run_file::{RunFile, ShardRun, Start};
pub use sample::{SampledChain, sample_chains};
pub use series::{ChainSeries, DROPPED, topology_identity};
pub use shard::{Shard, gaps};

use std::collections::{HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::chain::{self, Observer, Position, TemperingReport, TraceRecorder};
use crate::dataset::{DataError, DataSet};
use crate::sampler::{State, StepInfo};
use crate::settings::Settings;
use crate::sweep::Sweep;

use checkpoint::Checkpoints;
use finish::Finished;
use limits::{Watch, bytes_of_draws};

/// What wants to know how a run goes. Called from many threads.
pub trait Progress: Sync {
    /// Before the first chain: how many are to be run, with how many proposals in all, and how many
    /// had been finished by an earlier run.
    fn start(&self, _n_chains: usize, _n_steps: u64, _n_already_done: usize) {}
    /// So many exact posteriors are had, after so many seconds.
    fn exact_done(&self, _n_tables: usize, _seconds: f64) {}
    /// Something is amiss that costs time only.
    fn note(&self, _what: &str) {}
    /// A chain is done.
    fn chain_done(&self, _n_steps: u64, _status: &ChainStatus) {}
    /// A stopping rule gives some cells more worlds.
    fn round(&self, _round: Round) {}
    /// Nothing more will come.
    fn finish(&self) {}
}

/// Tells nobody.
pub struct Silent;
impl Progress for Silent {}

/// Records a chain, holds it to its limits, saves where it stands and ends it when it is told to.
struct Attendant<'a> {
    recorder: TraceRecorder,
    watch: Watch,
    checkpoints: Option<Checkpoints>,
    stops: [&'a AtomicBool; 2],
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
}

/// What a run gave.
pub struct RunResult {
    /// A record of every chain, in the order of cells, worlds and chains; `None` for those that were
    /// not run because the run was stopped.
    pub records: Vec<Option<ChainRecord>>,
    /// Wall-clock seconds of every chain that was run now.
    pub seconds: Vec<Option<f64>>,
}

impl RunResult {
    /// Number of chains with a record.
    pub fn n_done(&self) -> usize {
        self.records.iter().flatten().count()
    }
}

/// How a run is to be made.
#[derive(Clone, Default)]
pub struct RunOptions {
    /// What each chain may take.
    pub limits: Limits,
    /// Whether chains that failed are run again whatever they failed for.
    pub retry_failed: bool,
    /// The part of the chains that is run; all of them if there is none.
    pub shard: Option<Shard>,
    /// The folder where chains say how far they are, and how often; nowhere if there is none.
    pub checkpoints: Option<(PathBuf, Duration)>,
}

/// A run that cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Its journal cannot be written.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The worlds of a further round cannot be had.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// The records made by this run, with the seconds that each took, by the chain's key.
type Fresh = HashMap<String, (ChainRecord, f64)>;

/// Runs what the journal does not hold yet; under a stopping rule round by round, until no cell needs more worlds: `plan`
/// then has them all. `stop` ends the run early, with everything that was finished kept.
///
/// # Errors
/// A journal that cannot be written, or a world file that has changed for the worse since the plan was made.
pub fn execute(
    sweep: &Sweep,
    plan: &mut Plan,
    journal: &Journal,
    options: &RunOptions,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Result<RunResult, RunError> {
    let mut fresh = Fresh::new();
    let mut counted = HashSet::new();
    if let Some((folder, _)) = &options.checkpoints {
        tidy_checkpoints(folder, journal);
    }
    loop {
        let how = (options, progress, stop);
        run_round(sweep, plan, journal, how, &mut fresh, &mut counted)?;
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let known = |task: &Task| {
            let own = fresh.get(&task.key).map(|(record, _)| record);
            Some(&own.or_else(|| journal.get(&task.key))?.status)
        };
        match plan.next_round(sweep, known)? {
            Some(round) => progress.round(round),
            None => break,
        }
    }
    journal.flush()?;
    progress.finish();
    // A chain of several tasks is timed once, at the first of them.
    let mut timed = HashSet::new();
    let seconds = plan.tasks.iter().map(|task| {
        let (_, seconds) = fresh.get(&task.key)?;
        timed.insert(task.key.as_str()).then_some(*seconds)
    });
    let seconds = seconds.collect();
    let own = fresh.into_iter().map(|(key, (record, _))| (key, record));
    let mut records: HashMap<String, ChainRecord> = own.collect();
    for task in &plan.tasks {
        if let (false, Some(record)) = (records.contains_key(&task.key), journal.get(&task.key)) {
            records.insert(task.key.clone(), record.clone());
        }
    }
    let records = plan.in_order(records);
    if let Some((folder, _)) = &options.checkpoints {
        let may_go_on = records.iter().flatten().filter(|record| record.may_go_on());
        let may_go_on: HashSet<&str> = may_go_on.map(|record| record.key.as_str()).collect();
        // When every chain is done, what is left is of chains that nobody asks for any more.
        let is_whole = options.shard.is_none() && records.iter().all(Option::is_some);
        checkpoint::tidy(folder, |key| is_whole && !may_go_on.contains(key));
    }
    Ok(RunResult { records, seconds })
}

/// Runs the chains of the plan that neither the journal nor `fresh` holds, and puts them into both. `counted`: keys of
/// the chains that were looked at in an earlier round.
fn run_round(
    sweep: &Sweep,
    plan: &Plan,
    journal: &Journal,
    (options, progress, stop): (&RunOptions, &dyn Progress, &AtomicBool),
    fresh: &mut Fresh,
    counted: &mut HashSet<String>,
) -> Result<(), RunError> {
    let is_first = counted.is_empty();
    let mut asked = plan.chains(options.shard);
    asked.retain(|task| counted.insert(task.key.clone()));
    let n_asked = asked.len();
    let is_missing = |task: &&Task| standing(task, journal, options).is_to_be_run();
    let missing: Vec<&Task> = asked.into_iter().filter(is_missing).collect();
    if missing.is_empty() && !is_first {
        return Ok(());
    }
    let n_steps = missing
        .iter()
        .map(|task| sweep.cells[task.cell].settings.count("samples"))
        .sum();
    let before = Instant::now();
    let tables = exact::exact_tables(sweep, plan, &missing, stop);
    if !tables.is_empty() {
        progress.exact_done(tables.len(), before.elapsed().as_secs_f64());
    }
    progress.start(missing.len(), n_steps, n_asked - missing.len());
    // A journal that cannot be written ends the chains in flight too: their records would be lost.
    let journal_failed = AtomicBool::new(false);
    let stops = [stop, &journal_failed];
    let run_one = |task: &&Task| -> Result<Option<(ChainRecord, f64)>, JournalError> {
        if stops.iter().any(|stop| stop.load(Ordering::Relaxed)) {
            return Ok(None);
        }
        let settings = &sweep.cells[task.cell].settings;
        let started = Instant::now();
        let run = || match plan.data(task) {
            Ok(data) => run_chain((settings, data, task), &tables, options, progress, stops),
            Err(reason) => Some(failed(FailureKind::Data, reason)),
        };
        let status = isolated(run).unwrap_or_else(|what| Some(failed(FailureKind::Panic, &what)));
        let Some(status) = status else {
            return Ok(None);
        };
        let record = ChainRecord {
            key: task.key.clone(),
            status,
        };
        let appended = journal.append(&record);
        journal_failed.fetch_or(appended.is_err(), Ordering::Relaxed);
        appended?;
        if let (Some(checkpoints), false) = (checkpoints(task, options), record.may_go_on()) {
            checkpoints.remove();
        }
        progress.chain_done(settings.count("samples"), &record.status);
        Ok(Some((record, started.elapsed().as_secs_f64())))
    };
    let done: Vec<_> = missing.par_iter().map(run_one).collect::<Result<_, _>>()?;
    for (record, seconds) in done.into_iter().flatten() {
        fresh.insert(record.key.clone(), (record, seconds));
    }
    Ok(())
}

fn failed(kind: FailureKind, what: &str) -> ChainStatus {
    ChainStatus::Failed {
        kind,
        reason: kind.reason(what),
    }
}

/// What `run` gives, or in one line what it panicked with.
fn isolated<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(run)).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let what = text.unwrap_or_else(|| "without a message".to_owned());
        what.replace('\n', " ")
    })
}

fn checkpoints(task: &Task, options: &RunOptions) -> Option<Checkpoints> {
    let (folder, interval) = options.checkpoints.as_ref()?;
    Some(Checkpoints::new(folder, &task.key, *interval))
}

/// One chain, summarised; `None` if it was stopped before its end.
fn run_chain(
    (settings, data, task): (&Settings, &DataSet, &Task),
    tables: &exact::ExactTables,
    options: &RunOptions,
    progress: &dyn Progress,
    stops: [&AtomicBool; 2],
) -> Option<ChainStatus> {
    let limits = options.limits;
    let mut watch = Watch::new(limits);
    let prepared = data
        .start(&settings.init(), task.chain)
        .and_then(|start| Ok((start, data.model(settings)?)));
    let (start, model) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => return Some(failed(FailureKind::Data, &error.to_string())),
    };
    let n_steps = settings.count("samples");
    let sampler = settings.sampler();
    if let Some(bytes) = limits
        .max_bytes
        .filter(|most| bytes_of_draws(&model, &sampler) > *most)
    {
        return Some(failed(FailureKind::MemoryLimit { bytes }, ""));
    }
    let checkpoints = checkpoints(task, options);
    let saved = match checkpoints.as_ref().map(Checkpoints::load) {
        None => None,
        Some(Ok(saved)) => saved,
        Some(Err(what)) => {
            progress.note(&what);
            None
        }
    };
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
    let mut observer = Attendant {
        recorder,
        watch,
        checkpoints,
        stops,
    };
    let (prior, purpose) = (settings.prior(), &task.purpose);
    let observed = &mut observer;
    let done = match position {
        Some(position) => chain::resume(
            &model, prior, &sampler, position, n_steps, purpose, observed,
        ),
        None => chain::run(&model, prior, &sampler, &start, n_steps, purpose, observed),
    };
    let Attendant {
        recorder, watch, ..
    } = observer;
    if let Some(kind) = watch.met {
        return Some(failed(kind, ""));
    }
    if done < n_steps {
        return None;
    }
    let trace = recorder.finish();
    if trace.runs.iter().any(|run| !run.ln_target.is_finite()) {
        let what = "ln target is not finite; use less extreme settings";
        return Some(failed(FailureKind::Numerical, what));
    }
    let finished = Finished {
        trace: &trace,
        start: &start,
        model: &model,
        data,
        settings,
        purpose,
        tables,
    };
    // Limits are of the chain itself: its probes are a bounded part more.
    let is_stopped = || stops.iter().any(|stop| stop.load(Ordering::Relaxed));
    let outcome = finished.outcome(&is_stopped)?;
    Some(ChainStatus::Done(Box::new(outcome)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_one_line_and_nothing_more() {
        assert_eq!(isolated(|| 3), Ok(3));
        let two_lines = || -> u8 { panic!("a µ\nand {}", 2) };
        assert_eq!(isolated(two_lines), Err("a µ and 2".to_owned()));
        let status = failed(FailureKind::Panic, "index out of bounds");
        assert!(
            matches!(status, ChainStatus::Failed { reason, .. } if reason == "panic: index out of bounds")
        );
    }
}
