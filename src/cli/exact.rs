//! `ptm exact`: the posterior of a few detections by enumeration.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::dataset::DataSet;
use crate::diagnostics::pareto::MAX_PARETO_K;
use crate::exact::{
    self, Ended, ExactSettings, MAX_DETECTIONS, MAX_DETECTIONS_LARGE, Posterior, Round,
};
use crate::files::text_of;
use crate::partition::count;
use crate::results::exact::{ExactResult, exact_result};
use crate::run::exact_purpose;
use crate::settings::Value;
use clap::Args;
use indicatif::HumanDuration;

use super::numbers::positive;
use super::progress::Stages;
use super::settings::{MODEL, SettingsFlags};
use super::{Arguments, Exit, Failure, check_outputs, say, say_notes, write_json};

/// Arguments of `ptm exact`.
#[derive(Debug, Args)]
pub struct ExactCommand {
    /// The detections: x,y and optionally covariances, times, corner and landmark.
    file: PathBuf,
    /// Write the result as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Total variation to which the whole table is wanted.
    #[arg(long, value_name = "TV", value_parser = positive, allow_negative_numbers = true, default_value_t = ExactSettings::default().tolerance)]
    tolerance: f64,
    /// Draws of locations at most, some ten million a second on each core; where they will not do the
    /// command stops early, says so and exits with 2.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true, default_value_t = ExactSettings::default().max_draws)]
    max_draws: f64,
    /// Take 11 or 12 detections too: minutes to hours, and gigabytes.
    #[arg(long)]
    allow_large: bool,
    #[command(flatten)]
    settings: SettingsFlags<MODEL>,
}

/// Partitions in the summary.
const N_SHOWN: usize = 8;

/// Runs it.
pub fn run(command: &ExactCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let mut settings = command.settings.settings()?;
    settings.set("detections", &Value::Text(text_of(&command.file)))?;
    let data = DataSet::load(&settings, 0)?;
    say_notes(&data.notes, &command.file, arguments);
    check_size(data.detections.len(), command)?;
    let to_stdout = command.json.as_deref() == Some(Path::new("-"));
    if let Some(path) = command.json.as_ref().filter(|_| !to_stdout) {
        check_outputs(Some(&command.file), &[path])?;
    }
    let model = data.model(&settings)?;
    let purpose = exact_purpose(&settings, &data);
    let how = ExactSettings {
        tolerance: command.tolerance,
        max_draws: command.max_draws,
    };
    let started = Instant::now();
    let stages = Stages::new(arguments.quiet);
    stages.say("first draws of every set partition");
    let mut show = |round: &Round| stages.say(round_words(round, &how, started.elapsed()));
    // A signal ends the whole program.
    let never = AtomicBool::new(false);
    let watch = exact::Watch {
        round: &mut show,
        stop: &never,
    };
    let posterior = exact::watched_posterior(&model, settings.prior(), &how, &purpose, watch);
    let posterior = posterior.expect("nobody stops it");
    drop(stages);
    let seconds = started.elapsed().as_secs_f64();
    let result = exact_result(&posterior, &settings, &how);
    if let Some(why) = not_reached(&posterior, &how, seconds) {
        say(arguments, &why);
    }
    if !arguments.quiet && !to_stdout {
        out!("{}", summary(&result, &command.file, seconds));
    }
    if let Some(path) = &command.json {
        write_json(path, &result)?;
    }
    Ok(if result.accuracy.reached {
        Exit::Done
    } else {
        Exit::SomeFailed
    })
}

/// Where a round stands: the error against the tolerance, and the time that is left.
fn round_words(round: &Round, how: &ExactSettings, elapsed: Duration) -> String {
    let (error, needed) = (round.error.total(), round.n_draws_needed.min(how.max_draws));
    let seconds =
        elapsed.as_secs_f64() * (needed - round.n_draws).max(0.0) / round.n_draws.max(1.0);
    let left = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    format!(
        "round {}: total variation {error:.1e}, wanted {}; {:.1e} draws, {} left at most",
        round.number,
        how.tolerance,
        round.n_draws,
        HumanDuration(left)
    )
}

