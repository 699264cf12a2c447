//! `ptm sweep`: the main job.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use crate::job::{SweepEnd, SweepJob};
use crate::report::Pages;
use crate::results::SweepResults;
use crate::settings::keys_table;
use crate::sweep::{Sweep, schema};
use clap::Args;

use super::execution::Execution;
use super::progress::{Bar, Stages};
use super::signal::StopSignal;
use super::{Arguments, Exit, Failure, say, say_notes_of_plan, shard_run};

const EXAMPLE: &str = include_str!("../../sweeps/smoke.toml");

const STOPPED: &str = "stopped: what is finished is kept; run the same command again to continue";

/// Arguments of `ptm sweep`.
#[derive(Debug, Args)]
pub struct SweepCommand {
    /// The sweep file, as in sweeps/noisy.toml.
    #[arg(required_unless_present_any = ["print_example", "print_keys", "print_schema"])]
    file: Option<PathBuf>,
    /// Detections CSV to run the sweep on, instead of what the file names.
    #[arg(long, value_name = "CSV")]
    data: Option<PathBuf>,
    /// Folder of the report [default: reports/ and the name of the sweep file].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run this cell alone, as in --cell c017, with the worlds and chains it has in the whole sweep; may be
    /// repeated. Give it a folder of its own with --out.
    #[arg(long, value_name = "ID", requires = "out")]
    cell: Vec<String>,
    /// Replace what another sweep left in the folder.
    #[arg(long)]
    force: bool,
    /// Draw the chains of every cell, however many there are.
    #[arg(long)]
    all_cells: bool,
    #[command(flatten)]
    execution: Execution,
    /// Print an example of a sweep file and stop.
    #[arg(long)]
    print_example: bool,
    /// Print all keys of a sweep file, as Markdown, and stop.
    #[arg(long)]
    print_keys: bool,
    /// Print the JSON Schema of a sweep file, for editors, and stop.
    #[arg(long)]
    print_schema: bool,
}

/// Runs it.
pub fn run(command: &SweepCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let printed = [
        (command.print_example, EXAMPLE.to_owned()),
        (command.print_keys, keys_table()),
        (command.print_schema, format!("{:#}\n", schema())),
    ];
    if let Some((_, text)) = printed.iter().find(|(is_asked, _)| *is_asked) {
        out!("{text}");
        return Ok(Exit::Done);
    }
    let file = command.file.as_ref();
    let file = file.expect("clap asks for a file where nothing is to be printed");
    let mut sweep = Sweep::read(file, command.data.as_deref())?;
    if !command.cell.is_empty() {
        sweep = sweep.only(&command.cell, &file.display().to_string())?;
    }
    let stop = StopSignal::listen((!arguments.quiet).then_some(STOPPED))?;
    let job = SweepJob {
        sweep: &sweep,
        folder: &folder_of(command.out.as_deref(), &sweep),
        force: command.force,
        options: command.execution.options()?,
        checkpoints_every: command.execution.checkpoint_interval(),
    };
    // The folder's lock is held until the last file is written.
    let begun = job.begin(|plan| say_notes_of_plan(plan, arguments))?;
    if let Some(shard) = begun.options.shard {
        return shard_run::run(begun, shard, &stop, arguments);
    }
    let pages = if command.all_cells {
        Pages::All
    } else {
        Pages::Chosen
    };
    let progress = Bar::new(arguments.quiet);
    let stages = OnceCell::new();
    let stage = |what: &str| {
        let stages = stages.get_or_init(|| Stages::new(arguments.quiet));
        stages.say(what);
    };
    let words = || stop.words();
    let ended = begun.run(&pages, &stage, &progress, stop.interrupt(&words))?;
    drop(stages);
    match ended {
        SweepEnd::Stopped { n_done, n_chains } => {
            let again = "run the same command again to continue";
            let what = format!("stopped: {n_done} of {n_chains} chains are kept; {again}");
            say(arguments, &what);
            Ok(Exit::Signal(stop.received().unwrap_or_default()))
        }
        SweepEnd::Reported { results, index } => {
            if !arguments.quiet {
                outln!("{}", summary(&sweep, &results));
                outln!("report: {}", index.display());
            }
            Ok(if results.n_failed() > 0 {
                Exit::SomeFailed
            } else {
                Exit::Done
            })
        }
    }
}

/// Where a sweep's report goes.
pub fn folder_of(out: Option<&Path>, sweep: &Sweep) -> PathBuf {
    out.map_or_else(|| Path::new("reports").join(&sweep.name), Path::to_owned)
}

/// The findings, a line each.
pub fn summary(sweep: &Sweep, results: &SweepResults) -> String {
    let mut text = format!("{}\n", sweep.title);
    for cell in results.ranking().iter().copied().take(3) {
        let (cell, result) = (&sweep.cells[cell], &results.cells[cell]);
        let rate = result.recovery.map_or_else(
            || "unknown".to_owned(),
            |r| format!("{:.0} %", 100.0 * r.rate),
        );
        let values = sweep
            .factors
            .iter()
            .map(|f| format!("{} {}", f.key.name, cell.settings.get(f.key.name)));
        let values: Vec<String> = values.collect();
        text.push_str(&format!(
            "  {}  recovery {rate:>7}  {}  {}\n",
            cell.title(),
            result.verdict_words(),
            values.join(", ")
        ));
    }
    let worse = results.cells.len().saturating_sub(3);
    if worse > 0 {
        text.push_str(&format!(
            "  … and {worse} more {}; the report has them all\n",
            if worse == 1 { "cell" } else { "cells" }
        ));
    }
    if results.n_failed() > 0 {
        text.push_str(&format!(
            "  {} chains failed; chains.csv says why\n",
            results.n_failed()
        ));
    }
    text.trim_end().to_owned()
}
