//! What `ptm evaluate` found: the posterior's estimates on data of known truth beside plain
//! clusterings of the same detections, and whether the pair probabilities are right.

use rand::Rng;
use serde::Serialize;

use super::estimates::AgainstTruth;
use super::sample::{CoClustering, SampleResult};
use crate::baseline;
use crate::dataset::DataSet;
use crate::diagnostics::calibration::{Bin, Pair, brier_score, recalibrated, reliability};
use crate::diagnostics::recovery::Truth;
use crate::partition::Topology;

/// Share of a landmark's detections that nearest-neighbour gating is to let through.
pub const GATE_PROBABILITY: f64 = 0.99;
/// Distances tried for a baseline that is tuned on the truth: so many quantiles of those between pairs.
const MOST_TRIED: usize = 400;

/// One clustering of one data set against the truth.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// `map`, `binder`, `vi`, `gate`, `dbscan-tuned`, `gate-tuned`, `ward-true-number` or
    /// `nearest-true-centroid`.
    pub method: &'static str,
    /// Whether it knows something of the truth. Then it is a bound, and no method to use.
    pub uses_truth: bool,
    /// The distance it was tuned to, m.
    pub distance_m: Option<f64>,
    /// Against the truth.
    pub truth: AgainstTruth,
}

/// One data set.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluated {
    /// Its name.
    pub name: String,
    /// N.
    pub n_detections: usize,
    /// Landmarks of known truth.
    pub n_landmarks: usize,
    /// Whether the chains converged: `mixes`, `at-rest` or `not-shown`; `None` if no chain could be looked at.
    pub convergence: Option<&'static str>,
    /// The posterior's estimates, then the baselines.
    pub scores: Vec<Score>,
    /// Pairs of known truth with their probabilities.
    #[serde(skip)]
    pub pairs: Vec<Pair>,
}

/// How good pair probabilities are.
#[derive(Clone, Debug, Serialize)]
pub struct Reliability {
    /// Mean squared error of the probabilities.
    pub brier_score: Option<f64>,
    /// By probability.
    pub bins: Vec<Bin>,
}

/// All data sets.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// Each by itself.
    pub data_sets: Vec<Evaluated>,
    /// Pair probabilities of all.
    pub before: Reliability,
    /// The same, each data set recalibrated by the others; `None` for a single one.
    pub after: Option<Reliability>,
}

/// Scores a sample; `None` where no truth is known.
pub fn evaluate(name: &str, data: &DataSet, sample: &SampleResult) -> Option<Evaluated> {
    let truth = data.truth.as_ref()?;
    let estimates = sample.estimates.iter().filter_map(|estimate| {
        Some(Score {
            method: estimate.kind,
            uses_truth: false,
            distance_m: None,
            truth: estimate.truth?,
        })
    });
    let mut scores: Vec<Score> = estimates.collect();
    scores.extend(baselines(data, truth));
    Some(Evaluated {
        name: name.to_owned(),
        n_detections: data.detections.len(),
        n_landmarks: truth.n_landmarks(),
        convergence: sample.convergence.as_ref().map(|found| found.verdict),
        scores,
        pairs: pairs(data, sample),
    })
}

/// Puts data sets together.
pub fn together(data_sets: Vec<Evaluated>, rng: &mut impl Rng) -> Evaluation {
    let windows: Vec<Vec<Pair>> = data_sets.iter().map(|set| set.pairs.clone()).collect();
    let mut of = |windows: &[Vec<Pair>]| Reliability {
        brier_score: brier_score(windows),
        bins: reliability(windows, rng),
    };
    Evaluation {
        before: of(&windows),
        after: recalibrated(&windows).map(|windows| of(&windows)),
        data_sets,
    }
}

/// Plain clusterings of the same detections.
pub fn baselines(data: &DataSet, truth: &Truth) -> Vec<Score> {
    let positions_m = data.detections.positions_m();
    let score = |method, uses_truth, distance_m, topology: &Topology| Score {
        method,
        uses_truth,
        distance_m,
        truth: AgainstTruth::new(truth, topology),
    };
    let mut found = Vec::new();
    if let Some(topology) = baseline::gate(&data.detections, GATE_PROBABILITY) {
        found.push(score("gate", false, None, &topology));
    }
    let distances = distances_to_try(&positions_m);
    let best = |cluster: fn(&[[f64; 2]], f64) -> Topology| {
        let tried = distances.iter().map(|&d| (d, cluster(&positions_m, d)));
        tried
            .filter_map(|(d, topology)| {
                let index = truth.adjusted_rand_index(&topology)?;
                Some((index, d, topology))
            })
            // Of equals the smallest distance.
            .reduce(|best, next| if next.0 > best.0 { next } else { best })
    };
    for (method, cluster) in [
        (
            "dbscan-tuned",
            baseline::dbscan as fn(&[[f64; 2]], f64) -> _,
        ),
        ("gate-tuned", baseline::gate_by_distance),
    ] {
        if let Some((_, distance_m, topology)) = best(cluster) {
            found.push(score(method, true, Some(distance_m), &topology));
        }
    }
    let ward = baseline::ward(&positions_m, truth.n_landmarks());
    found.push(score("ward-true-number", true, None, &ward));
    let centroids = centroids_m(data);
    let nearest = baseline::nearest_place(&positions_m, &centroids);
    found.push(score("nearest-true-centroid", true, None, &nearest));
    found
}

