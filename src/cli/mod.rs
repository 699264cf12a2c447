//! The program `ptm`: clap, indicatif, exit codes. The only place that prints.

#[macro_use]
mod terminal;

mod compare;
mod counting;
mod diagnose;
mod evaluate;
mod exact;
mod execution;
mod exit;
mod export;
mod import;
mod import_words;
mod memory;
mod merge;
mod numbers;
mod outputs;
mod plan;
mod progress;
mod recording;
mod report;
mod sample;
mod settings;
mod shard_run;
mod shards;
mod signal;
mod simulate;
mod solve;
mod submit;
mod sweep;
mod tune;
mod version;

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::panic::AssertUnwindSafe;
use std::path::Path;

#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;

use crate::input::Note;
use crate::run::Plan;
use crate::settings::numbers::repeated;
use clap::error::{ContextKind, ContextValue};
use clap::{ArgAction, CommandFactory, Parser, Subcommand};

pub use counting::Counting;
use exit::{Exit, Failure};
use outputs::{check_outputs, make_folder, map_beside, unwritable, write_json, write_output};

const ABOUT: &str = "Parameter sweeps and diagnostics for Probabilistic Topological Maps";
const AFTER_HELP: &str = "\
Exit codes: 0 done; 1 command line or environment must change; 2 finished, but some chains failed or
ptm exact did not reach its tolerance; 3 compare found a difference;
65 an input file's content is wrong; 70 a bug of ours; 75 try again, as when the disk was full,
another ptm is at work in the folder or chains are missing; 130 or 143 stopped by a signal,
everything a sweep has finished so far kept.";

/// Runs the program on a command line, its own name first, and returns its exit code.
pub fn run(command_line: impl Iterator<Item = OsString>) -> u8 {
    quiet_panics();
    survive_size_limit();
    let outcome = std::panic::catch_unwind(AssertUnwindSafe(|| {
        let arguments = parse(command_line)?;
        set_threads(&arguments)?;
        match arguments.command {
            None => version::print(arguments.verbose),
            Some(Command::Sweep(ref command)) => sweep::run(command, &arguments),
            Some(Command::Report(ref command)) => report::run(command, &arguments),
            Some(Command::Compare(ref command)) => compare::run(command, &arguments),
            Some(Command::Merge(ref command)) => merge::run(command, &arguments),
            Some(Command::Submit(ref command)) => submit::run(command, &arguments),
            Some(Command::Export(ref command)) => export::run(command, &arguments),
            Some(Command::Sample(ref command)) => sample::run(command, &arguments),
            Some(Command::Tune(ref command)) => tune::run(command, &arguments),
            Some(Command::Diagnose(ref command)) => diagnose::run(command, &arguments),
            Some(Command::Evaluate(ref command)) => evaluate::run(command, &arguments),
            Some(Command::Exact(ref command)) => exact::run(command, &arguments),
            Some(Command::Simulate(ref command)) => simulate::run(command, &arguments),
            Some(Command::Import(ref command)) => import::run(command, &arguments),
            Some(Command::Solve(ref command)) => solve::run(command, &arguments),
            Some(Command::Plan(ref command)) => plan::run(command, &arguments),
            Some(Command::Completions { shell }) => completions(shell),
        }
    }));
    exit::code(outcome)
}

