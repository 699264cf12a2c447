//! Random weights for bootstraps of estimates that have two kinds of units, such as design points and worlds.

use rand::Rng;
use rand_distr::{Distribution, Exp1};

use super::interval::Interval;

/// Draws of a bootstrap; the ends of an interval are then known to some 3 % of its width.
pub const N_DRAWS: usize = 1000;

/// Weights that sum to 1: those of the Bayesian bootstrap (Rubin, Annals of Statistics 9, 1981). Unlike
/// counts they are never all on one unit, so that products across different units are always defined.
pub fn random_weights(n: usize, rng: &mut impl Rng) -> Vec<f64> {
    let mut weights: Vec<f64> = (0..n).map(|_| Exp1.sample(rng)).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    weights
}

/// Equal weights.
pub fn equal_weights(n: usize) -> Vec<f64> {
    vec![1.0 / n as f64; n]
}

/// The middle 95 % of the draws; `None` of fewer than forty.
pub fn percentiles(mut draws: Vec<f64>) -> Option<Interval> {
    if draws.len() < 40 {
        return None;
    }
    draws.sort_unstable_by(f64::total_cmp);
    let at = |p: f64| draws[((draws.len() - 1) as f64 * p).round() as usize];
    Some(Interval {
        low: at(0.025),
        high: at(0.975),
    })
}

/// Σ over pairs of different units of ω_w ω_v a_w b_v, over the sum of those weights: without bias for the product
/// of the means of a and b, however noisy each unit is, where the noise of different units is independent.
/// The plain product for one unit, which cannot tell noise apart.
pub fn product_across(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    if a.len() == 1 {
        return a[0] * b[0];
    }
    let (mut sum_a, mut sum_b, mut same, mut squares) = (0.0, 0.0, 0.0, 0.0);
    for ((a, b), weight) in a.iter().zip(b).zip(weights) {
        sum_a += weight * a;
        sum_b += weight * b;
        same += weight * weight * a * b;
        squares += weight * weight;
    }
    (sum_a * sum_b - same) / (1.0 - squares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    #[test]
    fn products_leave_out_what_a_unit_has_with_itself() {
        let (a, b) = ([1.0, 2.0, 4.0], [3.0, 0.0, 1.0]);
        let mut sum = 0.0;
        for (w, a) in a.iter().enumerate() {
            let others = b.iter().enumerate().filter(|(v, _)| *v != w);
            sum += others.map(|(_, b)| a * b).sum::<f64>();
        }
        let found = product_across(&a, &b, &equal_weights(3));
        assert!((found - sum / 6.0).abs() < 1e-14, "{found}");
        assert_eq!(product_across(&[2.0], &[3.0], &[1.0]), 6.0);
    }

    /// The variance of a mean under these weights is s²/(n + 1), s² over n: of 4,000 draws within five standard
    /// errors, 5 √(2/4000) = 0.112, of it.
    #[test]
    fn weighted_means_vary_as_the_mean_does() {
        let mut rng = Purpose::new("test", 5).generator();
        let values: Vec<f64> = (0..20).map(f64::from).collect();
        let draws: Vec<f64> = (0..4000)
            .map(|_| {
                let weights = random_weights(20, &mut rng);
                weights.iter().zip(&values).map(|(w, x)| w * x).sum()
            })
            .collect();
        let mean = draws.iter().sum::<f64>() / 4000.0;
        let variance = draws.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 4000.0;
        let expected = (400.0 - 1.0) / 12.0 / 21.0;
        assert!((variance / expected - 1.0).abs() < 0.112, "{variance}");
    }
}
