//! `ptm plan`: what a sweep would run, without running it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::chain::{self, TraceRecorder};
use crate::run::{self, Earlier, Journal, Owner, Plan, Reasons, RunFile, Stop, Task};
use crate::settings::{Key, Settings, Until, Value};
use crate::sweep::{Axis, Design, Spread, Stopping, Sweep};
use clap::Args;
use indicatif::HumanDuration;

use super::execution::Execution;
use super::numbers::grouped;
use super::report::Finished;
use super::sweep::folder_of;
use super::{Arguments, Exit, Failure, say_notes_of_plan};

/// Arguments of `ptm plan`.
#[derive(Debug, Args)]
pub struct PlanCommand {
    /// The sweep file.
    file: PathBuf,
    /// Detections CSV to run the sweep on, instead of what the file names.
    #[arg(long, value_name = "CSV")]
    data: Option<PathBuf>,
    /// Say for every cell which chains would run, and why, and stop.
    #[arg(long)]
    explain: bool,
    /// The folder that the sweep would run in [default: reports/ and the name of the sweep file].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    execution: Execution,
}

/// Cells that are tried to estimate the time, evenly over the sweep.
const N_TRIED: usize = 24;
/// Proposals of each trial.
const N_TRIAL_STEPS: u64 = 500;

/// Runs it.
pub fn run(command: &PlanCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let sweep = Sweep::read(&command.file, command.data.as_deref())?;
    let mut plan = Plan::new(&sweep)?;
    say_notes_of_plan(&plan, arguments);
    if command.explain {
        return explain(command, &sweep, &mut plan);
    }
    let n_steps_of = |task: &Task| plan.settings(&sweep, task).most_samples();
    let n_steps: u64 = plan.tasks.iter().map(n_steps_of).sum();
    let stopping = sweep.stopping();
    let most = sweep.max_replicates();
    let n_most = sweep.cells.len() as u64 * most * sweep.n_chains();
    outln!("sweep      {} ({})", sweep.title, sweep.design.name());
    for (name, values) in factors_in_words(&sweep) {
        outln!("  {name:<20} {values}");
    }
    outln!("cells      {}", sweep.cells.len());
    outln!(
        "data sets  {} ({} worlds per cell)",
        plan.data_sets.len(),
        sweep.n_replicates()
    );
    let is_of_cell = |task: &&Task| matches!(task.owner, Owner::Cell(_));
    let n_chains = plan.tasks.iter().filter(is_of_cell).count();
    outln!("chains     {n_chains} ({} per world)", sweep.n_chains());
    if !plan.posteriors().is_empty() {
        outln!(
            "reference  {} more chains, of the posteriors of {} models and worlds: they sort the failures",
            plan.tasks.len() - n_chains,
            plan.posteriors().len()
        );
    }
    if let Some(rule) = stopping {
        outln!(
            "rounds     this is the first; a cell whose recovery rate is not known to ± {} goes on, to {} worlds",
            rule.error,
            worlds_of_rounds(rule, sweep.n_replicates())
        );
        outln!("at most    {n_most} chains ({most} worlds per cell)");
    }
    let is_led_on = |task: &Task| plan.settings(&sweep, task).until() == Until::Converged;
    let bound = if plan.tasks.iter().any(is_led_on) {
        " at most"
    } else {
        ""
    };
    outln!("proposals  {}{bound}", grouped(n_steps));
    outln!("seed       {}", sweep.seed());
    let sizes = plan
        .data_sets
        .iter()
        .flatten()
        .map(|data| data.detections.len());
    let (smallest, largest) = (sizes.clone().min().unwrap_or(0), sizes.max().unwrap_or(0));
    let range = if smallest == largest {
        smallest.to_string()
    } else {
        format!("{smallest} to {largest}")
    };
    outln!("detections {range} in a data set");
    let threads = rayon::current_num_threads();
    let seconds = seconds_of_chains(&sweep, &plan) / threads as f64;
    let time = |seconds: f64| HumanDuration(Duration::from_secs_f64(seconds));
    let at_most = match stopping {
        // Everything grows with the number of worlds.
        Some(_) => {
            let times = most as f64 / sweep.n_replicates() as f64;
            format!(", at most {}", time(seconds * times))
        }
        None => String::new(),
    };
    outln!(
        "time       about {}{at_most} on {threads} threads",
        time(seconds)
    );
    outln!(
        "memory     about {:.0} MB",
        memory_bytes(&sweep, largest) / 1e6
    );
    if arguments.verbose > 0 {
        for task in &plan.tasks {
            let owner = match task.owner {
                Owner::Cell(cell) => sweep.cells[cell].id.clone(),
                Owner::Posterior(index) => format!("reference {}", index + 1),
            };
            outln!(
                "{owner} world {} chain {} key {}",
                task.replicate + 1,
                task.chain + 1,
                task.key
            );
        }
    }
    Ok(Exit::Done)
}

