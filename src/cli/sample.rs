//! `ptm sample`: the topologies of one detections CSV.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use topometric::chain::Trace;
use topometric::dataset::DataSet;
use topometric::diagnostics::pareto::MAX_PARETO_K;
use topometric::files::text_of;
use topometric::map::{MapFormat, PosteriorMap};
use topometric::partition::Topology;
use topometric::report;
use topometric::results::sample::{SampleResult, judgement, pool};
use topometric::run::{
    ChainOutcome, Judge, Judgement, Looks, TemperingOutcome, sample_chains, tables_of_one,
};
use topometric::settings::{Settings, Value};
use topometric::table;

use super::found_words::{answers_line, convergence_lines, estimate_lines, fitted, topology_lines};
use super::numbers::count;
use super::progress::Stages;
use super::settings::{SAMPLING, SettingsFlags};
use super::signal::StopSignal;
use super::{
    Arguments, Exit, Failure, check_outputs, make_folder, say, say_notes, write_json, write_output,
};

/// Arguments of `ptm sample`.
#[derive(Debug, Args)]
pub struct SampleCommand {
    /// The detections: x,y and optionally covariances, times, corner and landmark.
    file: PathBuf,
    /// Write the result as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Topologies in the JSON at most [default: as many as have 4,000,000 labels together].
    #[arg(long, value_name = "K", value_parser = count::<usize>(0, u64::MAX))]
    top: Option<usize>,
    /// Write the trace, one row for each stretch without a move.
    #[arg(long, value_name = "PARQUET")]
    trace: Option<PathBuf>,
    /// Where the picture goes [default: FILE-sample.png in the current folder; with --json - none].
    #[arg(long, value_name = "PNG")]
    figure: Option<PathBuf>,
    /// Write the topometric map into a folder: of the topology sampled most (map.*) and of the
    /// consensus, the VI estimate (consensus.*), as PNG, SVG, GraphML, GeoJSON, DOT and g2o. All
    /// coordinates are local metres, not degrees, in GeoJSON too: a program that asks for a
    /// reference system of the layer (CRS) is to be told a local one, or the projected one in which
    /// the detections are.
    #[arg(long, value_name = "DIR")]
    map: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingsFlags<SAMPLING>,
}

/// Labels of all topologies in the JSON, unless the user asks for more: 20 MB of text.
const MAX_LABELS: usize = 4_000_000;
/// Estimates that maps are drawn of: their kind, the stem of the files, and words for the heading.
const MAPS: [(&str, &str, &str); 2] = [
    ("map", "map", "the topology sampled most"),
    ("vi", "consensus", "the consensus of all draws"),
];

