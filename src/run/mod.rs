//! Cells × worlds × chains on rayon: every finished chain is on disk at once, and a chain that
//! fails is a row with its reason and never stops the sweep.

mod exact;
mod folder;
mod journal;
mod outcome;
mod plan;
mod sample;
mod series;

pub use exact::{ExactComparison, ExactDistance, exact_purpose};
pub use folder::{FolderError, RunFile, RunFolder};
pub use journal::{Journal, JournalError};
pub use outcome::{ChainOutcome, ChainRecord, ChainStatus, MoveRow, TopTopology, summarise};
pub use plan::{Plan, Task, chain_purpose};
pub use sample::sample_chains;
pub use series::{ChainSeries, topology_identity};

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::chain::{self, Observer, TraceRecorder};
use crate::dataset::DataSet;
use crate::settings::Settings;
use crate::sweep::Sweep;

/// What wants to know how a run goes. Called from many threads.
pub trait Progress: Sync {
    /// Before the first chain: how many are to be run, with how many proposals in all, and how many
    /// had been finished by an earlier run.
    fn start(&self, _n_chains: usize, _n_steps: u64, _n_already_done: usize) {}
    /// So many exact posteriors are had, after so many seconds.
    fn exact_done(&self, _n_tables: usize, _seconds: f64) {}
    /// A chain is done.
    fn chain_done(&self, _n_steps: u64, _status: &ChainStatus) {}
    /// Nothing more will come.
    fn finish(&self) {}
}

/// Tells nobody.
pub struct Silent;
impl Progress for Silent {}

/// A chain that can be told to stop.
struct StopFlag<'a>(&'a AtomicBool);
impl Observer for StopFlag<'_> {
    fn wants_stop(&mut self) -> bool {
        self.0.load(Ordering::Relaxed)
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

/// Runs what the journal does not hold yet. `stop` ends the run early, with everything that was
/// finished kept.
///
/// # Errors
/// A journal that cannot be written.
pub fn execute(
    sweep: &Sweep,
    plan: &Plan,
    journal: &Journal,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Result<RunResult, JournalError> {
    let missing: Vec<&Task> = plan
        .tasks
        .iter()
        .filter(|task| journal.get(&task.key).is_none())
        .collect();
    let mut keys = std::collections::HashSet::new();
    let missing: Vec<&Task> = missing
        .into_iter()
        .filter(|task| keys.insert(&task.key))
        .collect();
    let n_steps = missing
        .iter()
        .map(|task| sweep.cells[task.cell].settings.count("samples"))
        .sum();
    let before = Instant::now();
    let tables = exact::exact_tables(sweep, plan, &missing, stop);
    if !tables.is_empty() {
        progress.exact_done(tables.len(), before.elapsed().as_secs_f64());
    }
    progress.start(missing.len(), n_steps, plan.tasks.len() - missing.len());
    let run_one = |task: &&Task| -> Result<Option<(usize, ChainRecord, f64)>, JournalError> {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let settings = &sweep.cells[task.cell].settings;
        let started = Instant::now();
        let status = match plan.data(task) {
            Ok(data) => isolated(|| run_chain(settings, data, task, &tables, stop)),
            Err(reason) => Some(ChainStatus::Failed {
                reason: reason.clone(),
            }),
        };
        let Some(status) = status else {
            return Ok(None);
        };
        let record = ChainRecord {
            key: task.key.clone(),
            status,
        };
        journal.append(&record)?;
        progress.chain_done(settings.count("samples"), &record.status);
        Ok(Some((task.index, record, started.elapsed().as_secs_f64())))
    };
    let fresh: Vec<_> = missing.par_iter().map(run_one).collect::<Result<_, _>>()?;
    progress.finish();
    let mut seconds = vec![None; plan.tasks.len()];
    let mut fresh_records = std::collections::HashMap::new();
    for (index, record, elapsed) in fresh.into_iter().flatten() {
        seconds[index] = Some(elapsed);
        fresh_records.insert(record.key.clone(), record);
    }
    let record = |task: &Task| {
        journal
            .get(&task.key)
            .or_else(|| fresh_records.get(&task.key))
            .cloned()
    };
    let records = plan.tasks.iter().map(record).collect();
    Ok(RunResult { records, seconds })
}

/// A panic in one chain is that chain's failure.
fn isolated(run: impl FnOnce() -> Option<ChainStatus>) -> Option<ChainStatus> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let what = text.unwrap_or_else(|| "a panic without a message".to_owned());
        Some(ChainStatus::Failed {
            reason: format!("panic: {}", what.replace('\n', " ")),
        })
    })
}

/// One chain, summarised; `None` if it was stopped before its end.
fn run_chain(
    settings: &Settings,
    data: &DataSet,
    task: &Task,
    tables: &exact::ExactTables,
    stop: &AtomicBool,
) -> Option<ChainStatus> {
    let prepared = data
        .start(&settings.init())
        .and_then(|start| Ok((start, data.model(settings)?)));
    let (start, model) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => {
            return Some(ChainStatus::Failed {
                reason: error.to_string(),
            });
        }
    };
    let n_steps = settings.count("samples");
    let mut observer = (
        TraceRecorder::new(settings.count("max_topologies") as usize),
        StopFlag(stop),
    );
    let sampler = settings.sampler();
    let prior = settings.prior();
    let done = chain::run(
        &model,
        prior,
        &sampler,
        &start,
        n_steps,
        &task.purpose,
        &mut observer,
    );
    if done < n_steps {
        return None;
    }
    let trace = observer.0.finish();
    if trace.runs.iter().any(|run| !run.ln_target.is_finite()) {
        let reason = "numerical failure: ln target is not finite; use less extreme settings";
        return Some(ChainStatus::Failed {
            reason: reason.to_owned(),
        });
    }
    let mut outcome = summarise(&trace, data, settings);
    let burn_in = outcome.burn_in.unwrap_or(0);
    outcome.exact = exact::compare(tables, &trace, burn_in, settings, data, &task.purpose);
    Some(ChainStatus::Done(Box::new(outcome)))
}
