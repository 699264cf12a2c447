//! `ptm report`: the report of a finished or partial sweep, again or with more pictures.

use std::path::PathBuf;

use clap::Args;
use topometric::report::{self, Material, Pages};
use topometric::results::SweepResults;
use topometric::run::{Journal, Plan, RunFolder};
use topometric::sweep::{Cell, Sweep};

use super::sweep::write_tables;
use super::{Arguments, Exit, Failure};

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
}

/// Runs it.
pub fn run(command: &ReportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let folder = RunFolder::existing(&command.folder);
    let run = folder.read_run_file()?;
    let file = command.folder.join("sweep.toml");
    let path = file.display().to_string();
    let text = std::fs::read_to_string(&file).map_err(|error| {
        Failure::usage(format!(
            "{path}: cannot be read ({error}); run the sweep again"
        ))
    })?;
    // The data as they were, wherever the original CSV is now.
    let csv = run
        .data
        .as_ref()
        .map(|_| command.folder.join(report::data_file(0)));
    let sweep = Sweep::parse(&text, &path, &run.sweep, csv.as_deref())?;
    let plan = Plan::new(&sweep)?;
    if plan.key(&sweep) != run.key {
        let folder = command.folder.display();
        return Err(Failure::usage(format!(
            "{folder}: got data or settings that have changed since the run, expected those of \
             run.json; restore the world file or the detections, or run the sweep again"
        )));
    }
    let journal = Journal::open(&folder.journal())?;
    let records: Vec<_> = plan
        .tasks
        .iter()
        .map(|task| journal.get(&task.key).cloned())
        .collect();
    let results = SweepResults::gather(&sweep, &plan, &records);
    write_tables(&folder, &sweep, &results)?;
    let pages = if command.all_cells {
        Pages::All
    } else {
        Pages::Also(cells(&sweep, &command.cell)?)
    };
    let material = Material {
        sweep: &sweep,
        plan: &plan,
        results: &results,
    };
    let index = report::write(&command.folder, material, &pages)?;
    if !arguments.quiet {
        println!("report: {}", index.display());
    }
    Ok(if results.n_failed() > 0 {
        Exit::SomeFailed
    } else {
        Exit::Done
    })
}

fn cells(sweep: &Sweep, ids: &[String]) -> Result<Vec<usize>, Failure> {
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