/// Runs it.
pub fn run(command: &SampleCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let mut settings = command.settings.settings()?;
    settings.set("detections", &Value::Text(text_of(&command.file)))?;
    let data = DataSet::load(&settings, 0)?;
    let settings = settings.naming_sampler(data.detections.len());
    say_notes(&data.notes, &command.file, arguments);
    let to_stdout = command.json.as_deref() == Some(std::path::Path::new("-"));
    let figure = figure_path(command, to_stdout);
    let json_file = command.json.as_ref().filter(|_| !to_stdout);
    let outputs = [json_file, command.trace.as_ref(), figure.as_ref()];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    check_outputs(Some(&command.file), &outputs)?;
    if let Some(folder) = &command.map {
        make_folder(folder)?;
    }
    for fault in settings.faults() {
        say(arguments, &format!("INCORRECT on purpose: {fault}"));
    }
    if arguments.verbose > 0 {
        say(arguments, &settings.canonical_text(|_| true));
    }

    let stop =
        StopSignal::listen((!arguments.quiet).then_some("stopped before the chains were done"))?;
    let stages = Stages::new(arguments.quiet);
    stages.say("the exact posterior of these few detections");
    let tables = tables_of_one(&settings, &data);
    stages.say("the chains and their probes");
    let started = Instant::now();
    let look = |n_steps: u64, found: Judgement| {
        say(arguments, &look_line(n_steps, found, started.elapsed()));
    };
    let judging: (Judge<'_>, Looks<'_>) = (&judgement, &look);
    let chains = sample_chains(&data, &settings, &tables, judging, &stop.flag)?;
    let chains = chains.unwrap_or_default();
    let seconds = started.elapsed().as_secs_f64();
    if let Some(signal) = stop.received() {
        say(
            arguments,
            "stopped before the chains were done; nothing is written",
        );
        return Ok(Exit::Signal(signal));
    }

    let stage = |what: &str| stages.say(format!("after the chains: {what}"));
    let mut result = pool(&chains, &data, &settings, seconds, &stage);
    if let Some(path) = &command.trace {
        stage("the trace");
        let traces: Vec<&Trace> = chains.iter().map(|chain| &chain.trace).collect();
        table::trace_table(&traces).write_parquet(path)?;
    }
    let outcomes: Vec<ChainOutcome> = chains.into_iter().map(|chain| chain.outcome).collect();
    if let Some(folder) = &command.map {
        stage("the maps");
        write_maps(folder, &result, &data, &settings, &file_name(&command.file))?;
    }
    if let Some(path) = &figure {
        stage("the picture");
        let title = file_name(&command.file);
        let words = settings_words(&settings);
        if let Some(png) = report::sample_figure(&outcomes, &data, title, words) {
            write_output(path, &png)?;
        }
    }
    drop(stages);
    if !arguments.quiet && !to_stdout {
        out!("{}", summary(&result, &outcomes, &data, &command.file));
        if let Some(path) = &figure {
            outln!("picture     {}", path.display());
        }
        if let Some(folder) = &command.map {
            outln!("maps        {}", folder.display());
        }
    }
    if let Some(path) = &command.json {
        let by_labels = (MAX_LABELS / data.detections.len().max(1)).max(1);
        let most = command.top.unwrap_or(by_labels);
        let n_topologies = result.n_topologies;
        if command.top.is_none() && n_topologies > most {
            say(
                arguments,
                &format!(
                    "{}: the {most} topologies sampled most of {n_topologies}; --top \
                     {n_topologies} writes all",
                    path.display()
                ),
            );
        }
        result.topologies.truncate(most);
        write_json(path, &result)?;
    }
    Ok(Exit::Done)
}

/// What chains that run until they have converged came to when they were looked at.
fn look_line(n_steps: u64, found: Judgement, elapsed: Duration) -> String {
    let verdict = if found.has_converged {
        "converged"
    } else {
        "not yet"
    };
    let judged = match (found.r_hat, found.ess) {
        (Some(r_hat), Some(ess)) => format!("R-hat at most {r_hat:.3}, ESS at least {ess:.0}"),
        (Some(r_hat), None) => format!("R-hat of M {r_hat:.3}"),
        // Nothing is material, or what is has no R-hat: the summary says which.
        _ => "no R-hat".to_owned(),
    };
    let seconds = elapsed.as_secs_f64();
    format!("{n_steps} proposals a chain, {seconds:.1} s: {judged}: {verdict}")
}

/// The maps of the MAP and of the consensus topology.
fn write_maps(
    folder: &Path,
    result: &SampleResult,
    data: &DataSet,
    settings: &Settings,
    name: &str,
) -> Result<(), Failure> {
    let model = data.model(settings)?;
    let positions_m = data.detections.positions_m();
    let drawn = result.topologies.iter();
    let draws: Vec<(&Topology, u64)> = drawn.map(|row| (&row.topology, row.count)).collect();
    for (kind, stem, words) in MAPS {
        let Some(estimate) = result.estimates.iter().find(|e| e.kind == kind) else {
            continue;
        };
        let topology = Topology::canonical(&estimate.labels);
        let map = PosteriorMap::new(&topology, &positions_m, &model, &draws);
        let write = |extension: &str, bytes: &[u8]| {
            write_output(&folder.join(format!("{stem}.{extension}")), bytes)
        };
        let title = format!("{name}, {words}: M = {}", map.nodes.len());
        let page = report::map_figure(&map, data, title.clone());
        write("png", &page.png())?;
        write("svg", page.svg(&title).as_bytes())?;
        for format in MapFormat::ALL {
            write(format.extension(), format.text(&map, name).as_bytes())?;
        }
    }
    Ok(())
}

fn figure_path(command: &SampleCommand, to_stdout: bool) -> Option<PathBuf> {
    if command.figure.is_some() || to_stdout {
        return command.figure.clone();
    }
    let stem = command
        .file
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    Some(PathBuf::from(format!("{stem}-sample.png")))
}