/// Levels that a line lists before it names the ends alone.
const MOST_LEVELS: usize = 12;

/// Every factor with its levels; of a sampled design with the range that they are drawn from.
fn factors_in_words(sweep: &Sweep) -> Vec<(&'static str, String)> {
    let unit = |key: &Key| match key.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let listed = |levels: &[Value]| {
        let words: Vec<String> = levels.iter().map(ToString::to_string).collect();
        match words.as_slice() {
            [first, .., last] if words.len() > MOST_LEVELS => {
                format!("{} levels from {first} to {last}", words.len())
            }
            _ => words.join(", "),
        }
    };
    let of_axis = |axis: &Axis| {
        let values = match &axis.spread {
            Spread::Range { low, high, log } => {
                let scale = if *log { "logarithmic" } else { "linear" };
                format!("{low} to {high}{} ({scale})", unit(axis.key))
            }
            Spread::Levels(levels) => listed(levels),
        };
        (axis.key.name, values)
    };
    match &sweep.design {
        Design::Sampled(design) => design.axes.iter().map(of_axis).collect(),
        _ => (sweep.factors.iter())
            .map(|factor| {
                let values = format!("{}{}", listed(&factor.levels), unit(factor.key));
                (factor.key.name, values)
            })
            .collect(),
    }
}

/// As in "8, 12, 18, 27, 40", with the middle left out of many.
fn worlds_of_rounds(rule: Stopping, first: u64) -> String {
    let rounds = std::iter::successors(rule.next(first), |n| rule.next(*n));
    let mut rounds: Vec<String> = rounds.map(|n| n.to_string()).collect();
    if rounds.len() > 8 {
        rounds.splice(6..rounds.len() - 1, ["…".to_owned()]);
    }
    rounds.join(", ")
}

