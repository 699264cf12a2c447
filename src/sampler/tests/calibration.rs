//! Simulation-based calibration (Talts et al. 2018; the idea is Cook, Gelman & Rubin's 2006) of the part of
//! the model that generates data: the metric model without a penalty.
//!
//! With the penalty, P(X|T) has no normaliser that could be drawn from. Without it a set S of n detections
//! is generated so: its mean is uniform over an area A; deviations e_i − ē with e_i ~ N(0, I/(2gn)) make
//! exp(−g Σ_{i<j}|x_i−x_j|²); z_i = x_i + N(0, I/(2a)). Integrated over X, with κ = agn/b_n,
//!
//! ln p(z_S) = −ln A − ln n + (n−1)·ln(κ/π) − κW,
//!
//! so that ln p(z_S) − ln I₀(S) = −ln A − ln n + (n−1)·ln(gn/π) depends on n alone: a term of the prior. Near
//! the rim of A this fails, so data are drawn anew until every z lies well inside; that is a condition on
//! Z alone, which leaves P(T|Z) as it is.
//!
//! Topologies come from the Chinese restaurant process. If the chain samples P(T|Z), the rank of a statistic of
//! the true topology among those of thinned samples is uniform. No code of the model is used to generate.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::super::*;
use crate::model::prior::PriorTable;
use crate::model::{MetricModel, Model, Penalty, PenaltyShape, Prior};
use crate::partition::Partition;
use crate::rng::{Purpose, StepGenerators};

const N: usize = 6;
const SIGMA_O_M: f64 = 0.8;
const SIGMA_T_M: f64 = 1.6;
const ALPHA: f64 = 3.0;
/// Side of the square A, and of the one in which every z must lie.
const SIDE_M: f64 = 16.0;
const INNER_M: f64 = 5.0;
const N_WORLDS: usize = 1_000;
const N_RANKS: usize = 20;
/// Steps between two samples: a multiple of the longest autocorrelation time seen, some 30 steps.
const THINNING: u64 = 150;

fn chinese_restaurant(rng: &mut impl Rng) -> Vec<u32> {
    let mut labels: Vec<u32> = Vec::new();
    for i in 0..N {
        let mut left = rng.random::<f64>() * (i as f64 + ALPHA);
        let n_sets = labels.iter().max().map_or(0, |&most| most + 1);
        let label = (0..n_sets).find(|set| {
            left -= labels.iter().filter(|label| *label == set).count() as f64;
            left < 0.0
        });
        labels.push(label.unwrap_or(n_sets));
    }
    labels
}

fn detections(labels: &[u32], rng: &mut impl Rng) -> Vec<[f64; 2]> {
    let (a, g) = (SIGMA_O_M.powi(-2), SIGMA_T_M.powi(-2));
    let mut z = vec![[0.0; 2]; N];
    for set in 0..N as u32 {
        let members: Vec<usize> = (0..N).filter(|&i| labels[i] == set).collect();
        let n = members.len() as f64;
        for axis in [0, 1] {
            let mean_m = SIDE_M * (rng.random::<f64>() - 0.5);
            let mut normal = |variance: f64| -> f64 {
                let epsilon: f64 = StandardNormal.sample(rng);
                epsilon * variance.sqrt()
            };
            let e: Vec<f64> = members.iter().map(|_| normal(0.5 / (g * n))).collect();
            let centre = e.iter().sum::<f64>() / n;
            for (&i, e) in members.iter().zip(&e) {
                z[i][axis] = mean_m + (e - centre) + normal(0.5 / a);
            }
        }
    }
    z
}

/// The Chinese restaurant process with what turns I₀ into a density of z; `slip` is added for each
/// non-singleton set, to see the test fail.
fn prior(slip: f64) -> PriorTable {
    let g = SIGMA_T_M.powi(-2);
    PriorTable::custom(N, |n| {
        let size = n as f64;
        let per_set = ALPHA.ln() - 2.0 * SIDE_M.ln() - size.ln();
        let within = (size - 1.0) * (g * size / std::f64::consts::PI).ln();
        let seats = libm::lgamma(size);
        per_set + within + seats + if n > 1 { slip } else { 0.0 }
    })
}

