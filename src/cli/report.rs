//! `ptm report`: the report of a finished or partial sweep, again or with more pictures.

use std::path::{Path, PathBuf};

use crate::files::read_text_at_most;
use crate::job::{read_timings, write_tables};
use crate::report::{self, Material, Pages};
use crate::results::SweepResults;
use crate::run::{Journal, Plan, RunFile, RunFolder, tidy_checkpoints};
use crate::sweep::{Cell, MAX_SWEEP_FILE, Sweep};
use clap::Args;

use super::numbers::count;
use super::{Arguments, Exit, Failure, say, watch};

/// Arguments of `ptm report`.
#[derive(Debug, Args)]
pub struct ReportCommand {
    /// Folder of the sweep, as in reports/noisy.
    folder: PathBuf,
    /// Draw the chains of this cell too, as in --cell c017; may be repeated.
    #[arg(long, value_name = "ID", conflicts_with = "all_cells")]
    cell: Vec<String>,
    /// Draw the chains of every cell.
    #[arg(long)]
    all_cells: bool,
    /// While a sweep runs in the folder, write what is known so far to live.html every few seconds,
    /// a page that reads itself again; ends with the sweep. Nothing else is written.
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "5",
        value_parser = count::<u64>(1, 3600), conflicts_with_all = ["cell", "all_cells"])]
    watch: Option<u64>,
}

/// A folder with what was run there.
pub struct Finished {
    /// The folder.
    pub folder: RunFolder,
    /// Its `run.json`.
    pub run: RunFile,
    /// Its sweep.
    pub sweep: Sweep,
    /// Its chains; under a stopping rule those of the first round, until the journal is known.
    pub plan: Plan,
}

impl Finished {
    /// Reads what a run left in a folder, and checks that its sweep and its data are the same still.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        Self::of(RunFolder::existing(path))
    }

    /// As [`read`](Self::read), with the folder's lock, for whoever writes there.
    pub fn lock(path: &Path) -> Result<Self, Failure> {
        Self::of(RunFolder::lock(path)?)
    }

    fn of(folder: RunFolder) -> Result<Self, Failure> {
        let path = folder.path().to_owned();
        let (finished, is_same) = Self::of_any(folder)?;
        if !is_same {
            let folder = path.display();
            return Err(Failure::usage(format!(
                "{folder}: got data or settings that have changed since the run, expected those of \
                 run.json; restore the world file or the detections, or run the sweep again"
            )));
        }
        Ok(finished)
    }

    /// As [`read`](Self::read), and whether they are the same still.
    pub fn read_any(path: &Path) -> Result<(Self, bool), Failure> {
        Self::of_any(RunFolder::existing(path))
    }

    fn of_any(folder: RunFolder) -> Result<(Self, bool), Failure> {
        let path = folder.path();
        let run = folder.read_run_file()?;
        let file = path.join("sweep.toml");
        let name = file.display().to_string();
        let text = read_text_at_most(&file, MAX_SWEEP_FILE).map_err(|error| {
            Failure::usage(format!(
                "{name}: cannot be read ({error}); run the sweep again"
            ))
        })?;
        // The data as they were, wherever the original CSV is now.
        let csv = run.data.as_ref().map(|_| path.join(report::data_file(0)));
        let sweep = Sweep::parse(&text, &name, &run.sweep, csv.as_deref())?;
        let plan = Plan::new(&sweep)?;
        let is_same = plan.key(&sweep) == run.key;
        let finished = Self {
            folder,
            run,
            sweep,
            plan,
        };
        Ok((finished, is_same))
    }

    /// What its journal holds.
    pub fn results(&mut self) -> Result<SweepResults, Failure> {
        let journal = Journal::read_only(self.folder.path())?;
        self.plan.replay(&self.sweep, &journal)?;
        Ok(self.gathered(journal))
    }

    /// What a journal holds of it.
    pub fn gathered(&self, journal: Journal) -> SweepResults {
        let records = self.plan.in_order(journal.into_records());
        SweepResults::gather(&self.sweep, &self.plan, records)
    }
}

/// Runs it.
pub fn run(command: &ReportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    if let Some(seconds) = command.watch {
        return watch::run(&command.folder, seconds, arguments);
    }
    let mut finished = Finished::lock(&command.folder)?;
    let journal = Journal::read_only(finished.folder.path())?;
    for note in journal.notes() {
        say(arguments, note);
    }
    finished.folder.clear_temporary()?;
    tidy_checkpoints(&finished.folder.checkpoints(), &journal);
    finished.plan.replay(&finished.sweep, &journal)?;
    say_what_is_missing(&finished, &journal, arguments);
    let (all, cells) = (command.all_cells, &command.cell);
    write_report(&finished, journal, all, cells, arguments)
}

/// A report of a part of a sweep is one, but not of all of it.
fn say_what_is_missing(finished: &Finished, journal: &Journal, arguments: &Arguments) {
    let tasks = &finished.plan.tasks;
    let missing = tasks.iter().filter(|task| journal.get(&task.key).is_none());
    let (n_missing, n) = (missing.count(), tasks.len());
    if n_missing > 0 {
        let folder = finished.folder.path().display();
        let what =
            format!("{folder}: {n_missing} of {n} chains have no record; run the sweep to its end");
        say(arguments, &what);
    }
}

/// Writes tables and pages of what a journal holds.
pub fn write_report(
    finished: &Finished,
    journal: Journal,
    all_cells: bool,
    ids: &[String],
    arguments: &Arguments,
) -> Result<Exit, Failure> {
    let Finished {
        folder,
        sweep,
        plan,
        ..
    } = finished;
    let results = finished.gathered(journal);
    if sweep.stopping().is_some() {
        // The worlds of later rounds.
        folder.write_inputs(sweep, plan, report::data_file)?;
    }
    write_tables(folder, (sweep, plan), &results)?;
    let pages = if all_cells {
        Pages::All
    } else {
        Pages::Also(chosen_cells(sweep, ids)?)
    };
    let material = Material {
        sweep,
        plan,
        results: &results,
    };
    let index = report::write(folder.path(), material, &pages)?;
    report::write_timing(folder.path(), material, &read_timings(folder.path()))?;
    if !arguments.quiet {
        outln!("report: {}", index.display());
    }
    Ok(if results.n_failed() > 0 {
        Exit::SomeFailed
    } else {
        Exit::Done
    })
}

/// Cells by id or label.
pub fn chosen_cells(sweep: &Sweep, ids: &[String]) -> Result<Vec<usize>, Failure> {
    let mut found = Vec::new();
    for id in ids {
        let before = found.len();
        // A label may stand for several variants.
        let named = |cell: &Cell| cell.id == *id || cell.label == *id;
        found.extend((0..sweep.cells.len()).filter(|&cell| named(&sweep.cells[cell])));
        if found.len() == before {
            let (first, last) = (&sweep.cells[0].id, &sweep.cells[sweep.cells.len() - 1].id);
            return Err(Failure::usage(format!(
                "--cell: got {id}, expected one of {first} to {last}"
            )));
        }
    }
    Ok(found)
}
