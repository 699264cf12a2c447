//! How right a method is.

use std::collections::HashMap;
use std::fmt;

use topometric::diagnostics::agreement::adjusted_rand_index;
use topometric::mission::{fit, optimum_of};
use topometric::partition::Topology;
use topometric::sighting::Pose;

use super::data::Case;

/// The figures of one method on one case.
pub struct Score {
    rand_index: f64,
    precision: f64,
    recall: f64,
    count_error: f64,
    path_m: f64,
    chi_square: f64,
    seconds: f64,
}

impl Score {
    pub fn new(case: &Case, labels: &[u32], poses: Option<&[Pose]>, seconds: f64) -> Self {
        let [truth, found] = [&case.truth[..], labels].map(Topology::canonical);
        let n = labels.iter().max().map_or(0, |&most| most as usize + 1);
        let [both, of_truth, of_found] = pairs(&case.truth, labels);
        let path_m = poses.map(|poses| {
            let found: Vec<[f64; 2]> = poses.iter().map(|pose| pose.position_m()).collect();
            let known = case.true_path_m.clone().or_else(|| {
                let known = optimum_of(&case.graph, &case.truth).ok()?;
                Some(known.poses.iter().map(|pose| pose.position_m()).collect())
            });
            known.map_or(f64::NAN, |known| apart_m(&found, &known))
        });
        let chi_square = poses.map(|poses| {
            let fit = fit(&case.graph, poses, labels);
            fit.chi_square / fit.degrees_of_freedom as f64
        });
        Self {
            rand_index: adjusted_rand_index(&truth, &found).unwrap_or(f64::NAN),
            precision: both / of_found,
            recall: both / of_truth,
            count_error: n as f64 - case.n_landmarks() as f64,
            path_m: path_m.unwrap_or(f64::NAN),
            chi_square: chi_square.unwrap_or(f64::NAN),
            seconds,
        }
    }
}

/// Means over cases; of several also the least and greatest Rand index.
pub struct Means<'a>(&'a [Score]);

pub fn mean_of(scores: &[Score]) -> Means<'_> {
    Means(scores)
}

impl fmt::Display for Means<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A figure that is not defined on a case (no pair was found, say) is left out of the mean.
        let mean = |of: fn(&Score) -> f64| {
            let defined: Vec<f64> = self
                .0
                .iter()
                .map(of)
                .filter(|one| one.is_finite())
                .collect();
            defined.iter().sum::<f64>() / defined.len() as f64
        };
        let number = |value: f64, digits: usize| {
            if value.is_finite() {
                format!("{value:.digits$}")
            } else {
                "–".to_owned()
            }
        };
        write!(f, "{}", number(mean(|one| one.rand_index), 3))?;
        if self.0.len() > 1 {
            let each = || self.0.iter().map(|one| one.rand_index);
            let (least, most) = (each().fold(1.0, f64::min), each().fold(-1.0, f64::max));
            write!(f, " ({least:.2} to {most:.2})")?;
        }
        let rest = [
            number(mean(|one| one.precision), 3),
            number(mean(|one| one.recall), 3),
            format!("{:+.1}", mean(|one| one.count_error)),
            number(mean(|one| one.path_m), 3),
            number(mean(|one| one.chi_square), 3),
            number(mean(|one| one.seconds), 1),
        ];
        write!(f, " | {}", rest.join(" | "))
    }
}

/// Pairs that share a set in both, in the truth, in what was found.
fn pairs(truth: &[u32], found: &[u32]) -> [f64; 3] {
    let mut cells: HashMap<(u32, u32), f64> = HashMap::new();
    let mut rows: HashMap<u32, f64> = HashMap::new();
    let mut columns: HashMap<u32, f64> = HashMap::new();
    for (&t, &f) in truth.iter().zip(found) {
        *cells.entry((t, f)).or_default() += 1.0;
        *rows.entry(t).or_default() += 1.0;
        *columns.entry(f).or_default() += 1.0;
    }
    let of = |n: &f64| n * (n - 1.0) / 2.0;
    [
        cells.values().map(of).sum(),
        rows.values().map(of).sum(),
        columns.values().map(of).sum(),
    ]
}

/// Root mean square distance of two paths, one turned and moved onto the other, m.
fn apart_m(path: &[[f64; 2]], onto: &[[f64; 2]]) -> f64 {
    let n = path.len().min(onto.len()) as f64;
    let mean = |points: &[[f64; 2]]| {
        let sums = points
            .iter()
            .fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
        sums.map(|sum| sum / n)
    };
    let (a, b) = (mean(path), mean(onto));
    let centred = path.iter().zip(onto);
    let centred = centred.map(|(p, q)| ([p[0] - a[0], p[1] - a[1]], [q[0] - b[0], q[1] - b[1]]));
    let centred: Vec<_> = centred.collect();
    let dot: f64 = centred.iter().map(|(p, q)| p[0] * q[0] + p[1] * q[1]).sum();
    let cross: f64 = centred.iter().map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum();
    let (sin, cos) = cross.atan2(dot).sin_cos();
    let squares = centred.iter().map(|(p, q)| {
        let turned = [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]];
        (turned[0] - q[0]).powi(2) + (turned[1] - q[1]).powi(2)
    });
    (squares.sum::<f64>() / n).sqrt()
}
