//! `ptm exact`: the posterior of a few detections by enumeration.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use topometric::dataset::DataSet;
use topometric::diagnostics::pareto::MAX_PARETO_K;
use topometric::exact::{self, ExactSettings, MAX_DETECTIONS, MAX_DETECTIONS_LARGE};
use topometric::files::text_of;
use topometric::partition::count;
use topometric::results::exact::{ExactResult, MAX_SHOWN_ERROR, exact_result};
use topometric::run::exact_purpose;
use topometric::settings::Value;

use super::settings::{MODEL, SettingsFlags};
use super::{Arguments, Exit, Failure, check_outputs, say, write_json};

/// Arguments of `ptm exact`.
#[derive(Debug, Args)]
pub struct ExactCommand {
    /// The detections: x,y and optionally covariances, times, corner and landmark.
    file: PathBuf,
    /// Write the result as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Total variation to which the whole table is wanted.
    #[arg(long, value_name = "TV", default_value_t = ExactSettings::default().tolerance)]
    tolerance: f64,
    /// Draws of locations at most; if they do not do, the result says so.
    #[arg(long, value_name = "N", default_value_t = ExactSettings::default().max_draws)]
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
    for (flag, value) in [
        ("tolerance", command.tolerance),
        ("max-draws", command.max_draws),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Failure::usage(format!(
                "--{flag}: got {value}, expected a number > 0"
            )));
        }
    }
    let data = DataSet::load(&settings, 0)?;
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
    let posterior = exact::posterior(&model, settings.prior(), &how, &purpose);
    let seconds = started.elapsed().as_secs_f64();
    let result = exact_result(&posterior, &settings, &how);
    if !result.accuracy.reached {
        say(
            arguments,
            &format!(
                "the table is known to a total variation of {:.1e}, not {}; raise --max-draws",
                result.accuracy.total_variation, how.tolerance
            ),
        );
    }
    if !arguments.quiet && !to_stdout {
        out!("{}", summary(&result, &command.file, seconds));
    }
    if let Some(path) = &command.json {
        write_json(path, &result)?;
    }
    Ok(Exit::Done)
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
            result.co_clustering.len(),
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
        format!(
            "sets M      {:.3} on average",
            result.expected_number_of_sets
        ),
    ];
    if accuracy.total_variation > MAX_SHOWN_ERROR {
        lines.push(
            "topologies  not known well enough to be shown: what the draws missed may hold most of the\n            \
             probability; raise --max-draws, or use ptm sample"
                .to_owned(),
        );
        return lines.into_iter().map(|line| line + "\n").collect();
    }
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
        lines.push(format!(
            "  {:>2}  {:>6.2} %  M = {n_sets:<3} {}{doubt}",
            rank + 1,
            100.0 * row.probability,
            labels.join(",")
        ));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}
