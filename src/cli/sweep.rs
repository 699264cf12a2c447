//! `ptm sweep`: the main job.

use std::path::{Path, PathBuf};

use clap::Args;
use topometric::report::{self, Material, Pages};
use topometric::results::SweepResults;
use topometric::results::sample::judgement;
use topometric::run::{self, Claimant, FolderError, Journal, Plan, RunFile, RunFolder};
use topometric::settings::keys_table;
use topometric::sweep::Sweep;
use topometric::table;

use super::execution::Execution;
use super::progress::{Bar, Stages};
use super::signal::StopSignal;
use super::{Arguments, Exit, Failure, provenance, say, say_notes_of_plan, shard_run, timing};

const EXAMPLE: &str = include_str!("../../sweeps/smoke.toml");

const STOPPED: &str = "stopped: what is finished is kept; run the same command again to continue";

/// Arguments of `ptm sweep`.
#[derive(Debug, Args)]
pub struct SweepCommand {
    /// The sweep file, as in sweeps/noisy.toml.
    #[arg(required_unless_present_any = ["print_example", "print_keys"])]
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
}

/// Runs it.
pub fn run(command: &SweepCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let Some(file) = command
        .file
        .as_ref()
        .filter(|_| !command.print_example && !command.print_keys)
    else {
        out!(
            "{}",
            if command.print_keys {
                keys_table()
            } else {
                EXAMPLE.to_owned()
            }
        );
        return Ok(Exit::Done);
    };
    let mut sweep = Sweep::read(file, command.data.as_deref())?;
    if !command.cell.is_empty() {
        sweep = sweep.only(&command.cell, &file.display().to_string())?;
    }
    let stop = StopSignal::listen((!arguments.quiet).then_some(STOPPED))?;
    // Everything that can be wrong with the input is found before a file is touched.
    let mut plan = Plan::new(&sweep)?;
    say_notes_of_plan(&plan, arguments);
    let mut options = command.execution.options()?;
    let out = folder_of(command.out.as_deref(), &sweep);
    let mut run_file = RunFile::new(&sweep, &plan);
    let claimant = match options.shard {
        Some(_) => Claimant::Shard,
        None => Claimant::Writer,
    };
    // The folder's lock is held until the last file is written.
    let claimed = RunFolder::claim(&out, &run_file, command.force, claimant);
    let (folder, earlier) = claimed.map_err(|error| with_what_is_kept(error, &plan, &out))?;
    options.checkpoints = command.execution.checkpoints(&folder);
    if let Some(shard) = options.shard {
        folder.write_inputs(&sweep, &plan, report::data_file)?;
        return shard_run::run(
            &sweep,
            &mut plan,
            &folder,
            (shard, &options),
            &stop,
            arguments,
        );
    }
    if let Some(earlier) = earlier {
        run_file.starts = earlier.starts;
        run_file.chains_done = earlier.chains_done;
    }
    run_file
        .starts
        .push(provenance::start_now(&options.limits, None));
    folder.write_run_file(&run_file)?;
    let journal = Journal::open(folder.path())?;
    for note in journal.notes() {
        say(arguments, note);
    }
    let mut so_far = plan.clone();
    so_far.replay(&sweep, &journal)?;
    say_what_was_lost(&so_far, &journal, &run_file, &out, arguments);
    drop(so_far);
    folder.clear_temporary()?;
    folder.write_inputs(&sweep, &plan, report::data_file)?;

    let progress = Bar::new(arguments.quiet);
    let result = run::execute(
        &sweep,
        &mut plan,
        &journal,
        &options,
        (&judgement, &progress),
        &stop.flag,
    )?;
    run_file.chains = plan.tasks.len();
    run_file.chains_done = result.n_done();
    if let Some(start) = run_file.starts.last_mut() {
        provenance::ended(start, &stop, &result);
    }
    folder.write_run_file(&run_file)?;
    if let Some(signal) = stop.received() {
        let (done, all) = (result.n_done(), plan.tasks.len());
        let again = "run the same command again to continue";
        say(
            arguments,
            &format!("stopped: {done} of {all} chains are kept; {again}"),
        );
        return Ok(Exit::Signal(signal));
    }
    let pages = if command.all_cells {
        Pages::All
    } else {
        Pages::Chosen
    };
    if sweep.stopping().is_some() {
        // The worlds of later rounds.
        folder.write_inputs(&sweep, &plan, report::data_file)?;
    }
    let seconds = timing::write_timings(&folder, &plan, &result)?;
    // The journal has done its work, and would hold every record a second time.
    drop(journal);
    let stages = Stages::new(arguments.quiet);
    stages.say("after the chains: diagnostics of worlds, cells and factors");
    let results = SweepResults::gather(&sweep, &plan, result.records);
    stages.say("after the chains: tables");
    write_tables(&folder, (&sweep, &plan), &results)?;
    stages.say("after the chains: figures and pages");
    folder.clear_pages()?;
    let material = Material {
        sweep: &sweep,
        plan: &plan,
        results: &results,
    };
    let index = report::write(folder.path(), material, &pages)?;
    report::write_timing(folder.path(), material, &seconds)?;
    drop(stages);
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

/// A refusal of a folder with what --force would keep of it: a chain that both sweeps have is the same.
fn with_what_is_kept(error: FolderError, plan: &Plan, out: &Path) -> FolderError {
    let FolderError::Taken { path, what, .. } = error else {
        return error;
    };
    let kept = Journal::read_only(out).map_or_else(
        |_| String::new(),
        |journal| {
            let chains = plan.chains(None);
            let n_kept = chains.iter().filter(|task| journal.get(&task.key).is_some());
            let n_kept = n_kept.count();
            let n_gone = journal.n_records().saturating_sub(n_kept);
            let (n_chains, one) = (chains.len(), if n_gone == 1 { "chain" } else { "chains" });
            format!(
                ", which keeps {n_kept} of the {n_chains} chains of this sweep and leaves {n_gone} other {one} out \
                 of the tables"
            )
        },
    );
    FolderError::Taken { path, what, kept }
}

/// A journal cut at the end of a line looks like one that was never longer, but for what `run.json` says.
fn say_what_was_lost(
    plan: &Plan,
    journal: &Journal,
    run_file: &RunFile,
    out: &Path,
    arguments: &Arguments,
) {
    let held = plan
        .tasks
        .iter()
        .filter(|task| journal.get(&task.key).is_some());
    let (n_held, n_done) = (held.count(), run_file.chains_done);
    if n_held < n_done {
        say(
            arguments,
            &format!(
                "{}: run.json says that {n_done} chains were done, and the journal holds {n_held}: records were \
                 lost, and their chains are run again",
                out.display()
            ),
        );
    }
}

/// Where a sweep's report goes.
pub fn folder_of(out: Option<&Path>, sweep: &Sweep) -> PathBuf {
    out.map_or_else(|| Path::new("reports").join(&sweep.name), Path::to_owned)
}

/// Writes the tables of what was found.
pub fn write_tables(
    folder: &RunFolder,
    (sweep, plan): (&Sweep, &Plan),
    results: &SweepResults,
) -> Result<(), Failure> {
    let path = folder.path();
    table::chains_table(sweep, results).write(path, "chains")?;
    table::cells_table(sweep, results).write(path, "cells")?;
    table::topologies_table(sweep, results).write(path, "topologies")?;
    table::convergence_table(sweep, results).write(path, "convergence")?;
    if let Some(table) = table::posteriors_table(sweep, plan, results) {
        table.write(path, "posteriors")?;
    }
    // A list of cells has no factors whose effects could be told.
    for (name, table) in table::sensitivity_tables(&results.sensitivity) {
        table.write(path, name)?;
    }
    Ok(())
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