/// Why the tolerance was not reached, and what to change; one line.
fn not_reached(posterior: &Posterior, how: &ExactSettings, seconds: f64) -> Option<String> {
    let (needed, stopped) = match posterior.ended {
        Ended::Reached => return None,
        Ended::OutOfDraws { n_draws_needed } => (n_draws_needed, "the draws are spent"),
        Ended::OutOfReach { n_draws_needed } => (n_draws_needed, "stopped early"),
    };
    let seconds = seconds * needed / posterior.n_draws.max(1.0);
    let time = HumanDuration(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    Some(format!(
        "{stopped}: the table is known to a total variation of {:.1e}, not {}, and needs about {needed:.0e} draws \
         ({time} here), where --max-draws allows {:.0e}; raise --max-draws or --tolerance, or use ptm \
         sample: detections that crowd within the penalty radius take many draws",
        posterior.error.total(),
        how.tolerance,
        how.max_draws
    ))
}

fn check_size(n: usize, command: &ExactCommand) -> Result<(), Failure> {
    let most = if command.allow_large {
        MAX_DETECTIONS_LARGE
    } else {
        MAX_DETECTIONS
    };
    if n <= most {
        return Ok(());
    }
    let bell = count::bell(n).map_or_else(|| "more than 10^38".to_owned(), |bell| bell.to_string());
    let advice = if n <= MAX_DETECTIONS_LARGE {
        "add --allow-large (11 or 12 detections), or use ptm sample"
    } else {
        "use ptm sample"
    };
    Err(Failure::usage(format!(
        "{}: got {n} detections with {bell} set partitions (the Bell number), expected at most {most} detections; {advice}",
        command.file.display()
    )))
}

/// What a person wants to know first, within a terminal's width.
fn summary(result: &ExactResult, file: &Path, seconds: f64) -> String {
    let accuracy = &result.accuracy;
    let mut lines = vec![
        format!(
            "{}: {} detections, {} set partitions",
            file.file_name().unwrap_or_default().to_string_lossy(),
            result.partitions.first().map_or(0, |row| row.labels.len()),
            result.partitions.len()
        ),
        format!("time        {seconds:.2} s, {:.2e} draws", accuracy.draws),
        format!(
            "accuracy    total variation {:.1e} ({} {})",
            accuracy.total_variation,
            if accuracy.reached {
                "below"
            } else {
                "NOT below"
            },
            accuracy.tolerance
        ),
    ];
    let Some(n_sets) = result.expected_number_of_sets else {
        lines.push(
            "topologies  not known well enough to be shown: what the draws missed may hold most of the\n            \
             probability; raise --max-draws, or use ptm sample"
                .to_owned(),
        );
        return lines.into_iter().map(|line| line + "\n").collect();
    };
    lines.push(format!("sets M      {n_sets:.3} on average"));
    lines.push("topologies  the most probable:".to_owned());
    for (rank, row) in result.partitions.iter().take(N_SHOWN).enumerate() {
        let labels: Vec<String> = row.labels.iter().map(ToString::to_string).collect();
        let n_sets = row.labels.iter().max().map_or(0, |largest| largest + 1);
        let doubt = match row.effective_draws {
            Some(effective) if !row.reliable => {
                format!("  UNRELIABLE: {effective:.0} effective draws")
            }
            _ => match row.pareto_k {
                Some(k) if k > MAX_PARETO_K => format!("  heavy weights: Pareto k {k:.2}"),
                _ => String::new(),
            },
        };
        let share = match row.probability {
            Some(probability) if row.reliable => format!("{:>6.2} %", 100.0 * probability),
            _ => "       ?".to_owned(),
        };
        lines.push(format!(
            "  {:>2}  {share}  M = {n_sets:<3} {}{doubt}",
            rank + 1,
            labels.join(",")
        ));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}
