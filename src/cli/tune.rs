//! `ptm tune`: settings for detections without truth.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::dataset::DataError;
use crate::detections::{Detections, DetectionsError};
use crate::input::Source;
use crate::tune::rule::{ModelKind, Tuned};
use crate::tune::{Estimated, Request, Tuning, tune};
use clap::Args;

use super::numbers::{count, number};
use super::progress::reading;
use super::{Arguments, Exit, Failure, check_outputs, say_notes, write_json};

/// Arguments of `ptm tune`.
#[derive(Debug, Args)]
#[command(after_help = "\
Only positions and times are looked at, never the column landmark. Two routes are compared: a normalised \
likelihood of the detections, whose settings are recommended, and simulated worlds that resemble them. \
docs/tune.md says what is normalised and why, and how well it does.")]
pub struct TuneCommand {
    /// The detections: x,y and optionally times.
    file: PathBuf,
    /// The model that settings are wanted for: metric, or covariance, which takes the stated covariances as they are
    /// but for one factor.
    #[arg(long, value_name = "MODEL", default_value = "metric", value_parser = model)]
    model: ModelKind,
    /// What a single detection errs by at least, m [default: half of the surest covariance].
    #[arg(long, value_name = "M", value_parser = number, allow_negative_numbers = true)]
    sensor_noise: Option<f64>,
    /// Leave the simulated worlds out: faster, but nothing to compare with.
    #[arg(long)]
    no_simulation: bool,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", value_parser = count::<u64>(0, u64::MAX), default_value_t = 1)]
    seed: u64,
    /// Write all of it as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
}

fn model(text: &str) -> Result<ModelKind, String> {
    let kinds = [ModelKind::Metric, ModelKind::Covariance];
    let found = kinds.into_iter().find(|kind| kind.name() == text);
    found.ok_or_else(|| "expected metric or covariance".to_owned())
}

/// Runs it.
pub fn run(command: &TuneCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    if let Some(noise) = command
        .sensor_noise
        .filter(|noise| !(noise.is_finite() && *noise > 0.0))
    {
        return Err(Failure::usage(format!(
            "--sensor-noise: got {noise}, expected a number of metres > 0"
        )));
    }
    let to_stdout = command.json.as_deref() == Some(Path::new("-"));
    if let Some(path) = command.json.as_ref().filter(|_| !to_stdout) {
        check_outputs(Some(&command.file), &[path])?;
    }
    let watch = reading(&command.file, arguments.quiet);
    let source = Source::open_watched(&command.file, watch).map_err(DetectionsError::from);
    let read = source.and_then(Detections::from_source);
    let (detections, notes) = read.map_err(DataError::from)?;
    say_notes(&notes, &command.file, arguments);
    let started = Instant::now();
    let request = Request {
        model: command.model,
        sensor_noise_m: command.sensor_noise,
        simulate: !command.no_simulation,
        seed: command.seed,
    };
    let found = tune(&detections, &request)
        .map_err(|error| Failure::data(format!("{}: {error}", command.file.display())))?;
    if !arguments.quiet && !to_stdout {
        out!("{}", summary(&found, &command.file, detections.len()));
        outln!("time        {:.1} s", started.elapsed().as_secs_f64());
    }
    if let Some(path) = &command.json {
        write_json(path, &found)?;
    }
    Ok(Exit::Done)
}

/// Settings as flags.
fn flags(model: ModelKind, s: &Tuned) -> String {
    let model = match model {
        ModelKind::Metric => "",
        ModelKind::Covariance => "--model covariance ",
    };
    format!(
        "{model}--sigma-o {:.4} --sigma-t {:.4} --penalty-radius {:.4} --penalty-height {:.1}",
        s.sigma_o, s.sigma_t, s.penalty_radius, s.penalty_height
    )
}

