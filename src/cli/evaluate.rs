//! `ptm evaluate`: the posterior on detections of known truth, beside plain clusterings.

use std::path::{Path, PathBuf};

use crate::dataset::DataSet;
use crate::files::text_of;
use crate::job::{self, Watch};
use crate::report;
use crate::results::evaluation::{Evaluated, Evaluation, Reliability, Score, together};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::Value;
use crate::table;
use clap::Args;

use super::settings::{SAMPLING, SettingsFlags};
use super::signal::StopSignal;
use super::{
    Arguments, Exit, Failure, check_outputs, make_folder, say_notes, write_json, write_output,
};

/// Arguments of `ptm evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each file is sampled with the same settings; files are the units of every mean and of the bootstrap, so give \
one for each window of a recording or each simulated world. Methods marked * are told something of the truth: \
DBSCAN and gating by distance the distance that is best, Ward the number of landmarks, nearest the true \
centroids. They are bounds and no methods. docs/real-data.md has an example.")]
pub struct EvaluateCommand {
    /// Detections with known landmarks, one file for each window or world.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Where the tables, the figure and the JSON go: a folder, made if need be.
    #[arg(short, long, value_name = "DIR", default_value = "evaluation")]
    out: PathBuf,
    /// Take σ_o, σ_t, radius and height of each file from `ptm tune` (its likelihood), not from the flags; with
    /// --model covariance those of that model.
    #[arg(long, conflicts_with_all = ["sigma_o", "sigma_t", "penalty_radius", "penalty_height", "penalty_shape"])]
    tune: bool,
    #[command(flatten)]
    settings: SettingsFlags<SAMPLING>,
}

/// Methods in the order of the table, with the head of their column.
const COLUMNS: [(&str, &str); 7] = [
    ("map", "MAP"),
    ("vi", "VI"),
    ("gate", "gating"),
    ("dbscan-tuned", "DBSCAN*"),
    ("gate-tuned", "gating*"),
    ("ward-true-number", "Ward*"),
    ("nearest-true-centroid", "nearest*"),
];
/// Characters of a data set's name in the table.
const NAME: usize = 12;

/// Runs it.
pub fn run(command: &EvaluateCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let settings = command.settings.settings()?;
    make_folder(&command.out)?;
    let [figure, json] = ["reliability.png", "evaluation.json"].map(|file| command.out.join(file));
    check_outputs(None, &[&figure, &json])?;
    let stop = StopSignal::listen(
        (!arguments.quiet).then_some("stopped before all were done; nothing is written"),
    )?;
    let mut data_sets = Vec::new();
    for file in &command.files {
        let mut settings = settings.clone();
        settings.set("detections", &Value::Text(text_of(file)))?;
        let data = DataSet::load(&settings, 0)?;
        say_notes(&data.notes, file, arguments);
        let watch = Watch {
            stop: &stop.flag,
            ..Watch::NOBODY
        };
        let (name, settings) = (file.display().to_string(), settings.clone());
        let evaluated = job::evaluate(&name, &data, settings, command.tune, &watch)?;
        let Some(mut evaluated) = evaluated else {
            return Ok(Exit::Signal(stop.received().unwrap_or_default()));
        };
        evaluated.name = name_of(file);
        data_sets.push(evaluated);
    }
    let purpose = Purpose::new(SAMPLER_SEMANTICS, settings.count("seed"));
    let evaluation = together(
        data_sets,
        &mut purpose.text("use", "evaluation").generator(),
    );
    table::scores_table(&evaluation).write(&command.out, "scores")?;
    table::reliability_table(&evaluation).write(&command.out, "reliability")?;
    let page = report::reliability_figure(&evaluation);
    let svg = figure.with_extension("svg");
    for (path, bytes) in [
        (&figure, page.png()),
        (
            &svg,
            page.svg("Reliability of pair probabilities").into_bytes(),
        ),
    ] {
        write_output(path, &bytes)?;
    }
    write_json(&json, &evaluation)?;
    if !arguments.quiet {
        out!("{}", summary(&evaluation));
        outln!("written     {}", command.out.display());
    }
    Ok(Exit::Done)
}

fn name_of(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

fn score_of<'a>(set: &'a Evaluated, method: &str) -> Option<&'a Score> {
    set.scores.iter().find(|score| score.method == method)
}

/// Adjusted Rand index and error in the number of landmarks, a line for each data set.
fn summary(evaluation: &Evaluation) -> String {
    let mut lines = vec![String::from(
        "adjusted Rand index with the truth, and sets found − landmarks (* knows something of the truth)",
    )];
    let heads = COLUMNS.map(|(_, head)| format!("{head:>9}"));
    lines.push(format!("{:<NAME$}{:>4}{}", "data", "N", heads.concat()));
    for set in &evaluation.data_sets {
        let cells = COLUMNS.map(|(method, _)| {
            score_of(set, method).map_or_else(
                || format!("{:>9}", "–"),
                |score| {
                    let (index, error) =
                        (score.truth.adjusted_rand_index, score.truth.n_sets_error);
                    format!("{index:>6.2}{error:>+3}")
                },
            )
        });
        let name: String = set.name.chars().take(NAME - 1).collect();
        lines.push(format!(
            "{name:<NAME$}{:>4}{}",
            set.n_detections,
            cells.concat()
        ));
    }
    let means = COLUMNS.map(|(method, _)| {
        let found: Vec<&Score> = evaluation
            .data_sets
            .iter()
            .filter_map(|set| score_of(set, method))
            .collect();
        if found.is_empty() {
            return format!("{:>9}", "–");
        }
        let n = found.len() as f64;
        let index = found
            .iter()
            .map(|s| s.truth.adjusted_rand_index)
            .sum::<f64>()
            / n;
        let error = found
            .iter()
            .map(|s| s.truth.n_sets_error.unsigned_abs() as f64)
            .sum::<f64>()
            / n;
        format!("{index:>5.2}±{error:>3.1}")
    });
    lines.push(format!(
        "{:<NAME$}{:>4}{}",
        "mean, |error|",
        "",
        means.concat()
    ));
    let not_shown = evaluation.data_sets.iter();
    let not_shown = not_shown.filter(|set| !matches!(set.convergence, Some("mixes" | "at-rest")));
    lines.push(format!(
        "converged   {} of {} data sets",
        evaluation.data_sets.len() - not_shown.count(),
        evaluation.data_sets.len()
    ));
    lines.push(format!(
        "pairs       {}",
        reliability_words(&evaluation.before)
    ));
    if let Some(after) = &evaluation.after {
        lines.push(format!("recalibrated {}", reliability_words(after)));
    }
    lines.join("\n") + "\n"
}

fn reliability_words(found: &Reliability) -> String {
    let judged: Vec<bool> = found
        .bins
        .iter()
        .filter_map(|bin| bin.is_inside())
        .collect();
    let brier = found
        .brier_score
        .map_or_else(|| "none".to_owned(), |score| format!("{score:.4}"));
    format!(
        "Brier score {brier}; {} of {} bins of probability within their band",
        judged.iter().filter(|inside| **inside).count(),
        judged.len()
    )
}