fn file_name(path: &std::path::Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn settings_words(settings: &Settings) -> String {
    let faults = settings.faults();
    let incorrect = if faults.is_empty() {
        String::new()
    } else {
        format!("INCORRECT: {}. ", faults.join("; "))
    };
    let locations = if settings.is_idle("importance_samples") {
        "explicit locations".to_owned()
    } else {
        format!("R {}", settings.get("importance_samples"))
    };
    format!(
        "{incorrect}σₒ {} m, σₜ {} m, radius {} m, height {} nats, {locations}, init {}",
        settings.get("sigma_o"),
        settings.get("sigma_t"),
        settings.get("penalty_radius"),
        settings.get("penalty_height"),
        settings.get("init")
    )
}

/// What a person wants to know first, within a terminal's width.
fn summary(
    result: &SampleResult,
    outcomes: &[ChainOutcome],
    data: &DataSet,
    file: &std::path::Path,
) -> String {
    let mut lines = Vec::new();
    let n_steps = outcomes.first().map_or(0, |outcome| outcome.n_steps);
    lines.push(format!(
        "{}: {} detections, {} chains of {n_steps} proposals",
        file_name(file),
        data.detections.len(),
        outcomes.len(),
    ));
    lines.push(format!(
        "time        {:.2} s, {:.0} proposals/s",
        result.seconds, result.proposals_per_second
    ));
    for fault in &result.incorrect {
        lines.push(format!("INCORRECT   {fault}"));
    }
    for (number, outcome) in outcomes.iter().enumerate().take(4) {
        let rates = outcome.moves.iter().map(|row| {
            let rate = 100.0 * row.accepted as f64 / row.proposed as f64;
            format!("{} {rate:.2} %", row.kind)
        });
        let burn_in = match outcome.burn_in {
            Some(n) => format!("burn-in {n}"),
            None => format!("no burn-in: {}", outcome.burn_in_reason),
        };
        let rates: Vec<String> = rates.collect();
        lines.push(format!(
            "chain {:<5} accepted {:.2} %, {burn_in} ({})",
            number + 1,
            100.0 * outcome.acceptance_rate,
            rates.join(", ")
        ));
        if let Some(ladder) = &outcome.tempering {
            lines.push(ladder_line(ladder));
        }
    }
    if outcomes.len() > 4 {
        lines.push(format!(
            "            … and {} more chains",
            outcomes.len() - 4
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
    if let Some(importance) = &result.importance {
        let tail = match importance.pareto_k {
            Some(k) if k > MAX_PARETO_K => format!("; Pareto k {k:.2}: NOT to be trusted"),
            Some(k) => format!("; Pareto k {k:.2}"),
            None => String::new(),
        };
        lines.push(format!(
            "importance  R = {} samples count as {:.1} at the MAP topology{tail}",
            result.settings["importance_samples"], importance.effective_samples
        ));
    }
    lines.extend(convergence_lines(result.convergence.as_ref()));
    lines.extend(estimate_lines(&result.estimates));
    lines.extend(answers_line(&result.representatives));
    if let Some(truth) = &data.truth {
        let recovered = outcomes
            .iter()
            .filter(|outcome| outcome.recovered == Some(true))
            .count();
        let mass =
            outcomes.iter().filter_map(|o| o.truth_mass).sum::<f64>() / outcomes.len() as f64;
        lines.push(format!(
            "truth       {} landmarks; the MAP topology of {recovered} of {} chains, {:.1} % of draws",
            truth.n_landmarks(),
            outcomes.len(),
            100.0 * mass
        ));
    }
    if result.truncated {
        lines.push(
            "truncated   the table of topologies was full; the rarest were dropped".to_owned(),
        );
    }
    fitted(lines)
}

/// How a chain's ladder of temperatures did.
fn ladder_line(ladder: &TemperingOutcome) -> String {
    let rejected = || ladder.rejected.iter().map(|share| 100.0 * share);
    format!(
        "            {} rungs, {} round trips, swaps rejected {:.0} to {:.0} %, barrier {:.1}",
        ladder.inverse_temperatures.len(),
        ladder.round_trips,
        rejected().fold(f64::INFINITY, f64::min),
        rejected().fold(0.0, f64::max),
        ladder.barrier
    )
}
