//! Cells × worlds × chains on rayon: every finished chain is on disk at once, and a chain that
//! fails is a row with its reason and never stops the sweep.

mod attended;
mod checkpoint;
mod checks;
mod claim;
mod coupling;
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
mod posteriors;
mod probes;
mod queue;
mod rounds;
mod run_file;
mod sample;
mod series;
mod shard;
mod shard_files;
mod together;

pub use checkpoint::tidy_checkpoints;
pub use checks::{ChainChecks, Noted, noise_of};
pub use claim::Claimant;
pub use coupling::CouplingOutcome;
pub use exact::{
    ExactComparison, ExactDistance, ExactQuantity, ExactTables, PosteriorTopology, exact_purpose,
    tables_of_one,
};
pub use explain::{Earlier, Explained, Reasons, explain};
pub use folder::{FolderError, RunFolder};
pub use journal::{Contents, Journal, JournalError};
pub use journey::Journey;
pub use limits::{FailureKind, Limits};
pub use outcome::{
    ChainOutcome, ChainRecord, ChainStatus, MoveRow, MserBurnIns, TemperingOutcome, TopTopology,
    summarise,
};
pub use pairs::{PairSeries, UNSURE, rank};
pub use plan::{Owner, Plan, Task, chain_purpose};
pub use posteriors::AskedPosterior;
pub use probes::ProbeOutcome;
pub use queue::{Standing, standing};
pub use rounds::{Round, Stop};
pub use run_file::{RunFile, ShardRun, Start};
pub use sample::{SampledChain, sample_chains};
pub use series::{ChainSeries, topology_identity};
pub use shard::{Shard, gaps};
pub use together::{Judge, Judgement, Looks};

use std::collections::{HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::chain::Run;
use crate::dataset::{DataError, DataSet};
use crate::settings::{Settings, Until};
use crate::sweep::Sweep;

use attended::{Attendance, Attended, ChainOf, Ended, threads_of_chain};
use checkpoint::Checkpoints;
use together::until_converged;

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
/// then has them all. `judge` says when chains that run until they have converged may end. `stop` ends the run
/// early, with everything that was finished kept.
///
/// # Errors
/// A journal that cannot be written, or a world file that has changed for the worse since the plan was made.
pub fn execute(
    sweep: &Sweep,
    plan: &mut Plan,
    journal: &Journal,
    options: &RunOptions,
    (judge, progress): (Judge<'_>, &dyn Progress),
    stop: &AtomicBool,
) -> Result<RunResult, RunError> {
    let mut fresh = Fresh::new();
    let mut counted = HashSet::new();
    if let Some((folder, _)) = &options.checkpoints {
        tidy_checkpoints(folder, journal);
    }
    loop {
        let how = (options, judge, progress, stop);
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
    (options, judge, progress, stop): (&RunOptions, Judge<'_>, &dyn Progress, &AtomicBool),
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
        .map(|task| plan.settings(sweep, task).most_samples())
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
    let n_threads = threads_of_chain(missing.len());
    let is_missing: HashSet<&str> = missing.iter().map(|task| task.key.as_str()).collect();
    type Ran = Result<Vec<(ChainRecord, f64)>, JournalError>;
    let run_some = |tasks: &Vec<&Task>| -> Ran {
        if stops.iter().any(|stop| stop.load(Ordering::Relaxed)) {
            return Ok(Vec::new());
        }
        let settings = plan.settings(sweep, tasks[0]);
        let started = Instant::now();
        let run = || match plan.data(tasks[0]) {
            Ok(data) => {
                let chains = (settings, data, tasks.as_slice());
                let how = (stops.as_slice(), n_threads);
                run_chains(chains, &tables, options, (judge, progress), how)
            }
            Err(reason) => Some(vec![failed(FailureKind::Data, reason); tasks.len()]),
        };
        let statuses = isolated(run)
            .unwrap_or_else(|what| Some(vec![failed(FailureKind::Panic, &what); tasks.len()]));
        let seconds = started.elapsed().as_secs_f64() / tasks.len() as f64;
        let mut ran = Vec::new();
        for (task, status) in tasks.iter().zip(statuses.into_iter().flatten()) {
            if !is_missing.contains(task.key.as_str()) {
                continue;
            }
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
            progress.chain_done(settings.most_samples(), &record.status);
            ran.push((record, seconds));
        }
        Ok(ran)
    };
    let work = together(sweep, plan, &missing);
    let done: Vec<_> = work.par_iter().map(run_some).collect::<Result<_, _>>()?;
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

/// Chains that are run as one: a single one, or all of a world that go on until they have converged.
fn together<'a>(sweep: &Sweep, plan: &'a Plan, missing: &[&'a Task]) -> Vec<Vec<&'a Task>> {
    let mut seen = HashSet::new();
    let mut found = Vec::new();
    for &task in missing {
        match plan.settings(sweep, task).until() {
            Until::Samples => found.push(vec![task]),
            Until::Converged if seen.insert((task.owner, task.replicate)) => {
                let of_world = plan.tasks_of_owner(task.owner).iter();
                let of_world = of_world.filter(|own| own.replicate == task.replicate);
                found.push(of_world.collect());
            }
            Until::Converged => (),
        }
    }
    found
}

/// What became of chains that are run as one; `None` if they were stopped before their end.
fn run_chains(
    (settings, data, tasks): (&Settings, &DataSet, &[&Task]),
    tables: &exact::ExactTables,
    options: &RunOptions,
    (judge, progress): (Judge<'_>, &dyn Progress),
    (stops, n_threads): (&[&AtomicBool], usize),
) -> Option<Vec<ChainStatus>> {
    let note = |what: &str| progress.note(what);
    let begin = |task: &&Task| {
        let of = ChainOf {
            settings,
            data,
            number: task.chain,
            purpose: task.purpose.clone(),
        };
        let how = Attendance {
            limits: options.limits,
            checkpoints: checkpoints(task, options),
            stops,
            note: &note,
            n_threads,
        };
        Attended::new(of, how)
    };
    let chains = tasks.iter().map(begin).collect::<Result<Vec<_>, _>>();
    let sampled = chains.and_then(|chains| match settings.until() {
        Until::Samples => chains
            .into_iter()
            .map(|chain| chain.sampled(tables))
            .collect(),
        Until::Converged => until_converged(chains, (settings, data), tables, (judge, &|_, _| ())),
    });
    match sampled {
        Ok(sampled) => Some(
            sampled
                .into_iter()
                .map(|own| {
                    let is_finite = |run: &Run| run.ln_target.is_finite();
                    if own.trace.runs.iter().all(is_finite) {
                        return ChainStatus::Done(Box::new(own.outcome));
                    }
                    let what = "ln target is not finite; use less extreme settings";
                    failed(FailureKind::Numerical, what)
                })
                .collect(),
        ),
        Err(Ended::Stopped) => None,
        Err(Ended::Failed { kind, what }) => Some(vec![failed(kind, &what); tasks.len()]),
    }
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
