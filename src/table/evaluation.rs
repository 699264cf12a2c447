//! The tables of an evaluation: one row per data set and method, one per bin of pair probability.

use super::{Table, Values};
use crate::diagnostics::calibration::Bin;
use crate::results::evaluation::{Evaluated, Evaluation, Score};

/// One row for each data set and method.
pub fn scores_table(evaluation: &Evaluation) -> Table {
    let sets = evaluation.data_sets.iter();
    let rows: Vec<(&Evaluated, &Score)> = sets
        .flat_map(|set| set.scores.iter().map(move |score| (set, score)))
        .collect();
    let mut table = Table::default();
    let mut texts = |name: &str, value: &dyn Fn(&(&Evaluated, &Score)) -> Option<String>| {
        table.push(name, Values::Texts(rows.iter().map(value).collect()));
    };
    texts("data", &|(set, _)| Some(set.name.clone()));
    texts("method", &|(_, score)| Some(score.method.to_owned()));
    texts("convergence", &|(set, _)| {
        set.convergence.map(str::to_owned)
    });
    let told = rows.iter().map(|(_, score)| Some(score.uses_truth));
    table.push("uses_truth", Values::Flags(told.collect()));
    type Number = fn(&Evaluated, &Score) -> Option<f64>;
    let numbers: [(&str, Number); 13] = [
        ("n_detections", |set, _| Some(set.n_detections as f64)),
        ("n_known", |_, score| Some(score.truth.n_known as f64)),
        ("n_landmarks", |set, _| Some(set.n_landmarks as f64)),
        ("n_sets_error", |_, score| {
            Some(score.truth.n_sets_error as f64)
        }),
        ("adjusted_rand_index", |_, score| {
            Some(score.truth.adjusted_rand_index)
        }),
        ("pair_precision", |_, score| score.truth.pair_precision),
        ("pair_recall", |_, score| score.truth.pair_recall),
        ("variation_of_information", |_, score| {
            Some(score.truth.variation_of_information)
        }),
        ("homogeneity", |_, score| Some(score.truth.homogeneity)),
        ("completeness", |_, score| Some(score.truth.completeness)),
        ("v_measure", |_, score| Some(score.truth.v_measure)),
        ("recovered", |_, score| {
            Some(f64::from(u8::from(score.truth.recovered)))
        }),
        ("distance_m", |_, score| score.distance_m),
    ];
    for (name, value) in numbers {
        let values = rows.iter().map(|(set, score)| value(set, score));
        table.push(name, Values::Numbers(values.collect()));
    }
    table
}

/// One row for each bin of probability, before and after recalibration.
pub fn reliability_table(evaluation: &Evaluation) -> Table {
    let after = evaluation.after.iter().flat_map(|found| &found.bins);
    let before = evaluation.before.bins.iter();
    let rows: Vec<(&str, &Bin)> = before
        .map(|bin| ("sampled", bin))
        .chain(after.map(|bin| ("recalibrated", bin)))
        .collect();
    let mut table = Table::default();
    let names = rows.iter().map(|(name, _)| Some((*name).to_owned()));
    table.push("probabilities", Values::Texts(names.collect()));
    type Number = fn(&Bin) -> Option<f64>;
    let numbers: [(&str, Number); 6] = [
        ("low", |bin| Some(bin.low)),
        ("high", |bin| Some(bin.high)),
        ("mean_probability", |bin| Some(bin.mean_probability)),
        ("share", |bin| Some(bin.share)),
        ("band_low", |bin| bin.band.map(|band| band.0)),
        ("band_high", |bin| bin.band.map(|band| band.1)),
    ];
    for (name, value) in numbers {
        let values = rows.iter().map(|(_, bin)| value(bin));
        table.push(name, Values::Numbers(values.collect()));
    }
    for (name, value) in [
        ("n_pairs", (|bin| bin.n_pairs as u64) as fn(&Bin) -> u64),
        ("n_windows", |bin| bin.n_windows as u64),
    ] {
        let values = rows.iter().map(|(_, bin)| Some(value(bin)));
        table.push(name, Values::Counts(values.collect()));
    }
    let inside = rows.iter().map(|(_, bin)| bin.is_inside());
    table.push("inside", Values::Flags(inside.collect()));
    table
}
