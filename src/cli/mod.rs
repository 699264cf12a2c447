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
mod online;
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
mod watch;

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};

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
            Some(Command::Man { ref folder }) => man(folder, &arguments),
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
    #[command(
        before_help = "Example: ptm sweep sweeps/noisy.toml\n         runs the sweep and writes reports/noisy/index.html"
    )]
    Sweep(sweep::SweepCommand),
    /// Say what a sweep would run, and how long it would take.
    #[command(
        before_help = "Example: ptm plan sweeps/noisy.toml\n         says how many cells and chains there are, and how long they take"
    )]
    Plan(plan::PlanCommand),
    /// Write the report of a sweep again, or the pages of more cells.
    #[command(
        before_help = "Example: ptm report reports/noisy --cell c017\n         writes the report again, with the chains of one more cell"
    )]
    Report(report::ReportCommand),
    /// Say where sweeps on the same worlds differ; exit code 3 if they do.
    #[command(
        before_help = "Example: ptm compare reports/before reports/after --page compared.html\n         shows where two sweeps differ"
    )]
    Compare(compare::CompareCommand),
    /// Put the parts of a sweep together that were run as shards, and write its report.
    #[command(
        before_help = "Example: ptm merge reports/noisy\n         puts the shards of reports/noisy together"
    )]
    Merge(merge::MergeCommand),
    /// Run a sweep as an array of shards, on Slurm or Kubernetes.
    #[command(
        before_help = "Example: ptm submit sweeps/noisy.toml --slurm --shards 20\n         runs the sweep as an array of 20 jobs"
    )]
    Submit(submit::SubmitCommand),
    /// Write the draws of a sweep's chains for ArviZ, or as a table.
    #[command(
        before_help = "Example: ptm export reports/noisy --cell c017 --out c017.json\n         writes the draws of one cell for ArviZ"
    )]
    Export(export::ExportCommand),
    /// Sample the topologies of one detections CSV.
    #[command(
        before_help = "Example: ptm sample detections.csv --json result.json\n         samples topologies and says whether the chains converged"
    )]
    Sample(sample::SampleCommand),
    /// Recommend settings for detections of unknown truth.
    #[command(
        before_help = "Example: ptm tune detections.csv\n         recommends settings for detections of unknown truth"
    )]
    Tune(tune::TuneCommand),
    /// Judge chains of label vectors that another program drew.
    #[command(
        before_help = "Example: ptm diagnose chains.csv --page verdict.html\n         judges chains that another program drew"
    )]
    Diagnose(diagnose::DiagnoseCommand),
    /// Score the posterior of detections of known truth beside plain clusterings.
    #[command(
        before_help = "Example: ptm evaluate a.csv b.csv --out evaluation\n         scores the posterior beside plain clusterings"
    )]
    Evaluate(evaluate::EvaluateCommand),
    /// The exact posterior of a few detections, by enumeration. Up to ten; the more of them crowd within
    /// the penalty radius, the fewer are in reach.
    #[command(
        before_help = "Example: ptm exact few.csv --json exact.json\n         computes the posterior of up to ten detections exactly"
    )]
    Exact(exact::ExactCommand),
    /// Simulate a mission in a polygonal world and write its detections.
    #[command(
        before_help = "Example: ptm simulate --noise 0.5 --seed 7 --out detections.csv\n         simulates one noisy mission"
    )]
    Simulate(simulate::SimulateCommand),
    /// Track a recording into detections.
    #[command(
        before_help = "Example: ptm import MRCLAM_Dataset6 --robot 1 --out detections.csv\n         tracks a recording into detections"
    )]
    Import(import::ImportCommand),
    /// Solve a whole mission: which sightings are of one landmark, poses and map, as a graph.
    #[command(
        before_help = "Example: ptm solve graph.g2o --out solved\n         finds poses, landmarks and association of a mission"
    )]
    Solve(solve::SolveCommand),
    /// Print completions for a shell.
    #[command(
        before_help = "Example: ptm completions bash > /etc/bash_completion.d/ptm\n         \
        completes commands and flags in new shells"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write man pages: ptm.1, and one for each command.
    #[command(before_help = "Example: ptm man /usr/local/share/man/man1\n         \
        writes ptm.1, ptm-sweep.1 and so on")]
    Man {
        /// The folder for the pages; it is made if it is missing.
        folder: PathBuf,
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

/// Writes the man page of the program and of each command.
fn man(folder: &Path, arguments: &Arguments) -> Result<Exit, Failure> {
    make_folder(folder)?;
    let program = Arguments::command().version(env!("CARGO_PKG_VERSION"));
    let mut pages = vec![("ptm".to_owned(), program.clone())];
    for command in program
        .get_subcommands()
        .filter(|own| own.get_name() != "help")
    {
        let name = format!("ptm-{}", command.get_name());
        let version = env!("CARGO_PKG_VERSION");
        let bin_name = format!("ptm {}", command.get_name());
        let page = command.clone().version(version).bin_name(bin_name);
        pages.push((name.clone(), page.name(name).disable_version_flag(true)));
    }
    let n = pages.len();
    for (name, command) in pages {
        let mut text = Vec::new();
        let rendered = clap_mangen::Man::new(command).render(&mut text);
        rendered.expect("memory takes every page");
        write_output(&folder.join(format!("{name}.1")), &text)?;
    }
    if !arguments.quiet {
        outln!("{n} man pages in {}", folder.display());
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every command opens its help with an example, and each is a command line that the program
    /// takes.
    #[test]
    fn every_command_opens_with_an_example_that_it_takes() {
        let program = Arguments::command();
        let commands = program.get_subcommands();
        let mut n_tried = 0;
        for command in commands.filter(|own| own.get_name() != "help") {
            let name = command.get_name();
            let before = command.get_before_help().map(ToString::to_string);
            let before = before.unwrap_or_default();
            let example = before
                .lines()
                .next()
                .and_then(|line| line.strip_prefix("Example: "));
            let example = example.unwrap_or_else(|| panic!("{name} has no example"));
            let words = example.split_whitespace().take_while(|word| *word != ">");
            let parsed = Arguments::try_parse_from(words);
            assert!(
                parsed.is_ok(),
                "{example}: {}",
                parsed.err().map_or_else(String::new, |e| e.to_string())
            );
            n_tried += 1;
        }
        assert!(n_tried > 15, "{n_tried}");
    }
}
