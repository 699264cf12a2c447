//! One part of a sweep, run here: records into a file of its own, tables and report when all parts are
//! merged.

use crate::job::{Begun, provenance};
use crate::report;
use crate::results::sample::judgement;
use crate::run::{self, Journal, Shard, ShardRun};

use super::progress::Bar;
use super::signal::StopSignal;
use super::{Arguments, Exit, Failure, say};

/// Runs it.
pub fn run(
    begun: Begun<'_>,
    shard: Shard,
    stop: &StopSignal,
    arguments: &Arguments,
) -> Result<Exit, Failure> {
    let Begun {
        sweep,
        mut plan,
        folder,
        options,
        ..
    } = begun;
    folder.write_inputs(sweep, &plan, report::data_file)?;
    let journal = Journal::open_shard(folder.path(), shard)?;
    for note in journal.notes() {
        say(arguments, note);
    }
    let path = journal.path().expect("a shard's journal has a file");
    let mut this = ShardRun {
        start: provenance::start_now(&options.limits, Some(shard)),
        ..ShardRun::default()
    };
    this.write(&path)?;
    let progress = Bar::new(arguments.quiet);
    let result = run::execute(
        sweep,
        &mut plan,
        &journal,
        &options,
        (&judgement, &progress),
        &stop.flag,
    )?;
    let words = || stop.words();
    provenance::ended(&mut this.start, stop.interrupt(&words), &result);
    let timed = plan.tasks.iter().zip(&result.seconds);
    this.seconds = timed
        .filter_map(|(task, seconds)| Some((task.key.clone(), (*seconds)?)))
        .collect();
    this.write(&path)?;
    let asked = plan.chains(Some(shard));
    let records = asked
        .iter()
        .filter_map(|task| result.records[task.index].as_ref());
    let (n_done, n_failed) = records.fold((0, 0), |(done, failed), record| {
        (done + 1, failed + usize::from(record.has_failed()))
    });
    let n = asked.len();
    if let Some(signal) = stop.received() {
        let again = "run the same command again to continue";
        let words = format!("stopped: {n_done} of {n} chains of shard {shard} are kept; {again}");
        say(arguments, &words);
        return Ok(Exit::Signal(signal));
    }
    let out = folder.path().display();
    if !arguments.quiet {
        outln!(
            "shard {shard}: {n_done} chains, {n_failed} of them failed; ptm merge {out} when all are done"
        );
    }
    Ok(if n_failed > 0 {
        Exit::SomeFailed
    } else {
        Exit::Done
    })
}