/// Half-way between neighbouring distances of pairs, or at so many quantiles of them.
fn distances_to_try(positions_m: &[[f64; 2]]) -> Vec<f64> {
    let all = baseline::pair_distances_m(positions_m);
    let between: Vec<f64> = all
        .windows(2)
        .map(|pair| (pair[0] + pair[1]) / 2.0)
        .collect();
    let lowest = all.first().map(|d| d / 2.0);
    let every = between.len().div_ceil(MOST_TRIED).max(1);
    // Small distances decide: they are all tried.
    let dense = between.iter().take(MOST_TRIED);
    let sparse = between.iter().skip(MOST_TRIED).step_by(every);
    lowest
        .into_iter()
        .chain(dense.chain(sparse).copied())
        .collect()
}

/// The mean of the detections of each true landmark, m.
fn centroids_m(data: &DataSet) -> Vec<[f64; 2]> {
    let mut sums = std::collections::BTreeMap::new();
    for row in &data.detections {
        if let Some(landmark) = row.landmark {
            let (sum, n) = sums.entry(landmark).or_insert(([0.0; 2], 0.0));
            sum[0] += row.position_m[0];
            sum[1] += row.position_m[1];
            *n += 1.0;
        }
    }
    sums.into_values()
        .map(|(sum, n)| sum.map(|v| v / n))
        .collect()
}

/// Pairs whose truth is known, each with its probability.
fn pairs(data: &DataSet, sample: &SampleResult) -> Vec<Pair> {
    let landmarks = data.detections.truth();
    let mut found = Vec::new();
    let mut add = |i: usize, j: usize, probability: f64| {
        if let (Some(a), Some(b)) = (landmarks[i], landmarks[j]) {
            found.push(Pair {
                probability,
                is_same: a == b,
            });
        }
    };
    match &sample.co_clustering {
        CoClustering::Dense(matrix) => {
            for (i, row) in matrix.iter().enumerate() {
                for (j, &p) in row.iter().enumerate().skip(i + 1) {
                    add(i, j, p);
                }
            }
        }
        CoClustering::Sparse(list) => {
            // What is not listed is as good as 0.
            let listed: std::collections::HashMap<(usize, usize), f64> =
                list.iter().map(|&(i, j, p)| ((i, j), p)).collect();
            for i in 0..landmarks.len() {
                for j in i + 1..landmarks.len() {
                    add(i, j, listed.get(&(i, j)).copied().unwrap_or(0.0));
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::{Detection, Detections};

    #[test]
    fn baselines_are_scored_and_those_that_know_the_truth_say_so() {
        // Two landmarks of two detections 1 m apart and 4 m between, and one of unknown truth.
        let at = |x: f64, landmark| Detection {
            landmark,
            ..Detection::at(x, 0.0)
        };
        let rows = vec![
            at(0.0, Some(1)),
            at(1.0, Some(1)),
            at(5.0, Some(2)),
            at(6.0, Some(2)),
            at(5.5, None),
        ];
        let data = DataSet::new(Detections::new(rows).expect("good"), None);
        let truth = data.truth.as_ref().expect("known");
        let found = baselines(&data, truth);
        let names: Vec<_> = found.iter().map(|score| score.method).collect();
        // No covariances, so no gate of stated width.
        let expected = [
            "dbscan-tuned",
            "gate-tuned",
            "ward-true-number",
            "nearest-true-centroid",
        ];
        assert_eq!(names, expected);
        for score in &found {
            assert!(score.uses_truth && score.truth.recovered, "{score:?}");
            assert_eq!((score.truth.n_known, score.truth.n_sets_error), (4, 0));
        }
        let distance = found[0].distance_m.expect("tuned");
        assert!((1.0..4.0).contains(&distance), "{distance}");
    }

    #[test]
    fn distances_lie_between_those_of_pairs() {
        let line: Vec<[f64; 2]> = (0..4).map(|k| [f64::from(k * k), 0.0]).collect();
        // Pairs: 1, 3, 4, 5, 8, 9.
        assert_eq!(distances_to_try(&line), [0.5, 2.0, 3.5, 4.5, 6.5, 8.5]);
        let many: Vec<[f64; 2]> = (0..60).map(|k| [f64::from(k).powf(1.5), 0.0]).collect();
        assert!(distances_to_try(&many).len() <= 2 * MOST_TRIED + 1);
    }
}