/// For every cell, which of its chains would run and why.
fn explain(command: &PlanCommand, sweep: &Sweep, plan: &mut Plan) -> Result<Exit, Failure> {
    let out = folder_of(command.out.as_deref(), sweep);
    let run_file = RunFile::new(sweep, plan);
    let (before, journal) = if out.join("run.json").exists() {
        let (mut before, _) = Finished::read_any(&out)?;
        let journal = Journal::read_only(&out)?;
        before.plan.replay(&before.sweep, &journal)?;
        (Some(before), journal)
    } else {
        (None, Journal::empty())
    };
    for note in journal.notes() {
        outln!("{note}");
    }
    plan.replay(sweep, &journal)?;
    let earlier = before.as_ref().map(|before| Earlier {
        sweep: &before.sweep,
        plan: &before.plan,
        semantics: &before.run.semantics,
    });
    let options = command.execution.of_all();
    let semantics = &run_file.semantics;
    let explained = run::explain(sweep, plan, &journal, &options, earlier.as_ref(), semantics);
    let names = sweep.cells.iter().map(|cell| cell.id.as_str());
    let mut rows: Vec<(&str, &Reasons)> = names.zip(&explained.of_cells).collect();
    if !plan.posteriors().is_empty() {
        rows.push(("reference", &explained.of_posteriors));
    }
    let mut n_run = 0;
    for (name, reasons) in rows {
        let words: Vec<String> = reasons
            .iter()
            .map(|(reason, n)| format!("{n} {reason}"))
            .collect();
        outln!("{name}  {}", words.join("; "));
        let runs = reasons
            .iter()
            .filter(|(reason, _)| reason.starts_with("run"));
        n_run += runs.map(|(_, n)| n).sum::<usize>();
    }
    let n = plan.tasks.len();
    outln!("{n_run} of {n} chains would run in {}", out.display());
    if let Some(rule) = sweep.stopping() {
        let is_open = |cell: &usize| {
            let known = |task: &Task| journal.get(&task.key).map(|record| &record.status);
            plan.stop(sweep, *cell, known) == Some(Stop::Unfinished)
        };
        let (mut n_open, mut n_more) = (0, 0);
        for cell in (0..sweep.cells.len()).filter(is_open) {
            n_open += 1;
            n_more += (rule.most - plan.replicates[cell]) * sweep.n_chains();
        }
        outln!(
            "then at most {n_more} more, while the recovery rates of {n_open} of {} cells are not known to ± {}",
            sweep.cells.len(),
            rule.error
        );
    }
    if before.is_some_and(|before| before.run.key != run_file.key) {
        outln!(
            "the folder holds another sweep or other data: ptm sweep wants --force, and keeps what is the same"
        );
    }
    Ok(Exit::Done)
}

/// Seconds of all chains one after the other, by some that are tried for a moment. A chain's first steps are slower than
/// its later ones where it has to settle first, so this errs on the long side.
fn seconds_of_chains(sweep: &Sweep, plan: &Plan) -> f64 {
    let stride = plan.tasks.len().div_ceil(N_TRIED).max(1);
    let tried: Vec<f64> = plan
        .tasks
        .iter()
        .step_by(stride)
        .filter_map(|task| try_chain(sweep, plan, task))
        .collect();
    plan.tasks.len() as f64 * tried.iter().sum::<f64>() / tried.len().max(1) as f64
}

/// Seconds that a chain takes.
fn try_chain(sweep: &Sweep, plan: &Plan, task: &Task) -> Option<f64> {
    let settings = plan.settings(sweep, task);
    let data = plan.data(task).ok()?;
    let (model, start) = (
        data.model(settings).ok()?,
        data.start(&settings.init(), 0).ok()?,
    );
    let mut recorder = TraceRecorder::new(1000);
    let (prior, sampler) = (settings.prior(), settings.sampler(model.n_detections()));
    let started = Instant::now();
    chain::run(
        &model,
        prior,
        &sampler,
        &start,
        N_TRIAL_STEPS,
        &task.purpose,
        &mut recorder,
    );
    let step_s = started.elapsed().as_secs_f64() / N_TRIAL_STEPS as f64;
    Some(step_s * settings.most_samples() as f64)
}

/// The largest of what stays for each chain in flight (its trace, if every step were accepted, its
/// table of topologies, its draws), and what is kept of every chain.
fn memory_bytes(sweep: &Sweep, n_detections: usize) -> f64 {
    let largest = |value: &dyn Fn(&Settings) -> u64| {
        let values = sweep.cells.iter().map(|cell| value(&cell.settings));
        values.max().unwrap_or(0) as f64
    };
    let most = |name: &str| largest(&|settings| settings.count(name));
    let draws = largest(&|settings| {
        let draws_locations = settings.estimator(n_detections).draws_locations();
        u64::from(draws_locations) * settings.count("importance_samples")
    });
    let samples = largest(&Settings::most_samples);
    let n = n_detections as f64;
    let topologies = samples.min(most("max_topologies")) * (80.0 + 4.0 * n);
    let in_flight = samples.min(chain::MAX_RUNS as f64) * 48.0 + topologies + draws * n * 16.0;
    let kept = 12e3 * (sweep.cells.len() as u64 * sweep.max_replicates() * sweep.n_chains()) as f64;
    in_flight * rayon::current_num_threads() as f64 + kept + 30e6
}