fn summary(found: &Tuning, file: &Path, n_detections: usize) -> String {
    let within = |e: &Estimated, digits: usize| {
        format!("{:.digits$} ({})", e.value, ends(e, digits, "all draws"))
    };
    let unit = found.model.unit();
    let mut lines = vec![
        format!(
            "{}: {n_detections} detections; medians with 95 % intervals",
            file.display()
        ),
        match found.model {
            ModelKind::Metric => {
                format!(
                    "noise       {} m per axis about its landmark",
                    within(&found.noise, 3)
                )
            }
            ModelKind::Covariance => {
                format!(
                    "noise       {} times what is stated (sd)",
                    within(&found.noise, 3)
                )
            }
        },
        format!("landmarks   {}", within(&found.n_landmarks, 0)),
    ];
    lines.push(match found.apart {
        Some(apart) => {
            format!("apart       99 % of pairs seen at once are more than {apart:.2} {unit} apart")
        }
        None => "apart       not known: too few detections were seen at once".to_owned(),
    });
    lines.push(format!(
        "merge       pairs up to {:.2} {unit}; {:.0} % of those of one landmark lie farther apart",
        found.merge,
        100.0 * found.missed_share
    ));
    lines.push(format!(
        "expected    Rand index {:.2} of the map by these settings, if the likelihood is right",
        found.expected_rand_index
    ));
    let names = ["sigma-o", "sigma-t", "radius", "height"];
    let s = &found.settings;
    let values = [s.sigma_o, s.sigma_t, s.penalty_radius, s.penalty_height];
    for ((name, value), e) in names.iter().zip(values).zip(&found.intervals) {
        // σ's of the covariance model have no unit: they multiply standard deviations.
        let unit = match (*name, found.model) {
            ("height", _) => "nats",
            ("radius", _) | (_, ModelKind::Metric) => unit,
            (_, ModelKind::Covariance) => "",
        };
        lines.push(format!(
            "{name:<11} {} ({})",
            format!("{value:.3} {unit}").trim_end(),
            ends(e, 3, "by the rule, whatever the noise")
        ));
    }
    if let Some(simulated) = &found.simulated {
        let of = |c: &crate::tune::matched::Candidate| {
            format!(
                "radius {:.2} {unit}: {} of {} recovered, Rand index {:.2}",
                c.settings.penalty_radius, c.n_recovered, c.n_worlds, c.mean_rand_index
            )
        };
        lines.push(format!(
            "simulated   worlds like these have noise {}{}",
            within(&simulated.noise, 3),
            if found.model == ModelKind::Metric {
                " m"
            } else {
                ""
            }
        ));
        lines.push(format!("  these     {}", of(&simulated.recommended)));
        lines.push(format!("  best      {}", of(&simulated.best)));
    }
    if found.doubts.is_empty() {
        lines.push("decided     yes".to_owned());
    }
    for doubt in &found.doubts {
        lines.push(format!("NOT decided {doubt}"));
    }
    let command = |word: &str, settings: &Tuned| {
        let flags = flags(found.model, settings);
        format!("{word:<11} ptm sample {} {flags}", file.display())
    };
    match &found.simulated {
        _ if found.decided => lines.push(command("use", &found.settings)),
        Some(simulated) => {
            lines.push(command("try", &found.settings));
            lines.push(command("or", &simulated.best.settings));
        }
        None => lines.push(command("try", &found.settings)),
    }
    lines.join("\n") + "\n"
}

/// "0.41 to 0.55", or in words why there is no interval.
fn ends(estimated: &Estimated, digits: usize, otherwise: &str) -> String {
    match (estimated.low, estimated.high) {
        (Some(low), Some(high)) => {
            let at = |digits: usize| [low, high].map(|end| format!("{end:.digits$}"));
            // As many digits as show that the ends differ.
            let shown = (digits..15).map(at).find(|[low, high]| low != high);
            shown.unwrap_or_else(|| at(15)).join(" to ")
        }
        _ => otherwise.to_owned(),
    }
}
