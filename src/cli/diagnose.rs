//! `ptm diagnose`: the verdict on chains of label vectors that another program drew.

use std::path::{Path, PathBuf};

use clap::Args;
use topometric::input::Source;
use topometric::labels::{Collector, LabelChains};
use topometric::results::labels::{LabelChainSummary, LabelsResult, diagnose_labels};
use topometric::settings::BurnInRule;
use topometric::table;

use super::found_words::{answers_line, convergence_lines, estimate_lines, fitted, topology_lines};
use super::numbers::count;
use super::progress::Stages;
use super::{Arguments, Exit, Failure, check_outputs, say, write_json};

/// Arguments of `ptm diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "\
A draw gives each item a label; items of one label share a set. A table has a row for each draw and a column \
for each item, or one column labels such as 0,0,1; and, if need be, chain, weight (steps that a draw stands \
for) and ln_target. JSON is an array chain x draw x item. Without chain each file is one chain. The Parquet \
of ptm sample --trace will do. docs/diagnose.md has examples.")]
pub struct DiagnoseCommand {
    /// The draws: CSV, Parquet or JSON, several files or one.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Write the result as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Draws left out at the start of each chain, or auto: as many as MSER finds.
    #[arg(long, value_name = "N", default_value = "auto", value_parser = burn_in)]
    burn_in: BurnInRule,
    /// Topologies in the JSON at most.
    #[arg(long, value_name = "K", default_value = "1000", value_parser = count::<usize>(0, u64::MAX))]
    top: usize,
    /// Distinct topologies held of each chain.
    #[arg(long, value_name = "N", default_value = "100000", value_parser = count::<usize>(1, u64::MAX))]
    max_topologies: usize,
}

fn burn_in(text: &str) -> Result<BurnInRule, String> {
    let expected = "auto or a whole number of draws";
    text.parse().map_err(|_| expected.to_owned())
}

/// Chains that the summary lists.
const N_CHAINS: usize = 8;

/// Runs it.
pub fn run(command: &DiagnoseCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let to_stdout = command.json.as_deref() == Some(Path::new("-"));
    let json_file = command.json.as_ref().filter(|_| !to_stdout);
    for file in &command.files {
        check_outputs(Some(file), &json_file.into_iter().collect::<Vec<_>>())?;
    }
    let stages = Stages::new(arguments.quiet);
    let found = read(command, &stages)?;
    if found.n_left_out > 0 {
        let what = format!(
            "noted: chains are cut to the shortest: {} draws at the ends of others are left out",
            found.n_left_out
        );
        say(arguments, &what);
    }
    let stage = |what: &str| stages.say(what);
    let mut result = diagnose_labels(found.chains, command.burn_in, &stage);
    drop(stages);
    if !arguments.quiet && !to_stdout {
        out!("{}", summary(&result));
    }
    if let Some(path) = &command.json {
        result.topologies.truncate(command.top);
        write_json(path, &result)?;
    }
    Ok(Exit::Done)
}

fn read(command: &DiagnoseCommand, stages: &Stages) -> Result<LabelChains, Failure> {
    let mut collector = Collector::new(command.max_topologies);
    for file in &command.files {
        stages.say(format!("reading {}", file.display()));
        if table::is_parquet(file) {
            table::read_labels(file, &mut collector)?;
        } else {
            topometric::labels::read(Source::open(file)?, &mut collector)?;
        }
    }
    let found = collector.finish().map_err(|name| {
        Failure::data(format!(
            "{name}: got more draws than other chains and too many to be cut, expected chains of one length; \
             leave draws out at the end"
        ))
    })?;
    if found.chains.is_empty() {
        let files: Vec<_> = command
            .files
            .iter()
            .map(|file| file.display().to_string())
            .collect();
        return Err(Failure::data(format!(
            "{}: got no draw, expected at least one; write a row for each draw",
            files.join(", ")
        )));
    }
    Ok(found)
}

fn summary(result: &LabelsResult) -> String {
    let n_chains = result.chains.len();
    let chains = if n_chains == 1 { "chain" } else { "chains" };
    let mut lines = vec![format!(
        "{n_chains} {chains} of {} draws of {} items",
        result.n_draws, result.n_items
    )];
    let chain = |own: &LabelChainSummary| {
        let burn_in = own.burn_in.map_or_else(
            || format!("no burn-in: {}", own.burn_in_reason),
            |n| format!("burn-in {n}"),
        );
        format!(
            "chain       {}: {burn_in}, M {:.3}",
            own.name, own.mean_n_sets
        )
    };
    lines.extend(result.chains.iter().take(N_CHAINS).map(chain));
    if n_chains > N_CHAINS {
        lines.push(format!(
            "            … and {} more chains",
            n_chains - N_CHAINS
        ));
    }
    lines.push(format!(
        "sets M      {:.3} on average",
        result.expected_number_of_sets
    ));
    lines.extend(topology_lines(
        &result.topologies,
        (result.n_topologies, result.truncated),
    ));
    lines.extend(convergence_lines(result.convergence.as_ref()));
    lines.extend(estimate_lines(&result.estimates));
    lines.extend(answers_line(&result.representatives));
    if result.truncated {
        lines.push(
            "truncated   the table of topologies was full; the rarest were dropped".to_owned(),
        );
    }
    fitted(lines)
}