/// What the user asked for.
#[derive(Debug, Parser)]
#[command(name = "ptm", about = ABOUT, after_help = AFTER_HELP, disable_version_flag = true)]
struct Arguments {
    /// More words on standard error.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
    /// No words but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Threads [default: one per core].
    #[arg(long, global = true, value_name = "N", value_parser = numbers::count::<usize>(1, MAX_THREADS))]
    pub threads: Option<usize>,
    /// Print the version; with -v also the CPU path and the threads.
    #[arg(short = 'V', long)]
    version: bool,
    /// The command.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The commands.
#[derive(Debug, Subcommand)]
enum Command {
    /// Run a sweep file and write its report.
    Sweep(sweep::SweepCommand),
    /// Say what a sweep would run, and how long it would take.
    Plan(plan::PlanCommand),
    /// Write the report of a sweep again, or the pages of more cells.
    Report(report::ReportCommand),
    /// Say where two sweeps on the same cells differ; exit code 3 if they do.
    Compare(compare::CompareCommand),
    /// Put the parts of a sweep together that were run as shards, and write its report.
    Merge(merge::MergeCommand),
    /// Run a sweep as an array of shards, on Slurm or Kubernetes.
    Submit(submit::SubmitCommand),
    /// Write the draws of a sweep's chains for ArviZ, or as a table.
    Export(export::ExportCommand),
    /// Sample the topologies of one detections CSV.
    Sample(sample::SampleCommand),
    /// Recommend settings for detections of unknown truth.
    Tune(tune::TuneCommand),
    /// Judge chains of label vectors that another program drew.
    Diagnose(diagnose::DiagnoseCommand),
    /// Score the posterior of detections of known truth beside plain clusterings.
    Evaluate(evaluate::EvaluateCommand),
    /// The exact posterior of a few detections, by enumeration. Up to ten; the more of them crowd within
    /// the penalty radius, the fewer are in reach.
    Exact(exact::ExactCommand),
    /// Simulate a mission in a polygonal world and write its detections.
    Simulate(simulate::SimulateCommand),
    /// Track a recording into detections.
    Import(import::ImportCommand),
    /// Solve a whole mission: which sightings are of one landmark, poses and map, as a graph.
    Solve(solve::SolveCommand),
    /// Print completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// Reads the command line; help is printed here.
fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Arguments, Failure> {
    match Arguments::try_parse_from(arguments) {
        Ok(arguments) if arguments.command.is_none() && !arguments.version => {
            out!("{}", Arguments::command().render_help());
            Err(Failure::silent(Exit::Usage))
        }
        Ok(arguments) => Ok(arguments),
        // What was asked for, as --help, goes to standard output.
        Err(error) if !error.use_stderr() => {
            out!("{}", error.render());
            Err(Failure::silent(Exit::Done))
        }
        Err(error) => {
            let message = wrong_value(&error);
            let message = message.unwrap_or_else(|| one_line(&error.render().to_string()));
            Err(Failure::usage(message))
        }
    }
}

/// A value that a flag of ours did not take, in the words of every other message.
fn wrong_value(error: &clap::Error) -> Option<String> {
    let text = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let expected = std::error::Error::source(error)?.to_string();
    let expected = expected.trim_start_matches("expected ");
    let flag = text(ContextKind::InvalidArg)?;
    let flag = flag.split([' ', '[', '=']).next().unwrap_or(flag);
    let got = repeated(text(ContextKind::InvalidValue)?);
    Some(format!("{flag}: got {got}, expected {expected}"))
}

/// clap explains over several lines; an error of ours is one. Its first paragraph says what is wrong
/// and its tips what to do; the usage that follows is what --help is for.
fn one_line(text: &str) -> String {
    let words = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut parts = text.split("\n\n").map(words);
    let first = parts.next().unwrap_or_default();
    let what = first.trim_start_matches("error: ");
    let tip = parts
        .find_map(|part| Some(part.strip_prefix("tip: ")?.replace(" tip: ", "; ")))
        .unwrap_or_else(|| "ptm --help shows what there is".to_owned());
    format!("{what}; {tip}")
}

/// More threads than any machine has cores for are a slip: starting 100,000 of them takes minutes.
const MAX_THREADS: u64 = 1024;

/// Sets the number of worker threads.
fn set_threads(arguments: &Arguments) -> Result<(), Failure> {
    let threads = arguments.threads.unwrap_or(0);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|error| {
            Failure::usage(format!(
                "--threads: the threads cannot be started ({error})"
            ))
        })
}

/// A file that reaches the limit on its size (`ulimit -f`) is a write that fails, with a message
/// and exit code 75, and not the end of the process.
fn survive_size_limit() {
    #[cfg(unix)]
    {
        let reached = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
        // Where it cannot be caught it ends the process, as it always has.
        let _ = signal_hook::flag::register(SIGXFSZ, reached);
    }
}

/// A panic in a chain is reported as that chain's failure, so the default message, with its advice
/// on backtraces, is kept for those who ask for one.
fn quiet_panics() {
    if std::env::var_os("RUST_BACKTRACE").is_none_or(|value| value == "0") {
        std::panic::set_hook(Box::new(|_| {}));
    }
}

/// Prints completions.
fn completions(shell: clap_complete::Shell) -> Result<Exit, Failure> {
    // By way of memory: the generator panics where it cannot write, as into a closed pipe.
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "ptm", &mut script);
    out!("{}", String::from_utf8_lossy(&script));
    Ok(Exit::Done)
}

/// A line to standard error, unless the user wants quiet.
fn say(arguments: &Arguments, text: &str) {
    if !arguments.quiet {
        errln!("{text}");
    }
}

/// Says what the reader of a file left out or put up with.
fn say_notes(notes: &[Note], file: &Path, arguments: &Arguments) {
    for note in notes {
        say(arguments, &format!("noted: {}: {note}", file.display()));
    }
}

/// The same for the detections of a sweep.
fn say_notes_of_plan(plan: &Plan, arguments: &Arguments) {
    let data_sets = plan.data_sets.iter().flatten();
    let notes: BTreeSet<String> = data_sets
        .flat_map(|data| data.notes.iter().map(ToString::to_string))
        .collect();
    for note in notes {
        say(arguments, &format!("noted: detections: {note}"));
    }
}
