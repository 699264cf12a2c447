//! `ptm merge`: the parts of a sweep put together, checked for gaps and contradictions, and its report.

use std::collections::HashMap;
use std::path::PathBuf;

use crate::job::write_timings;
use crate::run::{Journal, Plan, RunFolder, RunResult, ShardRun, gaps, tidy_checkpoints};
use clap::Args;

use super::report::{Finished, write_report};
use super::{Arguments, Exit, Failure, say};

/// Arguments of `ptm merge`.
#[derive(Debug, Args)]
pub struct MergeCommand {
    /// Folder of the sweep, that all parts were run in.
    folder: PathBuf,
    /// Write a page for every cell, however many there are.
    #[arg(long)]
    all_cells: bool,
}

/// Runs it. What is there twice is there once afterwards, so merging again changes nothing.
pub fn run(command: &MergeCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let mut finished = Finished::lock(&command.folder)?;
    let folder = finished.folder.clone();
    let journal = Journal::open(folder.path())?;
    for note in journal.notes() {
        say(arguments, note);
    }
    folder.clear_temporary()?;
    tidy_checkpoints(&folder.checkpoints(), &journal);
    finished.plan.replay(&finished.sweep, &journal)?;
    let plan = &finished.plan;
    journal.rewrite(folder.path(), plan.tasks.iter().map(|task| &task.key))?;
    let shards = ShardRun::all(folder.path())?;
    let records: Vec<_> = plan
        .tasks
        .iter()
        .map(|task| journal.get(&task.key).cloned())
        .collect();
    let n_done = records.iter().flatten().count();
    finished.run.chains = plan.tasks.len();
    finished.run.chains_done = n_done;
    for shard in &shards {
        if !finished.run.starts.contains(&shard.start) {
            finished.run.starts.push(shard.start.clone());
        }
    }
    finished
        .run
        .starts
        .sort_by_key(|start| start.started_unix_s);
    folder.write_run_file(&finished.run)?;
    let n = plan.tasks.len();
    let twice = match journal.n_duplicates() {
        0 => String::new(),
        n => format!("; {n} results are there more than once, the same each time"),
    };
    say(
        arguments,
        &format!("{n_done} of {n} chains have a record{twice}"),
    );
    if n_done < n {
        return Err(Failure::try_again(missing(
            &folder, plan, &journal, &shards,
        )));
    }
    write_times(&folder, plan, records, &shards)?;
    write_report(&finished, journal, command.all_cells, &[], arguments)
}

/// What is missing, and whose it is.
fn missing(folder: &RunFolder, plan: &Plan, journal: &Journal, shards: &[ShardRun]) -> String {
    let count = shards.iter().filter_map(|shard| {
        let shard: crate::run::Shard = shard.start.shard.as_ref()?.parse().ok()?;
        Some(shard.count())
    });
    let gaps = gaps(plan, journal, count.max().unwrap_or(1));
    let n: usize = gaps.values().sum();
    let named: Vec<String> = gaps
        .iter()
        .take(8)
        .map(|(shard, n)| format!("{shard} ({n})"))
        .collect();
    let more = gaps.len().saturating_sub(named.len());
    let more = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    format!(
        "{}: {n} chains have no record, those of shards {}{more}; run these again, as `ptm submit` does by \
         itself, then merge again",
        folder.path().display(),
        named.join(", ")
    )
}

/// The times of all starts of all shards; of a chain that was run twice the later one.
fn write_times(
    folder: &RunFolder,
    plan: &Plan,
    records: Vec<Option<crate::run::ChainRecord>>,
    shards: &[ShardRun],
) -> Result<(), Failure> {
    let times: HashMap<&String, f64> = shards
        .iter()
        .flat_map(|shard| shard.seconds.iter().map(|(key, seconds)| (key, *seconds)))
        .collect();
    let seconds = plan.tasks.iter().map(|task| times.get(&task.key).copied());
    let seconds = seconds.collect();
    write_timings(folder, plan, &RunResult { records, seconds })?;
    Ok(())
}