/// How the ranks of M and of the size of the first detection's set differ from uniform ones: (χ², z of
/// their mean) of each.
fn misfits(estimator: Estimator, slip: f64) -> [(f64, f64); 2] {
    let mut rng = Purpose::new("calibration", 1).generator();
    let settings = SamplerSettings {
        moves: "split-merge=0.3,reassign=0.3,anchors=0.3,refresh=0.1"
            .parse()
            .expect("a good mix"),
        estimator,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 2,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    };
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 0.0,
    };
    let mut ranks = [[0_u32; N_RANKS]; 2];
    for world in 0..N_WORLDS {
        let (labels, z) = loop {
            let labels = chinese_restaurant(&mut rng);
            let z = detections(&labels, &mut rng);
            let inside = |value: &f64| value.abs() < INNER_M / 2.0;
            if z.iter().flatten().all(inside) {
                break (labels, z);
            }
        };
        let model = Model::from(MetricModel::new(&z, SIGMA_O_M, SIGMA_T_M, penalty));
        let generators = StepGenerators::new(&Purpose::new("calibration", world as u64));
        let mut kernel = Kernel::new(&model, Prior::Uniform, &settings, generators);
        kernel.prior = prior(slip);
        let mut state = kernel.init(Partition::random(N, &mut rng));
        let statistic = |partition: &Partition| {
            let first = partition.set_of()[0] as usize;
            [partition.n_sets(), partition.sets()[first].len()]
        };
        let truth = statistic(&Partition::from_labels(&labels));
        let (mut below, mut equal) = ([0; 2], [0; 2]);
        for step in 0..THINNING * N_RANKS as u64 {
            kernel.step(&mut state, step, &mut rng);
            // N_RANKS − 1 samples after as long a burn-in as lies between two of them.
            if step >= THINNING && step % THINNING == 0 {
                for (k, value) in statistic(&state.partition).into_iter().enumerate() {
                    below[k] += usize::from(value < truth[k]);
                    equal[k] += usize::from(value == truth[k]);
                }
            }
        }
        for k in [0, 1] {
            // Ties take a uniform place among themselves.
            let rank = below[k] + rng.random_range(0..=equal[k]);
            ranks[k][rank] += 1;
        }
    }
    let expected = N_WORLDS as f64 / N_RANKS as f64;
    ranks.map(|counts| {
        let squares = counts
            .iter()
            .map(|&count| (f64::from(count) - expected).powi(2));
        let total: f64 = counts
            .iter()
            .zip(0..)
            .map(|(&count, rank)| f64::from(count * rank))
            .sum();
        // A uniform rank out of K has the mean (K−1)/2 and the variance (K²−1)/12.
        let k = N_RANKS as f64;
        let mean = total / N_WORLDS as f64;
        let error = ((k * k - 1.0) / 12.0 / N_WORLDS as f64).sqrt();
        (
            squares.sum::<f64>() / expected,
            (mean - (k - 1.0) / 2.0) / error,
        )
    })
}

/// χ² with 19 degrees of freedom exceeds 50.8, and |z| exceeds 3.89, once in ten thousand times.
const QUANTILES: (f64, f64) = (50.8, 3.89);

#[test]
fn ranks_of_the_truth_are_uniform() {
    for estimator in [Estimator::Fresh, Estimator::Common] {
        let misfits = misfits(estimator, 0.0);
        for (chi_square, z) in misfits {
            let fits = chi_square < QUANTILES.0 && z.abs() < QUANTILES.1;
            assert!(fits, "{estimator}: {misfits:?}");
        }
    }
}

/// A posterior that is off by a factor of 4.5 for each non-singleton set is caught.
#[test]
fn a_slip_is_seen() {
    let misfits = misfits(Estimator::Common, 1.5);
    let seen = misfits.iter().any(|(_, z)| z.abs() > QUANTILES.1);
    assert!(seen, "{misfits:?}");
}
