//! `ptm export`: the draws of a sweep's chains for other programs.

use std::path::{Path, PathBuf};

use crate::results::SweepResults;
use crate::results::draws::{Draws, draws};
use crate::table::{self, CellDraws};
use clap::Args;
use serde_json::{Value, json};

use super::numbers::count;
use super::report::{Finished, chosen_cells};
use super::{Arguments, Exit, Failure, check_outputs, write_json};

/// Arguments of `ptm export`.
#[derive(Debug, Args)]
pub struct ExportCommand {
    /// Folder of the sweep, as in reports/noisy.
    folder: PathBuf,
    /// The cell, as in --cell c017; may be repeated [default: all].
    #[arg(long, value_name = "ID")]
    cell: Vec<String>,
    /// The world, from 1 [default: all; with .json the first].
    #[arg(long, value_name = "N", value_parser = count::<u64>(1, u64::MAX))]
    world: Option<u64>,
    /// Where to: .json for ArviZ (one cell and world), .parquet or .csv for a row per draw.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// The chains of one cell on one world.
struct Part {
    cell: usize,
    world: u64,
    chains: Vec<u64>,
    draws: Draws,
}

/// Runs it.
pub fn run(command: &ExportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let ending = command.out.extension().and_then(|ending| ending.to_str());
    let is_json = match ending {
        Some("json") => true,
        Some("parquet" | "csv") => false,
        _ => {
            return Err(Failure::usage(format!(
                "--out: got {}, expected a name that ends in .json, .parquet or .csv",
                command.out.display()
            )));
        }
    };
    let mut finished = Finished::read(&command.folder)?;
    check_outputs(None, &[&command.out])?;
    let cells = if command.cell.is_empty() {
        (0..finished.sweep.cells.len()).collect()
    } else {
        chosen_cells(&finished.sweep, &command.cell)?
    };
    if is_json && cells.len() != 1 {
        return Err(Failure::usage(format!(
            "--out: got .json and {} cells, expected one cell: name it with --cell, or write .parquet",
            cells.len()
        )));
    }
    let world = command.world.or(is_json.then_some(1));
    let results = finished.results()?;
    let parts = parts(&finished, &results, &cells, world);
    if parts.is_empty() {
        return Err(Failure::usage(format!(
            "{}: got no finished chain of these cells and worlds; run the sweep, or choose others",
            command.folder.display()
        )));
    }
    match ending {
        Some("json") => write_json(&command.out, &for_arviz(&finished, &parts[0]))?,
        _ => write_table(&command.out, &finished, &parts)?,
    }
    if !arguments.quiet {
        outln!("draws: {}", command.out.display());
    }
    ended(&finished, &results, &cells, world)
}

/// How it ends: what was written may be of a part of the chains only.
fn ended(
    finished: &Finished,
    results: &SweepResults,
    cells: &[usize],
    world: Option<u64>,
) -> Result<Exit, Failure> {
    let is_asked = |replicate: u64| world.is_none_or(|one| one == replicate + 1);
    let (mut n, mut n_recorded, mut n_failed) = (0, 0, 0);
    for &cell in cells {
        let tasks = finished.plan.tasks_of(cell).iter();
        n += tasks.filter(|task| is_asked(task.replicate)).count();
        let chains = results.chains_of(cell);
        for chain in chains.filter(|chain| is_asked(chain.replicate)) {
            n_recorded += 1;
            n_failed += usize::from(chain.outcome().is_none());
        }
    }
    let folder = finished.folder.path().display();
    if n_recorded < n {
        return Err(Failure::try_again(format!(
            "{folder}: {} of {n} chains have no record, and what was written is without them; run \
             the sweep to its end, then export again",
            n - n_recorded
        )));
    }
    if n_failed > 0 {
        errln!("{folder}: {n_failed} of {n} chains failed and have no draws; chains.csv says why");
        return Ok(Exit::SomeFailed);
    }
    Ok(Exit::Done)
}

fn parts(
    finished: &Finished,
    results: &SweepResults,
    cells: &[usize],
    world: Option<u64>,
) -> Vec<Part> {
    let worlds = 1..=finished.sweep.max_replicates();
    let worlds: Vec<u64> = worlds
        .filter(|w| world.is_none_or(|one| one == *w))
        .collect();
    let part = |cell: usize, world: u64| {
        let own = results.chains_of(cell);
        let own = own.filter(|chain| chain.replicate + 1 == world && !chain.is_repeat);
        let own: Vec<_> = own
            .filter_map(|chain| Some((chain.chain + 1, chain.outcome()?)))
            .collect();
        let (chains, outcomes): (Vec<u64>, Vec<_>) = own.into_iter().unzip();
        Some(Part {
            cell,
            world,
            chains,
            draws: draws(&outcomes)?,
        })
    };
    let of_cell = |&cell: &usize| worlds.iter().filter_map(move |&world| part(cell, world));
    cells.iter().flat_map(of_cell).collect()
}

/// Groups and variables as `arviz.from_dict` takes them.
fn for_arviz(finished: &Finished, part: &Part) -> Value {
    let cell = &finished.sweep.cells[part.cell];
    let settings: serde_json::Map<String, Value> = (cell.settings.iter())
        .filter(|(key, _)| key.name != "detections")
        .map(|(key, value)| (key.name.to_owned(), json!(value.to_string())))
        .collect();
    let by_chain = |value: &dyn Fn(&crate::results::draws::ChainDraws) -> Value| {
        Value::from(part.draws.chains.iter().map(value).collect::<Vec<_>>())
    };
    json!({
        "posterior": {
            "n_sets": by_chain(&|chain| json!(chain.n_sets)),
            "topology": by_chain(&|chain| json!(chain.topology)),
        },
        "sample_stats": { "lp": by_chain(&|chain| json!(chain.ln_target)) },
        "attrs": {
            "created_by": format!("topometric {}", env!("CARGO_PKG_VERSION")),
            "sweep": finished.sweep.name,
            "cell": cell.id,
            "world": part.world,
            "chains": part.chains,
            "proposals_left_out": part.draws.first_step,
            "proposals_per_draw": part.draws.every,
            "record_stride": part.draws.stride,
            "topologies": part.draws.topologies,
            "settings": settings,
        },
    })
}

fn write_table(path: &Path, finished: &Finished, parts: &[Part]) -> Result<(), Failure> {
    let parts: Vec<CellDraws<'_>> = parts
        .iter()
        .map(|part| CellDraws {
            cell: &finished.sweep.cells[part.cell].id,
            world: part.world,
            chains: part.chains.clone(),
            draws: &part.draws,
        })
        .collect();
    let table = table::draws_table(&parts);
    if path.extension().is_some_and(|ending| ending == "csv") {
        table.write_csv(path)?;
    } else {
        table.write_parquet(path)?;
    }
    Ok(())
}
