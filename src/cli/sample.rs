//! `ptm sample`: the topologies of one detections CSV.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::chain::Trace;
use crate::dataset::DataSet;
use crate::files::text_of;
use crate::job::{self, Watch};
use crate::map::{MapFormat, PosteriorMap};
use crate::partition::Topology;
use crate::report;
use crate::results::sample::SampleResult;
use crate::run::Judgement;
use crate::settings::{Settings, Value};
use crate::table;
use clap::Args;

use super::numbers::count;
use super::progress::Stages;
use super::settings::{SAMPLING, SettingsFlags};
use super::signal::StopSignal;
use super::{
    Arguments, Exit, Failure, check_outputs, make_folder, say, say_notes, terminal, write_json,
    write_output,
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
    let settings = settings.naming_sampler(data.detections.len());
    for fault in settings.faults() {
        say(arguments, &format!("INCORRECT on purpose: {fault}"));
    }
    if arguments.verbose > 0 {
        say(arguments, &settings.canonical_text(|_| true));
    }

    let stop =
        StopSignal::listen((!arguments.quiet).then_some("stopped before the chains were done"))?;
    let stages = Stages::new(arguments.quiet);
    let started = Instant::now();
    let watch = Watch {
        stage: &|what| stages.say(what),
        looks: &|n_steps, found| {
            say(arguments, &look_line(n_steps, found, started.elapsed()));
        },
        stop: &stop.flag,
    };
    let sampled = job::sample(&data, &settings, &watch)?;
    let Some(mut sampled) = sampled else {
        let what = "stopped before the chains were done; nothing is written";
        say(arguments, what);
        return Ok(Exit::Signal(stop.received().unwrap_or_default()));
    };
    let stage = |what: &str| stages.say(format!("after the chains: {what}"));
    if let Some(path) = &command.trace {
        stage("the trace");
        let traces: Vec<&Trace> = sampled.chains.iter().map(|chain| &chain.trace).collect();
        table::trace_table(&traces).write_parquet(path)?;
    }
    let result = &sampled.result;
    if let Some(folder) = &command.map {
        stage("the maps");
        write_maps(folder, result, &data, &settings, &file_name(&command.file))?;
    }
    if let Some(path) = &figure {
        stage("the picture");
        let title = file_name(&command.file);
        if let Some(page) = report::sample_figure(&sampled.outcomes(), &data, &settings, title) {
            write_output(path, &page.png())?;
        }
    }
    drop(stages);
    if !arguments.quiet && !to_stdout {
        let name = file_name(&command.file);
        out!(
            "{}",
            report::sample_summary(
                (&sampled.result, &sampled.outcomes()),
                &data,
                &name,
                terminal::width()
            )
        );
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
        let result = &mut sampled.result;
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
        write_json(path, result)?;
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
