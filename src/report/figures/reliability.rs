//! Pair probabilities against how often they came true.

use crate::figure::reliability::{ReliabilityPanel, ReliabilityPlot, ReliabilityPoint};
use crate::figure::scene::Scene;
use crate::results::evaluation::{Evaluation, Reliability};

/// The reliability plot of an evaluation: as sampled, and recalibrated on other data sets.
pub fn reliability_figure(evaluation: &Evaluation) -> Scene {
    let n = evaluation.data_sets.len();
    let mut panels = vec![panel("As sampled", &evaluation.before, n)];
    if let Some(after) = &evaluation.after {
        panels.push(panel("Each recalibrated by the others", after, n));
    }
    let width_px = if panels.len() > 1 { 1600 } else { 900 };
    ReliabilityPlot { panels }.page(width_px, 860)
}

fn panel(title: &str, found: &Reliability, n_data_sets: usize) -> ReliabilityPanel {
    let n_pairs: usize = found.bins.iter().map(|bin| bin.n_pairs).sum();
    let brier = found.brier_score;
    let brier = brier.map_or_else(String::new, |score| format!("; Brier score {score:.4}"));
    ReliabilityPanel {
        title: title.to_owned(),
        note: format!(
            "{n_pairs} pairs of {n_data_sets} data sets{brier}. Grey: where 95 % of shares lie if p is right, by \
             bootstrap over data sets; orange: outside. Numbers: pairs."
        ),
        points: found
            .bins
            .iter()
            .map(|bin| ReliabilityPoint {
                probability: bin.mean_probability,
                share: bin.share,
                band: bin.band,
                n_pairs: bin.n_pairs,
            })
            .collect(),
    }
}
